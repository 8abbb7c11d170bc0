"""Who is who among several targets: orders that tracks have lost come back from geometry."""

import numpy as np
import pytest
from helpers import room, trajectory, walk
from hypothesis import given, settings
from hypothesis import strategies as st

import vidsindy_lite as vl
from vidsindy_lite.cameras import identify, targets

FRAMES = 240
BLIND = 7  # frames around a meeting in which a view loses the targets


def mixed(places, rng, meetings=5):
    """Tracks (n, 2 k) of a view whose targets change places behind each of some gaps."""
    n, k, _ = places.shape
    track = places.copy()
    for at in rng.integers(10, n - 10, meetings):
        order = rng.permutation(k)
        track[at:] = track[at:][:, order]
        track[at - BLIND // 2 : at + BLIND // 2 + 1] = np.nan
    return track.reshape(n, -1)


def filmed(rig, paths, rng, noise=0.0):
    """What the cameras see of the targets, each view in an order of its own."""
    views = [np.stack([camera.project(x) for x in paths], axis=1) for camera in rig.cameras]
    return [mixed(view + noise * rng.normal(size=view.shape), rng) for view in views], views


def assert_told_apart(told, views, tolerance=1e-9):
    """The same order in all views, that of the truth up to the names of the targets."""
    first = np.nanargmax(np.isfinite(told[0]).all(axis=1))
    k = views[0].shape[1]
    places = told[0].reshape(len(told[0]), k, 2)
    apart = np.linalg.norm(places[first][:, None] - views[0][first][None], axis=2)
    order = apart.argmin(axis=1)
    assert sorted(order) == list(range(k))
    assert (np.diff(places[first][:, 0]) > 0).all()  # numbered from left to right
    for track, view in zip(told, views, strict=True):
        off = track.reshape(len(track), k, 2) - view[:, order]
        assert np.nanmax(np.abs(off)) < tolerance
        assert np.isfinite(off).all(axis=(1, 2)).mean() > 0.7


@settings(max_examples=6)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 3]))
def test_orthographic_views_whose_cameras_are_not_learned_yet(seed, count):
    rng = np.random.default_rng(seed)
    paths = [trajectory(rng, FRAMES) for _ in range(count)]
    middle = paths[0].mean(axis=0)
    paths = [(x - x.mean(axis=0)) / np.ptp(x) + 0.2 * rng.normal(size=3) for x in paths]
    rig = vl.Rig.around(np.concatenate(paths) + middle)
    paths = [x + middle for x in paths]
    tracks, views = filmed(rig, paths, rng)
    told, doubts = identify(tracks, rig.uncalibrated(keep=0))
    if not doubts:  # all views may be blind at once, just when two targets meet in space
        assert_told_apart(told, views)


@pytest.mark.parametrize("twin", [False, True])
def test_a_meeting_that_one_view_alone_does_not_see_costs_its_frames_only(twin):
    rig, truth, views = two_walks(3)
    if twin:  # of two views from one place none tells the other anything
        rig, truth[2], views[2] = vl.Rig([*rig.cameras[:2], rig.cameras[0]]), truth[0], views[0]
    views = [view.reshape(FRAMES, -1) for view in views]
    views[1][100:] = np.roll(views[1][100:], 2, axis=1)
    views[1][95:105] = np.nan
    told, doubts = identify(views, rig)
    assert not doubts
    for i, view in enumerate(truth):
        expected = view.reshape(FRAMES, -1)
        seen = np.isfinite(told[i]).all(axis=1)
        assert seen.sum() == FRAMES - 10 * (i == 1)
        np.testing.assert_allclose(told[i][seen], expected[seen])


def test_each_of_many_views_adds_the_orders_of_its_own_targets(monkeypatch):
    rig, tried = room(np.random.default_rng(5), 4), []
    learned = lambda *given: tried.append(given) or vl.learn_cameras(*given)  # noqa: E731
    monkeypatch.setattr(targets, "learn_cameras", learned)
    paths = [walk(np.arange(FRAMES) + start) for start in (0, 700, 1900)]
    identify([np.hstack([camera.project(x) for x in paths]) for camera in rig.cameras], rig)
    assert len(tried) == 3 * 6


