"""How a problem is posed from data: standard units, and where the data pause."""

import numpy as np
import pytest
from helpers import posed

from vidsindy_lite.dynamics.problem import GAP


def test_data_are_in_standard_units():
    problem = posed()
    ((t, x),) = problem.trajectories
    np.testing.assert_allclose(x.mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(x.std(axis=0), 1)
    (measured,) = problem.measured
    np.testing.assert_allclose(problem.units.point(x), measured[1])
    np.testing.assert_allclose(problem.units.standard(measured[1]), x, atol=1e-12)
    np.testing.assert_allclose(t * problem.units.time, measured[0])
    speed = np.sqrt((np.gradient(x, t, axis=0) ** 2).mean())
    assert speed == pytest.approx(1, rel=0.02)
    np.testing.assert_allclose(problem.systematic[0][0, :, 0], 1 / measured[1].std(axis=0))
    np.testing.assert_allclose(problem.origin, -measured[1].mean(axis=0) / measured[1].std(axis=0))


def test_a_pause_is_a_gap_if_the_target_moves_far_in_it():
    step = posed().units.time * GAP / 0.05  # samples in the longest pause that is none
    for missing, stretches in ((int(step) - 2, 1), (int(step) + 2, 2)):
        seen = np.r_[0:150, 150 + missing : 401]
        assert len(posed(seen=seen).stretches) == stretches
