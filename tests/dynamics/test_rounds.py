"""Circles and spheres against those that the data were made from, and the law of a bob."""

import numpy as np
import pandas as pd
import pytest

import vidsindy_lite as vl
from vidsindy_lite.dynamics.result import LIBRARY, NAME, swinging

TIMES = np.linspace(0, 10, 400)
SWING = 0.8 * np.cos(3 * TIMES) * np.exp(-0.05 * TIMES)
DOWN = np.array([0.0, 0.0, -1.0])
ASIDE = np.array([0.6, 0.8, 0.0])


def bob(angle, centre=(1.0, 2.0, 3.0), length=1.2):
    """Positions of a pendulum that swings aside."""
    return np.array(centre) + length * (
        np.cos(angle)[:, None] * DOWN + np.sin(angle)[:, None] * ASIDE
    )


def test_a_pendulum_gives_its_length_and_angle():
    circle = vl.on_circle(bob(SWING), zero=DOWN)
    assert circle.radius == pytest.approx(1.2)
    assert circle.centre == pytest.approx([1, 2, 3])
    assert circle.distance < 1e-12
    assert circle.angle == pytest.approx(SWING, abs=1e-9)
    assert circle.axes == pytest.approx(np.stack([DOWN, ASIDE]), abs=1e-9)


def test_the_errors_cover_in_space():
    rng = np.random.default_rng(0)
    truth, covered = np.array([1.2, 1, 2, 3]), []
    for _ in range(100):
        circle = vl.on_circle(bob(SWING) + 0.005 * rng.standard_normal((400, 3)))
        found = np.append(circle.radius, circle.centre)
        errors = np.append(circle.radius_error, circle.centre_errors)
        covered.append(np.abs(found - truth) < 1.96 * errors)
    assert ((np.mean(covered, axis=0) > 0.87) & (np.mean(covered, axis=0) < 1)).all()
    white = rng.standard_normal((400, 3))
    lasting = np.apply_along_axis(np.convolve, 0, white, np.ones(9) / 3, "same")
    one, nine = (vl.on_circle(bob(SWING) + 0.005 * e) for e in (white, lasting))
    assert nine.radius_error > 1.7 * one.radius_error


def test_a_sphere_has_two_angles():
    second = 0.5 * np.sin(2.1 * TIMES)
    x = 1.5 * np.stack(
        [np.cos(second) * np.sin(SWING), np.sin(second), -np.cos(second) * np.cos(SWING)], axis=1
    )
    noisy = x + 0.003 * np.random.default_rng(2).standard_normal(x.shape)
    ball = vl.on_sphere(noisy + [5, 0, 0], zero=DOWN)
    assert abs(ball.radius - 1.5) < 4 * ball.radius_error
    assert (np.abs(ball.centre - [5, 0, 0]) < 4 * ball.centre_errors).all()
    # The angles say where it is, whatever direction they are counted in.
    longitude, latitude = ball.angle.T
    c, place = np.cos(latitude), [np.cos(longitude), np.sin(longitude), np.sin(latitude)]
    back = (
        ball.centre + ball.radius * np.stack([c * place[0], c * place[1], place[2]], 1) @ ball.axes
    )
    assert back == pytest.approx(noisy + [5, 0, 0], abs=0.02)


@pytest.mark.parametrize(
    ("fit", "x", "rule"),
    [
        (vl.on_circle, np.zeros((9, 4)), r"x: must have shape \(n, 2\) or \(n, 3\), got \(9, 4\)"),
        (vl.on_sphere, np.zeros((9, 2)), r"x: must have shape \(n, 3\), got \(9, 2\)"),
        (vl.on_circle, bob(SWING)[:5], "x: must hold at least 6 positions, got 5"),
        (vl.on_circle, TIMES[:, None] * [1.0, 2.0], "x: must not lie on a line"),
        (vl.on_sphere, bob(SWING), "x: must not be flat"),
    ],
)
def test_what_is_not_round_is_refused(fit, x, rule):
    with pytest.raises(ValueError, match=rule):
        fit(x)
    for zero in ((0, 1), (0.8, -0.6, 0), (0, 0, np.nan)):  # the second is not in its plane
        with pytest.raises(ValueError, match="zero: must be"):
            vl.on_circle(bob(SWING), zero=zero)


