"""Rig files to start from are rig files."""

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite.cameras import rig_template
from vidsindy_lite.cameras.models import MODELS


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("cameras", [2, 3, 4, 5])
def test_a_template_is_a_rig_with_one_calibrated_camera(tmp_path, cameras, model):
    path = tmp_path / "rig.toml"
    path.write_text(rig_template(cameras, model, (640, 480)), encoding="utf-8")
    rig = vl.Rig.load(path)
    calibrated = [camera.is_calibrated for camera in rig.cameras]
    assert calibrated == [True] + [False] * (cameras - 1)
    assert {camera.model for camera in rig.cameras} == {model}
    assert {camera.image_size for camera in rig.cameras} == {(640, 480)}


@pytest.mark.parametrize("model", MODELS)
def test_its_origin_is_in_the_middle_and_z_is_up(tmp_path, model):
    path = tmp_path / "rig.toml"
    path.write_text(rig_template(model=model), encoding="utf-8")
    camera = vl.Rig.load(path).cameras[0]
    origin, above = camera.project([[0, 0, 0], [0, 0, 0.5]])
    np.testing.assert_allclose(origin, (959.5, 539.5), atol=2)  # its numbers are rounded
    assert abs(above[0] - origin[0]) < 1
    assert above[1] < origin[1] - 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1,), "cameras: must be an integer of at least 2, got 1"),
        ((10**11,), "cameras: must be at most 100, got 100000000000"),
        ((3, "fisheye"), "model: must be one of orthographic, perspective, got 'fisheye'"),
        ((3, "orthographic", (0, 1)), "image_size: must be two integers of at least 1"),
    ],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        rig_template(*arguments)
