"""The slides show what the notebooks of the plan show, and nothing else."""

import re

import pytest

from vidsindy_lite.companion.slides import PLANNED, slides
from vidsindy_lite.stamp import PACKAGE

ROOT = PACKAGE.parent


@pytest.fixture(scope="module")
def page():
    return slides(ROOT)


def test_all_notebooks_of_the_plan_are_there_in_its_order(page):
    planned = list(dict.fromkeys(PLANNED.findall((ROOT / "docs" / "teaching.md").read_text())))
    assert len(planned) >= 5
    links = re.findall(r"^\[\d\d_\w+\]\(\.\./(notebooks/\w+)\.ipynb\)$", page, re.MULTILINE)
    assert links == planned


def test_there_are_enough_for_a_session_and_none_is_empty(page):
    shown = page.split("\n## ")[1:]
    assert 30 <= len(shown) <= 60
    assert all(len(slide.strip().splitlines()) > 1 for slide in shown)
    assert page.count("$$") % 2 == 0
    assert min(page.count("$$") // 2, page.count("![")) >= 10


def test_figures_are_there_and_exercises_are_not(page):
    images = re.findall(r"!\[.*?\]\(\.\./figures/(.*?)\)", page)
    assert images
    assert all((ROOT / "figures" / image).exists() for image in images)
    assert "Exercise" not in page
    assert "Solution" not in page


def test_twice_the_same(page):
    assert slides(ROOT) == page