def test_errors_that_all_positions_share_are_passed_on():
    x, centre = bob(SWING), np.array([1.0, 2.0, 3.0])
    aside = np.cross(np.cross(DOWN, ASIDE), x - centre)  # a turn about the axis
    causes = np.stack([0.01 * (x - centre), 0.002 * aside, np.full_like(x, 0.03)])
    causes[:, 7] = x[7] = np.nan
    plain, circle = vl.on_circle(x, zero=DOWN), vl.on_circle(x, zero=DOWN, systematic=causes)
    assert plain.systematic is None
    assert circle.systematic.shape == (3, 400, 1)
    assert circle.radius_error == pytest.approx(0.012, rel=1e-6)
    assert circle.centre_errors == pytest.approx([0.03] * 3, rel=1e-4)
    seen = np.isfinite(circle.angle)
    assert circle.systematic[0, seen] == pytest.approx(0, abs=1e-9)
    assert np.abs(circle.systematic[1, seen]) == pytest.approx(0.002, rel=1e-4)
    with pytest.raises(ValueError, match=r"systematic: must be finite, of shape \(k, 400, 3\)"):
        vl.on_circle(x, systematic=causes[:, :9])


def test_what_is_on_no_circle_is_said_in_short():
    rng, t = np.random.default_rng(0), np.linspace(0, 30, 400)
    assert "hardly bends" in vl.on_circle(np.column_stack([t, np.sin(t)])).warnings[-1]
    arc = np.column_stack([np.sin(0.5 * np.sin(t)), np.cos(0.5 * np.sin(t))])
    assert vl.on_circle(arc + 0.01 * rng.standard_normal((400, 2))).warnings == ()
    fine = vl.on_circle(bob(SWING) + 0.01 * rng.standard_normal((400, 3)))
    assert fine.warnings == ()
    assert repr(fine).startswith("circle of radius 1.2")
    assert len(repr(fine)) < 120
    ellipse = np.stack([1.1 * np.cos(3 * TIMES), np.sin(3 * TIMES)], axis=1)
    for x in (ellipse, rng.standard_normal((200, 3))):
        assert "may be on no circle" in str(vl.on_circle(x))
    assert "may be on no sphere" in str(vl.on_sphere(rng.standard_normal((200, 3))))


LENGTH, G, FRICTION = 1.2, 9.81, 0.1
SINES = vl.Library.polynomial(1) + vl.Library.fourier(1)
PENDULUM = vl.PolynomialSystem.from_terms(
    {"x": {"vx": 1.0}, "vx": {"sin(x)": -G / LENGTH, "vx": -FRICTION}}, library=SINES
)
FRAMES = np.arange(450) / 30
RIGHT, BELOW = np.array([0.6, 0.8, 0.0]), np.array([0.48, -0.36, -0.8])


def swung_bob(start, noise, seed=0, lean=0.0):
    """Positions in the plane of RIGHT and BELOW of a pendulum let go at an angle."""
    angle = PENDULUM.simulate(FRAMES, np.array([start, 0.0]))[:, 0] + lean
    x = 2 + LENGTH * (np.sin(angle)[:, None] * RIGHT + np.cos(angle)[:, None] * BELOW)
    return x + noise * np.random.default_rng(seed).standard_normal(x.shape)


def right_terms(law):
    """Whether the law of an angle has gravity and friction alone."""
    found = {law.terms[row] for row in np.flatnonzero(law.system.support[:, 1])}
    return found == {"sin(angle)", "vangle"}


@pytest.fixture(scope="module")
def swung():
    return vl.discover(FRAMES[::4], swung_bob(1.5, 0.005)[::4])


def test_a_bob_in_space_has_the_law_of_its_angle(swung):
    swing = swung.swing
    assert right_terms(swing.law)
    assert swing.law.status == "ok"
    assert abs(swing.circle.radius - LENGTH) < 4 * swing.circle.radius_error
    assert abs(swing.g.value - G) < 4 * swing.g.error < 0.1
    # The angle is counted from where the swung_bob would rest.
    assert swing.circle.axes[0] @ BELOW > np.cos(0.01)
    # The law of positions stays doubted.
    assert swung.status == "suspect"
    assert any("stays on a circle" in text for text in swung.warnings)


