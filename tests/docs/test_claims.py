"""Every claim names a check that is there, and one that names none is seen."""

import pytest
from claims import claims_of, pages

from vidsindy_lite.storage import PACKAGE

ROOT = PACKAGE.parent
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.py"))


@pytest.mark.parametrize("page", [ROOT / "README.md", *NOTEBOOKS], ids=lambda page: page.stem)
def test_every_claim_has_a_check(page):
    assert len(claims_of(page)) >= 3


CELLS = """\
# %% [markdown]
# # One
#
# * an item that claims nothing
#
# ## What we learned
#
# * One and one
#   are two ([02](02_two.ipynb)).
#   <!-- by: one + one == 2; figure sum; docs/page.md; 02: two > 1 -->
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
    ("old", "new"),
    [
        ("#   <!-- by: one + one == 2; figure sum; docs/page.md; 02: two > 1 -->\n", ""),
        ("by: one + one == 2", "by: one + one == 3"),
        ("    one + one == 2\n", "    one + one == 3\n"),
        ("figure sum", "figure product"),
        ("docs/page.md", "docs/other.md"),
        ("02: two > 1", "02: two > 2"),
        ("::test_one", "::test_two"),
    ],
)
def test_a_claim_without_a_check_is_seen(page, old, new):
    assert old in CELLS
    page.write_text(CELLS.replace(old, new, 1))
    with pytest.raises(ValueError, match=r"01_one.py: no (check|assertion)"):
        claims_of(page)


def test_a_claim_that_nothing_could_make_false_is_seen(page):
    page.write_text(
        CELLS.replace("one + one == 2; figure sum; docs/page.md; 02: two > 1", "figure sum")
    )
    with pytest.raises(ValueError, match=r"01_one.py: nothing could make it false: 'One and one"):
        claims_of(page)


@pytest.mark.parametrize("name", ["README.md", "docs/claims.md"])
def test_pages_after_the_notebooks_are_those_of_now(name):
    assert pages(ROOT)[name] == (ROOT / name).read_text("utf-8")
