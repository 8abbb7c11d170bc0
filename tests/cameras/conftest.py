"""What tests of lags share."""

import numpy as np
import pytest
from helpers import trajectory
from scipy.interpolate import CubicSpline

import vidsindy_lite as vl


@pytest.fixture(scope="session")
def motion():
    """A motion as a function of the frame number, from -60 to 340, and a rig around it."""
    x = trajectory(np.random.default_rng(4), 400)
    return CubicSpline(np.arange(400) - 60, x), vl.Rig.around(x)
