"""Checked input and its cut at gaps."""

import numpy as np
import pytest

from vidsindy_lite.dynamics.data import (
    check_trajectories,
    check_trajectory,
    cut,
    typical_step,
)

T, X = np.arange(5.0), np.ones((5, 2))


def with_value(row, value):
    x = X.copy()
    x[row, 1] = value
    return x


@pytest.mark.parametrize(
    ("t", "x", "message"),
    [
        ("soon", X, "t: must be an array of real numbers, got 'soon'"),
        (T, [[1], [2, 3]], "x: must be an array of real numbers"),
        (T, X + 0j, "x: must be an array of real numbers"),
        (T, np.ones(5), r"x: must have shape \(n, d\)"),
        (T[:4], X, r"t: must have shape \(5,\) as x has 5 rows, got \(4,\)"),
        (np.array([0, 1, np.nan, 3, 4]), X, "t: must be finite, got nan"),
        (np.array([0, 1, 1, 3, 4]), X, r"t: must increase, got t\[1\] = 1 before t\[2\] = 1"),
        (T, with_value(3, np.inf), "x: must not be infinite .* got infinity in row 3"),
        (T, with_value(3, -1e150), r"x: must be at most 1e\+100, got 1e\+150: take another unit"),
        (T, np.diag(np.full(5, np.nan)) + 1, "x: must hold at least one row without NaN, got 5"),
        (T, np.full((5, 2), np.nan), "x: must hold a number, got 5 rows of NaN"),
    ],
)
def test_bad_input_is_named(t, x, message):
    with pytest.raises(ValueError, match=message):
        check_trajectory(t, x)


def test_missing_and_masked_rows_are_left_out():
    masked = np.ma.masked_greater(with_value(2, 1e9), 9)
    for given in (with_value(2, np.nan), masked):
        t, x = check_trajectory(T, given)
        assert t.tolist() == [0, 1, 3, 4]
        assert (x == X[:4]).all()


@pytest.mark.parametrize("t", [[1, 2], T, (T, X), [(T, X, X)], None])
def test_what_is_no_list_of_trajectories(t):
    with pytest.raises(ValueError, match=r"x: must be given, unless t is a list of pairs \(t, x\)"):
        check_trajectories(t)


@pytest.mark.parametrize("pairs", [[], [(T, X), (T, X[:, :1])]])
def test_trajectories_of_one_system(pairs):
    with pytest.raises(ValueError, match="t: a list of trajectories must hold at least one, all"):
        check_trajectories(pairs)


def test_rows_of_several_trajectories_count_for_what_was_seen_in_them():
    x = with_value(2, np.nan)
    x[3] = np.nan
    ((t, left),) = check_trajectories(T, x)
    assert t.tolist() == [0, 1, 2, 4]
    assert np.isnan(left[2]).tolist() == [False, True]


def test_a_coordinate_that_pauses_cuts():
    t = np.arange(10.0)
    x = np.stack([t, np.where((t > 1) & (t < 6), np.nan, t)], axis=1)
    assert [piece[0].tolist() for piece in cut((t, x), 2.5)] == [[0, 1], [6, 7, 8, 9]]
    assert [piece[0].tolist() for piece in cut((t, x), np.array([2.5, 5]))] == [t.tolist()]


def test_cut_at_long_steps_and_nowhere_else():
    t = np.array([0.0, 1, 2, 5, 6, 9])
    pieces = cut((t, t[:, None]), longest_step=2.0)
    assert [piece[0].tolist() for piece in pieces] == [[0, 1, 2], [5, 6], [9]]
    assert typical_step(pieces) == 1.0
