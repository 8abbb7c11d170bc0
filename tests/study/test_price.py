"""Wrong terms against the price of a term: cheap lets false ones in, dear loses true ones."""

import numpy as np

from vidsindy_lite.study.price import CHANCES, Case, price_curve, wrong_terms


def test_a_dear_term_is_lost_and_a_cheap_one_is_false():
    false, lost = np.sum([wrong_terms(Case(k, ((0.1, 300),)))[0] for k in (0, 1)], axis=0).T
    assert len(false) == len(CHANCES)
    assert (false[0], lost[0]) == (0, 1)
    assert (false[-1], lost[-1]) == (1, 0)


def test_a_law_that_is_seen_well_is_found_at_any_price():
    (counts,) = wrong_terms(Case(2, ((0.01, 400),)))
    assert counts[:-3] == [(0, 0)] * (len(CHANCES) - 3)


def test_the_curve_has_a_row_for_each_chance_and_condition():
    curve = price_curve(2, (0.1,), (100, 200), jobs=1)
    assert list(curve) == ["false alarm", "noise (%)", "samples", "false", "lost"]
    assert len(curve) == 2 * len(CHANCES)
    assert (curve[["false", "lost"]] >= 0).all(axis=None)
