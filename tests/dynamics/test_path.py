"""The path of laws: a first law, smooth errors, plateaus that compete, and which law persists."""

import numpy as np
import pytest

from vidsindy_lite.dynamics import inference
from vidsindy_lite.dynamics import path as paths
from vidsindy_lite.dynamics.model import PolynomialSystem
from vidsindy_lite.dynamics.path import LARGEST
from vidsindy_lite.dynamics.problem import Problem
from vidsindy_lite.dynamics.solver import discover
from vidsindy_lite.study import (
    FLOWS,
    REFERENCE_OFFSET,
    SYSTEMS,
    FlowContest,
    OdeContest,
    add_noise,
    corruption,
    score,
)

DUFFING = PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -0.5, "x^3": -0.5}}, degree=3)


@pytest.fixture(scope="module")
def swing():
    t = np.linspace(0, 30, 600)
    return t, DUFFING.simulate(t, (1.5, 0))


def bent(x, share):
    """Every coordinate is off by a smooth function of the next."""
    place = (x - x.mean(axis=0)) / np.ptp(x, axis=0)
    return x + share * np.ptp(x, axis=0) * np.sin(4 * np.roll(place, 1, axis=1))


def drifting(t, x, share):
    """A slow wander, less than one period over all the record."""
    wander = np.stack([np.sin(2 * np.pi * (0.7 * t / t[-1] + phase)) for phase in (0.1, 0.6)], 1)
    return x + share * x.std(axis=0) * wander


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_a_path_leads_from_the_errors_left_to_no_law_without_a_break(swing, noise):
    t, x = swing
    found = discover(t, add_noise(x, noise, np.random.default_rng(0)))
    for j, path in enumerate(found.path):
        assert path[-1].high == pytest.approx(LARGEST)
        assert path[0].low == pytest.approx(max(noise, 1e-5), rel=0.3)
        assert all(p.equation == j and p.low < p.high for p in path)
        for lower, higher in zip(path, path[1:], strict=False):
            assert lower.high == pytest.approx(higher.low)
            assert (lower.terms != higher.terms).any()
        if not noise:
            widest = max(path, key=lambda plateau: plateau.decades)
            assert widest.decades > 3.5
            assert (widest.terms == found.native.support[:, j]).all()


def test_smooth_errors_do_not_become_terms(swing, monkeypatch):
    t, x = swing
    assert score(discover(t, drifting(t, x, 0.002)), DUFFING).exact
    assert score(discover(t, bent(x, 0.001)), DUFFING).exact
    # Where the path is not followed, they do.
    monkeypatch.setattr(paths, "TOLERATED", 0.0)
    monkeypatch.setattr(paths, "SMOOTH", 0.0)
    assert not score(discover(t, bent(x, 0.001)), DUFFING).exact


def test_a_bent_space_moves_no_origin_nor_hides_one(monkeypatch):
    flow = FLOWS["NoseHoover"]
    aside = flow.shift([0.4, -0.4, 0.4])
    t, x = aside.trajectory(500)
    x = corruption.distort(x, 0.003, np.random.default_rng(1))
    assert score(discover(t, x, order=1), aside).exact
    t, x = flow.trajectory(800)
    x = corruption.distort(x, 0.002, np.random.default_rng([1, 4]))
    assert score(discover(t, x, order=1), flow).exact
    # By the errors of independent samples, it is a hundredth of the spread away.
    monkeypatch.setattr(inference, "place_errors", lambda fit: 0.0)
    assert not score(discover(t, x, order=1), flow).exact


@pytest.mark.parametrize("name", ["BurkeShaw", "Chen"])
def test_error_bars_cover_what_a_bent_space_does_to_a_law(name, monkeypatch):
    flow = FLOWS[name]
    t, x = flow.trajectory(600)
    x = corruption.distort(x, 0.002, np.random.default_rng([2, 4]))

    def farthest():
        found = discover(t, x, order=1)
        assert score(found.system, flow).exact
        kept = found.system.support
        off = np.abs(found.coefficients - flow.coefficients)
        return (off[kept] / found.standard_errors[kept]).max()

    assert farthest() < 2
    # As if such errors averaged out over the samples, they are too narrow.
    monkeypatch.setattr(inference, "bent", lambda fit: fit)
    assert farthest() > 2.5


