"""Typed trials: their data, their seeds, their scores; and the film behind them."""

from dataclasses import replace

import numpy as np
import pytest

from vidsindy_lite import discover
from vidsindy_lite.pipeline import Refused
from vidsindy_lite.study import score
from vidsindy_lite.study import trials as experiments
from vidsindy_lite.study.paper import REFERENCE_OFFSET, SYSTEMS
from vidsindy_lite.study.trials import FilmTask, Trial, by_condition, grid, run_trial, significant

FRAMES = 150


@pytest.fixture(autouse=True)
def nothing_of_another_test(tmp_path, monkeypatch):
    experiments._path.cache_clear()
    monkeypatch.setenv("VIDSINDY_CACHE", str(tmp_path))


@pytest.fixture(scope="module")
def filmed():
    return experiments.run_film(FilmTask("SprottE", 1, 150))


@pytest.fixture
def this_film(filmed, monkeypatch):
    monkeypatch.setattr(experiments, "film_result", lambda task: filmed)
    return filmed


def from_source(source, **fields):
    return experiments.trial_path(Trial("SprottE", trial=1, source=source, frames=150, **fields))


def test_film_result_reports_every_error(this_film):
    assert this_film.x.shape == (150, 3)
    assert max(this_film.pixel_error) < 0.1
    truth = from_source("truth").x
    np.testing.assert_array_equal(truth, this_film.truth.trajectory(150)[1])
    error = np.sqrt(np.mean((this_film.x - truth) ** 2, axis=0))
    np.testing.assert_allclose(this_film.path_error, error)
    assert (this_film.path_error < 0.01 * truth.std(axis=0)).all()
    assert all(camera.is_calibrated for camera in this_film.rig.cameras)
    off = {source: np.abs(from_source(source).x - truth).max() for source in experiments.SOURCES}
    pixel = max(camera.scale for camera in this_film.rig.cameras)
    assert off["path"] == pytest.approx(off["sub-pixel"], rel=1e-6)
    assert off["sub-pixel"] < 0.2 * off["detector"]
    assert off["detector"] < 4 * pixel


def test_gauss_newton_is_told_the_systematic_errors_of_what_cameras_reconstructed(
    this_film, monkeypatch
):
    told = {}

    def watch(t, x, systematic=None, **_):
        told[source] = systematic
        return SYSTEMS["SprottE"]

    monkeypatch.setattr(experiments, "discover", watch)
    for source in experiments.SOURCES:
        run_trial(Trial("SprottE", "blocks", 0.2, 1, source=source, frames=150))
    assert told["truth"] is None
    np.testing.assert_array_equal(told["path"], this_film.systematic)
    rms = {source: np.sqrt((told[source] ** 2).mean()) for source in ("sub-pixel", "detector")}
    assert 0 < 10 * rms["sub-pixel"] < rms["detector"]


def test_where_cameras_cannot_be_learned_no_method_has_a_law(this_film, monkeypatch):
    def refuse(tracks, *_, **__):
        raise Refused("tracks: the motion must determine the cameras", "cameras", tracks)

    monkeypatch.setattr(experiments, "observe_tracks", refuse)
    trials = grid(["SprottE"], {"clean": (0,)}, [1], experiments.METHODS, 150)
    results = [run_trial(trial) for trial in trials]
    assert {result.verdict for result in results} == {"wrong, refused"}
    assert {result.score.missing for result in results} == {8}
    assert results[0].warnings == ("tracks: the motion must determine the cameras",)
    row = experiments.summary(experiments.tabulate(results), "system").iloc[0]
    assert (row["exact"], row["no path"], row["wrong, ok"]) == ("0 of 6", 6, None)


def test_data_depend_on_system_condition_level_and_number_alone():
    x = SYSTEMS["Lorenz"].trajectory(FRAMES)[1]
    trial = Trial("Lorenz", "noise", 0.1, 3, frames=FRAMES)
    expected = trial.corrupt_each([x])[0]
    np.random.default_rng(0).random(100)
    Trial("SprottF", "noise", 0.1, 3).corrupt_each([x])  # what ran before does not matter
    same = replace(trial, method="PySINDy", source="path")
    np.testing.assert_array_equal(same.corrupt_each([x])[0], expected)
    for other in ({"trial": 4}, {"level": 0.15}, {"system": "SprottF"}):
        assert not np.array_equal(replace(trial, **other).corrupt_each([x])[0], expected)


def test_every_method_gets_the_same_data_and_the_number_as_its_seed(this_film, monkeypatch):
    seen = {}

    def watch(method, t, x, systematic, seed):
        seen[method] = (t, x, seed)
        return SYSTEMS["SprottE"]

    monkeypatch.setattr(experiments, "find_law", watch)
    trial = Trial("SprottE", "blocks", 0.2, 1, source="truth", frames=FRAMES)
    methods = [replace(trial, method=method) for method in experiments.METHODS]
    assert [result.trial for result in experiments.run_trials(methods, jobs=1)] == methods
    t, x, _ = seen["Gauss-Newton"]
    assert set(seen) == set(experiments.METHODS)
    for other_t, other_x, seed in seen.values():
        np.testing.assert_array_equal(other_t, t)
        np.testing.assert_array_equal(other_x, x)
        assert seed == 1


