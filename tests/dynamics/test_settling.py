"""Which law is settled on: a path around each, richer laws, plateaus that promise too much."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from vidsindy_lite.dynamics import settling, solver
from vidsindy_lite.dynamics.collocation import Fit, Status
from vidsindy_lite.dynamics.persistence import Path, Plateau
from vidsindy_lite.dynamics.polynomials import PolynomialSystem
from vidsindy_lite.dynamics.solver import discover
from vidsindy_lite.study import FlowContest, OdeContest, corruption, score


@pytest.fixture
def searched_once(monkeypatch):
    """No search that tolerates more makes up for what settling does not find."""
    monkeypatch.setattr(solver, "persists", lambda fit, path: True)


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_an_origin_that_moves_brings_no_terms_but_those_of_the_shift(monkeypatch):
    """The path of a bent motion leads to the law at home; its origin is told at its own errors."""
    data = FlowContest("NoseHoover", "bent space 0.3 %", seed=3).data()
    found = discover(data.t, data.x, degree=data.degree)
    assert score(found, data.truth).exact
    assert found.offset.all()
    monkeypatch.setattr(settling, "closure_mask", lambda exponents, active, _: active | True)
    assert not score(discover(data.t, data.x, degree=data.degree), data.truth).exact


@pytest.mark.usefixtures("searched_once")
def test_a_law_is_settled_where_the_path_around_it_leads_nowhere_else(monkeypatch):
    """A first path, around terms that a bend of space made, leads past the law."""
    data = FlowContest("SprottE", "bent space 0.3 %", seed=7).data()
    settled, persistent = [], settling._persistent

    def noted(problem, fit, history):
        settled.append((fit, *persistent(problem, fit, history)))
        return settled[-1][1:]

    monkeypatch.setattr(settling, "_persistent", noted)
    found = discover(data.t, data.x, degree=data.degree)
    assert score(found, data.truth).exact
    assert 2 < len(settled) < settling.MOST_PATHS + 1
    start, law, path = settled[-1]
    assert law is start
    assert path.fit is law
    monkeypatch.setattr(settling, "MOST_PATHS", 1)
    assert not score(discover(data.t, data.x, degree=data.degree), data.truth).exact


def test_no_path_is_followed_around_a_richer_law_that_did_not_converge(monkeypatch):
    around, follow, at_own_noise = [], settling.follow, settling.at_own_noise
    starts, persistent = [], settling._persistent

    def noted(problem, fit):
        around.append(fit)
        return follow(problem, fit)

    def started(problem, fit, history):
        starts.append(fit)
        return persistent(problem, fit, history)

    def unfinished(problem, fit):
        return replace(at_own_noise(problem, fit), status=Status.MAX_STEPS)

    data = OdeContest(41, 1).data()
    monkeypatch.setattr(settling, "follow", noted)
    monkeypatch.setattr(settling, "_persistent", started)
    discover(data.t, data.x, order=1)
    assert len(around) > len(starts)  # a richer law is followed
    around.clear()
    starts.clear()
    monkeypatch.setattr(settling, "at_own_noise", unfinished)
    discover(data.t, data.x, order=1)
    assert around == starts


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_a_plateau_that_leaves_more_than_it_was_said_to_is_passed_over(seed):
    """A fall against drag, integrated coarsely: a constant slope promises what it cannot keep."""
    fall = PolynomialSystem.from_terms({"x": {"1": 9.81, "x^2": -0.0021175}})
    t = np.linspace(0, 10, 150)
    seen = np.sort(np.random.default_rng(seed).permutation(150)[:75])
    x = corruption.coarse_path(fall, t, [73.0])
    found = discover(t[seen], x[seen], order=1)
    assert found.terms[np.flatnonzero(found.system.support[:, 0])[-1]] == "x^2"
    assert found.noise < 1e-3 * x.std()


@pytest.mark.parametrize("status", Status)
@pytest.mark.parametrize("high", [0.5, 0.05])
def test_a_law_persists_if_it_converged_and_no_other_plateau_is_wider(status, high):
    terms = np.eye(2, dtype=bool)
    rivals = Plateau(0, 0.01, high, terms[0]), Plateau(0, high, 1.0, terms[1])
    path = Path(None, None, 0.01, 0.1, (rivals,))
    fit = Fit(SimpleNamespace(active=terms[:1].T), None, status)
    assert settling.persists(fit, path) is (status is Status.CONVERGED and high == 0.5)
