"""Tracks as other programs write them."""

import numpy as np
import pytest

from vidsindy_lite.vision import read_tracks

PIXELS = np.array([[10.25, 20.5], [11, 21], [np.nan, np.nan], [13, 23]])


def read(tmp_path, text, name="a.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return read_tracks(path)


OURS = "frame,u,v\n0,10.25,20.5\n1,11,21\n2,,\n3,13,23\n"
GAP = "frame,u,v\n7,10.25,20.5\n8,11,21\n10,13,23\n"
TIMES = "t,u,v\n0,10.25,20.5\n0.1,11,21\n0.2,nan,\n0.3,13,23\n"
DLTDV = "pt1_cam1_X,pt1_cam1_Y\n11.25,21.5\n12,22\nNaN,NaN\n14,24\n"
DEEPLABCUT = (
    "scorer,net,net,net\nbodyparts,ball,ball,ball\ncoords,x,y,likelihood\n"
    "0,10.25,20.5,0.99\n1,11,21,0.9\n2,400,3,0.1\n3,13,23,1.0\n"
)
TRACKER_5 = (
    "mass_A\nt\tpixelx\tpixely\n0.0E0\t1.075E1\t21\n3.3E-2\t11.5\t21.5\n6.6E-2\t\t\n"
    "9.9E-2\t13.5\t23.5\n"
)
TRACKER_6 = (
    "#multi:\n\tmass A\t\t\nt\tx\ty\t\n0,0\t10,25\t20,5\t\n0,033\t11,0\t21,0\t\n0,066\t\t\t\n"
    "0,099\t13\t23\t\n"
)


@pytest.mark.parametrize(
    "text",
    [
        OURS,
        GAP,
        TIMES,
        DLTDV,
        DEEPLABCUT,
        TRACKER_5,
        TRACKER_6,
        OURS.replace(",", ";"),
        OURS.replace(",", "\t"),
        OURS.replace("\n", "\r\n"),
        "\ufeff" + OURS,
        "10.25 20.5\n11 21\nnan nan\n13 23\n",
        "0,10.25,20.5\n1,11,21\n2,,\n3,13,23\n",
        "frame;u;v\n0;10,25;20,5\n1;11;21\n2;;\n3;13,0;23,0\n",
        "Frame, X, Y\n0, 10.25, 20.5\n1, 11, 21\n3, 13, 23\n",
    ],
)
def test_every_kind_is_read(tmp_path, text):
    (track,) = read(tmp_path, text)
    np.testing.assert_allclose(track.pixels, PIXELS)


def test_times_are_kept(tmp_path):
    (track,) = read(tmp_path, TIMES)
    np.testing.assert_allclose(track.t, [0, 0.1, 0.2, 0.3], atol=1e-12)
    (track,) = read(tmp_path, TRACKER_6)
    np.testing.assert_allclose(track.t, [0, 0.033, 0.066, 0.099], atol=1e-12)
    assert read(tmp_path, OURS)[0].t is None


def test_several_cameras_in_one_file(tmp_path):
    text = "pt1_cam1_X,pt1_cam1_Y,pt1_cam2_X,pt1_cam2_Y,pt2_cam1_X,pt2_cam1_Y\n"
    tracks = read(tmp_path, text + "1,2,3,4,NaN,NaN\n2,3,4,5,NaN,NaN\n", "xy弾pts.csv")
    assert [track.name for track in tracks] == ["xy弾pts.csv, cam1", "xy弾pts.csv, cam2"]
    np.testing.assert_allclose(tracks[1].pixels, [[2, 3], [3, 4]])
    tracks = read(tmp_path, "t,u1,v1,u2,v2\n0,1,2,,\n1,2,3,4,5\n")
    np.testing.assert_allclose(tracks[1].pixels, [[np.nan, np.nan], [4, 5]])
    np.testing.assert_allclose(tracks[1].t, [0, 1])


def test_trackers_world_is_not_taken_for_pixels(tmp_path):
    (track,) = read(tmp_path, TRACKER_6)
    assert "export its columns pixelx and pixely" in track.warnings[0]
    assert read(tmp_path, TRACKER_5)[0].warnings == ()
    with pytest.raises(ValueError, match="got x and y of Tracker with another origin"):
        read(tmp_path, TRACKER_6.replace("20,5", "-20,5"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must hold rows of numbers"),
        ("u,v\n", "must hold rows of numbers"),
        ("a,b\n1,2\n", "must have columns u and v, got a, b"),
        ("1,2,3,4\n", "must have a header, or columns u and v"),
        ("u,v\n1,2\n3,soon\n", "must hold numbers below its header, got 'soon' in row 2"),
        ("t,u,v\n0,1,2\n0,1,2\n", "must have increasing times"),
        ("frame,u,v\n1,1,2\n0,1,2\n", "must have increasing whole numbers of frames"),
        ("frame,u,v\n0,1,2\n99999999999,1,2\n", "must have increasing whole numbers"),
        ("t,u1,v1,u2\n0,1,2,3\n", "must have a column 'v2'"),
        (DEEPLABCUT.replace("ball,ball,ball", "nose,nose,ear"), "one target, got ear, nose"),
        (DLTDV.replace("pt1_cam1_Y", "pt2_cam1_X"), "must hold one target, got pt1, pt2"),
        (TRACKER_6.replace("mass A\t", "mass A\tmass B"), "one target, got mass A, mass B"),
    ],
)
def test_files_that_hold_no_track(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        read(tmp_path, text)


@pytest.mark.parametrize("content", [b"RIFF\0\0AVI u,v\n1,2\n" * 9, b"\x89PNG\r\n\x1a\n\xff1,2\n"])
def test_a_file_that_is_no_text_is_not_printed(tmp_path, content):
    (tmp_path / "a.avi").write_bytes(content)
    with pytest.raises(ValueError, match=r"got 'a\.avi', which is no table of numbers$"):
        read_tracks(tmp_path / "a.avi")


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(FileNotFoundError, match="tracks: no such file"):
        read_tracks(tmp_path / "none.csv")


@pytest.mark.parametrize("text", ["u,v\n,\n1,2\n,\n3,4\n", "u\tv\n\t\n1\t2\n\t\n3\t4\n"])
def test_empty_rows_are_frames_without_a_target(tmp_path, text):
    (track,) = read(tmp_path, text)
    nan = [np.nan, np.nan]
    np.testing.assert_array_equal(track.pixels, [nan, [1, 2], nan, [3, 4]])


def test_zeros_are_frames_without_a_target_and_said(tmp_path):
    (track,) = read(tmp_path, "u,v\n1,2\n0,0\n0,5\n0.0,0\n")
    nan = [np.nan, np.nan]
    np.testing.assert_array_equal(track.pixels, [[1, 2], nan, [0, 5], nan])
    assert track.warnings == ("a.csv: 0, 0 in 2 of 4 rows is taken for not seen",)
    assert read(tmp_path, "u,v\n1,2\n0,5\n")[0].warnings == ()


@pytest.mark.parametrize("digits", [2, 3, 6])
def test_rounded_times_of_an_even_clock_are_even_again(tmp_path, digits):
    kept = np.delete(np.arange(90), [4, 30, 31])
    rows = "".join(f"{k / 29.97:.{digits}f},1,2\n" for k in kept)
    (track,) = read(tmp_path, "t,u,v\n" + rows)
    np.testing.assert_allclose(track.t, kept / 29.97, atol=0.2 * 10.0**-digits)
    wavering = "".join(f"{k / 30 + 0.004 * (k % 3):.6f},1,2\n" for k in range(30))
    (track,) = read(tmp_path, "t,u,v\n" + wavering)
    np.testing.assert_allclose(track.t, [round(k / 30 + 0.004 * (k % 3), 6) for k in range(30)])
