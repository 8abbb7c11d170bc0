"""The paper's own optimiser, as written: gradient descent alternating with STRidge (Eqs. S8-S9).

It stands beside `dynamics.discover`, to show what the formulation gives with the optimiser that the
paper describes. The formulation is the paper's: cubic B-splines with control points P and a
learnable offset, data loss at the measured times (Eq. 9a), physics loss at many random
collocation times (Eq. 9b), STRidge with an adaptive hard threshold for the coefficients, Adam on
(P, surviving coefficients, offset), an affine elimination of the offset (Eq. 10), and a small
value below which coefficients are cut at the end.

Three things the paper leaves open and what is done here:

* The curve is ``G P + offset`` in the data loss and ``G P`` in the library. With the offset in
  both, as one reading of the text has it, it changes nothing, for B-splines sum to one.
* Data are standardised (coordinates and time divided by their scale, undone at the end): one
  learning rate and one physics weight then serve all systems. The offset starts at the mean.
* Hyperparameters: see `discover_paper`. "PiSL" there is the public code of the same model by the
  same group (F. Sun, Y. Liu, H. Sun, "Physics-informed Spline Learning for Nonlinear Dynamics
  Discovery", IJCAI 2021), in its Lorenz example.

PyTorch works in double precision: a cubic library is nearly collinear, and on a CPU single
precision saves no more than a third of the time.
"""

import time
from dataclasses import dataclass

import numpy as np
import torch
from scipy.linalg import solveh_banded

from ..arrays import Floats, Ints
from ..checks import check_integer
from ..dynamics import (
    DEGREE,
    PolynomialSystem,
    Units,
    check_trajectory,
    clamped_knots,
    local_basis,
    monomial_exponents,
    monomials,
    variable_names,
)

ROUGHNESS = 1e-4
"""Weight of the second differences in the first curve: enough to carry it across gaps."""
REPORT = 50
"""Gradient steps between two entries of the history."""
RIDGE = 1e-6
"""Ridge penalty of `stridge`; columns and derivatives are scaled to a root mean square of 1."""
THRESHOLD_STEP = 1e-2
"""First threshold of `stridge` and its first step: root mean square of what a term contributes,
over that of the derivative."""
THRESHOLDS = 100
"""Number of thresholds that `stridge` tries."""


@dataclass(frozen=True, eq=False)
class PaperDiscovery:
    """A law found by the paper's optimiser.

    Parameters
    ----------
    system : PolynomialSystem
        The law in the frame of the data, after the offset is eliminated (paper: Eq. 10).
    native : PolynomialSystem
        The law as it was fitted, in coordinates that start at ``offset``.
    offset : ndarray, shape (d,)
        ``Delta``, in units of the data.
    history : tuple of dict
        ``iteration`` (gradient steps so far), ``seconds``, ``data_loss`` and ``physics_loss``
        (both in standardised units) and ``terms``, in the order of the fit.
    """

    system: PolynomialSystem
    native: PolynomialSystem
    offset: Floats
    history: tuple[dict[str, float], ...]


