"""Rig files to start from are rig files."""

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite.cameras import rig_template


@pytest.mark.parametrize("model", ["orthographic", "perspective"])
@pytest.mark.parametrize(("cameras", "apart"), [(2, 120), (3, 120), (5, 72)])
def test_a_template_is_a_rig_with_a_calibrated_camera_evenly_around(
    tmp_path, cameras, apart, model
):
    path = tmp_path / "rig.toml"
    path.write_text(rig_template(cameras, model, (640, 480)), encoding="utf-8")
    placed = vl.Rig.load(path).cameras
    calibrated = [camera.is_calibrated for camera in placed]
    assert calibrated == [True] + [model == "perspective"] * (cameras - 1)
    assert {(camera.model, camera.image_size) for camera in placed} == {(model, (640, 480))}
    azimuths = np.deg2rad(20 + apart * np.arange(cameras))
    circle = np.cos(np.deg2rad(20)) * np.column_stack((np.cos(azimuths), np.sin(azimuths)))
    expected = np.column_stack((circle, np.full(cameras, np.sin(np.deg2rad(20)))))
    np.testing.assert_allclose([c.normal for c in placed], expected, atol=2e-3)
    np.testing.assert_allclose([c.position for c in placed], 3 * expected, atol=2e-3)


def test_what_a_hand_measures(tmp_path):
    """A field of view of 90 degrees shows at one metre two metres; a roll turns the z axis left."""
    path = tmp_path / "rig.toml"
    text = """
[[camera]]
model = "perspective"
position = [3, 1, 1]
looks_at = [0, 1, 1]
field_of_view = 90
roll = {roll}
image_size = [641, 481]
normal_error = 2
"""
    for roll in (30, -90):
        other = "position = [1, 4, 1]\nlooks_at = [1, 1, 1]"
        first = text.format(roll=roll)
        path.write_text(first + first.replace("position = [3, 1, 1]\nlooks_at = [0, 1, 1]", other))
        camera = vl.Rig.load(path).cameras[0]
        middle, above, side = camera.project([[0, 1, 1], [0, 1, 2], [0, 4, 1]])
        np.testing.assert_allclose(middle, (320, 240), atol=1e-9)
        lean = np.deg2rad(roll)
        long = 641 / 2 / 3  # pixels of one metre at three metres
        np.testing.assert_allclose(
            above - middle, long * np.array([-np.sin(lean), -np.cos(lean)]), atol=1e-9
        )
        np.testing.assert_allclose(np.linalg.norm(side - middle), 3 * long, rtol=1e-12)
        assert camera.normal_error == 2


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("looks_at = ", "normal = [1, 0, 0]\nlooks_at = ", "looks_at: must be given with a pos"),
        ("field_of_view = 60", "field_of_view = 180", "field_of_view: must be between 0 and 180"),
        ("field_of_view = 60", "scale = 1\nfield_of_view = 60", "in place of scale and angle"),
        ("field_of_view = 60", "", "roll: must be given with a field_of_view"),
        ("looks_at = ", "# ", "normal: must be"),
        ("roll = 0", "roll = '0'", "roll: must be a finite number"),
    ],
)
def test_what_a_hand_cannot_have_measured(tmp_path, old, new, message):
    path = tmp_path / "rig.toml"
    path.write_text(rig_template(2).replace(old, new, 1), encoding="utf-8")
    with pytest.raises(ValueError, match=message) as caught:
        vl.Rig.load(path)
    assert "camera 0" in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1,), "cameras: must be an integer of at least 2, got 1"),
        ((101,), "cameras: must be at most 100, got 101"),
        ((3, "fisheye"), "model: must be one of orthographic, perspective, got 'fisheye'"),
        ((3, "orthographic", (0, 1)), "image_size: must be two integers of at least 1"),
    ],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        rig_template(*arguments)


@pytest.mark.parametrize("far", [1.0, 1e6])
def test_pinholes_at_one_place_are_no_rig_however_far_from_the_origin(far):
    def rig(apart):
        places = [(far, 0, 0), (far, apart * far, 0)]
        return vl.Rig(vl.PerspectiveCamera(position=p, normal=(1, 0, 0)) for p in places)

    assert len(rig(1e-8).cameras) == 2
    with pytest.raises(ValueError, match="must have at least two independent positions"):
        rig(1e-10)
