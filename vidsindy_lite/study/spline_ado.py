"""The paper's own optimiser, as written: gradient descent alternating with STRidge (Eqs. S8-S9).

It stands beside `dynamics.discover`, to show what the formulation gives with the optimiser that the
paper describes. The formulation is the paper's: cubic B-splines with control points P and a
learnable offset, data loss at the measured times (Eq. 9a), physics loss at many random
collocation times (Eq. 9b), STRidge with an adaptive hard threshold for the coefficients, Adam on
(P, surviving coefficients, offset), an affine elimination of the offset (Eq. 10), and a small
value below which coefficients are cut at the end.

Four things the paper leaves open and what is done here:

* The curve is ``G P + offset`` in the data loss and ``G P`` in the library. With the offset in
  both, as one reading of the text has it, it changes nothing, for B-splines sum to one.
* Data are standardised (coordinates and time divided by their scale, undone at the end): one
  learning rate and one physics weight then serve all systems. The offset starts at the mean.
* The law is asked for where samples are, or in the next knot span: within a gap the first curve is
  a guess, to which physics would fit the law.
* Hyperparameters: see `spline_ado`. "PiSL" there is the public code of the same model by the
  same group (F. Sun, Y. Liu, H. Sun, "Physics-informed Spline Learning for Nonlinear Dynamics
  Discovery", IJCAI 2021), in its Lorenz example.

PyTorch works in double precision: a cubic library is nearly collinear, and on a CPU single
precision saves no more than a third of the time.
"""

import time
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from scipy.linalg import solveh_banded
from scipy.sparse import csr_array

from ..arrays import Floats, Ints
from ..checks import check_integer, check_times
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

_CURVE = ("control_points", "offset")  # of `_Fit`, what is learned beside the coefficients

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
            value = np.asarray(getattr(self, name))
            if not ((value >= bound) & np.isfinite(value)).all():
                raise ValueError(f"{name}: must be at least {bound}, got {getattr(self, name)}")


def spline_ado(
    t: Floats, x: Floats, degree: int = 3, seed: int = 0, device: str | None = None,
    **settings: float,
) -> SplineADOLaw:  # fmt: skip
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
    device : str, optional
        Where PyTorch computes, e.g. "cpu" or "cuda:0"; by default a GPU if there is one.
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
    return spline_ado_batch(t, [x], degree, [seed], device, **settings)[0]


