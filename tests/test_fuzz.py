"""Odd calls of public names and odd files for every reader: an answer, or one clear line."""

import datetime
import inspect
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import vidsindy_lite as vl
from vidsindy_lite.cameras import read_calibration
from vidsindy_lite.vision import load_hints, read_tracks, video_info
from vidsindy_lite.vision.tracking import OnnxDetector

CLEAR = (ValueError, OSError)
T = np.linspace(0, 10, 40)
X = np.c_[np.cos(T), -np.sin(T)]
RIG = vl.Rig.around(np.c_[X, np.sin(2 * T)])
TRACKS = [camera.project(np.c_[X, np.sin(2 * T)]) for camera in RIG.cameras]
LAW = vl.PolynomialSystem.from_terms({"x": {"y": 1}, "y": {"x": -1}})

scalars = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 9), st.floats(), st.text(max_size=5),
    st.sampled_from([10**400, -(10**5000), 1j, b"x", object(), len, "data", "2", Path("none")]),
    st.sampled_from([np.float32(2), np.int64(-1), np.datetime64("2024-01-01"), np.ma.masked]),
    st.sampled_from([datetime.datetime(2024, 1, 1), datetime.timedelta(1), float("nan")]),
)  # fmt: skip
arrays = st.one_of(
    st.sampled_from(
        [T, X, X.T, X[:, :1], T.astype(np.float32), X * np.nan, X * np.inf, X * 1e200, X[:0],
         X.astype(complex), X.astype(str), X.astype(object), np.ma.masked_less(X, 0), T[::-1],
         np.zeros((2, 2, 2)), np.array(3.0), np.array([]), TRACKS, RIG, LAW, [X, X], [(T, X)],
         np.full((3, 2), 10**400, object), T.astype("datetime64[s]"), (T, X), [[1], [1, 2]]]
    ),
    st.lists(st.one_of(scalars, st.sampled_from([T, X])), max_size=4),
    st.dictionaries(st.text(max_size=3), scalars, max_size=3),
)  # fmt: skip
values = st.one_of(scalars, arrays)

PLACED = {"position": (1, 2, 3), "normal": (1, 0, 0)}

RIGHT = {
    "discover": lambda: {"t": T, "x": X, "degree": 1},
    "discover_from_tracks": lambda: {"tracks": TRACKS, "rig": RIG, "t": T, "degree": 1},
    "observe_tracks": lambda: {"tracks": TRACKS, "rig": RIG, "t": T},
    "reconstruct": lambda: {"tracks": TRACKS, "rig": RIG},
    "residuals": lambda: {"tracks": TRACKS, "rig": RIG},
    "learn_cameras": lambda: {"tracks": TRACKS, "rig": RIG.uncalibrated()},
    "rig_template": dict,
    "Rig": lambda: {"cameras": RIG.cameras},
    "OrthographicCamera": lambda: PLACED | {"scale": 1.0, "angle": 0},
    "PerspectiveCamera": lambda: PLACED | {"scale": 0.01, "angle": 0},
    "align": lambda: {"tracks": TRACKS, "lags": [0, 0, 0]},
    "learn_lags": lambda: {"tracks": TRACKS, "rig": RIG},
    "on_circle": lambda: {"x": X},
    "on_sphere": lambda: {"x": np.c_[X, T]},
    "track": lambda: {"path": "none.mkv"},
    "read_video": lambda: {"path": "none.mkv"},
    "read_frame": lambda: {"path": "none.mkv", "number": 0},
    "discover_from_videos": lambda: {"paths": ["none.mkv"] * 3, "rig": RIG},
    "observe": lambda: {"paths": ["none.mkv"] * 3, "rig": RIG},
    "Hint": lambda: {"frame": 1, "box": (1, 2, 9, 9)},
    "Scene": dict,
    "PolynomialSystem": lambda: {"names": ("x",), "exponents": [[1]], "coefficients": [[1]]},
}  # fmt: skip
METHODS = {
    "PolynomialSystem.from_terms": (vl.PolynomialSystem.from_terms, {"equations": {"x": {"x": 1}}}),
    "PolynomialSystem.simulate": (LAW.simulate, {"t": T, "x0": [1, 0]}),
    "PolynomialSystem.shift": (LAW.shift, {"offset": [1, 2]}),
    "Library.polynomial": (vl.Library.polynomial, {"degree": 1}),
    "Library.fourier": (vl.Library.fourier, {"harmonics": 1}),
    "Library.rational": (vl.Library.rational, {"degree": 1}),
    "Library.terms": (vl.Library.terms, {"functions": {"a": np.sin}}),
    "Library.inputs": (vl.Library.inputs, {"t": T, "values": {"u": T}}),
    "Library.parse": (vl.Library.parse, {"text": "polynomial(2)"}),
    "Rig.around": (vl.Rig.around, {"x": np.c_[X, T]}),
    "Rig.uncalibrated": (RIG.uncalibrated, {"keep": 0}),
    "Camera.project": (RIG.cameras[0].project, {"x": np.c_[X, T]}),
}


def clear(call, *given, **arguments):
    """What is raised must be clear, and one line."""
    said = ""
    try:
        call(*given, **arguments)
    except CLEAR as error:
        said = str(error)
    assert "\n" not in said


