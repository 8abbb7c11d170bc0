"""Typed trials: their data, their seeds, their scores; and the film behind them."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from vidsindy_lite import discover
from vidsindy_lite.study import baselines, score
from vidsindy_lite.study import trials as experiments
from vidsindy_lite.study.baselines import BASELINES
from vidsindy_lite.study.corruption import add_noise, drop_blocks, drop_fibers
from vidsindy_lite.study.systems import REFERENCE_OFFSET, SYSTEMS
from vidsindy_lite.study.trials import (
    FilmTask,
    Recording,
    Trial,
    by_level,
    grid,
    record,
    run_trial,
    select,
)

pytestmark = pytest.mark.slow  # films and discovers

FRAMES = 300
CORRUPT = [("noise", 0.1), ("blocks", 0.2), ("fibers", 0.2)]


def simulated(task):
    """A recording without videos: the true path, pixels from nowhere."""
    truth = SYSTEMS[task.system].shift(REFERENCE_OFFSET)
    t, x = truth.trajectory(task.frames)
    return Recording(task, truth, (), None, t, x, (0.0,) * 3, np.zeros(3), 0.0)


@pytest.fixture
def no_videos(monkeypatch):
    monkeypatch.setattr(experiments, "recording", simulated)


@pytest.fixture(scope="module")
def recorded():
    return record(FilmTask("SprottE", 1, 200))


# ------------------------------------------------------------------------------------------ films


def test_recording_reports_every_error(recorded):
    assert recorded.x.shape == (200, 3)
    assert max(recorded.pixel_error) < 0.1
    truth = recorded.path("truth")
    np.testing.assert_array_equal(truth, recorded.truth.trajectory(200)[1])
    np.testing.assert_allclose(
        recorded.path_error, np.sqrt(np.mean((recorded.x - truth) ** 2, axis=0))
    )
    assert (recorded.path_error < 0.01 * truth.std(axis=0)).all()
    assert all(camera.is_calibrated for camera in recorded.rig.cameras)


def test_whole_pixels_are_coarser_but_near(recorded):
    truth = recorded.path("truth")
    fine, coarse = (np.abs(recorded.path(s) - truth).max() for s in ("videos", "whole pixels"))
    pixel = max(camera.scale for camera in recorded.rig.cameras)
    assert fine < 0.2 * coarse
    assert coarse < 2 * pixel


def test_unknown_source_is_named(recorded):
    with pytest.raises(ValueError, match="source: must be one of videos, .* got 'memory'"):
        recorded.path("memory")


def test_recording_is_small_enough_to_store(recorded):
    assert len(pickle.dumps(recorded)) < 200_000


# ----------------------------------------------------------------------------------- what is random


@pytest.mark.parametrize(("condition", "level"), CORRUPT)
def test_data_depend_on_system_condition_level_and_number_alone(condition, level):
    x = SYSTEMS["Lorenz"].trajectory(FRAMES)[1]
    trial = Trial("Lorenz", condition, level, 3, frames=FRAMES)
    expected = trial.corrupt(x)
    np.random.default_rng(0).random(100)
    Trial("SprottF", condition, level, 3).corrupt(x)  # what ran before does not matter
    for method in experiments.METHODS:
        for source in experiments.SOURCES:
            same = replace(trial, method=method, source=source)
            np.testing.assert_array_equal(same.corrupt(x), expected)
    others = [
        replace(trial, trial=4),
        replace(trial, level=level + 0.05),
        replace(trial, system="SprottF"),
    ]
    for other in others:
        assert not np.array_equal(other.corrupt(x), expected, equal_nan=True)


def test_noise_of_two_levels_is_not_the_same_noise_scaled():
    x = SYSTEMS["Lorenz"].trajectory(FRAMES)[1]
    noise = {p: Trial("Lorenz", "noise", p, 0).corrupt(x) - x for p in (0.1, 0.2)}
    assert abs(np.corrcoef(noise[0.1].ravel(), noise[0.2].ravel())[0, 1]) < 0.2


@pytest.mark.parametrize(("condition", "level"), CORRUPT)
def test_every_method_gets_the_same_data(condition, level, no_videos, monkeypatch):
    seen = {}
    for method in experiments.METHODS:
        def watch(t, x, seed=None, method=method):
            seen[method] = (t, x)
            return SYSTEMS["Lorenz"]

        monkeypatch.setitem(experiments.METHODS, method, watch)
        run_trial(Trial("Lorenz", condition, level, 1, method, frames=FRAMES))
    t, x = seen["ours"]
    assert set(seen) == set(experiments.METHODS)
    for other_t, other_x in seen.values():
        np.testing.assert_array_equal(other_t, t)
        np.testing.assert_array_equal(other_x, x)


def test_corruption_is_that_of_the_protocol():
    x = SYSTEMS["Lorenz"].trajectory(1500)[1]
    noisy = Trial("Lorenz", "noise", 0.2).corrupt(x) - x
    np.testing.assert_allclose(noisy.std(axis=0), 0.2 * x.std(axis=0), rtol=0.1)
    for condition, gaps in (("blocks", 20), ("fibers", 5)):
        hidden = np.isnan(Trial("Lorenz", condition, 0.2).corrupt(x)).all(axis=1)
        assert hidden.sum() == 300
        assert np.sum(np.diff(np.concatenate([[0], hidden])) == 1) == gaps
    assert Trial("Lorenz").corrupt(x) is x
    functions = {"noise": add_noise, "blocks": drop_blocks, "fibers": drop_fibers}
    assert functions == experiments.CORRUPTIONS


# ----------------------------------------------------------------------------------------- results


def test_result_of_ours_equals_a_direct_computation(no_videos):
    trial = Trial("SprottE", "noise", 0.02, 2, frames=FRAMES)
    truth = SYSTEMS["SprottE"].shift(REFERENCE_OFFSET)
    t, x = truth.trajectory(FRAMES)
    found = discover(t, trial.corrupt(x))
    result = run_trial(trial)
    direct = score(found, truth)
    np.testing.assert_array_equal(result.law.coefficients, found.coefficients)
    assert str(result.score) == str(direct)
    assert result.wrong_terms == direct.missing + direct.false_positives
    assert result.native_exact == score(found.native, SYSTEMS["SprottE"]).exact
    assert (result.status, result.warnings) == (found.status, found.warnings)
    assert result.verdict == f"{'exact' if direct.exact else 'wrong'}, {found.status}"
    np.testing.assert_allclose(result.sigma, 0.02 * x.std(axis=0))
    assert result.seconds > 0
    assert len(result.pulls) == truth.support.sum() - direct.missing
    assert len(pickle.dumps(result)) < 10_000


@pytest.mark.parametrize("method", BASELINES)
def test_result_of_a_baseline_equals_a_direct_computation(method, no_videos, monkeypatch):
    # That each baseline is what pysindy does when called by hand is in test_baselines.
    monkeypatch.setattr(baselines, "THRESHOLDS", (0.1, 0.3))
    result = run_trial(Trial("Lorenz", trial=2, method=method, frames=FRAMES))
    data = simulated(FilmTask("Lorenz", 2, FRAMES))
    options = {} if method == "PySINDy" else {"seed": 2}
    found = BASELINES[method](data.t, data.x, **options)
    np.testing.assert_array_equal(result.law.coefficients, found.coefficients)
    assert str(result.score) == str(score(found, data.truth))
    assert (result.status, result.native_exact, len(result.pulls)) == (None, None, 0)


@pytest.mark.parametrize("method", BASELINES)
def test_gaps_reach_no_baseline(method, no_videos, monkeypatch):
    monkeypatch.setattr(baselines, "THRESHOLDS", (0.1, 0.3))
    result = run_trial(Trial("Lorenz", "blocks", 0.5, 0, method, frames=FRAMES))
    assert np.isfinite(result.law.coefficients).all()
    assert result.law.support.any()


# ------------------------------------------------------------------------------------ many of them


def test_grid_is_every_combination_once_and_zero_is_clean():
    levels = {"noise": (0, 0.1), "blocks": (0, 0.1)}
    trials = grid(["Lorenz", "SprottF"], levels, range(3), ["ours", "PySINDy"], frames=50)
    assert len(set(trials)) == len(trials) == 2 * 3 * 2 * 3
    assert {(t.condition, t.level) for t in trials} == {
        ("clean", 0.0), ("noise", 0.1), ("blocks", 0.1),
    }  # fmt: skip
    assert {t.film for t in trials} == {
        FilmTask(name, trial, 50) for name in ("Lorenz", "SprottF") for trial in range(3)
    }


def test_results_are_found_by_their_fields(no_videos, monkeypatch):
    monkeypatch.setitem(experiments.METHODS, "ours", lambda t, x: SYSTEMS["Lorenz"])
    levels = {"noise": (0, 0.2, 0.1), "blocks": (0.3,)}
    results = [run_trial(trial) for trial in grid(["Lorenz"], levels, range(2), frames=FRAMES)]
    assert len(select(results, condition="noise")) == 4
    assert len(select(results, condition="noise", trial=1, level=0.1)) == 1
    assert select(results, system="SprottF") == []
    noise = by_level(results, "noise", method="ours")
    assert list(noise) == [0.0, 0.1, 0.2]
    assert all(len(group) == 2 for group in noise.values())
    assert list(by_level(results, "blocks")) == [0.0, 0.3]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"system": "Lorentz"}, "system: must be one of Lorenz, .*, got 'Lorentz'"),
        ({"condition": "rain", "level": 0.1}, "condition: must be one of clean, noise"),
        ({"method": "guess"}, "method: must be one of ours, PySINDy, .*, got 'guess'"),
        ({"source": "memory"}, "source: must be one of videos"),
        ({"condition": "noise"}, "level: must be 0 in the condition 'clean' and above 0 in all"),
        ({"level": 0.1}, r"level: .*, got 0.1 in 'clean'"),
        ({"condition": "noise", "level": np.nan}, "level: .*, got nan"),
    ],
)
def test_a_trial_checks_itself(fields, message):
    with pytest.raises(ValueError, match=message):
        Trial(**{"system": "Lorenz"} | fields)
