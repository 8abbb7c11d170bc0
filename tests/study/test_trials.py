"""Typed trials: their data, their seeds, their scores; and the film behind them."""

import pickle
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from vidsindy_lite import discover
from vidsindy_lite.observation import Observation
from vidsindy_lite.study import baselines, score
from vidsindy_lite.study import trials as experiments
from vidsindy_lite.study.baselines import BASELINES
from vidsindy_lite.study.corruption import add_noise, drop_blocks, drop_fibers
from vidsindy_lite.study.films import FilmResult, FilmTask, detect_near, film, run_film
from vidsindy_lite.study.systems import REFERENCE_OFFSET, SYSTEMS
from vidsindy_lite.study.tables import by_condition, rate, significant, summary, tabulate
from vidsindy_lite.study.trials import Trial, grid, run_trial, source_path
from vidsindy_lite.vision import LearnedDetector, detections, read_video

pytestmark = pytest.mark.slow  # films and discovers

FRAMES = 300
CORRUPT = [("noise", 0.1), ("blocks", 0.2), ("fibers", 0.2)]


def simulated(task):
    """A recording without videos: the true path, pixels from nowhere."""
    truth = SYSTEMS[task.system].shift(REFERENCE_OFFSET)
    t, x = truth.trajectory(task.frames)
    seen = Observation((), None, None, t, x, np.zeros((0, *x.shape)), ())
    return FilmResult(
        **vars(seen),
        task=task,
        truth=truth,
        pixel_error=(0.0,) * 3,
        path_error=np.zeros(3),
        seconds=0.0,
        detected=(),
    )


@pytest.fixture
def no_videos(monkeypatch):
    monkeypatch.setattr(experiments, "film_result", simulated)


@pytest.fixture(scope="module")
def filmed():
    return run_film(FilmTask("SprottE", 1, 200))


# ------------------------------------------------------------------------------------------ films


def test_film_result_reports_every_error(filmed):
    assert filmed.x.shape == (200, 3)
    assert max(filmed.pixel_error) < 0.1
    truth = source_path(filmed, "truth")[0]
    np.testing.assert_array_equal(truth, filmed.truth.trajectory(200)[1])
    np.testing.assert_allclose(filmed.path_error, np.sqrt(np.mean((filmed.x - truth) ** 2, axis=0)))
    assert (filmed.path_error < 0.01 * truth.std(axis=0)).all()
    assert all(camera.is_calibrated for camera in filmed.rig.cameras)


def test_whole_pixels_are_coarser_but_near(filmed):
    truth = source_path(filmed, "truth")[0]
    fine, coarse = (
        np.abs(source_path(filmed, s)[0] - truth).max() for s in ("videos", "whole pixels")
    )
    pixel = max(camera.scale for camera in filmed.rig.cameras)
    assert fine < 0.2 * coarse
    assert coarse < 2 * pixel
    assert np.abs(source_path(filmed, "detector")[0] - truth).max() < 4 * pixel


def test_near_its_target_the_detector_sees_what_it_sees_in_the_whole_frame(tmp_path):
    shot = film("SprottE", tmp_path, 12)
    track = shot.tracks[0].copy()
    track[3], track[5:] = np.nan, shot.tracks[0][5:] + [3, -2]  # lost once, then only about there
    near = detect_near(shot.paths[0], track)
    whole = [detections(LearnedDetector().predict(f))[0].centre for f in read_video(shot.paths[0])]
    assert np.isnan(near[3]).all()
    others = np.arange(len(near)) != 3
    np.testing.assert_allclose(near[others], np.array(whole)[others], atol=0.3)
    assert np.linalg.norm(near - shot.tracks[0], axis=1)[others].mean() < 1


def test_the_detector_keeps_windows_of_the_frames_not_the_frames(tmp_path):
    shot = film("Lorenz", tmp_path, frames=60)
    tracemalloc.start()
    detect_near(shot.paths[0], shot.tracks[0])
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 60 * 512 * 512 * 3 / 2


def test_ours_is_told_the_systematic_errors_of_what_cameras_reconstructed(filmed, monkeypatch):
    told = {}

    def watch(t, x, systematic=None, **_):
        told[source] = systematic
        return SYSTEMS["SprottE"]

    monkeypatch.setattr(experiments, "film_result", lambda task: filmed)
    monkeypatch.setattr(experiments, "discover", watch)
    for source in experiments.SOURCES:
        run_trial(Trial("SprottE", "blocks", 0.2, 1, source=source, frames=200))
    assert told["truth"] is None
    np.testing.assert_array_equal(told["videos"], filmed.systematic)
    assert told["whole pixels"].shape == filmed.systematic.shape
    rms = {source: np.sqrt((told[source] ** 2).mean()) for source in ("videos", "whole pixels")}
    assert 0 < 10 * rms["videos"] < rms["whole pixels"]


