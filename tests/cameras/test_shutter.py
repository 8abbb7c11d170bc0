"""Rolling shutters: rows that are read late are put where they would be in the middle of it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidsindy_lite.cameras.models import steadied


def test_a_global_shutter_and_gaps_stay_as_they_are():
    track = np.cumsum(np.ones((9, 2)), axis=0)
    track[4] = np.nan
    assert steadied(track, 0.0, 100) is track
    assert (
        np.isnan(steadied(track, 0.5, 100)).any(axis=1).tolist()
        == [False] * 4 + [True] + [False] * 4
    )
    short = np.full((9, 2), np.nan)
    short[:3] = 1.0
    assert steadied(short, 0.5, 100) is short


@given(st.floats(-0.9, 0.9), st.integers(100, 1000))
def test_a_steady_motion_is_put_back_in_time(readout, height):
    """A point at row v is seen readout (v - (H - 1) / 2) / H frames late."""
    k = np.arange(30.0)
    # Rows v = a + b (k + late(v)), solved for v.
    a, b = 0.3 * height, 0.01 * height
    share = readout / height
    row = (a + b * (k - share * (height - 1) / 2)) / (1 - b * share)
    late = readout * (row - (height - 1) / 2) / height
    seen = np.column_stack((5 - 2 * (k + late), row))
    np.testing.assert_allclose(seen[:, 1], a + b * (k + late), atol=1e-9 * height)
    expected = np.column_stack((5 - 2 * k, a + b * k))
    np.testing.assert_allclose(steadied(seen, readout, height), expected, atol=1e-8 * height)


def test_the_middle_row_is_on_time():
    track = np.column_stack((np.arange(9.0) ** 2, np.full(9, 49.5)))
    np.testing.assert_allclose(steadied(track, 0.8, 100), track, atol=1e-12)


@pytest.mark.parametrize("readout", [0.8, -0.8])
def test_an_outlier_does_not_overtake_its_neighbours(readout):
    track = np.column_stack((np.arange(20.0), np.full(20, 99.0)))
    track[9, 1] = 5000.0
    found = steadied(track, readout, 100)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[0:4, 0], np.arange(4) - readout * 49.5 / 100, atol=0.05)
