"""Discovery: exact recovery, its uncertainty, its warnings, bad input, threads."""

import hashlib
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest
from threadpoolctl import threadpool_info, threadpool_limits
from tqdm import tqdm

import vidsindy_lite
from vidsindy_lite.dynamics import solver
from vidsindy_lite.dynamics.library import Library
from vidsindy_lite.dynamics.model import PolynomialSystem
from vidsindy_lite.dynamics.solver import discover, one_blas_thread
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, add_noise, score


def measured(name, noise, n=600, seed=11):
    truth = SYSTEMS[name].shift(REFERENCE_OFFSET)
    t, x = truth.trajectory(n)
    return truth, t, add_noise(x, noise, np.random.default_rng(seed))


@pytest.mark.parametrize(
    ("name", "gap"), [("Lorenz", 250), ("SprottE", 250), ("WangSun", 250), ("NoseHoover", 150)]
)
def test_clean_systems_are_recovered_exactly_across_a_gap(name, gap):
    truth, t, x = measured(name, 0.0, n=400)
    x[gap : gap + 10] = np.nan
    found = discover(t, x)
    result = score(found, truth)
    assert result.exact
    assert result.l2 < 1e-6
    assert score(found.native, SYSTEMS[name]).exact
    np.testing.assert_allclose(found.offset, REFERENCE_OFFSET, atol=1e-4)
    assert (found.status, found.note) == ("ok", "")


@pytest.mark.parametrize("name", ["SprottE", "WangSun"])
def test_noisy_systems_are_recovered(name):
    truth, t, x = measured(name, 0.1, n=700)
    found = discover(t, x)
    assert score(found, truth).exact
    np.testing.assert_allclose(found.noise, 0.1 * truth.trajectory(700)[1].std(axis=0), rtol=0.1)


PLANAR = {
    "oscillator": ({"x": {"y": 1}, "y": {"x": -1, "y": 0.5, "x^2y": -0.5}}, (0.5, 0), 25),
    "prey": ({"x": {"x": 1, "xy": -0.5}, "y": {"y": -0.8, "xy": 0.4}}, (1, 1), 30),
    "growth": ({"x": {"x": 1, "x^2": -0.5}}, (0.05,), 8),
}


@pytest.mark.parametrize("name", PLANAR)
def test_other_dimensions_and_uneven_times(name):
    equations, x0, duration = PLANAR[name]
    truth = PolynomialSystem.from_terms(equations, degree=3)
    rng = np.random.default_rng(2)
    t = np.sort(rng.uniform(0, duration, 400))
    found = discover(t, add_noise(truth.simulate(t, x0), 0.02, rng))
    assert score(found, truth).exact
    assert found.status == "ok", found.warnings  # on a line a trajectory needs no turns


TIED = {  # what is conserved ties the candidates together along the trajectory
    "oscillator": ({"x": {"y": 1}, "y": {"x": -1}}, (10, 10), (11, 10), 20, 3),
    "rigid body": (
        {"x": {"yz": 1}, "y": {"xz": -2}, "z": {"xy": 0.6}},
        (10, 10, 0),
        (11, 10.5, 0.8),
        20,
        3,
    ),
    "springs": (
        {"x": {"y": 1}, "y": {"x": -2, "z": 1}, "z": {"w": 1}, "w": {"x": 1, "z": -3}},
        (0, 0, 0, 0),
        (1, 0, 0.5, 0),
        30,
        2,
    ),
}


@pytest.mark.parametrize("name", TIED)
def test_conserved_quantities_do_not_hide_the_law(name):
    terms, offset, x0, duration, degree = TIED[name]
    truth = PolynomialSystem.from_terms(terms).shift(offset)
    t = np.linspace(0, duration, 400)
    assert score(discover(t, truth.simulate(t, x0), degree=degree), truth).exact