@dataclass(frozen=True)
class PaperSettings:
    """Hyperparameters of `discover_paper`.

    Parameters
    ----------
    knots_per_sample : float
        Knot spans per sample. The paper does not say; PiSL: 2.5 at 20 samples a time unit.
    collocation_per_knot : int
        Random collocation times in each knot span. Paper: many more than samples; PiSL: 20 a
        span, 50 a sample, uniform over the whole record.
    physics_weight : float
        ``alpha``. The paper does not say; PiSL: 0.01 in the units of its Lorenz data, which is
        0.56 in ours.
    sparsity_weight : float
        ``beta``: what a term has to save of the relative error of the derivative. PiSL: 0.001
        times the condition number of the library, in a loss that grows with the number of times:
        about 0.008 here, for Lorenz. Ours is the best of four tried on Lorenz, with its truth.
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
    sparsity_weight: float = 5e-3
    pretraining: int = 2000
    alternations: int = 5
    epochs: int = 1000
    learning_rate: float = 0.01
    prune: float = 0.1

    def __post_init__(self) -> None:
        least = {"knots_per_sample": 0.1, "collocation_per_knot": 1, "pretraining": 1, "epochs": 1}
        for name, bound in least.items():
            if not getattr(self, name) >= bound:
                raise ValueError(f"{name}: must be at least {bound}, got {getattr(self, name)}")


def discover_paper(
    t: Floats, x: Floats, degree: int = 3, seed: int = 0, **settings: float
) -> PaperDiscovery:
    """Discover a law with the paper's alternating direction optimisation (Eqs. 7-10, S8-S9).

    Parameters
    ----------
    t : array_like, shape (n,)
        Increasing times.
    x : array_like, shape (n, d)
        States; a row with a NaN is missing. The spline runs on through a gap, held by physics.
    degree : int
        Highest degree of the candidate terms. Paper: 3.
    seed : int
        Of the collocation times and of the rows that STRidge holds out.
    **settings
        Fields of `PaperSettings`.

    Returns
    -------
    PaperDiscovery

    Raises
    ------
    ValueError
        If the input is malformed (see `dynamics.check_trajectory`), a coordinate does not move, or
        there are fewer samples than candidate terms, or a hyperparameter is too small.
    """
    chosen = PaperSettings(**settings)  # type: ignore[arg-type]
    t, x = check_trajectory(t, x)
    exponents = monomial_exponents(x.shape[1], degree)
    if len(t) < len(exponents):
        raise ValueError(f"x: must hold at least {len(exponents)} samples, got {len(t)}")
    if not (np.ptp(x, axis=0) > 0).all():
        raise ValueError(f"x: every coordinate must move, got ranges {np.ptp(x, axis=0)}")
    rng = np.random.default_rng(check_integer("seed", seed))
    fit = _Fit(t, x, exponents, chosen, rng)
    fit.descend(chosen.pretraining, chosen.learning_rate)
    for _ in range(chosen.alternations):
        before = fit.active
        curve, slope = fit.collocation()
        terms = monomials(curve, exponents)
        fit.restart(stridge(terms, slope, rng, chosen.sparsity_weight))
        fit.descend(chosen.epochs, chosen.learning_rate)
        if (fit.active == before).all():
            break
    return fit.result(chosen.prune)


class _Fit:
    """Spline, coefficients and offset in standardised units, with the paper's two losses."""

    def __init__(
        self, t: Floats, x: Floats, exponents: Ints, settings: PaperSettings,
        rng: np.random.Generator,
    ) -> None:  # fmt: skip
        self.began = time.perf_counter()
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.exponents = exponents
        self.physics_weight = settings.physics_weight
        self.history: list[dict[str, float]] = []
        self.iteration = 0
        centre, scale = x.mean(axis=0), x.std(axis=0)
        spans = max(1, round(settings.knots_per_sample * (len(t) - 1)))
        breakpoints = np.linspace(t[0], t[-1], spans + 1)
        knots = clamped_knots(breakpoints)
        first, values = local_basis(knots, t)
        control = _first_curve(first, values, (x - centre) / scale, spans + DEGREE)

        # The same number in every span: random in time, and products become small and batched.
        fractions = rng.uniform(size=(spans, settings.collocation_per_knot))
        random_times = breakpoints[:-1, None] + fractions * np.diff(breakpoints)[:, None]
        basis, slopes = (
            local_basis(knots, random_times.ravel(), order)[1].reshape(*fractions.shape, DEGREE + 1)
            for order in (0, 1)
        )
        slope = _curve(torch.tensor(slopes), torch.tensor(control)).numpy()
        self.units = Units(centre, scale, time=float(1 / slope.std(axis=0).mean()))
        self.data = self._tensor((x - centre) / scale)
        touched = first[:, None] + np.arange(DEGREE + 1)
        self.sample_control = torch.tensor(touched, device=self.device)
        self.sample_basis = self._tensor(values)[:, :, None]
        self.basis = self._tensor(basis)
        self.slopes = self._tensor(slopes * self.units.time)
        self.control_points = self._tensor(control).requires_grad_()
        self.offset = self._tensor(np.zeros(x.shape[1])).requires_grad_()
        curve, slope = self.collocation()
        fitted = np.linalg.lstsq(monomials(curve, exponents), slope, rcond=None)[0]
        self.restart(fitted.astype(float))

    def _tensor(self, array: Floats) -> torch.Tensor:
        return torch.tensor(array, dtype=torch.float64, device=self.device)

    def restart(self, coefficients: Floats) -> None:
        """Set the coefficients; from now on only those that are not zero are learned."""
        self.active = coefficients != 0
        self.mask = self._tensor(self.active)
        self.coefficients = self._tensor(coefficients).requires_grad_()

    def collocation(self) -> tuple[Floats, Floats]:
        """Curve without offset and its slope at the collocation times, each (k, d)."""
        curve, slope = (_curve(b, self.control_points) for b in (self.basis, self.slopes))
        return curve.numpy(force=True), slope.numpy(force=True)

    def losses(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Data loss and physics loss (paper: Eqs. 9a and 9b)."""
        measured = (self.control_points[self.sample_control] * self.sample_basis).sum(dim=1)
        data_loss = ((measured + self.offset - self.data) ** 2).sum(dim=1).mean()
        curve = _curve(self.basis, self.control_points)
        rows = np.flatnonzero(self.active.any(axis=1))
        terms = _monomials(curve, self.exponents[rows])
        law = terms @ (self.coefficients * self.mask)[rows]
        physics_loss = ((_curve(self.slopes, self.control_points) - law) ** 2).sum(dim=1).mean()
        return data_loss, physics_loss

    def descend(self, steps: int, learning_rate: float) -> None:
        """Adam on control points, surviving coefficients and offset (paper: Eq. S9)."""
        unknowns = [self.control_points, self.coefficients, self.offset]
        optimiser = torch.optim.Adam(unknowns, lr=learning_rate)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(
            optimiser, steps, eta_min=learning_rate / 100
        )
        for step in range(steps):
            optimiser.zero_grad()
            data_loss, physics_loss = self.losses()
            (data_loss + self.physics_weight * physics_loss).backward()
            optimiser.step()
            schedule.step()
            self.iteration += 1
            if step % REPORT == 0 or step == steps - 1:
                self.history.append(
                    {
                        "iteration": self.iteration,
                        "seconds": time.perf_counter() - self.began,
                        "data_loss": float(data_loss.detach()),
                        "physics_loss": float(physics_loss.detach()),
                        "terms": int(self.active.sum()),
                    }
                )

    def result(self, prune: float) -> PaperDiscovery:
        """Back to the units of the data, without the offset (paper: Eq. 10)."""
        units, exponents = self.units, self.exponents
        standard = (self.coefficients * self.mask).numpy(force=True)
        offset = units.point(self.offset.numpy(force=True))
        names = variable_names(len(offset))
        native = PolynomialSystem(names, exponents, standard * units.factors(exponents))
        shifted = native.shift(offset)
        kept = np.where(np.abs(shifted.coefficients) < prune, 0.0, shifted.coefficients)
        system = PolynomialSystem(names, shifted.exponents, kept)
        return PaperDiscovery(system, native, offset, tuple(self.history))


def _curve(basis: torch.Tensor, control_points: torch.Tensor) -> torch.Tensor:
    """A spline at times given span by span: (m, q, 4) and (m + 3, d) to (m q, d)."""
    windows = control_points.unfold(0, DEGREE + 1, 1).transpose(1, 2)
    return (basis @ windows).reshape(-1, control_points.shape[1])


def _monomials(x: torch.Tensor, exponents: Ints) -> torch.Tensor:
    """Monomials of points (n, d), shape (n, l): as `polynomials.monomials`, for autograd."""
    columns = x.unbind(1)
    products: dict[tuple[int, ...], torch.Tensor] = {(): torch.ones_like(x[:, 0])}
    products |= {(i,): column for i, column in enumerate(columns)}

    def product(factors: tuple[int, ...]) -> torch.Tensor:  # each of them once
        if factors not in products:
            products[factors] = product(factors[:-1]) * columns[factors[-1]]
        return products[factors]

    variables = np.arange(x.shape[1])
    terms = [product(tuple(np.repeat(variables, powers).tolist())) for powers in exponents]
    return torch.stack(terms, dim=1) if terms else x.new_zeros((len(x), 0))


def _first_curve(first: Ints, values: Floats, x: Floats, r: int) -> Floats:
    """Control points (r, d) of a spline through the data, smooth where there are none."""
    band = np.zeros((DEGREE + 1, r))
    right = np.zeros((r, x.shape[1]))
    for a in range(DEGREE + 1):
        np.add.at(right, first + a, values[:, a, None] * x)
        for b in range(a + 1):
            np.add.at(band[a - b], first + b, values[:, a] * values[:, b])
    difference = np.array([1.0, -2.0, 1.0])
    for a in range(3):
        for b in range(a + 1):
            band[a - b, b : r - 2 + b] += ROUGHNESS * difference[a] * difference[b]
    return solveh_banded(band, right, lower=True)


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
