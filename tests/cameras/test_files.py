"""Calibrations of other tools: their projections to a billionth of a pixel, there and back."""

import json

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import vidsindy_lite as vl
from vidsindy_lite.__main__ import main
from vidsindy_lite.cameras import read_calibration

SIZE = (1280, 720)
EYE, K = [1, 0, 0, 0, 1, 0, 0, 0, 1], '"K": [9, 0, 5, 0, 9, 5, 0, 0, 1]'
POINTS = np.random.default_rng(0).uniform(-0.5, 0.5, (50, 3))


def rooms(seed, dist=True):
    """K, dist, R, t of three cameras as OpenCV has them, about three metres from the origin."""
    rng = np.random.default_rng(seed)
    parts = []
    for i in range(3):
        azimuth = 2 * np.pi * i / 3 + rng.uniform(-0.3, 0.3)
        away = np.array([np.cos(azimuth), np.sin(azimuth), rng.uniform(-0.4, 0.6)])
        away /= np.linalg.norm(away)
        right = np.cross([0, 0, 1.0], away)
        right /= np.linalg.norm(right)
        rotation = np.array([right, -np.cross(away, right), -away])
        rotation = Rotation.from_rotvec(rng.normal(scale=0.1, size=3)).as_matrix() @ rotation
        f = rng.uniform(900, 1300)
        parts.append({
            "K": np.array([[f, 0, 640 + 20 * rng.normal()], [0, f * 1.01, 350.0], [0, 0, 1]]),
            "dist": rng.normal(scale=[0.1, 0.05, 1e-3, 1e-3, 0.01]) * dist,
            "R": rotation,
            "t": np.array([0, 0, 3.0]) + 0.1 * rng.normal(size=3),
            "size": SIZE,
        })  # fmt: skip
    return parts


def assert_same(rig, parts):
    assert len(rig.cameras) == len(parts)
    for camera, part in zip(rig.cameras, parts, strict=True):
        assert camera.image_size == SIZE
        turned, *others = cv2.Rodrigues(part["R"])[0], part["t"], part["K"], part["dist"]
        seen = cv2.projectPoints(POINTS, turned, *others)[0][:, 0]
        np.testing.assert_allclose(camera.project(POINTS), seen, rtol=0, atol=1e-9)


def toml(parts, head="cam_{}", matrix=False):
    """As aniposelib's `CameraGroup.dump` and Pose2Sim write it."""
    text = ""
    for i, part in enumerate(parts):
        turned = part["R"] if matrix else Rotation.from_matrix(part["R"]).as_rotvec()
        text += (
            f'[{head.format(i)}]\nname = "{i}"\nsize = [ {SIZE[0]}, {SIZE[1]},]\n'
            f"matrix = {part['K'].tolist()}\ndistortions = {part['dist'].tolist()}\n"
            f"rotation = {turned.tolist()}\ntranslation = {part['t'].tolist()}\n\n"
        )
    return text + "[metadata]\nadjusted = false\nerror = 0.5\n"


@pytest.mark.parametrize(("head", "matrix"), [("cam_{}", 0), ("cam_0{}", 1), ("cameras.{}", 0)])
def test_anipose_pose2sim_and_caliscope(tmp_path, head, matrix):
    parts = rooms(0)
    (tmp_path / "a.toml").write_text(toml(parts, head, matrix), encoding="utf-8")
    assert_same(read_calibration([tmp_path / "a.toml"]), parts)


@pytest.mark.parametrize("suffix", [".yaml", ".json", ".xml"])
def test_opencv_storage_one_file_a_camera(tmp_path, suffix):
    parts, paths = rooms(4), []
    for i, part in enumerate(parts):
        paths.append(tmp_path / f"{i}{suffix}")
        storage = cv2.FileStorage(str(paths[-1]), cv2.FILE_STORAGE_WRITE)
        storage.write("image_width", SIZE[0])
        storage.write("image_height", SIZE[1])
        storage.write("camera_matrix", part["K"])
        # Arrays of one axis, too, as OpenCV 5 writes them.
        storage.write("distortion_coefficients", part["dist"].ravel())
        storage.write("rvec", cv2.Rodrigues(part["R"])[0])
        storage.write("tvec", part["t"].reshape(-1, 1))
        storage.release()
    assert_same(read_calibration(paths), parts)


