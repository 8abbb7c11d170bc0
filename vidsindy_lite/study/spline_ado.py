"""The paper's own optimiser, as written: gradient descent alternating with STRidge (Eqs. S8-S9).

It stands beside `dynamics.discover`, to show what the formulation gives with the optimiser that the
paper describes. The formulation is the paper's: cubic B-splines with control points P and a
learnable offset, data loss at the measured times (Eq. 9a), physics loss at many random
collocation times (Eq. 9b), STRidge with an adaptive hard threshold for the coefficients, Adam on
(P, surviving coefficients, offset), an affine elimination of the offset (Eq. 10), and a small
value below which coefficients are cut at the end.

What the paper leaves open or, as the third, does otherwise, and what is done here:

* The curve is ``G P + offset`` in the data loss and ``G P`` in the library. With the offset in
  both, as one reading of the text has it, it changes nothing, for B-splines sum to one.
* Data are standardised (coordinates and time divided by their scale, undone at the end): one
  learning rate and one physics weight then serve all systems. The offset starts at the mean.
* The law is asked for where samples are, or in the next knot span, and not at all times: within a
  gap the first curve is a guess, to which physics would fit the law.
* Hyperparameters: see `spline_ado`. "PiSL" there is the public code of the same model by the
  same group (F. Sun, Y. Liu, H. Sun, "Physics-informed Spline Learning for Nonlinear Dynamics
  Discovery", IJCAI 2021), in its Lorenz example.

Gradients are written out; a test holds them against differences of the losses.
"""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array, diags_array, vstack
from scipy.sparse.linalg import spsolve

from .. import dynamics
from ..arrays import Floats, Ints
from ..checks import check_integer, check_number, check_times
from ..dynamics import DEGREE, PolynomialSystem, monomials

#: Weight of the second differences in the first curve: enough to carry it across gaps.
ROUGHNESS = 1e-4
REPORT = 50  #: Gradient steps between two entries of the history.
#: Ridge penalty of `stridge`; columns and derivatives are scaled to a root mean square of 1.
RIDGE = 1e-6
#: First threshold of `stridge` and its first step: root mean square of what a term contributes,
#: over that of the derivative.
THRESHOLD_STEP = 1e-2
THRESHOLDS = 100  #: Number of thresholds that `stridge` tries.
#: What Adam keeps of its means of gradients and of their squares, as its authors have it.
MEAN, SQUARE = 0.9, 0.999


@dataclass(frozen=True, eq=False)
class SplineADOLaw:
    """A law found by the paper's optimiser.

    Parameters
    ----------
    system : PolynomialSystem
        The law in the frame of the data, after the offset is eliminated (paper: Eq. 10).
    native : PolynomialSystem
        The law as it was fitted, in coordinates that start at ``offset``.
    offset : ndarray, shape (d,)
        ``Delta``, in units of the data.
    curve : ndarray, shape (n, d)
        The fitted curve at the given times, in units of the data.
    history : tuple of dict
        ``iteration`` (gradient steps so far), ``seconds``, ``data_loss`` and ``physics_loss``
        (both in standardised units) and ``terms``, in the order of the fit.
    """

    system: PolynomialSystem
    native: PolynomialSystem
    offset: Floats
    curve: Floats
    history: tuple[dict[str, float], ...]


