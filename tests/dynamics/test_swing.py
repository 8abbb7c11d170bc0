"""The law of a bob's angle, found by itself from positions, against the one that made them."""

import numpy as np
import pandas as pd
import pytest

import vidsindy_lite as vl
from vidsindy_lite.dynamics.result import LIBRARY, NAME, swinging

LENGTH, G, FRICTION = 1.2, 9.81, 0.1
SINES = vl.Library.polynomial(1) + vl.Library.fourier(1)
PENDULUM = vl.PolynomialSystem.from_terms(
    {"x": {"vx": 1.0}, "vx": {"sin(x)": -G / LENGTH, "vx": -FRICTION}}, library=SINES
)
TIMES = np.arange(450) / 30
RIGHT, DOWN = np.array([0.6, 0.8, 0.0]), np.array([0.48, -0.36, -0.8])


def bob(start, noise, seed=0, lean=0.0):
    """Positions in the plane of RIGHT and DOWN of a pendulum let go at an angle."""
    angle = PENDULUM.simulate(TIMES, np.array([start, 0.0]))[:, 0] + lean
    x = 2 + LENGTH * (np.sin(angle)[:, None] * RIGHT + np.cos(angle)[:, None] * DOWN)
    return x + noise * np.random.default_rng(seed).standard_normal(x.shape)


def right_terms(law):
    """Whether the law of an angle has gravity and friction alone."""
    found = {law.terms[row] for row in np.flatnonzero(law.system.support[:, 1])}
    return found == {"sin(angle)", "vangle"}


@pytest.fixture(scope="module")
def swung():
    return vl.discover(TIMES, bob(1.5, 0.005))


def test_a_bob_in_space_has_the_law_of_its_angle(swung):
    swing = swung.swing
    assert right_terms(swing.law)
    assert swing.law.status == "ok"
    assert abs(swing.circle.radius - LENGTH) < 4 * swing.circle.radius_error
    assert abs(swing.g.value - G) < 4 * swing.g.error < 0.1
    # The angle is counted from where the bob would rest.
    assert swing.circle.axes[0] @ DOWN > np.cos(0.01)
    # The law of positions stays doubted.
    assert swung.status == "suspect"
    assert any("stays on a circle" in text for text in swung.warnings)


def test_the_swing_is_printed_and_kept(swung, tmp_path):
    first, *others = str(swung).splitlines()
    assert first.startswith(f"on a circle of radius {swung.swing.circle.radius:.6g} ± ")
    assert "angle'' = " in first
    place = others.index("a law of its positions, one of many that fit alike:")
    assert others[place + 1] == swung.equations().splitlines()[0]
    swung.save(tmp_path / "law.json")
    kept = vl.Discovery.load(tmp_path / "law.json").swing
    assert str(kept) == str(swung.swing)
    np.testing.assert_array_equal(kept.circle.angle, swung.swing.circle.angle)
    np.testing.assert_allclose(kept.law.predict([0.5, 0.1]), swung.swing.law.predict([0.5, 0.1]))


def test_coordinates_that_are_never_seen_together_are_on_no_circle():
    x = flat(bob(1.5, 0.005))
    x[::2, 0], x[1::2, 1] = np.nan, np.nan
    found = vl.discover(TIMES, x, degree=1)
    assert found.status == "suspect"
    assert found.swing is None


def test_errors_that_last_do_not_hide_a_circle():
    rng, errors = np.random.default_rng(5), np.zeros((len(TIMES), 2))
    for i in range(1, len(TIMES)):
        errors[i] = 0.78 * errors[i - 1] + 0.0015 * np.sqrt(1 - 0.78**2) * rng.standard_normal(2)
    found = vl.discover(TIMES, flat(bob(0.5, 0.0003)) + errors, degree=2)
    assert found.status == "suspect"
    assert any("stays on a circle" in text for text in found.warnings)
    assert found.swing is not None


def swing_of(runs, shared=None):
    """What is found where a motion is known to be on a circle."""
    none = [np.empty((*x.shape, 0)) for _, x in runs]

    def solve(angles, errors):
        modes = [np.moveaxis(part, -1, 0) for part in errors]
        frames = [(t, pd.DataFrame({NAME: angle[:, 0]})) for t, angle in angles]
        return vl.discover(frames, systematic=modes, order=2, library=LIBRARY)

    return swinging(runs, none if shared is None else shared, solve)


def flat(x):
    """Positions in the plane of the swing."""
    return np.stack([x @ RIGHT, x @ DOWN], axis=1)


def test_in_the_plane_too_and_from_two_runs():
    runs = [(TIMES, flat(bob(1.2, 0.003))), (TIMES, flat(bob(0.7, 0.003, 1)))]
    runs[0][1][150:160], runs[1][1][250, 1] = np.nan, np.nan  # rows that were not seen
    swing = swing_of(runs)
    assert right_terms(swing.law)
    assert abs(swing.g.value - G) < 4 * swing.g.error


def test_error_bars_count_in_those_of_the_circle():
    off = []
    for seed in range(5):
        law = swing_of([(TIMES, flat(bob(0.8, 0.006, seed)))]).law
        row = law.terms.index("sin(angle)")
        off.append((law.coefficients[row, 1] + G / LENGTH) / law.standard_errors[row, 1])
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 2.2  # without: 3.9


def test_errors_that_all_positions_share_widen_those_of_g():
    x = flat(bob(1.5, 0.005))
    stretched = 0.01 * (x - x.mean(axis=0))  # a scale that is off by 1 %
    alone, shared = swing_of([(TIMES, x)]), swing_of([(TIMES, x)], [stretched[:, :, None]])
    assert right_terms(shared.law)
    assert shared.g.error > 5 * alone.g.error
    assert shared.g.error == pytest.approx(0.01 * G, rel=0.2)


def test_where_nothing_rests_the_angle_counts_from_the_middle():
    x = flat(2 + np.cos(0.3 * TIMES)[:, None] * RIGHT + np.sin(0.3 * TIMES)[:, None] * DOWN)
    x = x + 0.002 * np.random.default_rng(0).standard_normal(x.shape)
    swing = swing_of([(TIMES, x)])
    assert swing.g is None
    assert "g =" not in str(swing)
    assert swing.circle.axes[0] @ (x.mean(axis=0) - swing.circle.centre) > 0


def test_no_swing_where_none_is_asked_for_or_none_is_there(swung):
    t, x = TIMES[::3], flat(bob(1.5, 0.005))[::3]
    assert vl.discover(t, x, order=1, degree=1).swing is None
    assert vl.discover(t, x * [1, 0.7], order=2, degree=1).swing is None  # an ellipse
    assert vl.discover(t, x, order=2, library=SINES).swing is None
    assert swung.swing.law.swing is None


@pytest.mark.parametrize(("speed", "turns"), [(8.0, 2), (15.0, 17)])
def test_a_bob_that_goes_over_the_top_and_on(speed, turns):
    angle = PENDULUM.simulate(TIMES, np.array([0.5, speed]))[:, 0]
    assert np.ptp(angle) > turns * 2 * np.pi
    x = 2 + LENGTH * (np.sin(angle)[:, None] * RIGHT + np.cos(angle)[:, None] * DOWN)
    swing = swing_of([(TIMES, x + 0.005 * np.random.default_rng(0).standard_normal(x.shape))])
    assert right_terms(swing.law)
    assert abs(swing.g.value - G) < 4 * swing.g.error
    assert swing.circle.axes[0] @ DOWN > np.cos(0.02)
