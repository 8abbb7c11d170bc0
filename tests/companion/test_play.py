"""The film of the law: as many frames as there are instants, and the ring where the target is."""

import io

import av
import numpy as np

import vidsindy_lite as vl
from vidsindy_lite import study
from vidsindy_lite.cameras import Lags
from vidsindy_lite.companion.report import law_over_videos
from vidsindy_lite.pipeline import Observation

LATER = 4  # frames


def observed(tmp_path, frames):
    """Two films of a motion, the second of which starts later, and its law."""
    truth = study.SYSTEMS["SprottE"].shift(study.REFERENCE_OFFSET)
    t, x = truth.trajectory(frames)
    rig = vl.Rig.around(x, image_size=(270, 270))
    tracks = [camera.project(x) for camera in rig.cameras[:2]]
    scene = vl.Scene(background="plain", size=12, image_size=(270, 270))
    paths = [vl.render_video(tmp_path / "a.mov", tracks[0], scene)]
    paths.append(vl.render_video(tmp_path / "b.mov", tracks[1][LATER:], scene))
    tracks[1][:LATER] = np.nan
    lags = Lags(np.array([0.0, LATER]), np.ones(2), np.zeros(2), 0.0)
    rig = vl.Rig(rig.cameras[:2])
    seen = Observation(tuple(tracks), rig, lags, t, x, np.empty((0, *x.shape)), ())
    return vl.VideoDiscovery(**vars(seen), discovery=vl.discover(t, x, degree=2)), paths


def decoded(film):
    with av.open(io.BytesIO(film)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def test_the_law_is_drawn_where_the_target_is(tmp_path):
    found, paths = observed(tmp_path, 150)
    frames = decoded(law_over_videos(found, paths))
    assert len(frames) == 150
    assert frames[0].shape == (270, 540, 3)
    for k in (0, LATER, 77, 149):
        for i, (path, start) in enumerate(zip(paths, (0, LATER), strict=True)):
            view = frames[k][:, 270 * i : 270 * (i + 1)].astype(int)
            raw = vl.read_frame(path, k - start) if k >= start else np.full((270, 270, 3), 128)
            v, u = np.nonzero(np.abs(view - raw).max(axis=2) > 60)
            ring = found.rig.cameras[i].project(found.x[[k]])[0]
            assert np.hypot(u - ring[0], v - ring[1]).min() < 10
    assert len(law_over_videos(found, paths)) < 1_000_000


def test_a_long_film_is_shown_in_steps(tmp_path):
    found, paths = observed(tmp_path, 201)
    assert len(decoded(law_over_videos(found, paths))) == 101
