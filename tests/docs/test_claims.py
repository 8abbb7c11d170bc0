"""Every claim names a check that is there, and no part of the paper is left out."""

import json
import re

import pytest
from claims import claims_of, pages

from vidsindy_lite.storage import PACKAGE

ROOT = PACKAGE.parent
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.py"))


@pytest.mark.parametrize("page", [ROOT / "README.md", *NOTEBOOKS], ids=lambda page: page.stem)
def test_every_claim_has_a_check(page):
    assert len(claims_of(page)) >= 3


CHECKS = "one + one == 2; figure sum; docs/page.md; 02: two > 1"
CELLS = f"""\
# %% [markdown]
# # One
#
# * an item that claims nothing
#
# ## What we learned
#
# * One and one
#   are two ([02](02_two.ipynb)).
#   <!-- by: {CHECKS} -->
#
# **What the paper says and what we found.** Nothing.
# <!-- by: tests/test_sum.py::test_one -->
#
# Next: two.
#
# ## Exercises
#
# * none

# %%
one = 1
assert (
    one + one == 2
), "no"
"""


@pytest.fixture
def page(tmp_path):
    files = {
        "notebooks/01_one.py": CELLS,
        "notebooks/02_two.py": "# %%\nassert two > 1",
        "figures/sum.json": "{}",
        "docs/page.md": "",
        "tests/test_sum.py": "def test_one(): ...",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path / "notebooks" / "01_one.py"


def test_a_claim_is_listed_with_its_checks(page):
    (first, checks), (second, others) = claims_of(page)
    assert first == "One and one are two ([02](../notebooks/02_two.ipynb))."
    assert checks == [
        'false unless `( one + one == 2 ), "no"`', "shown in [sum](../figures/README.md#sum)",
        "stated in [docs/page.md](page.md)", "false unless `two > 1` in 02",
    ]  # fmt: skip
    assert second.endswith("what we found.** Nothing.")
    assert others == ["false unless `tests/test_sum.py::test_one`"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (f"#   <!-- by: {CHECKS} -->\n", "", "no check"),
        ("by: one + one == 2", "by: one + one == 3", "no assertion"),
        ("    one + one == 2\n", "    one + one == 3\n", "no assertion"),
        ("figure sum", "figure product", "no assertion"),
        ("docs/page.md", "docs/other.md", "no assertion"),
        ("02: two > 1", "02: two > 2", "no assertion"),
        ("::test_one", "::test_two", "no assertion"),
        (CHECKS, "figure sum", "nothing could"),
    ],
)
def test_a_claim_without_a_check_is_seen(page, old, new, message):
    assert old in CELLS
    page.write_text(CELLS.replace(old, new, 1))
    with pytest.raises(ValueError, match=f"01_one.py: {message}"):
        claims_of(page)


@pytest.mark.parametrize("name", ["README.md", "docs/claims.md"])
def test_pages_after_the_notebooks_are_those_of_now(name):
    assert pages(ROOT)[name] == (ROOT / name).read_text("utf-8")


PAGE = (ROOT / "docs" / "paper.md").read_text("utf-8")
VERDICTS = {"same", "stronger", "weaker", "corrected", "open"}
# What the paper numbers, as it is called in the first column.
PARTS = (
    [f"{number} " for number in (1, 2, 3, 3.1, 3.2, 3.3, 3.4, 4, 4.1, 4.2, 4.3, 5)]
    + [f"App. {letter} " for letter in "ABCDEFGHIJ"]
    + [f"Eq. ({number}) " for number in [*range(1, 11), *(f"S{n}" for n in range(1, 10))]]
    + [f"Fig. {number} " for number in [*range(1, 5), *(f"S{n}" for n in range(1, 12))]]
    + [f"Table {number} " for number in (1, 2, "S1", "S2", "S3")]
)


def rows(page):
    """The rows of all tables: part, where, verdict."""
    lines = re.findall(r"^\| (.*) \|$", page, re.MULTILINE)
    cells = [tuple(line.split(" | ")) for line in lines]
    return [row for row in cells if row[0] != "part of the paper"]