def test_matrices_that_do_not_say_that_they_are_some(tmp_path):
    text = "%YAML:1.0\n---\nsize: [640, 480]\nR: [0, 0, 0]\nt: [0, 0, 3]\ncamera_matrix:\n"
    text += "   rows: 3\n   cols: 3\n   data: [500, 0, 320, 0, 500, 240, 0, 0, 1]\n"
    (tmp_path / "a.yaml").write_text(text)
    (camera,) = read_calibration([tmp_path / "a.yaml"]).cameras
    assert camera.focal_length == pytest.approx(500)


def listed(parts):
    """The same in lists, as JSON has them."""
    return [{key: np.asarray(value).tolist() for key, value in part.items()} for part in parts]


def from_json(folder, content):
    (folder / "a.json").write_text(json.dumps(content), encoding="utf-8")
    return read_calibration([folder / "a.json"])


def test_plain_json_and_arrays(tmp_path):
    parts = rooms(5)
    assert_same(from_json(tmp_path, {"cameras": listed(parts)}), parts)
    inner = [{k: v for k, v in part.items() if k not in "Rt"} for part in listed(parts)]
    split = [part | {"intrinsics": own} for part, own in zip(listed(parts), inner, strict=True)]
    split = [{k: v for k, v in part.items() if k in ("R", "t", "intrinsics")} for part in split]
    assert_same(from_json(tmp_path, split), parts)
    paths = [tmp_path / f"{i}.npz" for i in range(3)]
    for path, part in zip(paths, parts, strict=True):
        np.savez(path, mtx=part["K"], dist=part["dist"], R=part["R"], T=part["t"])
    assert_same(read_calibration(paths, SIZE), parts)
    with pytest.raises(ValueError, match=r"^paths: image_size: must be given .*, in '.*0\.npz'"):
        read_calibration(paths)
    stacked = {key: [part[key] for part in parts] for key in parts[0]}
    np.savez(paths[0], **stacked | {"size": SIZE})
    assert_same(read_calibration(paths[:1]), parts)
    np.savez(paths[0], **stacked | {"size": SIZE, "K": stacked["K"][:2]})
    with pytest.raises(ValueError, match="K: must be as many as all else of the cameras, got"):
        read_calibration(paths[:1])


def projection(part):
    return part["K"] @ np.column_stack((part["R"], part["t"]))


@pytest.mark.parametrize("lower_left", [False, True])
def test_dlt_coefficients(tmp_path, lower_left):
    parts, columns = rooms(6, dist=False), []
    for part in parts:
        # DLTdv counts pixels from 1; before version 8 from the lower left.
        turn = [[1, 0, 1], [0, -1, SIZE[1]] if lower_left else [0, 1, 1], [0, 0, 1]]
        matrix = turn @ projection(part)
        columns.append((matrix / matrix[2, 3]).ravel()[:11])
    np.savetxt(tmp_path / "dltCoefs.csv", np.column_stack(columns), delimiter=",", fmt="%.17g")
    rig = read_calibration([tmp_path / "dltCoefs.csv"], SIZE)
    assert_same(rig, parts)
    assert rig.warnings == ()
    text = (tmp_path / "dltCoefs.csv").read_text("utf-8").replace(",", ";").replace(".", ",")
    (tmp_path / "excel.csv").write_text(text, encoding="utf-8")
    assert read_calibration([tmp_path / "excel.csv"], SIZE) == rig


def test_projection_matrices(tmp_path):
    parts = rooms(7)
    lenses = [{"P": projection(part), "dist": part["dist"], "size": SIZE} for part in parts]
    assert_same(from_json(tmp_path, listed(lenses)), parts)
    parts = rooms(7, dist=False)
    stacked = np.array([s * projection(part) for s, part in zip((1, -2, 0.1), parts, strict=True)])
    np.save(tmp_path / "p.npy", stacked)
    np.savetxt(tmp_path / "p.txt", stacked.reshape(-1, 4), fmt="%.17g")
    for name in ("p.npy", "p.txt"):
        assert_same(read_calibration([tmp_path / name], SIZE), parts)
    # A small skew is told, a large one refused.
    for skew in (1.0, 100.0):
        parts[1]["K"] = np.array([[1000, skew, 640], [0, 1010, 350], [0, 0, 1]])
        np.save(tmp_path / f"{skew:g}.npy", np.array([projection(part) for part in parts]))
    (warning,) = read_calibration([tmp_path / "1.npy"], SIZE).warnings
    assert warning.startswith("1.npy: camera [1]: its pixels are skew, by 0.")
    with pytest.raises(ValueError, match="a camera with square corners, got a skew of"):
        read_calibration([tmp_path / "100.npy"], SIZE)


