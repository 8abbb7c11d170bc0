"""The methods that the paper compares with, each as one call from a trajectory to a law.

PySINDy (sequentially thresholded least squares), E-SINDy and WeakSINDy run through ``pysindy``;
Model-A is the paper's ablation, a spline followed by SINDy. They work in the frame and the units
of their input. The paper does not say which thresholds it used, so they are chosen without the
truth: each method is fitted to the first 80 % of the record with every threshold of `THRESHOLDS`,
and of those whose error in the last 20 % is within 10 % of the lowest, the largest is fitted to
all of it. So coefficients below the least threshold are lost: units matter. Everything else is
pysindy's default, except for the ridge penalty (`RIDGE`) and the windows of the weak form
(`WEAK_WINDOWS`, `WEAK_WIDTH`).

The truth did enter once: the tolerance of that choice, the ridge penalty and the window width are
the best of several that were scored on the seven systems, which favours the baselines.

Missing rows never reach pysindy: the record is cut at gaps into segments, which share one law.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial

import numpy as np
import pysindy
from pysindy.optimizers import BaseOptimizer
from sklearn import config_context

from .. import dynamics
from ..arrays import Floats
from ..checks import check_integer
from ..dynamics import PolynomialSystem, Trajectory

#: Grid of thresholds: least magnitude of a coefficient, in the units of the data.
THRESHOLDS = tuple(np.geomspace(0.01, 10, 13))
#: Part of the record, from its beginning, that a threshold is fitted to before it is judged.
TRAINING = 0.8
TOLERANCE = 1.1  #: A held-out error of up to this many times the lowest is as good as the lowest.
#: Ridge penalty of the least squares, in the units of the library. pysindy's default of 0.05 is not
#: small beside the nearly collinear columns of a shifted cubic library, still less beside the short
#: integrals of the weak form. On clean data it leaves false terms at every threshold for some of
#: the systems; under noise neither value is better throughout.
RIDGE = 1e-9
#: A step longer than this many median steps is a gap; shorter ones are just uneven.
LONGEST_STEP = 3.0
#: Segments of fewer samples are left out: their differences are mostly one-sided.
SHORTEST_SEGMENT = 5
#: Windows of the weak form in a whole record; a part of it has its share of them.
WEAK_WINDOWS = 500
#: Full width of a weak window over the length of the record. Half of pysindy's default: alike on
#: clean data, better under noise, erratic all the same.
WEAK_WIDTH = 0.05

#: Values of the candidate terms (k, l) and of the derivatives (k, d): a linear regression.
Rows = tuple[Floats, Floats]


def stlsq(t: Floats, x: Floats, degree: int = 3) -> PolynomialSystem:
    """PySINDy: central differences, then sequentially thresholded least squares.

    Parameters
    ----------
    t : array_like, shape (n,)
        Increasing times.
    x : array_like, shape (n, d)
        States; a row with a NaN is missing.
    degree : int
        Highest degree of the candidate terms.

    Returns
    -------
    PolynomialSystem
        The law in the frame of the data.

    Raises
    ------
    ValueError
        If the input is malformed (see `dynamics.check_trajectory`) or there are too few samples
        between gaps.

    References
    ----------
    S. L. Brunton, J. L. Proctor, J. N. Kutz, PNAS 113, 3932 (2016).
    """
    return _discover(t, x, degree, _difference_rows, _least_squares)


def ensemble(t: Floats, x: Floats, degree: int = 3, seed: int = 0) -> PolynomialSystem:
    """E-SINDy: the median of 20 fits like `stlsq` to resampled rows (bagging).

    Parameters
    ----------
    t, x, degree
        See `stlsq`.
    seed : int
        Of the resampling.

    References
    ----------
    U. Fasel, J. N. Kutz, B. W. Brunton, S. L. Brunton, Proc. R. Soc. A 478, 20210904 (2022).
    """

    def bagged(threshold: float) -> BaseOptimizer:
        # A new one for every fit: it would add the models of the last fit to those of this one.
        return pysindy.EnsembleOptimizer(_least_squares(threshold), bagging=True, n_models=20)

    with _numpy_seed(seed):
        return _discover(t, x, degree, _difference_rows, bagged)


def weak(t: Floats, x: Floats, degree: int = 3, seed: int = 0) -> PolynomialSystem:
    """WeakSINDy: integrals over random windows in place of derivatives.

    The result changes with the windows: report several seeds.

    Parameters
    ----------
    t, x, degree
        See `stlsq`.
    seed : int
        Of the windows.

    References
    ----------
    D. A. Messenger, D. M. Bortz, Multiscale Model. Simul. 19, 1474 (2021).
    """
    t, x = dynamics.check_trajectory(t, x)
    rows = partial(_weak_rows, half_width=WEAK_WIDTH / 2 * (t[-1] - t[0]), total=len(t))
    with _numpy_seed(seed):
        return _discover(t, x, degree, rows, _least_squares)


def model_a(t: Floats, x: Floats, degree: int = 3, seed: int = 0) -> PolynomialSystem:
    """The paper's Model-A: a cubic spline and its slope, then SINDy (paper: Table 2).

    The spline smooths as much as generalised cross-validation asks for; on clean data it
    interpolates. Nothing of the law flows back into the spline.

    Parameters
    ----------
    t, x, degree
        See `stlsq`.
    seed : int
        Of the probes in the cross-validation.
    """
    rows = partial(_spline_rows, seed=check_integer("seed", seed))
    return _discover(t, x, degree, rows, _least_squares)


#: The baselines by the names of the paper's tables; all are called as ``method(t, x)``.
BASELINES: dict[str, Callable[..., PolynomialSystem]] = {
    "PySINDy": stlsq,
    "E-SINDy": ensemble,
    "WeakSINDy": weak,
    "Model-A": model_a,
}


def candidates(t: Floats, x: Floats, degree: int = 3, seed: int = 0) -> list[PolynomialSystem]:
    """The laws of PySINDy and of Model-A with many thresholds, on the whole record, each once.

    From these an oracle can choose, which no user has: see `scoreboard`. As it needs no held-out
    error, smaller thresholds than those of `THRESHOLDS` do it no harm.

    Parameters
    ----------
    t, x, degree, seed
        See `stlsq` and `model_a`.
    """
    t, x = dynamics.check_trajectory(t, x)
    library = pysindy.PolynomialLibrary(degree=degree).fit(x)
    segments = _segments((t, x), LONGEST_STEP * dynamics.typical_step([(t, x)]))
    found = [
        _fit(_least_squares(threshold), rows)
        for rows in (_difference_rows(segments, library), _spline_rows(segments, library, seed))
        for threshold in np.geomspace(1e-5, 10, 25)
    ]
    distinct = {coefficients.tobytes(): coefficients for coefficients in found}
    names = dynamics.variable_names(x.shape[1])
    return [PolynomialSystem(names, library.powers_, one) for one in distinct.values()]


def _discover(
    t: Floats,
    x: Floats,
    degree: int,
    rows: Callable[[Sequence[Trajectory], pysindy.PolynomialLibrary], Rows],
    optimizer: Callable[[float], BaseOptimizer],
) -> PolynomialSystem:
    """Choose a threshold on the last part of the record and fit all of it."""
    t, x = dynamics.check_trajectory(t, x)
    library = pysindy.PolynomialLibrary(degree=degree).fit(x)
    split = int(TRAINING * len(t))
    step = LONGEST_STEP * dynamics.typical_step([(t, x)])
    everything, training, held_out = (
        rows(_segments((t[part], x[part]), step), library)
        for part in (slice(None), slice(split), slice(split, None))
    )
    errors = np.array([_error(_fit(optimizer(h), training), held_out) for h in THRESHOLDS])
    chosen = THRESHOLDS[np.flatnonzero(errors <= TOLERANCE * errors.min())[-1]]
    coefficients = _fit(optimizer(chosen), everything)
    return PolynomialSystem(dynamics.variable_names(x.shape[1]), library.powers_, coefficients)


def _segments(record: Trajectory, longest_step: float) -> list[Trajectory]:
    """The stretches between gaps that are long enough to be differentiated."""
    segments = [s for s in dynamics.cut(record, longest_step) if len(s[0]) >= SHORTEST_SEGMENT]
    if not segments:
        raise ValueError(
            f"x: must hold {SHORTEST_SEGMENT} samples in a row, both in its first {TRAINING:.0%} "
            f"and in the rest, got {len(record[0])} samples without such a stretch in one of them"
        )
    return segments


def _error(coefficients: Floats, rows: Rows) -> float:
    """Root mean square error of the derivatives over their spread, all equations alike."""
    terms, derivatives = rows
    squares = ((derivatives - terms @ coefficients) ** 2).mean(axis=0)
    spread = np.maximum(derivatives.var(axis=0), np.finfo(float).tiny)
    return float(np.sqrt((squares / spread).mean()))


def _least_squares(threshold: float) -> BaseOptimizer:
    # Scikit-learn's ridge regression checks its arguments for longer than such small regressions
    # take: a fit is handed to it in a dozen parts.
    return pysindy.STLSQ(threshold=threshold, alpha=RIDGE, ridge_kw={"check_input": False})


def _fit(optimizer: BaseOptimizer, rows: Rows) -> Floats:
    # Also without the other checks of arguments.
    unchecked = config_context(skip_parameter_validation=True, assume_finite=True)
    with unchecked, warnings.catch_warnings():
        # A threshold above all coefficients is a normal member of the grid.
        warnings.filterwarnings("ignore", "Sparsity parameter is too big")
        warnings.filterwarnings("ignore", "STLSQ did not converge")
        return optimizer.fit(*rows).coef_.T


def _difference_rows(segments: Sequence[Trajectory], library: pysindy.PolynomialLibrary) -> Rows:
    curves, differences = [x for _, x in segments], pysindy.FiniteDifference()
    slopes = [differences(x, t) for t, x in segments]
    return np.asarray(library.transform(np.concatenate(curves))), np.concatenate(slopes)


def _spline_rows(
    segments: Sequence[Trajectory], library: pysindy.PolynomialLibrary, seed: int
) -> Rows:
    splines = dynamics.smooth(segments, np.random.default_rng(seed)).splines
    curves = [spline(times) for spline, (times, _) in zip(splines, segments, strict=True)]
    slopes = [spline(times, 1) for spline, (times, _) in zip(splines, segments, strict=True)]
    return np.asarray(library.transform(np.concatenate(curves))), np.concatenate(slopes)


def _weak_rows(
    segments: Sequence[Trajectory],
    library: pysindy.PolynomialLibrary,
    half_width: float,
    total: int,
) -> Rows:
    """The weak form of every segment: pysindy's takes one grid, so each has a library.

    A segment has its share of the windows among the samples of the whole record, ``total``.
    """
    terms, derivatives = [], []
    for t, x in segments:
        # A window has to be smaller than its segment.
        fitting = min(half_width, 0.49 * (t[-1] - t[0]))
        windows = max(1, round(WEAK_WINDOWS * len(t) / total))
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".*axes labeled for array")
            weak_library = pysindy.WeakPDELibrary(
                function_library=library, spatiotemporal_grid=t, K=windows, H_xt=fitting
            )
            states = pysindy.AxesArray(x, {"ax_time": 0, "ax_coord": 1})
            terms.append(np.asarray(weak_library.fit_transform([states])[0]))
        derivatives.append(np.asarray(weak_library.convert_u_dot_integral(states)))
    return np.concatenate(terms), np.concatenate(derivatives)


@contextmanager
def _numpy_seed(seed: int) -> Iterator[None]:
    """Seed numpy's global generator, which pysindy draws from, and put it back after."""
    before = np.random.get_state()  # noqa: NPY002
    np.random.seed(check_integer("seed", seed))  # noqa: NPY002
    try:
        yield
    finally:
        np.random.set_state(before)  # noqa: NPY002
