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
    "#multi:\n\tmass A\t\t\nt\tx\ty\t\n0,0\t10,75\t21,0\t\n0,033\t11,5\t21,5\t\n0,066\t\t\t\n"
    "0,099\t13,5\t23,5\t\n"
)


ARGUS = "Track 1_cam_1_x,Track 1_cam_1_y\n11.25,79.5\n12.0,79\nnan,nan\n14.0,77\n"
INDIVIDUALS = (
    "scorer,net,net,net,net,net,net\nindividuals,one,one,one,two,two,two\n"
    "bodyparts,ball,ball,ball,ball,ball,ball\ncoords,x,y,likelihood,x,y,likelihood\n"
    "0,10.25,20.5,0.99,1,2,0.9\n1,11,21,0.9,1,2,0.9\n2,400,3,0.1,1,2,0.9\n3,13,23,1.0,1,2,0.9\n"
)
SLEAP = (
    "track,frame_idx,instance.score,nose.x,nose.y,nose.score,tail.x,tail.y,tail.score\n"
    "one,0,0.9,10.25,20.5,0.9,1,2,0.9\none,1,0.9,11,21,0.9,1,2,0.9\n"
    "one,3,0.9,13,23,0.9,1,2,0.9\ntwo,0,0.9,5,6,0.9,7,8,0.9\n"
)
TRACKMATE = (
    "LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME\n"
    "Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame\nLabel,Spot ID,Track ID,Quality,X,Y,Z,T,Frame\n"
    ",,,(quality),(pixel),(pixel),(pixel),(frame),\n"
    "ID9,9,0,1,13,23,0,3,3\nID7,7,0,1,10.25,20.5,0,0,0\nID8,8,0,1,11,21,0,1,1\n"
)
TRACKMATE_XML = (
    '<?xml version="1.0"?>\n<Tracks nTracks="1" spaceUnits="pixel" timeUnits="frame">\n'
    '<particle nSpots="3">\n<detection t="0" x="10.25" y="20.5" z="0.0" />\n'
    '<detection t="3" x="13" y="23" z="0.0" />\n<detection t="1" x="11" y="21" z="0.0" />\n'
    "</particle>\n</Tracks>\n"
)
KINOVEA = (
    "#Kinovea Trajectory data export\n#T X Y\n\n"
    "# ball\n0 10.25 20.5\n33 11 21\n66 nan nan\n99 13 23\n\n"
)


