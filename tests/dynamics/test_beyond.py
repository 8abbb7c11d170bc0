"""Laws that are approximations along their data are doubted, and true laws are not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vidsindy_lite.dynamics import Library, discover, monomial_exponents
from vidsindy_lite.dynamics.diagnostics import Beyond, _higher
from vidsindy_lite.study.scoreboard import OdeContest

TIMES = np.linspace(0, 20, 600)
WORDS = "terms that the law has not explain what it leaves"


def swung(pull, start):
    """Positions of a body that a law of second order moves."""
    rate = lambda _, s: [s[1], pull(s[0], s[1])]  # noqa: E731
    return solve_ivp(rate, (0, TIMES[-1]), [start, 0], t_eval=TIMES, rtol=1e-9, atol=1e-10).y[:1].T


def noisy(x, share, seed=0):
    return x + share * x.std() * np.random.default_rng(seed).standard_normal(x.shape)


OUTSIDE = {
    "sine": (lambda x, v: -9.81 * np.sin(x) - 0.2 * v, 1.6),
    "rational": (lambda x, v: -3 * x / (1 + x**2) - 0.05 * v, 2.0),
    "exponential": (lambda x, v: -2 * (1 - np.exp(-x)) * np.exp(-x) - 0.03 * v, 1.2),
}
INSIDE = {
    "Duffing": (lambda x, v: x - x**3 - 0.1 * v, 1.5),
    "Van der Pol": (lambda x, v: -x + 1.5 * (1 - x**2) * v, 0.5),
    "spring": (lambda x, v: -4 * x - 0.1 * v, 1.5),
}


@pytest.mark.parametrize(
    ("name", "share"), [("sine", 0.0), *((name, 0.01) for name in OUTSIDE), ("rational", 0.05)]
)
def test_a_cubic_for_another_function_is_doubted(name, share):
    found = discover(TIMES, noisy(swung(*OUTSIDE[name]), share), order=2)
    assert found.status == "suspect"
    if name == "sine":
        said = [warning for warning in found.warnings if WORDS in warning]
        assert said
        assert share or "x^5 in dvx/dt" in said[0]  # with noise, chance has a say in which


@pytest.mark.parametrize("share", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("name", INSIDE)
def test_a_true_law_is_not(name, share):
    found = discover(TIMES, noisy(swung(*INSIDE[name]), share, seed=3), order=2)
    assert not any(WORDS in warning for warning in found.warnings)


@pytest.mark.parametrize(("number", "status"), [(4, "suspect"), (13, "suspect"), (21, "suspect"),
                                                (2, "ok"), (12, "ok"), (17, "ok")])  # fmt: skip
def test_a_way_to_rest_on_a_line_is_doubted_where_higher_terms_explain_what_is_left(number, status):
    data = OdeContest(number).data()  # an exponential, a sine, a fraction; and three cubics
    assert discover(data.t, data.x).status == status


def test_many_terms_that_explain_all_are_no_reason_to_doubt():
    few = Beyond(gain=9.5, count=2, best=0.1, tried=5, left=10.0, term="x^4 in dx/dt")
    assert few.decisive
    assert not replace(few, gain=8.5).decisive
    assert not replace(few, count=3).decisive  # ten errors that are left are many for two terms


def test_one_term_that_explains_all_is_a_reason_where_chance_would_share_it_out():
    one = Beyond(gain=0.0, count=0, best=9.5, tried=5, left=10.0, term="x^3 in dx/dt")
    assert one.decisive
    assert not replace(one, best=8.9).decisive
    assert not replace(one, best=2.85, left=3.0).decisive  # of three errors one is often that large
    assert not replace(one, tried=100_000).decisive


def test_a_small_term_that_an_integrator_hides_is_missed_aloud():
    data = OdeContest(8, start=1).data()  # growth with an Allee effect, of which x^3 is 2 %
    found = discover(data.t, data.x)
    assert found.status == "suspect"
    assert "x^3 in dx/dt" in " ".join(found.warnings)


def test_a_rival_of_higher_degree_is_told():
    data = OdeContest(16, noise=0.02).data()  # of degree five, which a cubic imitates
    found = discover(data.t, data.x)
    assert "x^5" in " ".join(w for w in found.warnings if "another law may" in w)


def test_a_polynomial_of_a_library_of_fractions_is_asked_for_more_as_well():
    data = OdeContest(14, start=1).data()  # a fraction, too small to be seen where x is large
    found = discover(data.t, data.x, library=Library.polynomial(3) + Library.rational(1))
    assert any(WORDS in warning for warning in found.warnings)


@pytest.mark.parametrize(("degree", "status"), [(1, "suspect"), (3, "ok")])
def test_a_numerator_that_lacks_a_term_is_no_motion_that_is_kicked(degree, status):
    """Drag over 1 + x^2 needs x^2 vx there; without it, what is missed looks like kicks."""
    paths = [swung(lambda x, v: -3 * x / (1 + x**2) - 0.1 * v, start) for start in (3.0, 1.5)]
    runs = [(TIMES, noisy(x, 0.01, seed)) for seed, x in enumerate(paths)]
    library = Library.polynomial(degree) + Library.rational(2)
    found = discover(runs, library=library, order=2)
    assert found.status == status
    if status == "suspect":
        assert any(f"{WORDS} (x^2 vx in dvx/dt" in warning for warning in found.warnings)
    else:
        assert found.system.text(1) == "x'' = (-3 x - 0.1 vx - 0.1 x^2 vx) / (1 + x^2)"


def test_a_function_that_is_a_monomial_is_no_rival_of_itself():
    pull = {"pull": lambda x: x, "slow": lambda vx: vx}
    x = noisy(swung(INSIDE["spring"][0], 1.5), 0.02)
    found = discover(TIMES, x, order=2, library=Library.terms(pull))
    assert found.system.text(1) == "x'' = -4 pull - 0.1 slow"
    assert found.status == "ok"


def test_a_degree_that_is_too_low_is_told():
    x = noisy(swung(lambda x, v: -4 * x - 0.2 * x**3 - 0.1 * v, 1.5), 0.01)
    found = discover(TIMES, x, order=2, library=Library.polynomial(1))
    assert any(WORDS in warning for warning in found.warnings)


def test_the_wider_library_keeps_the_old_one_and_within_the_budget():
    cubic = monomial_exponents(3, 3)
    wide = _higher(cubic, 3, 1000)
    assert (wide[: len(cubic)] == cubic).all()
    assert len(wide) == len(monomial_exponents(3, 5))
    pairs, single = _higher(cubic, 3, 30), _higher(cubic, 3, 6)
    assert ((pairs[len(cubic) :] > 0).sum(axis=1) <= 2).all()
    assert len(single) == len(cubic) + 6
    assert _higher(cubic, 3, 5) is cubic
