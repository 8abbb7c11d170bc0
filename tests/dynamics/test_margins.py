"""What rounding may do to a discovery: nothing that counts.

A disturbance of the data by 1e-9, and another kernel of linear algebra, move no coefficient by a
hundredth of its standard error, and no term in or out. A path is the same to the last digit.
"""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import vidsindy_lite
from vidsindy_lite import discover
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, add_noise

CASES = [("Lorenz", 0.0), ("SprottF", 0.1)]
MORE = [(name, noise) for name in SYSTEMS for noise in (0.0, 0.02, 0.1, 0.2)]
PROCESS = """
import json, sys
sys.path.insert(0, sys.argv[1])
from test_margins import outcome
print(json.dumps(outcome()))
"""


def samples(name, noise, n=400):
    t, x = SYSTEMS[name].shift(REFERENCE_OFFSET).trajectory(n)
    return t, add_noise(x, noise, np.random.default_rng(8))


def assert_same(coefficients, errors, others):
    live = coefficients != 0
    assert (live == (others != 0)).all()
    assert (np.abs(others - coefficients)[live] / errors[live]).max() < 0.01


def check_disturbed(name, noise, n, draws):
    t, x = samples(name, noise, n)
    found = discover(t, x)
    for draw in range(draws):
        disturbed = x * (1 + 1e-9 * np.random.default_rng(draw).standard_normal(x.shape))
        other = discover(t, disturbed)
        assert_same(found.coefficients, found.standard_errors, other.coefficients)
        assert other.status == found.status


@pytest.mark.parametrize(("name", "noise"), CASES)
def test_a_disturbance_of_the_ninth_digit_does_not_count(name, noise):
    check_disturbed(name, noise, n=400, draws=1)


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "noise"), MORE)
def test_a_disturbance_of_the_ninth_digit_does_not_count_anywhere(name, noise):
    check_disturbed(name, noise, n=800, draws=2)


def outcome():
    """A chaotic path as a digest; coefficients and standard errors of what is found."""
    path = hashlib.sha256(SYSTEMS["SprottF"].trajectory(800)[1].tobytes()).hexdigest()
    found = discover(*samples("SprottF", 0.1))
    return path, found.coefficients.tolist(), found.standard_errors.tolist()


def test_a_kernel_of_linear_algebra_does_not_count():
    """With scipy's integrator the end of this path moved by its whole width."""
    here = {"PYTHONPATH": str(Path(vidsindy_lite.__file__).parents[1])}
    kernel = {"OPENBLAS_CORETYPE": "Haswell", "OMP_NUM_THREADS": "2"}
    ran = subprocess.run(
        [sys.executable, "-c", PROCESS, str(Path(__file__).parent)],
        env=os.environ | here | kernel, capture_output=True, text=True, check=True,
    )  # fmt: skip
    digest, found, errors = json.loads(ran.stdout)
    path, coefficients, _ = outcome()
    assert digest == path
    assert_same(np.array(found), np.array(errors), np.array(coefficients))