@pytest.mark.parametrize(
    "text",
    [
        OURS,
        TRACKMATE,
        TRACKMATE_XML,
        KINOVEA,
        KINOVEA.replace("# ball\n", "").replace("33", "0:00:00:03"),
        OURS.replace("u,v", "u [px],V (pixels)"),
        OURS.replace("2,,", "2,NA,lost"),
        OURS.replace("2,,", "2,-1,-1"),
        OURS.replace("2,,", "2,-9999,-9999"),
        "frame,x,y,visible\n0,10.25,20.5,1\n1,11,21,1\n2,3,4,0\n3,13,23,1\n",
        "x,y,lost\n10.25,20.5,0\n11,21,0\n3,4,1\n13,23,0\n",
        "frame,x,y,w,h\n0,9.75,20,2,2\n1,10.5,20.5,2,2\n2,-1,-1,-1,-1\n3,12.5,22.5,2,2\n",
        "frame,xmin,ymin,xmax,ymax\n0,9.75,20,11.75,22\n1,10.5,20.5,12.5,22.5\n3,12.5,22.5,14.5,24.5\n",
        "frame,particle,y,x\n0,4,20.5,10.25\n1,4,21,11\n3,4,23,13\n", GAP, TIMES, DLTDV, DEEPLABCUT,
        TRACKER_5, TRACKER_6, OURS.replace(",", ";"), OURS.replace(",", "\t"),
        OURS.replace("\n", "\r\n"), "\ufeff" + OURS, "10.25 20.5\n11 21\nnan nan\n13 23\n",
        "0,10.25,20.5\n1,11,21\n2,,\n3,13,23\n",
        "frame;u;v\n0;10,25;20,5\n1;11;21\n2;;\n3;13,0;23,0\n",
        "Frame, X, Y\n0, 10.25, 20.5\n1, 11, 21\n3, 13, 23\n",
        "my throw,2024\nFrame, X, Y\n,px,px\n0, 10.25, 20.5\n1, 11, 21\n3, 13, 23\n",
        *(GAP.replace("frame", name) for name in ("", "Frame Number", "Frame #", "slice n°")),
        GAP.replace("frame", "image").replace("10,", "v2/img10.png,").replace("7,", "v2/img7.png,"),
        "# my detector v1\n" + OURS, "# my detector v1\n# " + OURS,
        "frame,x,y,visible,by\n0,10.25,20.5,True,me\n1,11,21,True,me\n2,3,4,False,me\n3,13,23,True,me\n",
        TRACKMATE.split("\nLabel")[0] + "\n" + TRACKMATE.split("(frame),\n")[1],
        "frame,id,bb_left,bb_top,bb_width,bb_height,conf,x,y,z\n0,1,9.75,20,2,2,1,-1,-1,-1\n"
        "1,1,10.5,20.5,2,2,1,-1,-1,-1\n3,1,12.5,22.5,2,2,1,-1,-1,-1\n",
        "frame,x,y,left,top,w,h\n0,10.25,20.5,9,20,3,3\n1,11,21,9,20,3,3\n3,13,23,9,20,5,5\n",
        "u,v,t (image)\n10.25,20.5,a.png\n11,21,b\n,,\n13,23,c\n", "#" + OURS,
        "image,u,v\nt0.05.png,10.25,20.5\nt0.10.png,11,21\nt0.15.png,,\nt0.20.png,13,23\n",
        "index,id,u,v\n5,1,10.25,20.5\n7,1,11,21\n9,1,,\n11,1,13,23\n",
        "frame,x1,y1,x2,y2,u,v\n0,9.75,20,11.75,22,,\n1,10.5,20.5,12.5,22.5,,\n3,12.5,22.5,14.5,24.5,,\n",
        "scorer,,,net,net\nbodyparts,,,ball,ball\ncoords,,,x,y\nlabeled,v2,img07.png,10.25,20.5\n"
        "labeled,v2,img08.png,11,21\nlabeled,v2,img10.png,13,23\n",
    ],
)  # fmt: skip
def test_every_kind_is_read(tmp_path, text):
    (track,) = read(tmp_path, text)
    np.testing.assert_allclose(track.pixels, PIXELS)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (INDIVIDUALS, "one"), (INDIVIDUALS.replace("one", "1").replace("two", "2"), "1"),
        (INDIVIDUALS, "one ball"), (SLEAP, "one nose"),
        (TRACKMATE + "ID1,1,1,1,5,5,0,0,0\n", "0"), (KINOVEA + "# other\n0 1 2\n", "ball"),
        (TRACKMATE_XML.replace("</Tracks>", '<particle>\n<detection t="0" x="1" y="2"/>'), "0"),
        ("frame,id,x,y\n0,7,10.25,20.5\n0,8,1,2\n1,7,11,21\n3,7,13,23\n3,8,1,2\n", "7"),
    ],
)  # fmt: skip
def test_one_of_several_targets_is_chosen_by_its_name(tmp_path, text, name):
    with pytest.raises(ValueError, match="must hold one target, got .* as individual"):
        read(tmp_path, text)
    with pytest.raises(ValueError, match="must hold one target, got "):
        read_tracks(tmp_path / "a.csv", "nobody")
    (track,) = read_tracks(tmp_path / "a.csv", name)
    np.testing.assert_allclose(track.pixels, PIXELS)
    with pytest.raises(ValueError, match="must name the individual .7., got 8"):
        read(tmp_path, "frame,id,x,y\n0,8,1,2\n1,8,2,3\n") and read_tracks(tmp_path / "a.csv", "7")


def test_argus_counts_from_the_lower_left(tmp_path):
    (track,) = read(tmp_path, ARGUS)
    assert track.upwards
    np.testing.assert_allclose(track.downwards(100), PIXELS)


def test_boxes_say_so(tmp_path):
    for head, sides in (("x,y,w,h", "85,190,30,20"), ("x1,y1,x2,y2", "85,190,115,210")):
        (track,) = read(tmp_path, f"{head}\n{sides}\n{sides}\n")
        np.testing.assert_allclose(track.pixels, [[99.5, 199.5]] * 2)
        assert "the middles of its boxes are taken" in track.warnings[0]


def test_a_column_that_may_count_frames_is_told(tmp_path):
    assert (
        "'bild', which rises from each"
        in read(tmp_path, "bild,x,y\n0,1,2\n1,3,4\n5,5,6\n")[0].warnings[0]
    )
    assert read(tmp_path, "bild,x,y\n0,1,2\n1,3,4\n2,5,6\n")[0].warnings == ()


def test_milliseconds_are_seconds_if_their_column_says_so(tmp_path):
    for head in ("t_ms", "Time (ms)", "milliseconds", "time [ms]"):
        (track,) = read(tmp_path, f"{head},u,v\n0,1,2\n40,3,4\n")
        np.testing.assert_allclose(track.t, [0, 0.04])
    (track,) = read(tmp_path, "t,u,v\n0,1,2\n40,3,4\n")
    assert "its times are 40 apart: if these are milliseconds, call the column" in track.warnings[0]


@pytest.mark.parametrize("suffix", [".h5", ".slp", ".mat", ".xlsx", ".kva"])
def test_tables_of_other_kinds_are_refused_by_name(tmp_path, suffix):
    (tmp_path / f"a{suffix}").write_bytes(b"\x89HDF")
    with pytest.raises(ValueError, match=rf"must be a table as text, got 'a\{suffix}', .* as CSV"):
        read_tracks(tmp_path / f"a{suffix}")


