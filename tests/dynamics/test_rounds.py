"""Circles and spheres against those that the data were made from."""

import numpy as np
import pytest

import vidsindy_lite as vl

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


def test_whirling_has_no_leaps_and_what_is_missing_has_no_angle():
    whirl = 4 * TIMES
    x = bob(whirl)[:, [0, 2]]
    x[100:120] = np.nan
    circle = vl.on_circle(x / [0.6, 1.0], zero=(0, -1))
    seen = np.isfinite(circle.angle)
    assert seen.sum() == 380
    assert np.diff(circle.angle[seen]).max() < 21 * 4 * TIMES[1] + 1e-9
    assert abs(np.ptp(circle.angle[seen])) == pytest.approx(40, rel=1e-6)


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
    wave = np.column_stack([t, np.sin(t)])
    assert "hardly bends" in vl.on_circle(wave).warnings[-1]
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
