"""A kicked motion is told from a badly measured one, and its law is found all the same."""

import numpy as np
import pytest
from helpers import dependent

import vidsindy_lite as vl
from vidsindy_lite.dynamics import PolynomialSystem
from vidsindy_lite.dynamics.bspline import Segment
from vidsindy_lite.dynamics.collocation import Collocation, Fit, State, Status
from vidsindy_lite.dynamics.library import monomial_exponents
from vidsindy_lite.dynamics.noise import evidence
from vidsindy_lite.study.corruption import kicked_path

LAW = PolynomialSystem.from_terms(
    {"x": {"y": 1.0}, "y": {"x": -1.0, "y": 1.0, "x^2 y": -1.0}}, degree=3
)
TIMES = np.linspace(0.0, 60.0, 1000)


def test_errors_that_a_poor_law_leaves_are_not_taken_for_kicks():
    """The first law shows kicks; the one that is found under them holds exactly."""
    rng = np.random.default_rng(3)
    times = np.linspace(0.0, 60.0, 1500)
    x = LAW.simulate(times, np.array([2.0, 0.0])) + 0.2 * dependent(rng, len(times), 0.97)
    found = vl.discover(times, x, order=1)
    assert (found.system.support == LAW.support).all()
    assert not found.model_error.any()


def test_law_of_a_kicked_motion_is_found_with_the_size_of_its_kicks(tmp_path):
    rng, kept = np.random.default_rng(11), LAW.support
    x = kicked_path(LAW, TIMES, (2.0, 0.0), (0.05, 0.05), rng)
    found = vl.discover(TIMES, x + 0.002 * rng.standard_normal(x.shape))
    assert (found.system.support == LAW.support).all()
    assert found.status == "ok"
    np.testing.assert_allclose(found.model_error, 0.05, rtol=0.3)
    # Between two knots a kick cannot be told from noise: it is at most that of one sample.
    assert (found.noise < 0.05 * np.sqrt(TIMES[1])).all()
    off = (found.coefficients - LAW.coefficients)[kept]
    assert (np.abs(off / found.standard_errors[kept]) < 4).all()
    assert "process noise: 0.0" in str(found)
    found.save(tmp_path / "law.json")
    again = vl.Discovery.load(tmp_path / "law.json")
    np.testing.assert_array_equal(again.model_error, found.model_error)


@pytest.mark.parametrize("kind", ["independent", "lasting", "bent space"])
def test_errors_of_the_measurement_are_no_kicks(kind):
    rng = np.random.default_rng(5)
    x = LAW.simulate(TIMES, [2.0, 0.0])
    if kind == "independent":
        x = x + 0.05 * rng.standard_normal(x.shape)
    elif kind == "lasting":
        x = x + 0.05 * dependent(rng, len(x), 0.9)
    else:
        x = x + 0.01 * x[:, ::-1] ** 2
    found = vl.discover(TIMES, x)
    assert not found.model_error.any()
    assert "process noise" not in str(found)
    if kind != "bent space":
        assert (found.system.support == LAW.support).all()


def test_velocities_are_kicked_where_positions_are_seen():
    spring = PolynomialSystem.from_terms(
        {"x": {"y": 1.0}, "y": {"x": -4.0, "y": -0.2, "x^3": -3.0}}, degree=3
    )
    rng, times = np.random.default_rng(3), np.linspace(0.0, 30.0, 1000)
    path = kicked_path(spring, times, (1.5, 0.0), (0.0, 0.1), rng)[:, :1]
    found = vl.discover(times, path + 0.003 * rng.standard_normal(path.shape), order=2)
    assert set(np.array(found.terms)[found.system.support[:, 1]]) == {"x", "vx", "x^3"}
    assert found.model_error[0] == 0  # the slope of a position is its velocity, kicked or not
    assert found.model_error[1] == pytest.approx(0.1, rel=0.3)


def test_evidence_is_that_of_the_gaussian_model():
    """Against the marginal likelihood of the data by dense algebra, for a linear law."""
    rng = np.random.default_rng(0)
    t = np.linspace(0.0, 3.0, 12)
    segment = Segment.even(t, rng.standard_normal((len(t), 1)), 0.5, 0)
    exponents = monomial_exponents(1, 1)
    coefficients = np.array([[0.3], [-0.7]])

    def both(noise, kick):
        collocation = Collocation.of([segment], exponents, [noise**-2], [kick**-2])
        grid = collocation.grid
        state = State(
            np.zeros((grid.r, 1)), coefficients, coefficients != 0, np.zeros(1), np.zeros(1, bool)
        )
        # The curve alone is fitted: the law stays as it is.
        solved = collocation.linearise(state, np.array([], dtype=int))
        state = solved.along(state, np.zeros(0), 1.0)
        physics = grid.slopes.toarray() - coefficients[1] * grid.nodes.toarray()
        rows = np.vstack(
            [grid.samples.toarray() / noise, np.sqrt(grid.node_weights)[:, None] * physics / kick]
        )
        constant = np.sqrt(grid.node_weights) * coefficients[0] / kick
        right = np.concatenate([grid.x[:, 0] / noise, constant])
        control, *_ = np.linalg.lstsq(rows, right, rcond=None)
        left = ((rows @ control - right) ** 2).sum()
        dense = left + np.linalg.slogdet(rows.T @ rows)[1]
        dense += 2 * len(t) * np.log(noise)
        dense -= np.log(grid.node_weights).sum() - 2 * len(grid.node_weights) * np.log(kick)
        return evidence(Fit(state, collocation, Status.CONVERGED)), dense

    for noise, kick in ((0.1, 0.3), (0.5, 0.01)):
        ours, dense = both(noise, kick)
        assert ours == pytest.approx(dense, rel=1e-6)


def test_kicks_of_few_samples_a_turn_may_be_a_drive():
    """A spring pushed by cos(.85 t), which nobody named, at eight samples a turn."""
    times = np.arange(80) * 2 * np.pi / 0.85 / 8
    driven = PolynomialSystem.from_terms(
        {"x": {"v": 1}, "v": {"x": -1, "v": -0.1, "c": 1}, "c": {"s": -0.85}, "s": {"c": 0.85}}
    )
    x = driven.simulate(times, (1.0, 0.0, 1.0, 0.0))[:, :1]
    x += 0.05 * x.std() * np.random.default_rng(0).standard_normal(x.shape)
    found = vl.discover(times, x)
    assert found.model_error.any()
    assert any("from a drive or a force that nobody named" in text for text in found.warnings)