@pytest.mark.parametrize("kick", [0.0, 0.3])
def test_the_law_leads_across_gaps_but_for_one_in_which_the_target_was_kicked(kick):
    whole = np.linspace(0, 30, 600)
    first, second = slice(120, 150), slice(290, 330)
    t = np.delete(whole, np.r_[first, second])
    phase = t + kick * (t > 15)
    x = np.stack([np.sin(phase), np.cos(phase)], axis=1)
    found = discover(t, add_noise(x, 0.02, np.random.default_rng(0)), degree=1)
    inside = np.stack([np.sin(whole), np.cos(whole)], axis=1)[first]
    np.testing.assert_allclose(found.curve(whole[first]), inside, atol=0.02)
    assert np.isfinite(found.curve(whole[second])).all() == (kick == 0)


@pytest.mark.parametrize(
    ("missing", "noise"), [("a third of all entries", 0.02), ("nine of ten of a coordinate", 0.0)]
)
def test_what_was_seen_in_a_row_counts(missing, noise):
    truth, t, x = measured("Lorenz", noise, n=800)
    if missing == "a third of all entries":
        x[np.random.default_rng(8).random(x.shape) < 1 / 3] = np.nan
    else:
        x[np.arange(len(t)) % 10 > 0, 1] = np.nan
    found = discover(t, x)
    result = score(found, truth)
    assert result.exact
    assert result.l2 < 1e-4 + noise / 5
    assert found.status == "ok"


def test_units_do_not_matter():
    truth, t, x = measured("SprottE", 0.05, n=400)
    found = discover(t, x)
    scaled = discover(3600 * t, 1e-3 * x)
    assert (scaled.coefficients != 0).tolist() == (found.coefficients != 0).tolist()
    factor = 1e-3 / 1e-3 ** found.system.exponents.sum(axis=1)[:, None] / 3600
    np.testing.assert_allclose(scaled.coefficients, found.coefficients * factor, rtol=1e-6)
    np.testing.assert_allclose(scaled.standard_errors, found.standard_errors * factor, rtol=1e-4)


def test_curve_follows_the_truth_better_than_the_data_and_equal_seeds_give_equal_results():
    truth, t, x = measured("Lorenz", 0.05, n=400)
    found, again = (discover(t, x, seed=5, time_limit=limit) for limit in (None, 1e9))
    assert (found.coefficients == again.coefficients).all()
    assert (found.covariance == again.covariance).all()
    assert not any("time limit" in text for text in again.warnings)
    clean = truth.trajectory(400)[1]
    fitted = found.curve(t)
    assert np.sqrt(np.mean((fitted - clean) ** 2)) < 0.3 * np.sqrt(np.mean((x - clean) ** 2))
    assert np.isnan(found.curve(np.array([t[-1] + 1]))).all()


def test_standard_errors_are_calibrated():
    truth = PolynomialSystem.from_terms(PLANAR["oscillator"][0], degree=3)
    t = np.linspace(0, 25, 200)
    x = truth.simulate(t, (0.5, 0))
    scores = []
    for seed in range(8):
        found = discover(t, add_noise(x, 0.05, np.random.default_rng(seed)))
        error = found.coefficients - truth.coefficients
        if score(found, truth).exact:  # a false term every hundred draws is within the design
            scores.append(
                (error / np.where(truth.support, found.standard_errors, 1))[truth.support]
            )
    assert len(scores) >= 7
    assert kstest(np.concatenate(scores), "norm").pvalue > 1e-3


def test_the_progress_bar_knows_its_end(monkeypatch):
    bars = []

    class Bar(tqdm):
        def close(self):
            bars.append((self.n, self.total))
            super().close()

    monkeypatch.setattr(solver, "bar", lambda asked, label, **how: Bar(desc=label, **how))
    t = np.linspace(0, 12, 200)
    discover(t, np.stack([np.sin(t), np.cos(t)], axis=1), degree=1, progress=True)
    end = 2 * (1 + solver.ROUNDS)
    assert bars[0] == (end, end)