def test_times_are_kept_and_trackers_world_is_not_taken_for_pixels(tmp_path):
    assert read(tmp_path, OURS)[0].t is None
    (track,) = read(tmp_path, TRACKER_6)
    np.testing.assert_allclose(track.t, [0, 0.033, 0.066, 0.099], atol=1e-12)
    assert "export its columns pixelx and pixely" in track.warnings[0]
    assert read(tmp_path, TRACKER_5)[0].warnings == ()
    with pytest.raises(ValueError, match="got x and y of Tracker or Kinovea with another"):
        read(tmp_path, TRACKER_6.replace("21,0", "-21,0"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("u,v\n1,2,\n1,0,5\n", "must have 2 cells in a row, got 3 in row 1"),
        ("u,v\n", "must hold rows of numbers"),
        ("a,b\n1,2\n", "must have columns u and v, got a, b"),
        ("1,2,3,4\n", "must have a header, or columns u and v"),
        ("scorer,a,a,a\n0,1,2,.9\n", "must have rows scorer, bodyparts and coords"),
        ("pt1_cam1_X\n1\n2\n", "must have columns of both axes, got only pt1_cam1_x"),
        ("x,y,x,y\n1,2,3,4\n", "must hold one target, got x 2 times, y 2 times"),
        ("x,y,z\n1,2,3\n1,2,4\n", "must be the track of one camera, got x, y and z"),
        ("x (mm),y (mm)\n1,2\n", r"must have columns u and v, got x \(mm\), y \(mm\)"),
        (TRACKMATE.replace("(pixel)", "(micron)"), "must have positions in pixels, got micron"),
        ("<TrackMate><Model/></TrackMate>", "must be a table, or <Tracks> of TrackMate"),
        ("u,v\n" + "1" * 400 + ",2\n", "must hold numbers of less than 300 digits"),
        ("u,v\n" + "a" * 200_000 + ",2\n", "field larger than field limit"),
        ("u,v\n1,2\n3,soon\n", "must hold numbers below its header, got 'soon' in row 2"),
        ("t,u,v\n0,1,2\n0,1,2\n", "must have increasing times, got 0 as t in row 1"),
        ("frame,u,v\n1,1,2\n0,1,2\n", "increasing whole numbers of frames .* got 0 in row 1"),
        ("frame,u,v\n0,1,2\n99999999999,1,2\n", "must have increasing whole numbers"),
        ("t,u1,v1,u2\n0,1,2,3\n", "must have columns of both axes, got only u2"),
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
    with pytest.raises(ValueError, match=r"got 'a\.avi', which is none$"):
        read_tracks(tmp_path / "a.avi")
    with pytest.raises(FileNotFoundError, match="tracks: no such file"):
        read_tracks(tmp_path / "none.csv")


def test_empty_rows_and_zeros_are_frames_without_a_target_and_these_are_said(tmp_path):
    nan = [np.nan, np.nan]
    (track,) = read(tmp_path, "u\tv\n\t\n1\t2\n\t\n3\t4\n")
    np.testing.assert_array_equal(track.pixels, [nan, [1, 2], nan, [3, 4]])
    (track,) = read(tmp_path, "u,v\n1,2\n0,0\n0,5\n0.0,0\n")
    np.testing.assert_array_equal(track.pixels, [[1, 2], nan, [0, 5], nan])
    assert track.warnings == ("a.csv: 0, 0 in 2 of 4 rows is taken for not seen",)
    assert read(tmp_path, "u,v\n1,2\n0,5\n")[0].warnings == ()


@pytest.mark.parametrize("digits", [2, 6])
def test_rounded_times_of_an_even_clock_are_even_again(tmp_path, digits):
    kept = np.delete(np.arange(90), [4, 30, 31])
    rows = "".join(f"{k / 29.97:.{digits}f},1,2\n" for k in kept)
    (track,) = read(tmp_path, "t,u,v\n" + rows)
    seen = np.isfinite(track.pixels[:, 0])
    np.testing.assert_array_equal(np.flatnonzero(seen), kept)
    np.testing.assert_allclose(track.t[seen], kept / 29.97, atol=0.2 * 10.0**-digits)
    wavering = "".join(f"{k / 30 + 0.004 * (k % 3):.6f},1,2\n" for k in range(30))
    (track,) = read(tmp_path, "t,u,v\n" + wavering)
    np.testing.assert_allclose(track.t, [round(k / 30 + 0.004 * (k % 3), 6) for k in range(30)])


def test_several_cameras_in_one_file(tmp_path):
    text = "pt1_cam1_X,pt1_cam1_Y,pt1_cam2_X,pt1_cam2_Y,pt2_cam1_X,pt2_cam1_Y\n"
    first, second = read(tmp_path, text + "1,2,3,4,NaN,NaN\n2,3,4,5,NaN,NaN\n", "xy弾pts.csv")
    assert (first.name, second.name) == ("xy弾pts.csv, camera 1", "xy弾pts.csv, camera 2")
    np.testing.assert_allclose(second.pixels, [[2, 3], [3, 4]])
    first, second = read(tmp_path, "t,u1,v1,u2,v2\n0,1,2,,\n1,2,3,4,5\n")
    np.testing.assert_allclose(second.pixels, [[np.nan, np.nan], [4, 5]])
    np.testing.assert_allclose(second.t, [0, 1])