def test_the_swing_is_printed_and_kept(swung, tmp_path):
    first, *others = str(swung).splitlines()
    assert first.startswith(f"on a circle of radius {swung.swing.circle.radius:.6g} ± ")
    assert "angle'' = " in first
    place = others.index("a law of its positions, one of many that fit alike:")
    assert others[place + 1] == swung.equations().splitlines()[0]
    assert others[place - 1] == f"of small swings: {swung.physics()['period']}"
    swung.save(tmp_path / "law.json")
    kept = vl.Discovery.load(tmp_path / "law.json").swing
    assert str(kept) == str(swung.swing)
    np.testing.assert_array_equal(kept.circle.angle, swung.swing.circle.angle)
    np.testing.assert_allclose(kept.law.predict([0.5, 0.1]), swung.swing.law.predict([0.5, 0.1]))


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
    return np.stack([x @ RIGHT, x @ BELOW], axis=1)


def test_in_the_plane_too_and_from_two_runs():
    runs = [(FRAMES, flat(swung_bob(1.2, 0.003))), (FRAMES, flat(swung_bob(0.7, 0.003, 1)))]
    runs[0][1][150:160], runs[1][1][250, 1] = np.nan, np.nan  # rows that were not seen
    swing = swing_of(runs)
    assert right_terms(swing.law)
    assert abs(swing.g.value - G) < 4 * swing.g.error


def test_error_bars_count_in_those_of_the_circle():
    off = []
    for seed in range(5):
        law = swing_of([(FRAMES, flat(swung_bob(0.8, 0.006, seed)))]).law
        row = law.terms.index("sin(angle)")
        off.append((law.coefficients[row, 1] + G / LENGTH) / law.standard_errors[row, 1])
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 2.2  # without: 3.9


def test_errors_that_all_positions_share_widen_those_of_g():
    x = flat(swung_bob(1.5, 0.005))
    stretched = 0.01 * (x - x.mean(axis=0))  # a scale that is off by 1 %
    alone, shared = swing_of([(FRAMES, x)]), swing_of([(FRAMES, x)], [stretched[:, :, None]])
    assert right_terms(shared.law)
    assert shared.g.error > 5 * alone.g.error
    assert shared.g.error == pytest.approx(0.01 * G, rel=0.2)


def test_where_nothing_rests_the_angle_counts_from_the_middle():
    x = flat(2 + np.cos(0.3 * FRAMES)[:, None] * RIGHT + np.sin(0.3 * FRAMES)[:, None] * BELOW)
    x = x + 0.002 * np.random.default_rng(0).standard_normal(x.shape)
    swing = swing_of([(FRAMES, x)])
    assert swing.g is None
    assert "g =" not in str(swing)
    assert swing.circle.axes[0] @ (x.mean(axis=0) - swing.circle.centre) > 0


def test_no_swing_where_none_is_asked_for_or_none_is_there(swung):
    t, x = FRAMES[:150], flat(swung_bob(1.5, 0.005))[:150]
    assert vl.discover(t, x, order=1, degree=1).swing is None
    assert vl.discover(t, x * [1, 0.7], order=2, degree=1).swing is None  # an ellipse
    assert vl.discover(t, x, order=2, library=SINES).swing is None
    assert swung.swing.law.swing is None


@pytest.mark.parametrize(("speed", "turns"), [(8.0, 2), (15.0, 17)])
def test_a_bob_that_goes_over_the_top_and_on(speed, turns):
    angle = PENDULUM.simulate(FRAMES, np.array([0.5, speed]))[:, 0]
    assert np.ptp(angle) > turns * 2 * np.pi
    x = 2 + LENGTH * (np.sin(angle)[:, None] * RIGHT + np.cos(angle)[:, None] * BELOW)
    swing = swing_of([(FRAMES, x + 0.005 * np.random.default_rng(0).standard_normal(x.shape))])
    assert right_terms(swing.law)
    assert abs(swing.g.value - G) < 4 * swing.g.error
    assert swing.circle.axes[0] @ BELOW > np.cos(0.02)
