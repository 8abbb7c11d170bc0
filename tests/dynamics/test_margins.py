"""What rounding may do to a discovery: nothing that counts.

A disturbance of the data by 1e-9, and another kernel of linear algebra, move no coefficient by a
hundredth of its standard error, and no term in or out.
"""

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

HUNDREDTH = 0.01
DISCOVERY = """
import json, sys
import numpy as np
from vidsindy_lite import discover
from vidsindy_lite.study import REFERENCE_OFFSET, SYSTEMS, add_noise
for name, noise in json.loads(sys.argv[1]):
    t, x = SYSTEMS[name].shift(REFERENCE_OFFSET).trajectory(400)
    found = discover(t, add_noise(x, noise, np.random.default_rng(8)))
    print(json.dumps([found.coefficients.tolist(), found.standard_errors.tolist()]))
"""
CASES = [("Lorenz", 0.0), ("NoseHoover", 0.05), ("SprottF", 0.1)]
MORE = [(name, noise) for name in SYSTEMS for noise in (0.0, 0.02, 0.1, 0.2)]


def samples(name, noise, n):
    t, x = SYSTEMS[name].shift(REFERENCE_OFFSET).trajectory(n)
    return t, add_noise(x, noise, np.random.default_rng(8))


def assert_same(coefficients, errors, others):
    assert ((coefficients != 0) == (others != 0)).all()
    live = coefficients != 0
    moved = np.abs(others - coefficients)[live] / errors[live]
    assert moved.max() < HUNDREDTH


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


def discovered(**environment):
    """Coefficients and standard errors of all cases, by a process with these settings."""
    paths = {"PYTHONPATH": str(Path(vidsindy_lite.__file__).parents[1])}
    ran = subprocess.run(
        [sys.executable, "-c", DISCOVERY, json.dumps(CASES)],
        env=os.environ | paths | environment, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return [map(np.array, json.loads(line)) for line in ran.stdout.splitlines()]


@pytest.mark.slow
def test_a_kernel_of_linear_algebra_does_not_count():
    plain = discovered()
    haswell = discovered(OPENBLAS_CORETYPE="Haswell", OMP_NUM_THREADS="2")
    assert len(plain) == len(CASES)
    for (coefficients, errors), (found, _) in zip(plain, haswell, strict=True):
        assert_same(coefficients, errors, found)