def test_kicks_are_not_sought_when_the_time_is_over(monkeypatch):
    t = np.linspace(0, 40, 400)
    x = np.stack([np.sin(t + np.sin(3 * t)), np.cos(t)], axis=1)  # outside the library

    def sought(*_):
        raise AssertionError

    monkeypatch.setattr(solver, "with_process_noise", sought)
    with pytest.raises(AssertionError):
        discover(t, x, order=1)
    found = discover(t, x, order=1, time_limit=1e-9)
    assert "the time limit of `discover` ended the search" in found.warnings[0]


# -- warnings --------------------------------------------------------------------------------------


def test_pure_noise_gives_no_law_without_a_warning():
    x = np.random.default_rng(0).normal(size=(200, 2))
    found = discover(np.arange(200.0), x)
    assert (found.status, found.system.order, found.note) == ("suspect", 1, "")


# -- input ---------------------------------------------------------------------------------------


NOISE = np.random.default_rng(0).normal(size=(200, 3))


@pytest.mark.parametrize(
    ("x", "options", "message"),
    [
        (NOISE[:20], {}, "x: must hold at least as many samples as unknowns"),
        (NOISE * [1, 1e-12, 1] + [0, 1e3, 0], {}, "must move, got a constant column 1"),
        (NOISE[:, :1], {"degree": "3"}, "degree: must be"),
        (NOISE, {"degree": 2, "library": Library.fourier()}, "degree: must not be given with a li"),
        (NOISE[:, :1], {"time_limit": 0}, "time_limit: must be"),
        (NOISE[:, :1], {"time_limit": "soon"}, "time_limit: must be"),
    ],
)
def test_bad_input_is_refused(x, options, message):
    with pytest.raises(ValueError, match=message):
        discover(np.arange(len(x)), x, **options)


def threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_a_discovery_has_one_thread_and_gives_back_what_was_there(monkeypatch):
    here, there, within = one_blas_thread(), one_blas_thread(), []
    with threadpool_limits(limits=2, user_api="blas"), ThreadPoolExecutor(1) as other:
        here.__enter__()
        other.submit(there.__enter__).result()
        here.__exit__(None, None, None)
        within.append(other.submit(threads).result())  # the other one has not ended
        other.submit(there.__exit__, None, None, None).result()
        assert threads() == {2}
        monkeypatch.setattr(solver, "_of_order", lambda *_: within.append(threads()))
        discover(np.linspace(0, 10, 50), np.sin(np.linspace(0, 10, 50))[:, None])
        assert threads() == {2}
    assert within == [{1}, {1}]


PROCESS = "import json, test_solver; print(json.dumps(test_solver.outcome()))"


def outcome():
    """A chaotic path as a digest; coefficients and standard errors of what is found."""
    path = hashlib.sha256(SYSTEMS["SprottF"].trajectory(800)[1].tobytes()).hexdigest()
    found = discover(*measured("SprottF", 0.1, n=400, seed=8)[1:])
    return path, found.coefficients.tolist(), found.standard_errors.tolist()


def test_a_kernel_of_linear_algebra_does_not_count():
    """With scipy's integrator the end of this path moved by its whole width."""
    folders = Path(vidsindy_lite.__file__).parents[1], Path(__file__).parent
    here = {"PYTHONPATH": os.pathsep.join(map(str, folders))}
    kernel = {"OPENBLAS_CORETYPE": "Haswell", "OMP_NUM_THREADS": "2"}
    ran = subprocess.run(
        [sys.executable, "-c", PROCESS],
        env=os.environ | here | kernel, capture_output=True, text=True, check=True,
    )  # fmt: skip
    (digest, *found), (path, *own) = json.loads(ran.stdout), outcome()
    assert digest == path
    (found, errors), (coefficients, _) = np.array(found), np.array(own)
    live = found != 0
    assert (live == (coefficients != 0)).all()
    assert (np.abs(coefficients - found)[live] / errors[live]).max() < 0.01