@dataclass(frozen=True)
class SplineADOSettings:
    """Hyperparameters of `spline_ado`.

    Parameters
    ----------
    knots_per_sample : float
        Knot spans per sample. The paper does not say; PiSL: 2.5 at 20 samples a time unit.
    collocation_per_knot : int
        Random collocation times in each knot span. Paper: many more than samples; PiSL: 20 a
        span, 50 a sample, uniform over the whole record.
    physics_weight : float
        ``alpha``. The paper does not say; PiSL: 0.01 in the units of its Lorenz data, which is
        0.56 in ours. The default is what notebook 06 chooses on held-out samples.
    sparsity_weight : float
        ``beta``: what a term has to save of the relative error of the derivative. PiSL: 0.001
        times the condition number of the library, in a loss that grows with the number of times:
        about 0.008 here, for Lorenz. The default is chosen with ``physics_weight``.
    pretraining : int
        Gradient steps on all candidate terms before the first STRidge, starting at a spline fit
        and a least-squares regression. PiSL: 200,000 steps of Adamax from random numbers.
    alternations : int
        Largest number of alternations; it stops when the support no longer changes. PiSL: until
        the number of terms no longer falls, at least 5.
    epochs : int
        Adam steps in an alternation. PiSL: up to 20,000.
    learning_rate : float
        First learning rate, falling to a hundredth along a cosine. PiSL: 0.01 and then 0.05,
        divided by ten on each plateau.
    prune : float
        Coefficients of the final law below this magnitude, in units of the data, are cut. Paper:
        "a small value"; PiSL: 0.1.
    """

    knots_per_sample: float = 1.0
    collocation_per_knot: int = 5
    physics_weight: float = 1.0
    sparsity_weight: float = 0.005
    pretraining: int = 2000
    alternations: int = 5
    epochs: int = 1000
    learning_rate: float = 0.01
    prune: float = 0.1

    def __post_init__(self) -> None:
        least = {
            "knots_per_sample": 0.1, "collocation_per_knot": 1, "physics_weight": 0,
            "sparsity_weight": 0, "pretraining": 1, "alternations": 0, "epochs": 1,
            "learning_rate": 1e-12, "prune": 0,
        }  # fmt: skip
        for name, bound in least.items():
            value = getattr(self, name)
            if isinstance(getattr(type(self), name), int):
                check_integer(name, value, int(bound))
            elif check_number(name, value) < bound:
                raise ValueError(f"{name}: must be at least {bound}, got {value}")


def spline_ado(
    t: Floats, x: Floats, degree: int = 3, seed: int = 0, **settings: Any
) -> SplineADOLaw:
    """Discover a law with the paper's alternating direction optimisation (Eqs. 7-10, S8-S9).

    Parameters
    ----------
    t : array_like, shape (n,)
        Increasing times.
    x : array_like, shape (n, d)
        States; a row with a NaN is missing. No law is asked for within a gap.
    degree : int
        Highest degree of the candidate terms. Paper: 3.
    seed : int
        Of the collocation times and of the rows that STRidge holds out.
    **settings
        Fields of `SplineADOSettings`.

    Returns
    -------
    SplineADOLaw

    Raises
    ------
    ValueError
        If the input is malformed (see `dynamics.check_trajectory`), a coordinate does not move, or
        there are fewer samples than candidate terms, or a hyperparameter is too small.
    """
    chosen = SplineADOSettings(**settings)
    kept, seen = dynamics.check_trajectory(t, x)
    exponents = dynamics.monomial_exponents(seen.shape[1], degree)
    if len(kept) < len(exponents):
        raise ValueError(f"x: must hold at least {len(exponents)} samples, got {len(kept)}")
    if not (np.ptp(seen, axis=0) > 0).all():
        raise ValueError(f"x: every coordinate must move, got ranges {np.ptp(seen, axis=0)}")
    rng = np.random.default_rng(check_integer("seed", seed))
    fit = _Fit(check_times(t), np.asarray(x, dtype=float), exponents, chosen, rng)
    fit.descend(chosen.pretraining)
    for _ in range(chosen.alternations):
        before = fit.coefficients != 0
        curve, slopes = fit.collocation()
        fit.coefficients = stridge(monomials(curve, exponents), slopes, rng, chosen.sparsity_weight)
        settled = np.array_equal(fit.coefficients != 0, before)
        # Where the support is that of before, a last descent from the new coefficients ends it.
        fit.descend(chosen.epochs)
        if settled:
            break
    return fit.result()