def tried(call, known, draw):
    """Call with one or two arguments replaced."""
    names = [
        name for name, one in inspect.signature(call).parameters.items()
        if one.kind not in (one.VAR_POSITIONAL, one.VAR_KEYWORD) and name != "progress"
    ]  # fmt: skip
    arguments = dict(known)
    for name in draw(st.lists(st.sampled_from(names), min_size=1, max_size=2)) if names else []:
        arguments[name] = draw(values)
    clear(call, **arguments)


def texts(*seeds):
    """Texts near the right ones: cut, with parts twice, with marks and numbers in them."""
    odd = st.sampled_from(
        ["", "\0", "[" * 300, "{" * 300, "9" * 400, "nan", "-1", ",", ";", "\t", "\n", "=",
         "\ufeff", "camera", "true", "null", "1e999", "'", '"', "弾", "<a>", "x,y", "0,0"]
    )  # fmt: skip

    @st.composite
    def near(draw):
        text = draw(st.sampled_from(seeds))
        for _ in range(draw(st.integers(0, 3))):
            i, j = sorted(draw(st.tuples(*[st.integers(0, len(text))] * 2)))
            text = text[:i] + draw(st.one_of(odd, st.just(text[i:j] * 2))) + text[j:]
        encoding = draw(st.sampled_from(["utf-8", "utf-8", "utf-16", "latin-1"]))
        return text.encode(encoding, "replace")

    return near()


TABLES = (
    "frame,u,v\n0,1,2\n1,3,4\n", "t;x;y\n0,0;1,5;2\n0,1;3;4\n", "1 2\n3 4\n",
    "pt1_cam1_X,pt1_cam1_Y\n1,2\n", "Track 1_cam_1_x,Track 1_cam_1_y\n1,2\n",
    "scorer,a,a,a\nbodyparts,p,p,p\ncoords,x,y,likelihood\n0,1,2,.9\n",
    "track,frame_idx,instance.score,a.x,a.y,a.score\none,0,1,2,3,1\n",
    "LABEL,ID,TRACK_ID,POSITION_X,POSITION_Y,FRAME\n,,,(pixel),(pixel),\nI1,1,0,2,3,0\n",
    '<Tracks spaceUnits="pixel"><particle><detection t="0" x="1" y="2"/></particle></Tracks>',
    "#Kinovea Trajectory data export\n#T X Y\n# a\n0 1 2\n", "x,y,w,h\n1,2,3,4\n",
    "x1,y1,x2,y2\n1,2,3,4\n", "mass A\nt\tx\ty\n0\t1\t2\n",
)  # fmt: skip
CAMERA = {
    "K": [[9.0, 0, 5], [0, 9, 5], [0, 0, 1]], "D": [0.1], "R": [0.0, 0, 0], "t": [0.0, 0, 5],
    "size": [10, 10], "name": "a",
}  # fmt: skip
TOML = "".join(f"[{name}]\n" + "".join(f"{k} = {json.dumps(v)}\n" for k, v in CAMERA.items())
               for name in "ab")  # fmt: skip
STORAGE = (
    "%YAML:1.0\n---\nK: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
    "   data: [ 9., 0., 5., 0., 9., 5., 0., 0., 1. ]\nR: [ 0., 0., 0. ]\nt: [ 0., 0., 5. ]\n"
)
HINTED = "[[camera]]\ntarget = {colour = [1, 2, 3]}"
NO_LAW = '{"format": "vidsindy_lite discovery, version 1", "discovery": {"type": "Discovery"}}'
XML = '<?xml version="1.0"?>\n<opencv_storage><a><K>9 0 5</K></a><R>1</R></opencv_storage>\n'
READERS = {
    "tracks.csv": (read_tracks, texts(*TABLES)),
    "rig.toml": (vl.Rig.load, texts(RIG.text(), vl.rig_template())),
    "hints.toml": (load_hints, texts(RIG.text().replace("[[camera]]", HINTED))),
    "law.json": (vl.Discovery.load, texts(NO_LAW)),
    **{
        f"calibration{suffix}": (lambda path: read_calibration([path], (10, 10)), texts(*seeds))
        for suffix, seeds in {
            ".toml": (TOML,), ".json": (json.dumps({"a": CAMERA, "b": CAMERA}), '{"P": 5}'),
            ".yaml": (STORAGE,), ".xml": (XML,), ".csv": ("1,2\n" * 11, "1,2,3,4\n" * 3),
            ".npy": ("x",), ".npz": ("PK\x03\x04",),
        }.items()
    },
    "net.onnx": (OnnxDetector, texts("\x08\x07", "x")),
    "film.mkv": (video_info, texts("\x1aE\xdf\xa3", "RIFF", "II*\0")),
    "film.tif": (video_info, texts("II*\0", "MM\0*")),
}  # fmt: skip


@pytest.mark.parametrize("name", [*RIGHT, *METHODS, *READERS])
@pytest.mark.parametrize("examples", [12, pytest.param(150, marks=pytest.mark.thorough)])
def test_odd_ones(name, examples, tmp_path):

    @settings(max_examples=examples, suppress_health_check=list(HealthCheck))
    @given(data=st.data())
    def check(data):
        if name in READERS:
            read, contents = READERS[name]
            (tmp_path / name).write_bytes(data.draw(contents))
            clear(read, tmp_path / name)
        else:
            tried(*(METHODS.get(name) or (getattr(vl, name), RIGHT[name]())), data.draw)

    check()