def test_tracks_are_corrupted_each_by_its_own_draw_before_the_cameras_are_learned(
    filmed, monkeypatch
):
    given, observe = [], experiments.observe_tracks
    monkeypatch.setattr(experiments, "film_result", lambda task: filmed)
    monkeypatch.setattr(experiments, "discover", lambda t, x, **_: SYSTEMS["SprottE"])
    monkeypatch.setattr(
        experiments,
        "observe_tracks",
        lambda tracks, *rest, **o: given.extend(tracks) or observe(tracks, *rest, **o),
    )
    run_trial(Trial("SprottE", "noise", 0.02, 1, source="tracks", frames=200))
    off = [track - true for track, true in zip(given, filmed.tracks, strict=True)]
    for wrong, true in zip(off, filmed.tracks, strict=True):
        np.testing.assert_allclose(wrong.std(axis=0), 0.02 * true.std(axis=0), rtol=0.2)
    assert abs(np.corrcoef(off[0][:, 0], off[1][:, 0])[0, 1]) < 0.3


def test_unknown_source_is_named(filmed):
    with pytest.raises(ValueError, match="source: must be one of videos, .* got 'memory'"):
        source_path(filmed, "memory")


def test_film_result_is_small_enough_to_store(filmed):
    assert len(pickle.dumps(filmed)) < 200_000


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

        def watch(t, x, *_, method=method, **__):
            seen[method] = (t, x)
            return SYSTEMS["Lorenz"]

        if method == "ours":
            monkeypatch.setattr(experiments, "discover", watch)
        else:
            monkeypatch.setitem(BASELINES, method, watch)
        run_trial(Trial("Lorenz", condition, level, 1, method, frames=FRAMES))
    t, x = seen["ours"]
    assert set(seen) == set(experiments.METHODS)
    for other_t, other_x in seen.values():
        np.testing.assert_array_equal(other_t, t)
        np.testing.assert_array_equal(other_x, x)


def test_methods_are_ours_and_every_baseline():
    assert ("ours", *BASELINES) == experiments.METHODS


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
    assert (result.status, result.warnings) == (found.status, found.warnings)
    assert result.verdict == f"{'exact' if direct.exact else 'wrong'}, {found.status}"
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
    assert (result.status, result.promised_l2, len(result.pulls)) == (None, None, 0)


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


@pytest.fixture(scope="module")
def trials():
    """Twelve trials as a table; those of level .2 and number 1 have another law."""

    def found(t, x, systematic=None, **_):
        wrong = np.isclose((x - x[0]).std(), odd)
        return SYSTEMS["Lorenz"].shift(REFERENCE_OFFSET if not wrong else (0, 0, 0))

    x = SYSTEMS["Lorenz"].shift(REFERENCE_OFFSET).trajectory(FRAMES)[1]
    path = Trial("Lorenz", "noise", 0.2, 1, frames=FRAMES).corrupt(x)
    odd = (path - path[0]).std()
    levels = {"noise": (0, 0.2, 0.1), "blocks": (0.3,)}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(experiments, "film_result", simulated)
        patch.setattr(experiments, "discover", found)
        return tabulate(run_trial(t) for t in grid(["Lorenz"], levels, range(3), frames=FRAMES))


def test_a_row_a_trial(trials):
    assert len(trials) == 12
    assert list(trials.condition[:4]) == ["clean", "noise", "noise", "blocks"]
    assert list(trials.level[:4]) == [0, 0.2, 0.1, 0.3]
    (wrong,) = trials[~trials.exact].itertuples()
    assert (wrong.condition, wrong.level, wrong.trial) == ("noise", 0.2, 1)
    assert wrong.wrong_terms == wrong.missing + wrong.false_positives > 0
    assert wrong.l2 > 0.5
    assert (trials.l2[trials.exact] == 0).all()


def test_clean_trials_stand_in_every_condition(trials):
    levelled = by_condition(trials)
    counts = levelled.groupby(["condition", "level"], sort=False).size().to_dict()
    assert list(counts.items()) == [
        (("noise", 0.0), 3), (("noise", 0.1), 3), (("noise", 0.2), 3),
        (("blocks", 0.0), 3), (("blocks", 0.3), 3),
    ]  # fmt: skip
    assert by_condition(trials[trials.condition == "clean"]).empty


def test_summary_is_rates_and_medians_in_the_papers_units(trials):
    rows = summary(trials, ["condition", "level"])
    assert list(rows.level) == [0, 0.2, 0.1, 0.3]
    row = rows.iloc[1]
    assert (row["terms found"], row["exact"]) == ("2 of 3", "2 of 3")
    assert row["false positives"] == 0  # one trial of three moves no median
    assert row["l2 (e-2)"] == 0.001  # as good as exact, and given as the least that is told apart
    assert row["precision (%)"] == row["recall (%)"] == 100
    one = summary(trials[~trials.exact], "system").iloc[0]
    truth, found = SYSTEMS["Lorenz"].shift(REFERENCE_OFFSET), SYSTEMS["Lorenz"]
    direct = score(found, truth)
    assert one["l2 (e-2)"] == float(f"{100 * direct.l2:.1e}")
    assert one["precision (%)"] == pytest.approx(100 * direct.precision, abs=0.005)
    assert one["recall (%)"] == pytest.approx(100 * direct.recall, abs=0.005)


def test_digits_that_are_printed(trials):
    assert rate(trials.exact) == "11 of 12"
    assert significant(0.00123456) == 0.0012
    assert significant(-98765.4, 3) == -98800
    assert significant(0.0) == 0
    assert significant(2e-6, least=1e-5) == 1e-5


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
