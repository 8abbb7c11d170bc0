"""The seven systems against the paper's Tables S1 and S2."""

import inspect

import numpy as np
import pytest

from vidsindy_lite.dynamics import PolynomialSystem, runge_kutta_4
from vidsindy_lite.study.systems import FLOWS, REFERENCE_OFFSET, SYSTEMS, Benchmark

TERMS = {
    "Lorenz": 12, "SprottE": 8, "RayleighBenard": 11, "SprottF": 10, "NoseHoover": 9,
    "Tsucs2": 15, "WangSun": 14,
}  # fmt: skip


@pytest.mark.parametrize("name", SYSTEMS)
def test_number_of_true_terms_in_the_reference_frame(name):
    assert SYSTEMS[name].shift(REFERENCE_OFFSET).support.sum() == TERMS[name]


def test_shift_gives_the_ground_truth_of_table_s2():
    printed = PolynomialSystem.from_terms(
        {
            "x": {"xz": 0.5, "x": -40, "y": 40, "z": -5},
            "y": {"xz": -1, "x": 1, "y": 20, "z": 10, "1": -210},
            "z": {"x^2": -0.65, "xy": 1, "x": 3, "y": -10, "z": 0.8, "1": 35},
        },
        degree=3,
    )
    shifted = SYSTEMS["Tsucs2"].shift(REFERENCE_OFFSET)
    ours = dict(zip(shifted.terms, shifted.coefficients.tolist(), strict=True))
    for term, row in zip(printed.terms, printed.coefficients, strict=True):
        np.testing.assert_allclose(ours.get(term, [0, 0, 0]), row, atol=1e-12)


def test_trajectory_starts_at_the_shifted_initial_condition():
    system = SYSTEMS["Lorenz"].shift(REFERENCE_OFFSET)
    t, x = system.trajectory(30)
    np.testing.assert_allclose(x[0], (2, 17, 27))
    np.testing.assert_allclose(np.diff(t), 0.015)


@pytest.mark.parametrize("name", SYSTEMS)
def test_runge_kutta_agrees_with_the_adaptive_method(name):
    system = SYSTEMS[name]
    t, x = system.trajectory(100)
    rk4 = runge_kutta_4(system, t, system.x0, substeps=20)
    assert np.abs(rk4 - x).max() < 1e-5 * np.ptp(x, axis=0).max()


def test_runge_kutta_is_of_fourth_order():
    law = PolynomialSystem.from_terms({"x": {"x": -1}})
    errors = [
        abs(runge_kutta_4(law, np.array([0.0, 1.0]), [1.0], n)[-1, 0] - np.exp(-1)) for n in (4, 8)
    ]
    assert 14 < errors[0] / errors[1] < 18


@pytest.mark.parametrize(("systems", "count"), [(SYSTEMS, 7), (FLOWS, 12)])
def test_a_system_that_there_is_not_is_told_with_those_that_there_are(systems, count):
    with pytest.raises(KeyError, match="system: must be one of Lorenz, .*, got 'Lorentz'"):
        systems["Lorentz"]
    with pytest.raises(KeyError, match="got 3"):
        systems[3]
    assert "Lorentz" not in systems
    assert systems.get("Lorentz") is None
    assert len(systems) == len({**systems}) == count


def test_bad_benchmarks_are_refused():
    from dataclasses import replace

    with pytest.raises(ValueError, match="period: must be positive"):
        replace(SYSTEMS["Lorenz"], period=0)
    with pytest.raises(ValueError, match="x0: must be 3 finite numbers"):
        replace(SYSTEMS["Lorenz"], x0=(1, 2))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0,), "n: must be an integer of at least 1, got 0"),
        ((2.5,), "n: must be an integer of at least 1, got 2.5"),
        ((5, 0), "samples_per_period: must be positive, got 0"),
        ((5, -1), "samples_per_period: must be positive, got -1"),
        ((5, np.nan), "samples_per_period: must be a finite number, got nan"),
    ],
)
def test_bad_times_are_refused(arguments, message):
    for use in (SYSTEMS["Lorenz"].times, SYSTEMS["Lorenz"].trajectory):
        with pytest.raises(ValueError, match=message):
            use(*arguments)


def test_bad_steps_are_refused():
    law = SYSTEMS["Lorenz"]
    for t, x0, substeps, name in [
        ([0, np.inf], law.x0, 1, "t"), ([0, 1], [1, 2, np.nan], 1, "x0"),
        ([0, 1], [1, 2], 1, "x0"), ([0, 1], 1.0, 1, "x0"), ([0, 1], np.ones((3, 2)), 1, "x0"),
        ([0, 1], law.x0, 0, "substeps"),
    ]:  # fmt: skip
        with pytest.raises(ValueError, match=f"^{name}: must (be|have)"):
            runge_kutta_4(law, t, x0, substeps)


def test_several_motions_are_integrated_at_once():
    law, t = SYSTEMS["SprottE"], np.linspace(0, 1, 5)
    starts = np.array([[-1.0, 1.0, 1.0], [0.5, 0.2, -1.0]])
    together = runge_kutta_4(law, t, starts)
    alone = [runge_kutta_4(law, t, x0) for x0 in starts]
    np.testing.assert_allclose(together, np.stack(alone, axis=1), rtol=1e-12)


def test_the_signature_of_a_benchmark_can_be_read():
    # Half of it is inherited: the reference resolves its annotations in this module.
    inspect.signature(Benchmark, eval_str=True)
