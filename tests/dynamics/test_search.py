"""The search for terms: what it does where data are long, or where too many terms fit alike."""

from dataclasses import replace

import numpy as np
import pytest

from vidsindy_lite.dynamics import PolynomialSystem, check_trajectory, search
from vidsindy_lite.dynamics.candidates import Library
from vidsindy_lite.dynamics.collocation import Collocation, Status
from vidsindy_lite.dynamics.form import Form
from vidsindy_lite.dynamics.history import History
from vidsindy_lite.dynamics.posing import pose
from vidsindy_lite.dynamics.problem import fit_curves
from vidsindy_lite.dynamics.solver import discover
from vidsindy_lite.dynamics.state import State
from vidsindy_lite.study import score

CIRCLE = PolynomialSystem.from_terms({"x": {"y": -1}, "y": {"x": 1}}, degree=2)


def posed(times, degree=2):
    runs = [check_trajectory(t, CIRCLE.simulate(t, (1, 0.5))) for t in times]
    shared = [np.empty((*x.shape, 0)) for _, x in runs]
    form = Form.of(("x", "y"), Library.polynomial(degree))
    return pose(runs, shared, form, np.random.default_rng(0))


def test_short_data_are_searched_as_they_are():
    problem = posed([np.linspace(0, 20, 400)])
    assert search._enough(problem) is problem.stretches


def test_of_long_data_each_stretch_gives_its_share(monkeypatch):
    monkeypatch.setattr(search, "ENOUGH_SAMPLES", 300)
    monkeypatch.setattr(search, "ENOUGH_TURNS", 3)
    problem = posed([np.linspace(0, 80, 2000), np.linspace(0, 40, 1000)])
    part = search._enough(problem)
    assert [i for i, _ in part] == [0, 1]
    samples = sum(len(t) for _, (t, _) in part)
    assert 300 <= samples <= 0.5 * 3000
    for (_, (t, x)), (_, (whole, _)) in zip(part, problem.stretches, strict=True):
        np.testing.assert_array_equal(t, whole[: len(t)])
        assert len(x) == len(t)
        assert t[-1] - t[0] >= 0.99 * 2 * np.pi


def test_all_data_decide_on_the_terms_of_a_part(monkeypatch):
    monkeypatch.setattr(search, "ENOUGH_SAMPLES", 150)
    monkeypatch.setattr(search, "ENOUGH_TURNS", 2)
    problem, history = posed([np.linspace(0, 60, 1500)]), History()
    fit = search.search(problem, np.random.default_rng(0), history)
    assert sum(len(s.t) for s in fit.collocation.segments) == 1500
    assert "subset search, all data" in [step.stage for step in history.steps]
    assert fit.state.active.sum() == 2


def test_axes_that_moved_for_nothing_come_home_if_the_fit_has_converged():
    problem, history = posed([np.linspace(0, 20, 400)]), History()
    collocation = problem.weighted(problem.collocation(problem.segments()), search.FINAL_WEIGHT)
    control = fit_curves(collocation, problem.curves)
    active = CIRCLE.support
    state = State(control, 0.0 * active, active, problem.home, np.ones(2, dtype=bool))
    start = collocation.solve(state)
    moved = search.select(problem, start, search.FINAL_WEIGHT, "moved", history)
    assert moved.state.moving.all()
    assert not search.come_home(problem, moved, history).state.moving.any()
    unfinished = replace(moved, status=Status.MAX_STEPS)
    assert search.come_home(problem, unfinished, history) is unfinished


@pytest.mark.parametrize("fails_at", [None, 1, 3])
def test_terms_that_cannot_be_told_apart_are_searched_from_the_first_fit(monkeypatch, fails_at):
    problem = posed([np.linspace(0, 20, 400)])
    collocation = problem.collocation(problem.segments())
    control = fit_curves(collocation, problem.curves)
    solve, calls = Collocation.solve, []

    def solved(self, state, **options):
        fit = solve(self, state, **options)
        calls.append(fit)
        status = Status.MAX_STEPS if len(calls) - 1 == fails_at else Status.CONVERGED
        return search.replace(fit, status=status)

    monkeypatch.setattr(Collocation, "solve", solved)
    every = np.ones(len(problem.exponents), dtype=bool)
    _, weight = search.unpruned(problem, collocation, control, every, "", History())
    expected = search.FIRST_WEIGHTS[-1 if fails_at is None else 0]
    assert weight == expected
    assert len(calls) == (4 if fails_at is None else fails_at + 1)


def test_of_long_data_a_search_has_enough_turns_and_samples():
    """A turn takes 2 pi in standard units."""
    problem = posed([np.linspace(0, 20, 400)])
    for time, count in ((4e3, 10**5), (1e5, 10**4)):
        t = np.linspace(0, time, count)
        long = replace(problem, stretches=[(0, (t, np.ones((count, 2))))])
        ((_, (part, _)),) = search._enough(long)
        wanted = max(search.ENOUGH_TURNS * 2 * np.pi, search.ENOUGH_SAMPLES / count * time)
        assert part[-1] == pytest.approx(wanted, abs=2 * time / count)


@pytest.mark.slow
def test_four_species_are_found_among_terms_of_high_degree():
    # Chaotic competition (Vano et al. 2006); where the law hardly binds, cubic terms fit as well.
    growth = {"x": 1, "y": 0.72, "z": 1.53, "w": 1.27}
    harm = {
        "x": {"x^2": 1, "xy": 1.09, "xz": 1.52},
        "y": {"y^2": 1, "yz": 0.44, "yw": 1.36},
        "z": {"xz": 2.33, "z^2": 1, "zw": 0.47},
        "w": {"xw": 1.21, "yw": 0.51, "zw": 0.35, "w^2": 1},
    }
    equations = {
        name: {name: rate} | {term: -rate * value for term, value in harm[name].items()}
        for name, rate in growth.items()
    }
    truth = PolynomialSystem.from_terms(equations, degree=3)
    t = 0.5 * np.arange(1500)
    x = truth.simulate(t, np.array([0.3013, 0.4586, 0.1307, 0.3557]))
    rng = np.random.default_rng([9, 3])
    found = discover(t, x + 0.05 * x.std(axis=0) * rng.standard_normal(x.shape), order=1)
    assert score(found.system, truth).exact
