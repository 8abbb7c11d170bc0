"""The page that goes through the paper: nothing is left out, its verdicts are the data's."""

import json
import re

import pytest

from vidsindy_lite.repository import PACKAGE

ROOT = PACKAGE.parent
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


def ours_is_nearer(name):
    """Whether our method's error is below the paper's in every row of a table."""
    mine = [row for row in table(name) if row["method"] == "Gauss-Newton"]
    return all(row["l2 (e-2)"] < row["paper: l2 (e-2)"] for row in mine)


def beats_pysindy():
    whole = [row for row in table("table_1") if row["pixels"] != "sub"]
    error = {(row["pixels"], row["system"], row["method"]): row["l2 (e-2)"] for row in whole}
    cases = {key[:2] for key in error}
    return all(error[*case, "Gauss-Newton"] < error[*case, "PySINDy"] for case in cases)


def always_worse_without_the_law():
    """Whether the ablated model is wrong in some trial of every condition, as the paper says."""
    ablated = [row for row in table("table_2") if row["method"] == "Model-A"]
    return all(len(set(row["exact"].split(" of "))) > 1 for row in ablated)


def all_exact(condition, level):
    """Whether every trial of SprottF is exact."""
    shares = {(row["condition"], row["level (%)"]): row["SprottF"] for row in table("study_exact")}
    return shares[condition, level] == "100%"


VERDICT_OF = {row[0]: row[-1] for row in rows(PAGE)}
MEASURED = [
    ("Table 1 clean videos", "stronger", lambda: ours_is_nearer("table_1")),
    ("Table 2 the ablation", "stronger", lambda: ours_is_nearer("table_2")),
    ("Table S3 other methods", "stronger", lambda: ours_is_nearer("table_S3")),
    ('"outperforms PySINDy on each dataset"', "same", beats_pysindy),
    ("Fig. 3 SprottF, noise and gaps", "stronger", lambda: ours_is_nearer("table_2")),
    (
        '"performance of the ablated model deteriorates in all considered cases"', "weaker",
        lambda: not always_worse_without_the_law(),
    ),
    (
        '"beyond a 30% noise level, our method\'s performance begins to decline"', "stronger",
        lambda: all_exact("noise", 40),
    ),
    ('"highly robust even with up to 50% data loss"', "same", lambda: all_exact("blocks", 50)),
    (
        '"strong stability even when the fiber missing rate is about 20%"', "same",
        lambda: all_exact("fibers", 20),
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
