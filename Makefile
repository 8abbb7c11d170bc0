# Thin: the work is `python -m vidsindy_lite run`, pytest and Sphinx. Every target sets up what it needs.

VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.installed
# As many processes as cores; `tests/conftest.py` says what goes together to one of them.
SPREAD := -n auto --maxprocesses 8 --dist loadscope --no-loadscope-reorder
PYTHON ?= $(shell python3.11 -c "" 2>/dev/null && echo python3.11 || echo python3)

.DEFAULT_GOAL := help
.PHONY: help figures test test-fast bench lint demo site lab clean

help:
	@echo "make figures          run all notebooks, refresh what differs in figures/ and notebooks/"
	@echo "make figures ONLY=03  only this one, by its number"
	@echo "make figures QUICK=1  the same code in its small profile, into build/quick/"
	@echo "make figures FORCE=1  also those that this clone has executed with the same code"
	@echo "make test             all tests, the notebooks in the quick profile among them"
	@echo "make test-fast        the quick ones of the tests, in a few minutes"
	@echo "make bench            speed and memory, as ratios"
	@echo "make lint             style, types, and who may import whom"
	@echo "make demo             three videos of one target, and its equations, in a minute"
	@echo "make site             README, notebooks, figures and reference as web pages, in build/site/"
	@echo "make lab              JupyterLab on the notebooks"
	@echo "make clean            remove $(VENV), build and caches"

# Installed once, and again only when the requirements change.
$(READY): requirements.txt pyproject.toml
	@$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11))" || { \
	  echo "Python 3.11 or later is needed, $(PYTHON) is $$($(PYTHON) --version 2>&1):" \
	       "install it, or name one: make PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.txt
	@touch $@

figures: $(READY)
	$(BIN)/python -m vidsindy_lite run $(ONLY) --profile $(if $(QUICK),quick,full) $(if $(FORCE),--force)
	$(if $(QUICK),,@$(BIN)/python tests/claims.py)
	$(if $(QUICK),,@$(BIN)/python tests/exercises.py $(if $(FORCE),--force))

test: $(READY)
	$(BIN)/python -m pytest $(SPREAD)

test-fast: $(READY)
	$(BIN)/python -m pytest $(SPREAD) -m "not notebooks and not slow and not thorough"

bench: $(READY)
	$(BIN)/python -m pytest -s -o python_files="bench_*.py" tests/benchmarks

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

demo: $(READY)
	$(BIN)/python -m vidsindy_lite demo

site: $(READY)
	$(BIN)/sphinx-build --quiet --builder html --conf-dir docs . build/site
	@echo "open build/site/README.html"

lab: $(READY)
	$(BIN)/jupyter lab --ServerApp.root_dir=. --LabApp.default_url=/lab/tree/notebooks

clean:
	rm -rf $(VENV) build .pytest_cache .ruff_cache .mypy_cache .import_linter_cache .hypothesis *.egg-info
	find . -type d -name __pycache__ -prune -exec rm -rf {} +