def test_a_law_that_hangs_on_the_tolerated_error_is_told(swing):
    t, x = swing
    tiny = PolynomialSystem.from_terms(
        {"x": {"y": 1}, "y": {"x": -0.5, "x^3": -0.5, "y": -0.0001}}, degree=3
    )
    found = discover(t, tiny.simulate(t, (1.5, 0)))
    assert found.status == "suspect"
    (warning,) = found.warnings
    assert warning.startswith("dy/dt is settled by how large an error is tolerated")
    assert "and without y from 0.01 to" in warning


def test_errors_that_last_widen_the_error_bars(swing):
    t, x = swing
    white = 0.02 * x.std(axis=0) * np.random.default_rng(3).standard_normal(x.shape)
    smooth = np.apply_along_axis(np.convolve, 0, white, np.ones(9) / 3, "same")
    one, nine = discover(t, x + white), discover(t, x + smooth)
    assert score(nine, DUFFING).exact
    live = one.system.support
    wider = nine.standard_errors[live] / one.standard_errors[live]  # by the root of nine
    assert ((wider > 2) & (wider < 4.5)).all()


def test_times_that_are_not_exact_do_not_become_terms():
    truth = SYSTEMS["SprottF"].shift(REFERENCE_OFFSET)
    t, x = truth.trajectory(600)
    x = corruption.jitter(x, 0.3, np.random.default_rng(3))
    found = discover(t, x)
    assert score(found, truth).exact
    assert found.status == "ok", found.warnings


def test_data_are_nearly_exact_if_their_coordinates_are_on_the_average():
    """One coordinate is off by 1.1e-4 of its spread, the other by 4e-5: an integrator's errors."""
    data = OdeContest(41, 1).data()
    assert score(discover(data.t, data.x, order=1), data.truth).exact


def test_a_law_is_found_that_the_first_path_leads_past():
    data = FlowContest("SprottE", "bent space 0.3 %", 800, seed=9).data()
    assert score(discover(data.t, data.x, degree=data.degree), data.truth).exact


@pytest.mark.parametrize("seed", range(3))
def test_a_term_that_acts_while_a_motion_starts_is_part_of_its_law(seed):
    """Without x^2 y errors last, of single samples they are larger by a fifth alone."""
    data = OdeContest(39, noise=0.02, seed=seed).data()
    assert score(discover(data.t, data.x, order=1), data.truth).exact


def test_a_plateau_that_leaves_more_than_it_was_said_to_is_passed_over():
    """A fall against drag, integrated coarsely: a constant slope promises what it cannot keep."""
    fall = PolynomialSystem.from_terms({"x": {"1": 9.81, "x^2": -0.0021175}})
    t = np.linspace(0, 10, 150)
    seen = np.sort(np.random.default_rng(0).permutation(150)[:75])
    x = corruption.coarse_path(fall, t, [73.0])
    found = discover(t[seen], x[seen], order=1)
    assert found.terms[np.flatnonzero(found.system.support[:, 0])[-1]] == "x^2"
    assert found.noise < 1e-3 * x.std()


@pytest.mark.parametrize("last", [(2, 1), (0.3, 0)])
def test_a_law_is_looked_for_in_a_part_of_long_data_unless_that_is_not_like_the_rest(
    last, monkeypatch
):
    """Every second run, which make the part, is like the others, or has prey and no hunters."""
    law = PolynomialSystem.from_terms(
        {"x": {"x": 1, "xy": -1, "x^2": -0.1}, "y": {"y": -1, "xy": 1}}, degree=2
    )
    t, rng = np.linspace(0, 20, 400), np.random.default_rng(0)
    starts = [last, (1, 2), last, (2, 1.5), last, (1.5, 1)] if last[1] == 0 else [last, (1, 2)] * 3
    runs = [(t, law.simulate(t, s) + 0.01 * rng.normal(size=(400, 2))) for s in starts]
    found = []
    for enough in (2400, 1200):
        monkeypatch.setattr(Problem.part, "__defaults__", (enough,))
        found.append(discover(runs, order=1, degree=2))
    whole, part = found
    assert score(part.system, law).exact
    np.testing.assert_allclose(part.coefficients, whole.coefficients, atol=1e-5)
    searches = [sum(step.stage == "all terms" for step in one.history) for one in found]
    assert searches == ([1, 1] if last[1] else [1, 2])
