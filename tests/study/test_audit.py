"""Checks of published numbers: each must pass what can be true and catch what cannot."""

from itertools import combinations_with_replacement

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidsindy_lite.dynamics import PolynomialSystem
from vidsindy_lite.study.audit import (
    coefficient_ratios,
    could_be,
    counts_behind,
    false_terms,
    fit_coordinates,
    rounding_reach,
    seen_in,
)
from vidsindy_lite.study.metrics import score
from vidsindy_lite.study.published import LAWS, SCORES, PublishedScore
from vidsindy_lite.study.systems import REFERENCE_OFFSET, SYSTEMS


def printed(runs, true_terms):
    """The row that runs of (true terms found, false positives) give on average, as printed."""
    hits, false = np.array(runs).T
    return PublishedScore(
        terms_found=bool((hits == true_terms).all()),
        false_positives=round(false.mean()),
        l2=0.0,
        precision=round(float(np.mean(hits / np.maximum(hits + false, 1))), 4),
        recall=round(float(np.mean(hits / true_terms)), 4),
    )


run = st.tuples(st.integers(1, 9), st.integers(0, 12))


@given(run)
def test_every_row_of_one_law_is_possible(counts):
    row = printed([counts], 9)
    assert could_be(row, 9)
    assert counts in counts_behind(row, 9)


@settings(max_examples=15, deadline=None)
@given(st.lists(run, min_size=5, max_size=5))
def test_every_mean_of_five_is_possible(runs):
    assert could_be(printed(runs, 9), 9, trials=5)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 3), st.floats(0.3, 1), st.floats(0.3, 1))
def test_one_and_two_trials_agree_with_trying_all(false_positives, precision, recall):
    row = PublishedScore(False, false_positives, 0.0, round(precision, 4), round(recall, 4))
    every = [(hits, false) for hits in range(4) for false in range(9)]

    def fits(runs):
        hits, false = np.array(runs).T
        recalls, precisions = hits / 3, hits / np.maximum(hits + false, 1)
        return (
            abs(false.mean() - false_positives) <= 0.5
            and abs(recalls.mean() - row.recall) < 5e-5
            and abs(precisions.mean() - row.precision) < 5e-5
        )

    assert could_be(row, 3) == any(fits([counts]) for counts in every if counts[1] < 5)
    if any(fits(pair) for pair in combinations_with_replacement(every, 2)):
        assert could_be(row, 3, trials=2)


def test_contradictions_are_caught():
    perfect_but_false = PublishedScore(True, 1, 0.0, 1.0, 1.0)
    assert not could_be(perfect_but_false, 10)
    assert not could_be(perfect_but_false, 10, trials=5)
    eleventh = PublishedScore(False, 1, 0.0, 0.9, 0.9091)  # 10 / 11 of ten terms
    assert counts_behind(eleventh, 10) == []
    assert not could_be(eleventh, 10, trials=5)


def test_an_average_may_do_what_one_law_cannot():
    row = printed([(10, 0), (10, 0), (10, 0), (10, 0), (10, 3)], 10)
    assert not could_be(row, 10)
    assert could_be(row, 10, trials=5)


@pytest.mark.parametrize(
    ("arguments", "name"), [((0,), "true_terms"), ((61,), "true_terms"), ((9, 0), "trials")]
)
def test_nonsense_counts_are_refused(arguments, name):
    with pytest.raises(ValueError, match=name):
        could_be(SCORES["Table 1", "Ours", "Lorenz"], *arguments)


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("seed", [0, 1])
def test_rounding_alone_stays_within_its_reach(name, seed):
    truth = SYSTEMS[name].shift(REFERENCE_OFFSET)
    noise = np.random.default_rng(seed).uniform(0.9, 1.1, truth.coefficients.shape)
    exact = PolynomialSystem(truth.names, truth.exponents, truth.coefficients * noise)
    law = PolynomialSystem(truth.names, truth.exponents, exact.coefficients.round(2))
    difference = score(law, truth).l2 - round(score(exact, truth).l2, 4)
    assert 0 < abs(difference) <= rounding_reach(law, truth) < 5e-4


SCALE, OFFSET, CLOCK = np.array([1.1, 0.9, 0.95]), np.array([9.0, 11.0, 0.3]), 10.0


def test_seen_in_moves_with_the_stretched_trajectory():
    system = SYSTEMS["Lorenz"]
    t = np.linspace(0, 1, 50)
    moved = seen_in(system, SCALE, OFFSET, CLOCK)
    there = moved.simulate(t / CLOCK, OFFSET + SCALE * np.array(system.x0))
    expected = OFFSET + SCALE * system.simulate(t, system.x0)
    np.testing.assert_allclose(there, expected, atol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [(((1, 1), (0, 0, 0)), "scale"), (((1, -1, 1), (0, 0, 0)), "scale"),
     (((1, 1, 1), (0, 0, 0), 0.0), "clock")],
)  # fmt: skip
def test_nonsense_coordinates_are_refused(arguments, name):
    with pytest.raises(ValueError, match=name):
        seen_in(SYSTEMS["Lorenz"], *arguments)


@pytest.mark.parametrize("name", ["Lorenz", "NoseHoover", "WangSun"])
def test_coordinates_are_recovered(name):
    law = seen_in(SYSTEMS[name], SCALE, OFFSET, CLOCK)
    fit = fit_coordinates(law, SYSTEMS[name], REFERENCE_OFFSET, free_clock=True)
    assert fit.misfit < 1e-8
    assert fit.clock == pytest.approx(CLOCK)
    np.testing.assert_allclose(fit.scale, SCALE, rtol=1e-6)
    np.testing.assert_allclose(fit.offset, OFFSET, atol=1e-5)


def test_an_error_of_the_regression_stays_outside_of_rounding():
    truth = SYSTEMS["NoseHoover"].shift(REFERENCE_OFFSET)
    values = truth.coefficients.copy()
    values[truth.terms.index("z"), 1] *= 0.5
    wrong = PolynomialSystem(truth.names, truth.exponents, values)
    fit = fit_coordinates(wrong, SYSTEMS["NoseHoover"], REFERENCE_OFFSET)
    # Most of the l2 error goes, because constants dominate it: a small misfit proves nothing.
    assert 10 * rounding_reach(wrong, truth) < fit.misfit < 0.2 * score(wrong, truth).l2


def test_the_published_nose_hoover_is_one_of_coordinates():
    law, truth = LAWS["Ours", "NoseHoover"], LAWS["Ground truth", "NoseHoover"]
    fit = fit_coordinates(law, SYSTEMS["NoseHoover"], REFERENCE_OFFSET)
    assert score(law, truth).l2 > 0.06
    assert fit.misfit < rounding_reach(law, truth)


def test_ratios_are_those_of_the_true_terms():
    ratios = coefficient_ratios(LAWS["PySINDy", "NoseHoover"], LAWS["Ground truth", "NoseHoover"])
    assert len(ratios) == 9
    assert ratios["dx/dt: y"] == pytest.approx(10.97)


def test_false_terms_are_those_that_the_score_counts():
    for (_, name), law in LAWS.items():
        truth = LAWS["Ground truth", name]
        assert len(false_terms(law, truth)) == score(law, truth).false_positives
    lorenz = (LAWS[method, "Lorenz"] for method in ("Ours", "Ground truth"))
    assert false_terms(*lorenz) == {"dx/dt: 1": -0.94}
