"""The paper's numbers, complete and as printed, and the systems that they are of."""

from dataclasses import replace

import numpy as np
import pytest

from vidsindy_lite.dynamics import runge_kutta_4
from vidsindy_lite.study.metrics import score
from vidsindy_lite.study.paper import (
    ABLATION,
    FLOWS,
    LAB,
    LAWS,
    MISPRINTS,
    REFERENCE_OFFSET,
    SCORES,
    SYSTEMS,
    SYSTEMS_S1,
)


def test_every_table_is_complete():
    assert list(SYSTEMS_S1) == list(SYSTEMS)
    methods = {"Table 1": ("Ours", "PySINDy"), "Table S3": ("Ours", "E-SINDy", "WeakSINDy")}
    rows = {(table, m, s) for table, ms in methods.items() for m in ms for s in SYSTEMS}
    assert SCORES.keys() == rows
    conditions = ("noise", "random block", "fiber missing")
    rows = {(c, rate, m) for c in conditions for rate in (10, 20) for m in ("Ours", "Model-A")}
    assert ABLATION.keys() == rows
    assert LAWS.keys() == {(m, s) for m in ("Ground truth", "Ours", "PySINDy") for s in SYSTEMS}
    for name in SYSTEMS:
        assert SCORES["Table 1", "Ours", name] == SCORES["Table S3", "Ours", name]
    for misprint in MISPRINTS:
        assert misprint["equation"] in LAWS[misprint["method"], misprint["system"]].names
    for row in (*SCORES.values(), *ABLATION.values()):
        for value in (row.l2, row.precision, row.recall):
            assert value == round(value, 4)  # the printed decimals
        assert row.terms_found == (row.recall == 1)


def test_spot_values():
    assert SCORES["Table 1", "PySINDy", "WangSun"].l2 == pytest.approx(8.5647)
    assert SCORES["Table S3", "WeakSINDy", "RayleighBenard"].false_positives == 9
    assert SCORES["Table S3", "E-SINDy", "SprottF"].recall == pytest.approx(0.9091)
    assert not SCORES["Table S3", "WeakSINDy", "Tsucs2"].terms_found
    assert ABLATION["fiber missing", 20, "Model-A"].precision == pytest.approx(0.6667)
    law = LAWS["Ours", "Tsucs2"]
    assert law.coefficients[law.terms.index("y"), 2] == -10.258
    assert LAB.error == pytest.approx(8.87, abs=0.005)


@pytest.mark.parametrize("name", SYSTEMS)
def test_table_s1_is_what_the_package_simulates(name):
    published, system = SYSTEMS_S1[name], SYSTEMS[name]
    assert published.x0 == system.x0
    assert score(published.law, system).l2 == 0


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_ground_truths_of_table_s2_are_the_shifted_systems(name):
    result = score(LAWS["Ground truth", name], SYSTEMS[name].shift(REFERENCE_OFFSET))
    assert result.exact
    printed = 2e-4 if name == "Lorenz" else 1e-14  # 2.667 for 8/3, the only rounded number
    assert result.max_coefficient_error < printed


@pytest.mark.parametrize(("systems", "count"), [(SYSTEMS, 7), (FLOWS, 12)])
def test_a_system_that_there_is_not_is_told_with_those_that_there_are(systems, count):
    with pytest.raises(KeyError, match="system: must be one of Lorenz, .*, got 'Lorentz'"):
        systems["Lorentz"]
    with pytest.raises(KeyError, match="got 3"):
        systems[3]
    assert "Lorentz" not in systems
    assert systems.get("Lorentz") is None
    assert len(systems) == len({**systems}) == count


def test_bad_steps_are_refused():
    law = SYSTEMS["Lorenz"]
    for t, x0, substeps, name in [
        ([0, np.inf], law.x0, 1, "t"), ([0, 1], [1, 2], 1, "x0"), ([0, 1], law.x0, 0, "substeps"),
    ]:  # fmt: skip
        with pytest.raises(ValueError, match=f"^{name}: must (be|have)"):
            runge_kutta_4(law, t, x0, substeps)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda law: replace(law, period=0), "period: must be positive"),
        (lambda law: replace(law, x0=(1, 2)), "x0: must be 3 finite numbers"),
        (lambda law: law.times(0), "n: must be an integer of at least 1, got 0"),
        (lambda law: law.trajectory(5, -1), "samples_per_period: must be positive, got -1"),
    ],
)
def test_bad_benchmarks_and_times_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make(SYSTEMS["Lorenz"])
