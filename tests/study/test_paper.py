"""The paper's numbers, complete and as printed, and the systems that they are of."""

from dataclasses import replace

import pytest

from vidsindy_lite.study.metrics import score
from vidsindy_lite.study.paper import (
    FLOWS,
    LAWS,
    REFERENCE_OFFSET,
    SYSTEMS,
    SYSTEMS_S1,
)


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