def test_result_of_gauss_newton_equals_a_direct_computation(this_film):
    trial = Trial("SprottE", "noise", 0.02, 2, source="truth", frames=FRAMES)
    truth = SYSTEMS["SprottE"].shift(REFERENCE_OFFSET)
    t, x = truth.trajectory(FRAMES)
    found = discover(t, trial.corrupt_each([x])[0])
    result = run_trial(trial)
    direct = score(found, truth)
    np.testing.assert_array_equal(result.law.coefficients, found.coefficients)
    assert str(result.score) == str(direct)
    assert result.wrong_terms == direct.missing + direct.false_positives
    assert (result.status, result.warnings) == (found.status, found.warnings)
    assert result.verdict == f"{'exact' if direct.exact else 'wrong'}, {found.status}"
    assert result.seconds > 0
    assert len(result.pulls) == truth.support.sum() - direct.missing


def test_grid_is_every_combination_once_and_zero_is_clean():
    levels = {"noise": (0, 0.1), "blocks": (0, 0.1)}
    trials = grid(["Lorenz", "SprottF"], levels, range(3), ["Gauss-Newton", "PySINDy"], frames=50)
    assert len(set(trials)) == len(trials) == 2 * 3 * 2 * 3
    assert {(t.condition, t.level) for t in trials} == {
        ("clean", 0.0), ("noise", 0.1), ("blocks", 0.1),
    }  # fmt: skip
    assert {t.film for t in trials} == {
        FilmTask(name, trial, 50) for name in ("Lorenz", "SprottF") for trial in range(3)
    }


@pytest.fixture(scope="module")
def trials():
    """Twelve trials as a table; those of level .2 and number 1 have another law."""
    truth = SYSTEMS["Lorenz"].shift(REFERENCE_OFFSET)
    tasks = grid(["Lorenz"], {"noise": (0, 0.2, 0.1), "blocks": (0.3,)}, range(3))
    laws = [SYSTEMS["Lorenz"] if (one.level, one.trial) == (0.2, 1) else truth for one in tasks]
    return experiments.tabulate(
        experiments.TrialResult(one, law, score(law, truth), 0.0)
        for one, law in zip(tasks, laws, strict=True)
    )


def test_clean_trials_stand_in_every_condition(trials):
    levelled = by_condition(trials)
    counts = levelled.groupby(["condition", "level"], sort=False).size().to_dict()
    assert list(counts.items()) == [
        (("noise", 0.0), 3), (("noise", 0.1), 3), (("noise", 0.2), 3),
        (("blocks", 0.0), 3), (("blocks", 0.3), 3),
    ]  # fmt: skip
    assert by_condition(trials[trials.condition == "clean"]).empty


def test_summary_counts_by_trial_and_gives_median_and_range(trials):
    rows = experiments.summary(trials, ["condition", "level"])
    assert list(rows.level) == [0, 0.2, 0.1, 0.3]
    row, odd = rows.iloc[1], trials[~trials.exact].iloc[0]
    assert row["exact"] == "2 of 3"
    assert row["wrong terms"] == f"0 {odd.wrong_terms} 0"  # one trial of three moves no median
    assert row["l2 (e-2)"] == row["least"] == 0.001  # given as the least that is told apart
    assert row["most"] == float(f"{100 * odd.l2:.1e}")
    assert row["precision (%)"] == row["recall (%)"] == 100
    assert (row["exact, doubted"], row["wrong, ok"]) == (None, None)  # the stand-in has no status
    told = trials.assign(verdict=[f"{'exact' if e else 'wrong'}, {s}" for e, s in zip(
        trials.exact, ["ok", "suspect"] * 6, strict=True)])  # fmt: skip
    row = experiments.summary(told, "system").iloc[0]
    assert row["exact, doubted"] == (told.verdict == "exact, suspect").sum() > 0
    assert row["wrong, ok"] == (told.verdict == "wrong, ok").sum()
    assert (significant(0.00123456), significant(-98765.4, 3)) == (0.0012, -98800)
    assert (significant(0.0), significant(2e-6, least=1e-5)) == (0, 1e-5)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"system": "Lorentz"}, "system: must be one of Lorenz, .*, got 'Lorentz'"),
        ({"condition": "rain", "level": 0.1}, "condition: must be one of clean, noise"),
        ({"method": "guess"}, "method: must be one of Gauss-Newton, spline-ADO, .*, got 'guess'"),
        ({"source": "memory"}, "source: must be one of detector"),
        ({"condition": "noise"}, "level: must be 0 in the condition 'clean', above 0 in all o"),
        ({"condition": "blocks", "level": 1.0}, r"level: .*below 1 of blocks .*, got 1.0 in"),
        ({"level": 0.1}, r"level: .*, got 0.1 in 'clean'"),
        ({"condition": "noise", "level": np.nan}, "level: .*, got nan"),
    ],
)
def test_a_trial_checks_itself(fields, message):
    with pytest.raises(ValueError, match=message):
        Trial(**{"system": "Lorenz"} | fields)
