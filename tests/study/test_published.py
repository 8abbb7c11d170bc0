"""The paper's numbers: complete, as printed, and what they say of themselves."""

import numpy as np
import pytest

from vidsindy_lite.study.metrics import score
from vidsindy_lite.study.published import ABLATION, LAB, LAWS, MISPRINTS, SCORES, SYSTEMS_S1
from vidsindy_lite.study.systems import REFERENCE_OFFSET, SYSTEMS


def test_every_table_is_complete():
    assert list(SYSTEMS_S1) == list(SYSTEMS)
    methods = {"Table 1": ("Ours", "PySINDy"), "Table S3": ("Ours", "E-SINDy", "WeakSINDy")}
    rows = {(table, m, s) for table, ms in methods.items() for m in ms for s in SYSTEMS}
    assert SCORES.keys() == rows
    conditions = ("noise", "random block", "fiber missing")
    rows = {(c, rate, m) for c in conditions for rate in (10, 20) for m in ("Ours", "Model-A")}
    assert ABLATION.keys() == rows
    assert LAWS.keys() == {(m, s) for m in ("Ground truth", "Ours", "PySINDy") for s in SYSTEMS}


def test_spot_values():
    assert SCORES["Table 1", "PySINDy", "WangSun"].l2 == pytest.approx(8.5647)
    assert SCORES["Table S3", "WeakSINDy", "RayleighBenard"].false_positives == 9
    assert SCORES["Table S3", "E-SINDy", "SprottF"].recall == pytest.approx(0.9091)
    assert not SCORES["Table S3", "WeakSINDy", "Tsucs2"].terms_found
    assert ABLATION["fiber missing", 20, "Model-A"].precision == pytest.approx(0.6667)
    law = LAWS["Ours", "Tsucs2"]
    assert law.coefficients[law.terms.index("y"), 2] == -10.258
    assert LAB.error == pytest.approx(8.87, abs=0.005)


def test_ours_is_the_same_in_both_tables():
    for name in SYSTEMS:
        assert SCORES["Table 1", "Ours", name] == SCORES["Table S3", "Ours", name]


@pytest.mark.parametrize("row", [*SCORES.items(), *ABLATION.items()], ids=lambda row: str(row[0]))
def test_values_are_in_range_and_have_the_printed_decimals(row):
    _, published = row
    for value in (published.l2, published.precision, published.recall):
        assert value == round(value, 4)
    assert 0 < published.precision <= 1
    assert published.terms_found == (published.recall == 1)


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


@pytest.mark.parametrize("name", SYSTEMS)
def test_laws_have_the_printed_number_of_terms(name):
    terms = {
        "Lorenz": (13, 13), "SprottE": (8, 11), "RayleighBenard": (12, 13), "SprottF": (10, 10),
        "NoseHoover": (9, 12), "Tsucs2": (16, 16), "WangSun": (14, 15),
    }  # fmt: skip
    counted = tuple(np.count_nonzero(LAWS[m, name].coefficients) for m in ("Ours", "PySINDy"))
    assert counted == terms[name]


def test_misprints_point_at_laws():
    for misprint in MISPRINTS:
        assert misprint["equation"] in LAWS[misprint["method"], misprint["system"]].names