def two_walks(seed):
    """A room, two targets in its views, (n, 2, 2) each, and copies of these to change."""
    rig = room(np.random.default_rng(seed))
    paths = [walk(np.arange(FRAMES)), walk(np.arange(FRAMES) + 700)]
    views = [np.stack([camera.project(x) for x in paths], axis=1) for camera in rig.cameras]
    return rig, views, [view.copy() for view in views]


def test_a_view_may_be_blind_between_two_gaps_in_all_views():
    rig, views, tracks = two_walks(8)
    for track in tracks:
        track[100:140] = track[100:140, ::-1]
        for gap in (slice(97, 103), slice(137, 143)):
            track[gap] = np.nan
    tracks[0][97:143] = np.nan
    told, doubts = identify([track.reshape(FRAMES, -1) for track in tracks], rig)
    assert not doubts
    assert_told_apart(told, views)


def fallen(low, high, unseen):
    """A room, and two targets that fall onto a wall, where no view sees them."""
    rig = room(np.random.default_rng(5))
    t = np.linspace(low, high, FRAMES)
    # One comes back where the other might have.
    paths = [np.outer(np.abs(t), side) for side in ([0.5, 0.2, 0.1], [0.5, -0.2, 0.1])]
    views = [np.stack([camera.project(x) for x in paths], axis=1) for camera in rig.cameras]
    tracks = [view.copy() for view in views]
    for track in tracks:
        track[np.abs(t) < unseen] = np.nan
        track[t < 0] = track[t < 0, ::-1]
    return t, rig, views, tracks


@pytest.mark.parametrize(("low", "high"), [(-1.0, 0.6), (-0.6, 1.0)])
def test_of_targets_that_meet_in_space_unseen_the_longer_part_alone_is_told(low, high):
    t, rig, views, tracks = fallen(low, high, 0.1)
    told, doubts = identify([track.reshape(FRAMES, -1) for track in tracks], rig)
    longer = np.abs(t) > 0.1
    longer &= (t < 0) if high < -low else (t > 0)
    for track, view in zip(told, views, strict=True):
        np.testing.assert_array_equal(np.isfinite(track).all(axis=1), longer)
        places = track.reshape(FRAMES, 2, 2)[longer]
        off = [np.abs(places - view[longer][:, order]).max() for order in ([0, 1], [1, 0])]
        assert min(off) < 1e-9
    assert len(doubts) == 1
    left = int(((np.abs(t) > 0.1) & ~longer).sum())
    assert doubts[0].startswith(f"targets: {left} frames are left out, e.g. from frame ")


def test_where_two_orders_go_on_about_as_smoothly_nobody_is_sure():
    t, rig, _, tracks = fallen(-1.0, 0.6, 0.04)  # so short that smoothness could tell
    told, doubts = identify([track.reshape(FRAMES, -1) for track in tracks], rig)
    assert len(doubts) == 1
    assert all(np.isnan(track[t > 0]).all() for track in told)


def test_views_that_never_show_all_targets_at_once_or_other_things_are_refused():
    rig, _, tracks = two_walks(6)
    tracks = [track.reshape(FRAMES, -1) for track in tracks]
    tracks[0][: FRAMES // 2] = np.nan
    tracks[1][FRAMES // 2 :] = np.nan
    with pytest.raises(ValueError, match="targets: all views must show all targets apart"):
        identify(tracks, rig)
    rng = np.random.default_rng(7)
    rig = room(rng)
    tracks = [
        np.hstack([camera.project(walk(np.arange(FRAMES) + s)) for s in rng.integers(0, 9999, 2)])
        for camera in rig.cameras
    ]
    with pytest.raises(ValueError, match="targets: one order of the targets"):
        identify(tracks, rig)
