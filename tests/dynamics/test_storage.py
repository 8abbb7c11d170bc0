"""Laws with functions of one's own, written and read: a file holds their names and some values."""

import json

import numpy as np
import pytest

import vidsindy_lite as vl
from vidsindy_lite import Library, PolynomialSystem

T = np.linspace(0, 20, 400)
HELD = Library.terms({"restoring": lambda x: np.sin(x), "away": lambda x: 1 / (4 - x)})


@pytest.fixture(scope="module")
def pendulum():
    """A pendulum's law among two functions, of which it has one."""
    terms = {"x": {"vx": 1.0}, "vx": {"sin(x)": -9.81, "vx": -0.1}}
    law = PolynomialSystem.from_terms(terms, library=Library.polynomial(1) + Library.fourier(1))
    x = law.simulate(T, [1.5, 0.0])[:, :1]
    x += 0.01 * x.std() * np.random.default_rng(0).normal(size=x.shape)
    found = vl.discover(T, x, order=2, library=Library.polynomial(1) + HELD)
    used = found.system.exponents[found.system.support.any(axis=1), 2:].any(axis=0)
    assert used.tolist() == [True, False]
    return found


def test_another_function_of_the_same_name_is_refused(pendulum, tmp_path):
    pendulum.save(tmp_path / "law")
    for other in (lambda x: np.tanh(x), lambda x: 1.001 * np.sin(x), lambda x: x * np.nan):
        with pytest.raises(ValueError, match="library: .* function 'restoring' that the law was"):
            vl.Discovery.load(tmp_path / "law", Library.terms({"restoring": other}))
    # What a file of an earlier version does not hold is not compared.
    content = json.loads((tmp_path / "law").read_text())
    del content["functions"]
    (tmp_path / "old").write_text(json.dumps(content))
    assert vl.Discovery.load(tmp_path / "old", HELD).equations() == pendulum.equations()


def test_functions_that_the_law_has_not_may_be_missing(pendulum, tmp_path):
    pendulum.save(tmp_path / "law")
    again = vl.Discovery.load(tmp_path / "law", Library.terms({"restoring": lambda x: np.sin(x)}))
    state = np.array([[0.3, 1.0], [-1.0, 0.5]])
    np.testing.assert_array_equal(again.predict(state), pendulum.predict(state))
    np.testing.assert_array_equal(again.system.gradient(state), pendulum.system.gradient(state))
    np.testing.assert_array_equal(again.simulate(state[0], T).x, pendulum.simulate(state[0], T).x)
    assert again.equations() == pendulum.equations()
    assert np.isnan(again.system.library(state)[:, again.terms.index("away")]).all()
    assert str(again).startswith(pendulum.equations())
    again.save(tmp_path / "copy")
    assert str(vl.Discovery.load(tmp_path / "copy", HELD)) == str(pendulum)
