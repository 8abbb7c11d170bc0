"""Checked input and its cut at gaps."""

import numpy as np
import pytest

from vidsindy_lite.records import check_record, cut, typical_step

T, X = np.arange(5.0), np.ones((5, 2))


def with_value(row, value):
    x = X.copy()
    x[row, 1] = value
    return x


@pytest.mark.parametrize(
    ("t", "x", "message"),
    [
        ("soon", X, "t: must be an array of numbers, got 'soon'"),
        (T, [[1], [2, 3]], "x: must be an array of numbers"),
        (T, np.ones(5), r"x: must have shape \(n, d\)"),
        (T, np.ones((5, 0)), r"x: must have shape \(n, d\)"),
        (T[:4], X, r"t: must have shape \(5,\) as x has 5 rows, got \(4,\)"),
        (np.array([0, 1, np.nan, 3, 4]), X, "t: must be finite, got nan"),
        (np.array([0, 1, 1, 3, 4]), X, r"t: must increase, got t\[1\] = 1 before t\[2\] = 1"),
        (T[::-1], X, "t: must increase"),
        (T, with_value(3, np.inf), "x: must not be infinite .* got infinity in row 3"),
        (T, np.full((5, 2), np.nan), "x: must hold at least one row without NaN, got 5"),
        (np.empty(0), np.empty((0, 2)), "x: must hold at least one row without NaN, got 0"),
    ],
)
def test_bad_input_is_named(t, x, message):
    with pytest.raises(ValueError, match=message):
        check_record(t, x)


def test_missing_rows_are_left_out():
    t, x = check_record(T, with_value(2, np.nan))
    assert t.tolist() == [0, 1, 3, 4]
    assert x.shape == (4, 2)


def test_cut_at_long_steps_and_nowhere_else():
    t = np.array([0.0, 1, 2, 5, 6, 9])
    pieces = cut((t, t[:, None]), longest_step=2.0)
    assert [piece[0].tolist() for piece in pieces] == [[0, 1, 2], [5, 6], [9]]
    assert typical_step(pieces) == 1.0