def test_the_command_line(tmp_path, capsys):
    parts = rooms(10)
    (tmp_path / "a.toml").write_text(toml(parts), encoding="utf-8")
    assert main(["rig-import", str(tmp_path / "a.toml")]) == 0
    (tmp_path / "rig.toml").write_text(capsys.readouterr().out, encoding="utf-8")
    assert_same(vl.Rig.load(tmp_path / "rig.toml"), parts)
    out = ["--output", str(tmp_path / "again.toml")]
    assert main(["rig-import", str(tmp_path / "a.toml"), *out]) == 0
    assert_same(vl.Rig.load(tmp_path / "again.toml"), parts)
    assert main(["rig-template", "--output", str(tmp_path / "t.toml")]) == 0
    assert len(vl.Rig.load(tmp_path / "t.toml").cameras) == 3
    before = (tmp_path / "a.toml").read_text("utf-8")
    there = str(tmp_path / "a.toml")
    for command in (["rig-template"], ["rig-import", there]):
        assert main([*command, "--output", there]) == 2
        told = f"error: output: must be a new file, got '{there}'"
        assert capsys.readouterr().err.splitlines() == [told]
    assert (tmp_path / "a.toml").read_text("utf-8") == before


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("rotation = ", "rotated = ", r"^paths: camera cam_0: R: must be given \(r, rotation"),
        ("translation = [", "translation = [1.0, ", "t: must be finite and of shape"),
        ("[metadata]", "[", r"paths: must be a TOML file, got '.*a\.toml': "),
        ("matrix = ", "matrices = ", "must hold a camera matrix"),
        ("matrix = [[", "matrix = [[-", "K: must be"),
        (", 0.0, 6", ", 3.0, 6", "K: must have no skew, got 3, in"),
        ('name = "1"', "rotation_count = 1", "camera cam_1: rotation_count: must be 0, got 1"),
        ("distortions = [", "distortions = [1, 1, 1, 1, ", "distortion: must be at most 8 finite"),
        ("size = [ 1280, 720,]", "size = [ 1280 ]", r"size: must be .* of shape \(2,\), got"),
        ("rotation = [", "rotation = ['a', ", "R: must be an array of real numbers, got"),
        ("rotation = ", "rvec = [0, 0, 0]\nrotation = ", "rvec: must be the same as rotation"),
        ("rotation = ", "rotation = [0, 90, 0] # ", "R: must be a rotation in radians, got"),
    ],
)
def test_malformed_tables_are_refused_by_name(tmp_path, old, new, message):
    text = toml(rooms(11))
    assert old in text
    (tmp_path / "a.toml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ValueError, match=message) as caught:
        read_calibration([tmp_path / "a.toml"])
    assert str(tmp_path / "a.toml") in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", "1,2,3\n4,5\n", "of as many numbers each, .*: 2 numbers in one, and 3 in"),
        ("a.csv", "1,2,3\n4,5,6\n", "must hold 11 DLT coefficients per camera"),
        ("a.csv", "nan,2\n" * 11, "must hold finite numbers"),
        ("a.csv", "0,0\n" * 11, "must be of a camera at a finite place"),
        ("a.json", "{", "must be a JSON file"),
        ("a.yml", "no yaml: [", "of OpenCV, got .*: OpenCV cannot read it, which holds no"),
        ("a.npz", "PK\x03\x04 no archive", "must be a .npz file of numbers"),
        ("a.mat", "x", "must end in .toml, .* or .txt, got '.*a.mat'"),
        ("a.toml", "a = " + "9" * 400, "must hold numbers of less than 300 digits, got 999"),
        ("a.toml", "a = \udc80", "must be a TOML file in UTF-8, got 'a.toml', which is none"),
        ("a.json", '{"P": 5}', "must hold 11 DLT coefficients"),
        ("a.json", f'{{{K}, "R": {[2, *EYE[1:]]}, "t": [0, 0, 1]}}', "R: .* got one off by 3"),
        ("a.json", f'{{{K}, "R": {EYE}, "rvec": [0, 1, 0], "t": 0}}', "of rvec, got one 1 radians"),
        ("a.json", f'{{{K}, "R": {EYE}, "t": [0, 0, 1], "size": [9, 9]}}', "size: .*80, 720"),
        ("a.json", '{"P1": [[1, 0, 0, 0]], "Q": 2}', r"or P, got \['P1', 'Q'\] in"),
        ("a.txt", "# ID, MODEL\n1 OPENCV 1280\n", "could not convert string to float: 'OPENCV'"),
        ("a.json", '{"K": "x", "R": 1, "t": 2}', "K: must be an array of real numbers"),
        ("a.json", '{"K": [9, 0, 0.5, 0, 9, 0.5, 0, 0, 1], "R": 1, "t": 2}', "K: must have its"),
        ("a.npy", "\udc93NUMPY\x01\0v\0{'descr'", "must be a .npy file of numbers"),
        ("a.xml", "<?xml", "must be a XML file"),
        ("a.yaml", "", "must be a YAML file"),
    ],
)
def test_files_that_are_no_calibration(tmp_path, name, content, message):
    (tmp_path / name).write_text(content, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(ValueError, match=message) as caught:
        read_calibration([tmp_path / name], SIZE)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_one_name_is_no_list_of_files():
    for paths in ("a.toml", 3):
        with pytest.raises(ValueError, match="paths: must be a list, one per file, got"):
            read_calibration(paths)
    with pytest.raises(FileNotFoundError, match="paths: no such calibration file, got '"):
        read_calibration(["none.toml"])


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("camera_model", "FISHEYE"), ("distortion_model", "kannala_brandt"), ("fisheye_model", 1),
        ("fisheye", True), ("is_fisheye", "yes"), ("lens_model", "LENSMODEL_OPENCV_FISHEYE"),
        ("projection_type", "stereographic"), ("camera_type", "omni"),
    ],
)  # fmt: skip
def test_other_lenses_are_refused_by_name(tmp_path, key, value):
    plain = listed(rooms(5))
    named = {f"cam{i}": {key: value, **part} for i, part in enumerate(plain)}
    for content in (named, {key: value, "cameras": plain}):
        with pytest.raises(ValueError, match=rf"^paths: (camera cam0: )?{key}: must be none but"):
            from_json(tmp_path, content)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("model", "pinhole"), ("camera_model", "OPENCV"), ("distortion_model", "plumb_bob"),
        ("fisheye_model", 0), ("fisheye", "false"), ("distortion_coefficients", None),
    ],
)  # fmt: skip
def test_our_lens_under_its_names(tmp_path, key, value):
    parts = rooms(5)
    rig = from_json(tmp_path, [{key: value} | part for part in listed(parts)])
    assert_same(rig, parts)
    assert rig.warnings == ()