def spline_ado_batch(
    t: Floats, records: Sequence[Floats], degree: int = 3, seeds: Sequence[int] = (),
    device: str | None = None, **settings: Any,
) -> list[SplineADOLaw]:  # fmt: skip
    """Discover the laws of several records at the same times, as one computation.

    Each law is the one that `spline_ado` finds from its record alone, but for rounding.

    Parameters
    ----------
    t : array_like, shape (n,)
        Increasing times.
    records : sequence of array_like, shape (n, d) each
        States; rows may be missing (NaN) in one record and not in another.
    degree, device, **settings
        See `spline_ado`; the two weights may be sequences, one a record.
    seeds : sequence of int
        One a record; by default the number of the record.

    Returns
    -------
    list of SplineADOLaw

    Raises
    ------
    ValueError
        As `spline_ado` does, if there is no record, records have different shapes, or there is
        not one seed and weight a record.
    """
    chosen = SplineADOSettings(**settings)
    if not len(records) or len({np.shape(x) for x in records}) > 1:
        shapes = ", ".join(str(np.shape(x)) for x in records) or "none"
        raise ValueError(f"records: must be at least one, all of one shape, got {shapes}")
    for name in ("physics_weight", "sparsity_weight"):
        if np.shape(value := getattr(chosen, name)) not in ((), (len(records),)):
            raise ValueError(f"{name}: must be one number or one a record, got {value}")
    seeds = list(seeds) or list(range(len(records)))
    if len(seeds) != len(records):
        raise ValueError(f"seeds: must be one a record, {len(records)}, got {len(seeds)}")
    exponents = np.empty((0, 0), dtype=int)
    for x in records:
        kept, seen = check_trajectory(t, x)
        exponents = monomial_exponents(seen.shape[1], degree)
        if len(kept) < len(exponents):
            raise ValueError(f"x: must hold at least {len(exponents)} samples, got {len(kept)}")
        if not (np.ptp(seen, axis=0) > 0).all():
            raise ValueError(f"x: every coordinate must move, got ranges {np.ptp(seen, axis=0)}")
    generators = [np.random.default_rng(check_integer("seed", seed)) for seed in seeds]
    prices = np.broadcast_to(chosen.sparsity_weight, len(records))
    try:
        where = torch.device(device or ("cuda" if torch.cuda.is_available() else "cpu"))
    except RuntimeError as error:
        raise ValueError(f"device: must be one that PyTorch knows, got {device!r}") from error
    states = np.array([np.asarray(x, dtype=float) for x in records])
    fit = _Fit(check_times(t), states, exponents, chosen, generators, where)
    fit.descend(chosen.pretraining, chosen.learning_rate)
    for _ in range(chosen.alternations):
        sparse = fit.coefficients.numpy(force=True).copy()
        for one, rng in enumerate(generators):
            if fit.open[one]:
                curve, slope = fit.collocation(one)
                terms = monomials(curve, exponents)
                sparse[one] = stridge(terms, slope, rng, prices[one])
        changed = ((sparse != 0) != fit.active).any(axis=(1, 2)) & fit.open
        # Where the support is that of before, a last descent from the new coefficients ends it.
        fit.restart(sparse)
        fit.descend(chosen.epochs, chosen.learning_rate)
        fit.open &= changed
        if not fit.open.any():
            break
    return [fit.result(one, chosen.prune) for one in range(len(records))]


def held_out_misfits(
    t: Floats, records: Sequence[Floats], seeds: Sequence[int], rate: float = 0.2, **settings: Any
) -> list[float]:
    """How far the curves of `spline_ado` are from samples that they were not given.

    Parameters
    ----------
    t, records, **settings
        See `spline_ado_batch`.
    seeds : sequence of int
        One a record; also of the samples that are held out.
    rate : float
        Fraction of the samples that is held out, each by itself.

    Returns
    -------
    list of float
        Root mean square over the spread of each coordinate, one a record.
    """
    states = [np.asarray(x, dtype=float) for x in records]
    given = []
    for x, seed in zip(states, seeds, strict=True):
        out = np.random.default_rng(seed).random(len(x)) < rate
        given.append(np.where(out[:, None], np.nan, x))
    misfits = []
    laws = spline_ado_batch(t, given, 3, seeds, None, **settings)
    for x, seen, law in zip(states, given, laws, strict=True):
        off = (law.curve - x)[np.isnan(seen[:, 0]) & ~np.isnan(x[:, 0])] / np.nanstd(x, axis=0)
        misfits.append(float(np.sqrt((off**2).mean())))
    return misfits


