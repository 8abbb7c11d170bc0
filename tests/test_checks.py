"""The checks that all modules share."""

import re
from datetime import datetime, timedelta
from fractions import Fraction
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import vidsindy_lite as vl
from vidsindy_lite.checks import (
    check_array,
    check_image_size,
    check_instance,
    check_integer,
    check_number,
    check_path,
    check_positive,
    check_rows,
    check_times,
    check_vector,
)

INTEGER, NUMBER = "n: must be an integer of at least 0, got", "n: must be a finite number, got"
ARRAY, VECTOR = "n: must be an array of real numbers, got ", "n: must be 2 finite numbers, got "
SIZE = "image_size: must be two integers of at least 64, got "


def refused(check, values, message):
    return [(check, value, message) for value in values]


@pytest.mark.parametrize(
    ("check", "value", "message"),
    [
        *refused(check_integer, [-1, 1.5, 2.0, True, "2", None, np.nan, [1]], INTEGER),
        *refused(check_number, [np.nan, -np.inf, True, "1", 10**999, None, np.ones(1)], NUMBER),
        *refused(check_positive, [0, -1e-9], "n: must be positive, got "),
        *refused(check_array, ["abc", ["1", "2"], [1j], [[1], [1, 2]], object(), [True, 2]], ARRAY),
        *refused(check_array, [np.arange(3).astype("datetime64[s]")], ARRAY),
        *refused(lambda n, x: check_vector(n, x, 2), [[1, 2, 3], [1, np.nan], [[1, 2]]], VECTOR),
        *refused(lambda _, t: check_times(t), [[], 3.0], "t: must hold at least one time"),
        (lambda _, t: check_times(t), [0, np.inf], "t: must be finite, got inf"),
        (lambda _, t: check_times(t), np.ma.masked_array([0, 1, 2], [0, 1, 0]),
         "t: must be finite, got nan"),
        (lambda _, t: check_times(t), [0, 2, 2], "t: must increase, got t[1] = 2 before t[2] = 2"),
        *refused(lambda _, size: check_image_size(size, least=64),
                 [512, None, "ab", (512,), (512.0, 512), (True, True), (512, 63)], SIZE),
        *refused(lambda _, size: check_image_size(size), [(32769, 64), (64, 10_000_000)],
                 "image_size: must be at most 32768 a side, got "),
        *refused(check_path, [None, 5, ["a.mkv"]], "n: must be the name of a file, got "),
        (check_path, "\udcff.mkv", "n: must be made of characters, got "),
        (lambda n, x: check_instance(n, x, dict), "rig.toml",
         "n: must be of type dict, got 'rig.toml'"),
        *[(lambda n, x: check_rows(n, x, 2), x, f"n: must have shape (n, 2), got {np.shape(x)}")
          for x in (np.zeros(3), np.zeros((3, 3)), np.zeros((1, 3, 2)), 1.0)],
        (lambda n, x: check_rows(n, x, 2), [[0, np.inf]],
         "n: must be finite or NaN, got 1 infinite values"),
    ],
)  # fmt: skip
def test_what_is_none_is_refused(check, value, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        check("n", value)


def test_what_is_one_is_given_back():
    given = np.array([1.0, 2.0])
    check_vector("offset", given, 2)[0] = 9
    assert given[0] == 1  # it is a copy
    np.testing.assert_array_equal(check_rows("x", [[1, 2], [np.nan, 0]], 2), [[1, 2], [np.nan, 0]])
    check_instance("name", "rig.toml", str)
    numbers = np.float32(-0.5), Fraction(30000, 1001)
    assert [check_number("angle", one) for one in numbers] == [-0.5, 30000 / 1001]
    assert (check_integer("seed", np.int64(3)), check_positive("scale", 2)) == (3, 2.0)
    sizes = check_image_size([64, 80], least=64), check_image_size((32768, 32768))
    assert sizes == ((64, 80), (32768, 32768))
    assert check_path("path", "a.mkv") == Path("a.mkv")


@pytest.mark.parametrize("dtype", [int, float])
def test_masked_entries_are_missing(dtype):
    masked = np.ma.masked_array(np.arange(4, dtype=dtype), mask=[0, 0, 1, 0])
    values = check_array("x", masked)
    assert type(values) is np.ndarray
    np.testing.assert_array_equal(values, [0, 1, np.nan, 3])
    assert masked.data.tolist() == [0, 1, 2, 3]
    frame = pd.DataFrame({"a": [None, 1], "b": [0, 2]}, dtype=f"{dtype.__name__.title()}64")
    np.testing.assert_array_equal(check_array("x", frame), [[np.nan, 0], [1, 2]])


def test_messages_name_the_remedy():
    t = np.linspace(0, 10, 60)
    x = np.c_[np.cos(t), -np.sin(t)]
    stamps = [datetime(2024, 3, 1) + timedelta(seconds=s) for s in t]
    differences = np.diff([*stamps, stamps[-1] + timedelta(1)])
    for given, said in (
        ((stamps, x), r"got dates|give seconds since the first: with t = np.array\(t, 'datetime64"),
        ((np.array(stamps, "datetime64[us]"), x), "give seconds since the first"),
        ((differences, x), r"give seconds, np.array\(t, 'timedelta64\[us\]'\) / np.timedelta64"),
        (((1.7e9 + t).astype(np.float32), x), "equal in single precision: give t in float64"),
        ((t, x[:, 0]), r"got \(60,\): one coordinate is a column, x\[:, None\]"),
        (([t, t], [x, x]), r"got \(2, 60, 2\): several runs are a list of pairs, discover"),
        (([(t, x), (t, x), (t, np.nan * x), (t, x)],), "60 rows of NaN, in trajectory 2"),
        ((t, pd.DataFrame({"time": t, "x": x[:, 0]})), "got the times as column 'time'"),
        ((t, pd.DataFrame({"x": t, "q": "1"})), r"x: 'q' \(str\): must be an array of real numb"),
        ((t, np.full(x.shape, 10**5000, object)), "x: must be an array of real numbers"),
    ):
        with pytest.raises(ValueError, match=said):
            vl.discover(*given, degree=1)
    with pytest.raises(ValueError, match="systematic: must have shape"):
        vl.discover(t, x, systematic=object())
