"""Each baseline is what pysindy does when it is called by hand, with the threshold it chose."""

import numpy as np
import pysindy
import pytest

from vidsindy_lite.dynamics import smooth
from vidsindy_lite.study import baselines
from vidsindy_lite.study.baselines import BASELINES, RIDGE, WEAK_WIDTH, WEAK_WINDOWS
from vidsindy_lite.study.corruption import add_noise
from vidsindy_lite.study.metrics import score
from vidsindy_lite.study.paper import SYSTEMS

pytestmark = pytest.mark.slow  # fits ensembles

TRUTH = SYSTEMS["Lorenz"]
T, X = TRUTH.trajectory(500)


@pytest.fixture
def short_grid(monkeypatch):
    """Few thresholds, where the choice is not what is tested: a fifth of the time."""
    monkeypatch.setattr(baselines, "THRESHOLDS", (0.1, 0.3))


def by_hand(name, threshold):
    """A direct call of pysindy on clean Lorenz: its model, fitted."""
    library = pysindy.PolynomialLibrary(degree=3)
    optimizer = pysindy.STLSQ(threshold=threshold, alpha=RIDGE)
    if name == "PySINDy":
        return pysindy.SINDy(feature_library=library, optimizer=optimizer).fit(X, t=T)
    if name == "Model-A":
        spline = smooth([(T, X)], np.random.default_rng(0)).splines[0]
        model = pysindy.SINDy(feature_library=library, optimizer=optimizer)
        return model.fit(spline(T), t=T, x_dot=spline(T, 1))
    np.random.seed(0)  # noqa: NPY002
    if name == "E-SINDy":
        # The seed is set once, before the fits that choose the threshold: run through them.
        for h in (*baselines.THRESHOLDS, None):
            chosen = threshold if h is None else h
            bagging = pysindy.EnsembleOptimizer(
                pysindy.STLSQ(threshold=chosen, alpha=RIDGE), bagging=True, n_models=20
            )
            model = pysindy.SINDy(feature_library=library, optimizer=bagging)
            model.fit(X[:400] if h is not None else X, t=T[:400] if h is not None else T)
        return model
    weak = pysindy.WeakPDELibrary(
        function_library=library, spatiotemporal_grid=T, K=WEAK_WINDOWS,
        H_xt=WEAK_WIDTH / 2 * (T[-1] - T[0]),
    )  # fmt: skip
    return pysindy.SINDy(feature_library=weak, optimizer=optimizer).fit(X, t=T)


# Central differences at 100 samples a period are good for a percent; the weak form needs none.
@pytest.mark.parametrize(
    ("name", "most"), [("PySINDy", 2e-2), ("E-SINDy", 2e-2), ("WeakSINDy", 1e-5), ("Model-A", 1e-3)]
)
@pytest.mark.filterwarnings("ignore:.*axes labeled", "ignore:Sparsity parameter is too big")
def test_clean_lorenz_is_found_as_by_a_direct_call(name, most, monkeypatch, short_grid):
    chosen = []
    least_squares = baselines._least_squares
    monkeypatch.setattr(
        baselines, "_least_squares", lambda h, *r: (chosen.append(h), least_squares(h, *r))[1]
    )
    found = BASELINES[name](T, X)
    assert chosen[:-1] == list(baselines.THRESHOLDS)
    model = by_hand(name, chosen[-1])
    names = model.feature_library.get_feature_names(["x", "y", "z"])
    names = [term.replace(" ", "").replace("^", "") for term in names]
    ours = [term.replace("^", "") for term in found.terms]
    assert sorted(names) == sorted(ours)
    expected = model.coefficients().T[[names.index(term) for term in ours]]
    np.testing.assert_allclose(found.coefficients, expected, rtol=1e-9, atol=1e-12)
    result = score(found, TRUTH)
    assert result.exact
    assert result.l2 < most


def test_no_difference_is_taken_across_a_gap():
    # Two stretches of a straight line with a jump between them: one slope, if they are kept apart.
    t = np.arange(200) * 0.1
    x = np.stack([t, np.sin(t)], axis=1)
    x[150:] += [50, 0]
    x[140:150] = np.nan
    found = baselines.stlsq(t, x, degree=1)
    assert found.coefficients[found.terms.index("1"), 0] == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("name", ["E-SINDy", "WeakSINDy"])
def test_seeds_are_local_and_repeatable(name, short_grid):
    t, x = T[:300], add_noise(X[:300], 0.05, np.random.default_rng(0))
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    first, again, other = (BASELINES[name](t, x, seed=seed).coefficients for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


@pytest.mark.parametrize("name", BASELINES)
def test_bad_input(name, short_grid):
    method = BASELINES[name]
    with pytest.raises(ValueError, match="t: must increase"):
        method(T[::-1], X)
    with pytest.raises(ValueError, match="x: must hold 5 samples in a row"):
        method(T[:4], X[:4])
    with pytest.raises(ValueError, match="degree"):
        method(T, X, degree=-1)
    if name != "PySINDy":
        with pytest.raises(ValueError, match="seed: must be an integer of at least 0, got -1"):
            method(T, X, seed=-1)