class _Fit:
    """Splines, coefficients and offsets in standardised units, with the paper's two losses.

    One row a record in all arrays. Coordinates come before times, so that the innermost axis of
    every product is long; gradients are written out, which takes a quarter of what automatic
    differentiation does (they are tested against it).
    """

    def __init__(
        self, t: Floats, states: Floats, exponents: Ints, settings: SplineADOSettings,
        generators: Sequence[np.random.Generator], device: torch.device,
    ) -> None:  # fmt: skip
        self.began = time.perf_counter()
        self.device = device
        self.exponents = exponents
        alpha = np.broadcast_to(settings.physics_weight, len(states))
        self.open = np.ones(len(states), dtype=bool)
        self.history: list[list[dict[str, float]]] = [[] for _ in states]
        self.iteration = 0
        spans = max(1, round(settings.knots_per_sample * (len(t) - 1)))
        breakpoints = np.linspace(t[0], t[-1], spans + 1)
        knots = clamped_knots(breakpoints)
        first, values = local_basis(knots, t)
        seen = np.asarray(~np.isnan(states).any(axis=2))
        shape = (settings.collocation_per_knot, spans)
        self.units, data, controls, bases = [], [], [], []
        # Spans that hold samples, and their neighbours: there the law is asked for.
        self.held = np.zeros((len(states), spans), dtype=bool)
        for x, rows, held, rng in zip(states, seen, self.held, generators, strict=True):
            held[first[rows]] = True
            held |= np.append(held[1:], False) | np.append(False, held[:-1])
            centre, scale = x[rows].mean(axis=0), x[rows].std(axis=0)
            standard = np.where(rows[:, None], (x - centre) / scale, 0.0)
            control = _first_curve(first[rows], values[rows], standard[rows], spans + DEGREE)
            # The same number in every span: random in time, and all spans are treated alike.
            fractions = rng.uniform(size=shape[::-1])
            times = (breakpoints[:-1, None] + fractions * np.diff(breakpoints)[:, None]).ravel()
            basis, slopes = (
                local_basis(knots, times, order)[1].reshape(spans, -1, DEGREE + 1).T
                for order in (0, 1)
            )
            slope = _curve(torch.tensor(slopes)[None], torch.tensor(control.T)[None])
            spread = slope[..., torch.tensor(held)].std(dim=(2, 3), correction=0)
            units = Units(centre, scale, time=float(1 / spread.mean()))
            self.units.append(units)
            data.append(standard.T)
            controls.append(control.T)
            bases.append(np.concatenate([basis, slopes * units.time], axis=1))
        self.data = self._tensor(data)
        self.weights = self._tensor((seen / seen.sum(axis=1, keepdims=True))[:, None])
        every = np.tile(self.held, shape[0])  # collocation time by collocation time
        self.shares = self._tensor((every / every.sum(axis=1, keepdims=True))[:, None])
        self.physics_weight = self._tensor(np.array(alpha))[:, None, None]
        # The spline at the samples, as a matrix with four entries a row.
        rows, columns = np.repeat(np.arange(len(t)), DEGREE + 1), first[:, None] + np.arange(4)
        sampling = csr_array((values.ravel(), (rows, columns.ravel())), (len(t), spans + DEGREE))
        self.sampling, self.sampling_t = (self._sparse(m) for m in (sampling, sampling.T.tocsr()))
        self.basis = self._tensor(bases)
        self.control_points = self._tensor(controls)
        self.offset = self._tensor(np.zeros((len(states), states.shape[2], 1)))
        fitted = []
        for one in range(len(states)):
            points, speed = self.collocation(one)
            fitted.append(np.linalg.lstsq(monomials(points, exponents), speed, rcond=None)[0])
        self.restart(np.array(fitted))

    def _tensor(self, array: Floats | list[Floats]) -> torch.Tensor:
        return torch.tensor(np.array(array), dtype=torch.float64, device=self.device)

    def _sparse(self, matrix: csr_array) -> torch.Tensor:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Sparse CSR tensor support is in beta")
            warnings.filterwarnings("ignore", "Sparse invariant checks are implicitly disabled")
            starts, columns = (torch.tensor(part) for part in (matrix.indptr, matrix.indices))
            values, size = torch.tensor(matrix.data), list(matrix.shape)
            return torch.sparse_csr_tensor(starts, columns, values, size, device=self.device)

    def _at_samples(self, control_points: torch.Tensor) -> torch.Tensor:
        flat = control_points.reshape(-1, control_points.shape[-1]).T
        measured = torch.sparse.mm(self.sampling, flat).T
        return measured.reshape(*control_points.shape[:-1], -1)

    def restart(self, coefficients: Floats) -> None:
        """Set the coefficients; from now on only those that are not zero are learned."""
        self.active = coefficients != 0
        self.mask = self._tensor(self.active)
        self.coefficients = self._tensor(coefficients)
        self.terms = _Terms(self.exponents, self.active.any(axis=(0, 2)), self.device)

    def collocation(self, one: int) -> tuple[Floats, Floats]:
        """Curve without offset and slope of a record at its collocation times, each (k, d)."""
        both = _curve(self.basis[one : one + 1], self.control_points[one : one + 1])[0]
        halves = both.numpy(force=True)[..., self.held[one]].reshape(len(both), 2, -1)
        return halves[:, 0].T, halves[:, 1].T

    def losses(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Data and physics loss of each record (paper: Eqs. 9a and 9b); sets the gradients.

        The gradients are those of data loss + physics weight x physics loss.
        """
        number, d, _ = self.control_points.shape
        error = self._at_samples(self.control_points) + self.offset - self.data
        weighted = 2 * self.weights * error
        data_loss = (weighted * error).sum(dim=(1, 2)) / 2

        both = _curve(self.basis, self.control_points)
        half = both.shape[2] // 2
        points, slopes = both[:, :, :half], both[:, :, half:]
        rows = self.terms.needed
        products = self.terms.products(points.reshape(number, d, -1))
        coefficients = (self.coefficients * self.mask)[:, rows]
        law = torch.bmm(coefficients.transpose(1, 2), products)
        residual = slopes.reshape(law.shape) - law
        pull = self.shares * residual
        physics_loss = (pull * residual).sum(dim=(1, 2))

        pull *= 2 * self.physics_weight
        gradient = torch.zeros_like(self.coefficients)
        gradient[:, rows] = -torch.bmm(products, pull.transpose(1, 2))
        self.coefficients.grad = gradient * self.mask
        pulled = torch.empty_like(both)
        by_point = self.terms.jacobian(coefficients, products).mul_(pull[:, None]).sum(dim=2)
        pulled[:, :, :half] = by_point.neg_().view_as(points)
        pulled[:, :, half:] = pull.view_as(slopes)
        gradient = torch.zeros_like(self.control_points)
        spans = self.basis.shape[3]
        for a in range(DEGREE + 1):
            gradient[:, :, a : a + spans] += (self.basis[:, a, None] * pulled).sum(dim=2)
        flat = weighted.reshape(-1, weighted.shape[2]).T
        gradient += torch.sparse.mm(self.sampling_t, flat).T.reshape(gradient.shape)
        self.control_points.grad = gradient
        self.offset.grad = weighted.sum(dim=2, keepdim=True)
        return data_loss, physics_loss

    def descend(self, steps: int, learning_rate: float) -> None:
        """Adam on control points, surviving coefficients and offset (paper: Eq. S9).

        Records that are finished stay as they are.
        """
        going = self.open.copy()
        kept = self if going.all() else self._part(going)
        unknowns = [kept.control_points, kept.coefficients, kept.offset]
        optimiser = torch.optim.Adam(unknowns, lr=learning_rate, fused=True)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(
            optimiser, steps, eta_min=learning_rate / 100
        )
        for step in range(steps):
            losses = kept.losses()
            optimiser.step()
            schedule.step()
            self.iteration += 1
            if step % REPORT == 0 or step == steps - 1:
                self._report(np.flatnonzero(going), *losses)
        if kept is not self:
            at = torch.tensor(going, device=self.device)
            for name in ("coefficients", *_CURVE):
                getattr(self, name)[at] = getattr(kept, name)

    def _part(self, which: np.ndarray) -> "_Fit":
        """The records that go on, by themselves."""
        part = object.__new__(_Fit)
        part.__dict__.update(self.__dict__)
        at = torch.tensor(which, device=self.device)
        for name in ("physics_weight", "data", "weights", "shares", "basis", *_CURVE):
            setattr(part, name, getattr(self, name)[at])
        part.restart(self.coefficients.numpy(force=True)[which])
        return part

    def _report(self, going: Ints, data_loss: torch.Tensor, physics_loss: torch.Tensor) -> None:
        seconds = time.perf_counter() - self.began
        pairs = zip(data_loss.tolist(), physics_loss.tolist(), strict=True)
        for one, (data, physics) in zip(going, pairs, strict=True):
            self.history[one].append(
                {
                    "iteration": self.iteration,
                    "seconds": seconds,
                    "data_loss": data,
                    "physics_loss": physics,
                    "terms": int(self.active[one].sum()),
                }
            )

    def result(self, one: int, prune: float) -> SplineADOLaw:
        """Back to the units of the data, without the offset (paper: Eq. 10)."""
        units, exponents = self.units[one], self.exponents
        standard = (self.coefficients * self.mask)[one].numpy(force=True)
        offset = self.offset[one].numpy(force=True)
        control = self.control_points[one]
        path = units.point((self._at_samples(control).numpy(force=True) + offset).T)
        names = variable_names(len(offset))
        centre = units.point(offset[:, 0])
        native = PolynomialSystem(names, exponents, standard * units.factors(exponents))
        shifted = native.shift(centre)
        kept = np.where(np.abs(shifted.coefficients) < prune, 0.0, shifted.coefficients)
        system = PolynomialSystem(names, shifted.exponents, kept)
        return SplineADOLaw(system, native, centre, path, tuple(self.history[one]))


def _curve(basis: torch.Tensor, control_points: torch.Tensor) -> torch.Tensor:
    """Splines at times given span by span: (b, 4, q, m) and (b, d, m + 3) to (b, d, q, m)."""
    spans = basis.shape[3]
    curve = basis[:, 0, None] * control_points[:, :, None, :spans]
    for a in range(1, DEGREE + 1):
        curve.addcmul_(basis[:, a, None], control_points[:, :, None, a : a + spans])
    return curve


class _Terms:
    """The monomials that a law needs, with all that divide them: products and derivatives."""

    def __init__(self, exponents: Ints, active: np.ndarray, device: torch.device) -> None:
        divides = (exponents[:, None] <= exponents[active]).all(axis=2).any(axis=1)
        divides[0] = True  # the constant
        self.needed = torch.tensor(np.flatnonzero(divides), device=device)
        chosen = exponents[divides]
        place = {tuple(powers): row for row, powers in enumerate(chosen.tolist())}
        d = exponents.shape[1]
        self.steps: list[tuple[int, int, int]] = []  # row, row of one factor less, the factor
        derivatives = np.zeros((d, len(chosen), len(chosen)))
        for powers, row in place.items():
            less = [tuple(np.subtract(powers, np.eye(d, dtype=int)[j]).tolist()) for j in range(d)]
            factors = np.flatnonzero(powers)
            if len(factors):
                self.steps.append((row, place[less[factors[0]]], int(factors[0])))
            for j in factors:
                derivatives[j, place[less[j]], row] = powers[j]
        # Monomials come by degree: derivatives need only the first of them.
        self.low = 1 + int(np.flatnonzero(derivatives.any(axis=(0, 2))).max(initial=0))
        self.derivatives = torch.tensor(derivatives[:, : self.low], device=device)
        self.values: torch.Tensor | None = None

    def products(self, x: torch.Tensor) -> torch.Tensor:
        """Monomials of points (b, d, k), shape (b, l, k); the memory is used again."""
        shape = (x.shape[0], len(self.needed), x.shape[2])
        if self.values is None or self.values.shape != shape:
            self.values = x.new_ones(shape)
        for row, less, factor in self.steps:
            torch.mul(self.values[:, less], x[:, factor], out=self.values[:, row])
        return self.values

    def jacobian(self, coefficients: torch.Tensor, products: torch.Tensor) -> torch.Tensor:
        """Derivatives of a law by the coordinates, (b, d by, d of, k)."""
        number, _, d = coefficients.shape
        slopes = torch.einsum("jpr,bri->bjip", self.derivatives, coefficients)
        return torch.bmm(slopes.reshape(number, d * d, -1), products[:, : self.low]).view(
            number, d, d, -1
        )


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