def held_out_misfit(t: Floats, x: Floats, seed: int, **settings: Any) -> float:
    """How far the curve of `spline_ado` is from samples that it was not given, one in five.

    Parameters
    ----------
    t, x, **settings
        See `spline_ado`.
    seed : int
        Also of the samples that are held out, each by itself.

    Returns
    -------
    float
        Root mean square over the spread of each coordinate.
    """
    x = np.asarray(x, dtype=float)
    out = np.random.default_rng(seed).random(len(x)) < 0.2
    given = np.where(out[:, None], np.nan, x)
    law = spline_ado(t, given, 3, seed, **settings)
    off = (law.curve - x)[np.isnan(given[:, 0]) & ~np.isnan(x[:, 0])] / np.nanstd(x, axis=0)
    return float(np.sqrt((off**2).mean()))


class _Fit:
    """Spline, coefficients and offset in standardised units, with the paper's two losses."""

    def __init__(
        self, t: Floats, x: Floats, exponents: Ints, settings: SplineADOSettings,
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        self.began, self.iteration = time.perf_counter(), 0
        self.settings, self.exponents = settings, exponents
        self.history: list[dict[str, float]] = []
        spans = max(1, round(settings.knots_per_sample * (len(t) - 1)))
        breakpoints = np.linspace(t[0], t[-1], spans + 1)
        knots = dynamics.clamped_knots(breakpoints)
        seen = ~np.isnan(x).any(axis=1)
        centre, scale = x[seen].mean(axis=0), x[seen].std(axis=0)
        self.data = (x[seen] - centre) / scale
        self.everywhere = _sampling(knots, t)
        samples = self.everywhere[np.flatnonzero(seen)]
        self.control_points = _first_curve(samples, self.data)
        # Spans that hold samples, and their neighbours: there the law is asked for.
        held = np.zeros(spans, dtype=bool)
        held[dynamics.local_basis(knots, t[seen])[0]] = True
        held |= np.append(held[1:], False) | np.append(False, held[:-1])
        # The same number in every span: random in time, and all spans are treated alike.
        fractions = rng.uniform(size=(spans, settings.collocation_per_knot)).T
        times = (breakpoints[:-1] + fractions * np.diff(breakpoints))[:, held].ravel()
        nodes, slopes = _sampling(knots, times), _sampling(knots, times, order=1)
        pace = float(1 / (slopes @ self.control_points).std(axis=0).mean())
        self.units = dynamics.Units(centre, scale, time=pace)
        self.basis = csr_array(vstack([samples, nodes, slopes * pace]))
        self.turned = csr_array(self.basis.T)
        self.parts = [len(self.data), len(self.data) + len(times)]
        self.offset = np.zeros(x.shape[1])
        points, speed = self.collocation()
        self.coefficients = np.linalg.lstsq(monomials(points, exponents), speed, rcond=None)[0]
        lowered = exponents - np.eye(x.shape[1], dtype=int)[:, None]
        same = (lowered[:, None] == exponents[:, None]).all(axis=-1)
        self.derivatives = same * exponents.T[:, None]  # of all terms, in terms: (d, l, l)

    def collocation(self) -> tuple[Floats, Floats]:
        """Curve without offset and slope at the collocation times, each (k, d)."""
        _, points, slopes = np.split(self.basis @ self.control_points, self.parts)
        return points, slopes

    def losses(self) -> tuple[float, float, list[Floats]]:
        """Data and physics loss (paper: Eqs. 9a and 9b), and gradients of what is minimised.

        That is data loss + physics weight x physics loss; the gradients are by control points,
        coefficients (of the terms that the law has) and offset.
        """
        curve, points, slopes = np.split(self.basis @ self.control_points, self.parts)
        active = self.coefficients != 0
        # The terms of the law and all that divide them, which their derivatives need.
        terms = self.exponents[active.any(axis=1)]
        rows = np.flatnonzero((self.exponents[:, None] <= terms).all(axis=2).any(axis=1))
        law = self.coefficients[rows]
        products = monomials(points, self.exponents[rows])
        error, residual = curve + self.offset - self.data, slopes - products @ law
        miss = 2 / len(error) * error
        pull = 2 * self.settings.physics_weight / len(residual) * residual
        jacobian = self.derivatives[:, rows[:, None], rows] @ law
        by_point = np.stack([np.einsum("kl,kl->k", products @ part, pull) for part in jacobian], 1)
        by_coefficient = np.zeros_like(self.coefficients)
        by_coefficient[rows] = -products.T @ pull
        return (
            float((error**2).sum() / len(error)),
            float((residual**2).sum() / len(residual)),
            [
                self.turned @ np.concatenate([miss, -by_point, pull]),
                by_coefficient * active,
                miss.sum(axis=0),
            ],
        )

    def descend(self, steps: int) -> None:
        """Adam on control points, surviving coefficients and offset (paper: Eq. S9)."""
        unknowns = [self.control_points, self.coefficients, self.offset]
        means = [np.zeros_like(unknown) for unknown in unknowns]
        squares = [np.zeros_like(unknown) for unknown in unknowns]
        first = self.settings.learning_rate
        for step in range(steps):
            data_loss, physics_loss, gradients = self.losses()
            # From the first rate to a hundredth of it.
            rate = first * (0.01 + 0.99 * (1 + np.cos(np.pi * step / steps)) / 2)
            for unknown, mean, square, gradient in zip(
                unknowns, means, squares, gradients, strict=True
            ):
                mean += (1 - MEAN) * (gradient - mean)
                square += (1 - SQUARE) * (gradient**2 - square)
                size = np.sqrt(square / (1 - SQUARE ** (step + 1)))
                unknown -= rate / (1 - MEAN ** (step + 1)) * mean / (size + 1e-8)
            self.iteration += 1
            if step % REPORT == 0 or step == steps - 1:
                self.history.append({
                    "iteration": self.iteration, "seconds": time.perf_counter() - self.began,
                    "data_loss": data_loss, "physics_loss": physics_loss,
                    "terms": int(np.count_nonzero(self.coefficients)),
                })  # fmt: skip

    def result(self) -> SplineADOLaw:
        """Back to the units of the data, without the offset (paper: Eq. 10)."""
        names, centre = dynamics.variable_names(len(self.offset)), self.units.point(self.offset)
        curve = self.units.point(self.everywhere @ self.control_points + self.offset)
        coefficients = self.coefficients * self.units.factors(self.exponents)
        native = PolynomialSystem(names, self.exponents, coefficients)
        shifted = native.shift(centre)
        small = np.abs(shifted.coefficients) < self.settings.prune
        kept = np.where(small, 0.0, shifted.coefficients)
        system = PolynomialSystem(names, shifted.exponents, kept)
        return SplineADOLaw(system, native, centre, curve, tuple(self.history))


def _sampling(knots: Floats, t: Floats, order: int = 0) -> csr_array:
    """A spline or its derivative at times as a matrix (n, r), with four entries a row."""
    first, values = dynamics.local_basis(knots, t, order)
    rows, columns = np.arange(len(t)).repeat(DEGREE + 1), first[:, None] + np.arange(DEGREE + 1)
    shape = len(t), len(knots) - DEGREE - 1
    return csr_array((values.ravel(), (rows, columns.ravel())), shape)


def _first_curve(samples: csr_array, x: Floats) -> Floats:
    """Control points (r, d) of a spline through the data, smooth where there are none."""
    r = samples.shape[1]
    bend = diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(r - 2, r))
    normal = samples.T @ samples + ROUGHNESS * bend.T @ bend
    return np.asarray(spsolve(normal.tocsc(), samples.T @ x)).reshape(r, -1)