def test_a_lens_that_nobody_knows_is_told_and_so_are_other_keys(tmp_path):
    plain = listed(rooms(5))
    plain[1] |= {"model": "Hero 7", "shift_x": 3}
    lens, key = from_json(tmp_path, {"cameras": plain}).warnings
    assert lens.startswith("a.json: camera cameras[1]: model = 'Hero 7' is taken for a lens of k1")
    assert key == "a.json: camera cameras[1]: nothing is known of shift_x, which is left out"
    plain[1]["k1"] = 0.1
    with pytest.raises(ValueError, match=r"cameras\[1\]: k1: must stand in dist"):
        from_json(tmp_path, {"cameras": plain})


@pytest.mark.parametrize("mark", [{"ignore": True}, {"enabled": False}, {"Disabled": 1}])
def test_cameras_that_are_to_be_ignored(tmp_path, capsys, mark):
    parts = rooms(5)
    plain = listed(parts)
    plain[1] |= mark
    plain[0] |= {key: not value for key, value in mark.items()}
    rig = from_json(tmp_path, plain)
    assert_same(rig, parts[::2])
    assert "this camera is left out" in rig.warnings[0]
    assert main(["rig-import", str(tmp_path / "a.json")]) == 0
    assert capsys.readouterr().err == f"warning: {rig.warnings[0]}\n"


def test_eight_coefficients(tmp_path):
    parts = rooms(6)
    for part in parts:
        part["dist"] = np.append(part["dist"], [0.02, 0.01, -0.005])
    rig = from_json(tmp_path, listed(parts))
    assert_same(rig, parts)
    rig.save(tmp_path / "rig.toml")
    assert vl.Rig.load(tmp_path / "rig.toml") == rig
    tracks = [camera.project(POINTS) for camera in rig.cameras]
    np.testing.assert_allclose(vl.reconstruct(tracks, rig), POINTS, atol=1e-9)