def page_problems(page):
    """Parts of the paper that have no row, or two; rows that lead nowhere or give no verdict."""
    found = rows(page)
    firsts = [row[0] + " " for row in found]
    counts = {part: sum(first.startswith(part) for first in firsts) for part in PARTS}
    problems = [f"{part}: {count} rows" for part, count in counts.items() if count != 1]
    for part, *where, verdict in found:
        if len(where) != 1 or verdict not in VERDICTS:
            problems.append(f"{part}: three columns and a verdict")
        elif verdict != "open" and not re.search(r"\]\(", where[0]):
            problems.append(f"{part}: leads nowhere")
    return problems


def table(name):
    return json.loads((ROOT / "figures" / f"{name}.json").read_text("utf-8"))["rows"]


OPTIMISERS = ("spline-ADO", "Gauss-Newton")


def both_are_nearer(name):
    """Whether the median error of both optimisers is below the paper's in every row of a table."""
    mine = [row for row in table(name) if row["method"] in OPTIMISERS]
    return all(row["l2 (e-2)"] < row["paper: l2 (e-2)"] for row in mine)


def both_beat_pysindy():
    error = {(row["system"], row["method"]): row["l2 (e-2)"] for row in table("table_1")}
    systems = {system for system, _ in error}
    return all(error[s, m] < error[s, "PySINDy"] for s in systems for m in OPTIMISERS)


def nearer_without_the_law():
    """Whether in some condition the ablated model is nearer than both, in the median."""
    off = {(r["condition"], r["rate (%)"], r["method"]): r["l2 (e-2)"] for r in table("table_2")}
    cases = {key[:2] for key in off}
    return any(all(off[*c, "Model-A"] < off[*c, m] for m in OPTIMISERS) for c in cases)


def holds(condition, level, method="spline-ADO"):
    """Whether most trials of SprottF have all terms right, from the detector's tracks."""
    numbers = json.loads((ROOT / "figures" / "fig_3.json").read_text("utf-8"))["numbers"]
    _, wrong_terms = numbers[f"{condition}, {method}, {level:g}"]
    return wrong_terms == 0


VERDICT_OF = {row[0]: row[-1] for row in rows(PAGE)}
MEASURED = [
    ("Table 1 clean videos", "stronger", lambda: both_are_nearer("table_1")),
    ("Table 2 the ablation", "stronger", lambda: both_are_nearer("table_2")),
    ("Table S3 other methods", "stronger", lambda: both_are_nearer("table_S3")),
    ('"outperforms PySINDy on each dataset"', "same", both_beat_pysindy),
    ("Fig. 3 SprottF, noise and gaps", "stronger", lambda: both_are_nearer("table_2")),
    (
        '"performance of the ablated model deteriorates in all considered cases"', "weaker",
        nearer_without_the_law,
    ),
    (
        '"up to a 20% noise interference, our method almost accurately identifies all correct '
        'coefficients"', "same", lambda: holds("noise", 0.2),
    ),
    ('"highly robust even with up to 50% data loss"', "same", lambda: holds("blocks", 0.5)),
    (
        '"strong stability even when the fiber missing rate is about 20%"', "same",
        lambda: holds("fibers", 0.2),
    ),
]  # fmt: skip


def test_nothing_of_the_paper_is_left_out():
    assert page_problems(PAGE) == []


@pytest.mark.parametrize(("part", "verdict", "holds"), MEASURED, ids=[m[0] for m in MEASURED])
def test_a_verdict_is_that_of_the_data(part, verdict, holds):
    assert VERDICT_OF[part] == verdict
    assert holds()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("| Eq. (S7) ", "| Eq. (S17) "),
        ("| Fig. 4 ", "| Fig. 3 "),
        ("[tour](../notebooks/00_tour.ipynb) | same", "the tour | same"),
        ("| 2 Related Work |", "| 2 Related Work | all |"),
        (" | weaker |", " | worse |"),
    ],
)
def test_an_incomplete_page_is_seen(old, new):
    assert old in PAGE
    assert page_problems(PAGE.replace(old, new, 1))