def stridge(
    library: Floats, derivative: Floats, rng: np.random.Generator, sparsity_weight: float = 5e-3
) -> Floats:
    """Sequentially thresholded ridge regression with an adaptive threshold (paper: Eq. S8).

    Ridge regression, columns below a threshold cut, again until none is. The threshold is raised
    while the loss on held-out rows, ``|residual| + sparsity_weight |coefficients|_0``, does not
    grow, else it goes back in smaller steps; a plain least squares on all rows ends it. So do Rudy
    et al. (2017), but the residual is a root mean square here, and the condition number is left
    out of the price of a term, which then means the same for any rows and library.

    Parameters
    ----------
    library : ndarray, shape (n, l)
        Candidate terms.
    derivative : ndarray, shape (n, d)
        Derivatives to explain, one column an equation, each treated alone.
    rng : numpy.random.Generator
        Draws the held-out rows.
    sparsity_weight : float
        Price of a term: what it has to save of the relative error of the derivative.

    Returns
    -------
    ndarray, shape (l, d)
        Sparse coefficients.

    Raises
    ------
    ValueError
        If the shapes disagree or there are too few rows to hold some out.

    References
    ----------
    S. H. Rudy, S. L. Brunton, J. L. Proctor, J. N. Kutz, "Data-driven discovery of partial
    differential equations", Science Advances 3, e1602614 (2017).
    """
    library, derivative = np.asarray(library, dtype=float), np.asarray(derivative, dtype=float)
    if library.ndim != 2 or derivative.ndim != 2 or len(library) != len(derivative):
        raise ValueError(
            "library and derivative: must have shapes (n, l) and (n, d), "
            f"got {library.shape} and {derivative.shape}"
        )
    n, terms = library.shape
    order = rng.permutation(n)
    held_out, training = order[: n // 5], order[n // 5 :]
    if not len(held_out) or len(training) < terms:
        raise ValueError(f"library: must hold at least {terms} training rows, got {n} rows in all")
    size, speed = _root_mean_square(library), _root_mean_square(derivative)
    scaled = library / size
    columns = [
        _stridge_column(scaled, target, training, held_out, sparsity_weight)
        for target in (derivative / speed).T
    ]
    return np.stack(columns, axis=1) * speed / size[:, None]


def _root_mean_square(columns: Floats) -> Floats:
    """Scale of each column; 1 for a column of zeros."""
    scale = np.sqrt((columns**2).mean(axis=0))
    return np.where(scale > 0, scale, 1.0)


def _stridge_column(
    scaled: Floats, target: Floats, training: Ints, held_out: Ints, price: float
) -> Floats:
    """Sparse coefficients of one equation, in scaled columns."""
    gram = scaled[training].T @ scaled[training] / len(training)
    pull = scaled[training].T @ target[training] / len(training)

    def loss(coefficients: Floats) -> float:
        residual = target[held_out] - scaled[held_out] @ coefficients
        return float(np.sqrt((residual**2).mean())) + price * np.count_nonzero(coefficients)

    best = _thresholded(gram, pull, 0.0)
    lowest, threshold, step = loss(best), THRESHOLD_STEP, THRESHOLD_STEP
    for _ in range(THRESHOLDS):
        trial = _thresholded(gram, pull, threshold)
        value = loss(trial)
        if value <= lowest:
            best, lowest = trial, value
        else:
            # Back to the last threshold that helped, and on in smaller steps (golden section).
            threshold = max(0.0, threshold - 2 * step)
            step /= 1.618
        threshold += step
    inside = np.flatnonzero(best)
    refit = np.zeros_like(best)
    refit[inside] = np.linalg.lstsq(scaled[:, inside], target, rcond=None)[0]
    return refit


def _thresholded(gram: Floats, pull: Floats, threshold: float) -> Floats:
    """Ridge regression; columns below the threshold are cut, again until none is."""
    support = np.ones(len(pull), dtype=bool)
    coefficients = np.zeros(len(pull))
    while support.any():
        inside = np.flatnonzero(support)
        damped = gram[np.ix_(inside, inside)] + RIDGE * np.eye(len(inside))
        coefficients[inside] = np.linalg.solve(damped, pull[inside])
        small = support & (np.abs(coefficients) < threshold)
        if not small.any():
            break
        support &= ~small
        coefficients[small] = 0.0
    return coefficients
