"""Spline-enhanced sparse regression: a noisy trajectory goes in, the governing equations come out.

The objective is the paper's (Eqs. 8-9): data loss of a cubic B-spline, physics loss at collocation
points, a price per term. What differs is how it is minimised: banded Gauss-Newton steps with the
curve eliminated (`collocation`), a search over supports in the small algebra that remains
(`regression`), the offset as the origin in which the law is sparsest (`frames`), and a physics
weight that is raised until the law holds exactly. Nothing is set by hand per system.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import BSpline, make_lsq_spline
from scipy.stats import chi2
from tqdm import tqdm

from ..checks import check_integer
from .collocation import CLEANEST, Collocation, Segment, State
from .diagnostics import diagnose, outliers
from .discovery import Discovery, Step, Units, report
from .gaps import Gap, gaps, join
from .library import (
    closure_mask,
    monomial_exponents,
    monomials,
    shift_matrix,
    variable_names,
)
from .origin import ShiftedLaw, sparse_origins
from .polynomials import PolynomialSystem
from .selection import inverse, subset_search
from .smoothing import smooth
from .splines import DEGREE, clamped_knots
from .trajectories import Trajectory, check_systematic, check_trajectories, cut, typical_step

FIRST_WEIGHTS = (1e-1, 1e0, 1e1, 1e2)
"""Physics weights of the unpruned fits, relative to the misfit of a plain regression."""
SEARCH_WEIGHTS = (1e2, 1e4, 1e8)
"""Physics weights of the subset searches in the law's own frame."""
FINAL_WEIGHT = SEARCH_WEIGHTS[-1]
"""Weight at which the law holds exactly for all that the data can tell."""
FALSE_ALARM = 0.004
"""Chance of a false term in a law, if all candidates were independent."""
NEEDLESS_START = 0.1
"""Chance that a second start, from terms of all degrees, is made though the first left nothing."""
OFFSET_PENALTY = 0.95
"""Price of a moved axis, in constant terms: of two laws alike, the one with fewer terms wins."""
SPLINE_ERROR = 3e-7
"""Error of a coefficient, in standard units, that knots may leave in nearly exact data."""
GAP = 0.4
"""A pause longer than this fraction of the time scale of the motion is a gap."""
SHORTEST_STRETCH = 4
"""Stretches of fewer samples tell less than their initial conditions cost."""


def discover(
    t: np.ndarray | Sequence[tuple[np.ndarray, np.ndarray]],
    x: np.ndarray | None = None,
    degree: int = 3,
    seed: int = 0,
    progress: bool = False,
    systematic: np.ndarray | Sequence[np.ndarray] | None = None,
) -> Discovery:
    """Discover the polynomial law of a measured trajectory (paper: Eqs. 7-10).

    Parameters
    ----------
    t : array_like, shape (n,), or list of (t, x)
        Increasing times, even or uneven; or several trajectories of one system.
    x : array_like, shape (n, d), optional
        States with d of at least 1; a row with a NaN is missing. Omitted when ``t`` is a list.
    degree : int
        Highest degree of the candidate terms.
    seed : int
        For the random probes of the noise estimate and the starts of the offset search.
    progress : bool
        Show a progress bar.
    systematic : array_like, shape (k, n, d), optional
        Errors that all samples share, such as those of a scale: what k independent causes, each
        off by one standard error, add to ``x``; smooth like the path, and below its noise. One
        such array per trajectory if ``t`` is a list.

    Returns
    -------
    Discovery
        The law with standard errors in the frame of the data and in its own, sparsest frame.

    Raises
    ------
    ValueError
        If the input has the wrong shape, times that do not increase, infinite values, a
        coordinate that does not move, or fewer samples than unknowns.

    Examples
    --------
    >>> t, x = study.SYSTEMS["Lorenz"].trajectory(1500)
    >>> print(vl.discover(t, x).equations())
    """
    degree, seed = check_integer("degree", degree, 1), check_integer("seed", seed)
    trajectories = check_trajectories(t, x)
    times = [t] if x is not None else [pair[0] for pair in t]
    shared = check_systematic(systematic, times, trajectories)
    return _Search(trajectories, shared, degree, seed, progress).run()


def term_penalties(exponents: np.ndarray) -> np.ndarray:
    """Price of a term of each kind: how much of the chi-square it has to explain, shape (l,).

    Half of `FALSE_ALARM` goes to the constants, half of the rest to the linear terms, and so on;
    the terms of one degree in all equations share evenly (Bonferroni). So a term has to be
    significant among all that could have been, and of two laws that fit alike the one of lower
    degree wins.
    """
    d, degrees = exponents.shape[1], exponents.sum(axis=1)
    rivals = d * np.bincount(degrees)[degrees] * 2.0 ** (degrees + 1)
    return chi2.isf(FALSE_ALARM / rivals, df=1)


@dataclass(frozen=True)
class _Candidate:
    """A support in a frame, with what the quadratic model says it costs."""

    cost: float
    state: State


@dataclass(frozen=True)
class _Closure:
    """A law in the centred frame, with every term that a shift of it may contain."""

    state: State
    columns: np.ndarray
    algebra: ShiftedLaw
    objective: float


@dataclass
class _Search:
    """One discovery: the data in standard units, and the stages that lead to the law."""

    trajectories: list[Trajectory]
    systematic: list[np.ndarray]
    degree: int
    seed: int
    progress: bool
    history: list[Step] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.began = time.perf_counter()
        self.d = self.trajectories[0][1].shape[1]
        self.exponents = monomial_exponents(self.d, self.degree)
        n = sum(len(t) for t, _ in self.trajectories)
        unknowns = len(self.exponents) + 1
        if n < unknowns:
            raise ValueError(
                f"x: must hold at least as many samples as unknowns per equation "
                f"({unknowns} for degree {self.degree} and d = {self.d}), got {n} samples"
            )
        self.outliers = outliers(self.trajectories)
        self._standardise()
        self.home = self.units.standard(np.zeros(self.d))
        self.penalties = term_penalties(self.exponents)
        self.axis_penalty = OFFSET_PENALTY * self.penalties[0]
        self.rng = np.random.default_rng(np.random.SeedSequence(self.seed).spawn(1)[0])

    def _standardise(self) -> None:
        x = np.concatenate([values for _, values in self.trajectories])
        centre, scale = x.mean(axis=0), x.std(axis=0)
        if not (scale > 1e-12 * np.abs(centre)).all():
            still = int(np.argmin(scale))
            raise ValueError(f"x: every coordinate must move, got a constant column {still}")
        rng = np.random.default_rng(np.random.SeedSequence(self.seed).spawn(2)[1])
        step = typical_step(self.trajectories)
        trajectories = [(t / step, (values - centre) / scale) for t, values in self.trajectories]
        # Where the trajectory pauses is a gap or not depending on how fast the target moves, which
        # a first smoothing tells; if there are other gaps, a second one respects them.
        first = _stretches(trajectories, 5.0)
        smoothed = smooth([piece for _, piece in first], rng)
        speed = _rms_speed(smoothed.splines)
        stretches = _stretches(trajectories, max(2.5, GAP / speed))
        if [len(t) for _, (t, _) in stretches] != [len(t) for _, (t, _) in first]:
            smoothed = smooth([piece for _, piece in stretches], rng)
            speed = _rms_speed(smoothed.splines)
        self.units = Units(centre, scale, step / speed)
        self.step = speed
        self.trajectories = [(t * speed, values) for t, values in trajectories]
        self.systematic = [modes / scale[:, None] for modes in self.systematic]
        self.stretches = [(i, (t * speed, values)) for i, (t, values) in stretches]
        self.noise = self.smoothed_noise = np.maximum(smoothed.noise, CLEANEST)
        self.curves = [
            BSpline(spline.t * speed, spline.c, DEGREE, extrapolate=True)
            for spline in smoothed.splines
        ]
        self.spacing = 1 / 5 if self.noise.max() > 0.02 else 1 / 16

    # -- stages ----------------------------------------------------------------------------

    def run(self) -> Discovery:
        with tqdm(total=5, disable=not self.progress, desc="discover", leave=False) as bar:
            segments = [
                Segment.even(t, x, self.spacing, trajectory)
                for trajectory, (t, x) in self.stretches
            ]
            problem = self._problem(segments)
            control = _fit_curves(problem, self.curves)
            self._measure_slack(problem, control)
            bar.update()
            candidates = []
            for start in sorted({min(2, self.degree), self.degree}):
                state = self._unpruned(problem, control, start)
                candidates += self._candidates(state, problem)
                if not self._leaves_something_over(state, problem):
                    break
            bar.update()
            state = self._best(candidates, problem)
            bar.update()
            state, problem = self._bridge(state, problem)
            bar.update()
            state, problem = self._polish(state, problem)
            bar.update()
        law = PolynomialSystem(variable_names(self.d), self.exponents, state.coefficients)
        warnings = diagnose(
            law, state, problem, self.penalties, self.trajectories, self.smoothed_noise
        )
        warnings = self.outliers + warnings
        return report(state, problem, self.units, self.penalties, warnings, self.history)

    def _measure_slack(self, problem: Collocation, control: np.ndarray) -> None:
        """Misfit of a plain regression on the smoothed curve: the scale of physics weights."""
        x, slope = problem.node_states(control)
        terms = monomials(x, self.exponents)
        misfit = slope - terms @ np.linalg.lstsq(terms, slope, rcond=None)[0]
        self.slack = np.maximum(np.sqrt((misfit**2).mean(axis=0)), 1e-4)

    def _problem(self, segments: Sequence[Segment]) -> Collocation:
        shared = np.concatenate([self._shared(segment) for segment in segments])
        weights = self.noise**-2, np.ones(self.d)
        return Collocation(segments, self.exponents, *weights, shared)

    def _shared(self, segment: Segment) -> np.ndarray:
        """Systematic errors at the samples of a segment, shape (n, d, k)."""
        t, _ = self.trajectories[segment.trajectory]
        return self.systematic[segment.trajectory][np.searchsorted(t, segment.t)]

    def _weighted(self, problem: Collocation, weight: float) -> Collocation:
        return problem.weighted(self.noise**-2, weight / self.slack**2)

    def _criterion(self, problem: Collocation, state: State) -> float:
        terms = self.penalties @ state.active.sum(axis=1)
        return problem.objective(state) + terms + self.axis_penalty * state.moving.sum()

    def _log(self, stage: str, problem: Collocation, state: State, weight: float) -> None:
        data = problem.data_loss(state.control_points)
        self.history.append(
            Step(
                stage=stage,
                seconds=time.perf_counter() - self.began,
                physics_weight=weight,
                data_loss=data / problem.x.size,
                physics_loss=float((problem.physics_residual(state) ** 2).mean()),
                terms=int(state.active.sum()),
                offset=self.units.point(state.offset),
            )
        )

    def _unpruned(self, problem: Collocation, control: np.ndarray, degree: int) -> State:
        """Fit all terms up to a degree while the physics weight rises."""
        rows = self.exponents.sum(axis=1) <= degree
        problem = self._weighted(problem, 1.0)
        x, slope = problem.node_states(control)
        coefficients = np.zeros(self.exponents.shape)
        terms = monomials(x, self.exponents[rows])
        coefficients[rows] = np.linalg.lstsq(terms, slope, rcond=self.noise.min())[0]
        active = np.repeat(rows[:, None], self.d, axis=1)
        origin, still = np.zeros(self.d), np.zeros(self.d, dtype=bool)
        state = State(control, coefficients, active, origin, still)
        for weight in FIRST_WEIGHTS:
            problem = self._weighted(problem, weight)
            state = problem.solve(state, tolerance=1.0, max_steps=15)
            self._log(f"unpruned, degree {degree}", problem, state, weight)
        return state

    def _leaves_something_over(self, state: State, problem: Collocation) -> bool:
        """Would the terms of higher degree together explain more of the data than chance does?"""
        left_out = self.exponents.size - state.active.sum()
        if not left_out:
            return False
        problem = self._weighted(problem, FIRST_WEIGHTS[-1])
        _, gain = problem.linearise(state, np.arange(self.exponents.size)).newton()
        return gain > chi2.isf(NEEDLESS_START, left_out)

    def _select(
        self, state: State, problem: Collocation, weight: float, stage: str
    ) -> tuple[State, float]:
        """Alternate between the subset search and Gauss-Newton until the criterion stops falling.

        The search runs over all terms, active or not, on the quadratic model with the curve
        eliminated; its proposal is kept only if the true criterion falls after a refit.
        """
        problem = self._weighted(problem, weight)
        size = self.exponents.size
        state = problem.solve(state, tolerance=0.1)
        best = self._criterion(problem, state)
        self._log(stage, problem, state, weight)
        for _ in range(10):
            columns = np.concatenate([np.arange(size), size + np.flatnonzero(state.moving)])
            model = problem.linearise(state, columns)
            present = state.flat()[columns]
            penalty = np.append(np.tile(self.penalties, self.d), np.full(self.d, -np.inf))[columns]
            support, solution, _ = subset_search(
                model.information, model.gradient, present, penalty, state.free()[columns]
            )
            if (support == state.free()[columns]).all():
                break
            trial = _proposed(state, model.curve_step, model.curve_response, columns, solution)
            trial = problem.solve(trial, tolerance=0.1)
            value = self._criterion(problem, trial)
            if not value < best - 1e-6:
                break
            state, best = trial, value
            self._log(stage, problem, state, weight)
        return state, best

    def _candidates(self, state: State, problem: Collocation) -> list[_Candidate]:
        """Supports in the frames where the law is sparsest, by the quadratic model."""
        weight = FIRST_WEIGHTS[-1]
        state, _ = self._select(state, problem, weight, "subset search, centred frame")
        closed = self._closed(state, problem, weight)
        x = problem.x
        origins = sparse_origins(
            closed.algebra, closed.state.active, self.home, (x.min(axis=0), x.max(axis=0)),
            self.penalties.max(), keep=4, rng=self.rng,
        )  # fmt: skip
        variants = [
            variant for origin in [self.home, *origins] for variant in self._variants(origin)
        ]
        unique = {tuple(np.round(origin, 2)): (origin, moving) for origin, moving in variants}
        return [self._candidate(closed, *variant) for variant in unique.values()]

    def _variants(self, origin: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """An origin, and the same with some of its axes at home, where they cost nothing."""
        masks = itertools.product(
            *((True, False) if away else (False,) for away in origin != self.home)
        )
        return [(np.where(mask, origin, self.home), np.array(mask)) for mask in masks]

    def _closed(self, state: State, problem: Collocation, weight: float) -> _Closure:
        problem = self._weighted(problem, weight)
        state = State(
            state.control_points,
            shift_matrix(self.exponents, state.offset) @ state.coefficients,
            closure_mask(self.exponents, state.active),
            np.zeros(self.d),
            np.zeros(self.d, dtype=bool),
        )
        # A law exact in another frame has no firm minimum here: some steps are near enough.
        state = problem.solve(state, tolerance=0.1, max_steps=8)
        columns = np.flatnonzero(state.free())
        information = np.diag(np.where(state.free()[: self.exponents.size], 0.0, 1e30))
        information[np.ix_(columns, columns)] = problem.linearise(state, columns).information
        algebra = ShiftedLaw(self.exponents, state.coefficients, information)
        return _Closure(state, columns, algebra, problem.objective(state))

    def _candidate(self, closed: _Closure, origin: np.ndarray, moving: np.ndarray) -> _Candidate:
        """The cheapest support at an origin, by the quadratic model around the closed."""
        coefficients, information = closed.algebra.at(origin)
        present = coefficients.T.ravel()[closed.columns]
        information = information[np.ix_(closed.columns, closed.columns)]
        support, solution, value = subset_search(
            information,
            np.zeros(len(closed.columns)),
            present,
            np.tile(self.penalties, self.d)[closed.columns],
            np.ones(len(closed.columns), dtype=bool),
        )
        flat = np.zeros((2, self.exponents.size))
        flat[:, closed.columns] = solution, support
        coefficients, active = flat.reshape(2, self.d, -1).transpose(0, 2, 1)
        state = State(closed.state.control_points, coefficients, active != 0, origin.copy(), moving)
        cost = closed.objective + value + self.axis_penalty * moving.sum()
        return _Candidate(cost, state)

    def _best(self, candidates: list[_Candidate], problem: Collocation) -> State:
        """Refine the cheapest candidates; the lowest criterion wins."""
        candidates = sorted(candidates, key=lambda candidate: candidate.cost)
        states = list({_key(c.state): c.state for c in reversed(candidates)}.values())[::-1][:3]
        stage = "subset search, own frame"
        for weight in SEARCH_WEIGHTS:
            refined = [self._select(state, problem, weight, stage) for state in states]
            limit = min(value for _, value in refined) + self.penalties.max()
            kept = {_key(state): state for state, value in refined if value <= limit}
            states = list(kept.values())
        settled = [self._come_home(state, problem) for state in states]
        return min(settled, key=lambda item: item[1])[0]

    def _come_home(self, state: State, problem: Collocation) -> tuple[State, float]:
        """Put axes of the offset back to where they cost nothing, if the criterion falls.

        The frames were compared at a small physics weight, at which weak terms do not count.
        """
        value = self._criterion(self._weighted(problem, FINAL_WEIGHT), state)
        if not state.moving.any():
            return state, value
        closed = self._closed(state, problem, FINAL_WEIGHT)
        variants = [self._candidate(closed, *variant) for variant in self._variants(state.offset)]
        closest = min(variants, key=lambda candidate: candidate.cost)
        if closest.cost < value and closest.state.moving.sum() < state.moving.sum():
            trial, cost = self._select(closest.state, problem, FINAL_WEIGHT, "offset home")
            if cost < value:
                return trial, cost
        return state, value

    def _bridge(self, state: State, problem: Collocation) -> tuple[State, Collocation]:
        """Integrate the law across gaps and search again with the physics enforced there.

        A smoothing spline crosses a gap on the wrong branch, so until here the physics was cut
        at gaps. Groups of gaps are tried, shortest first; a group whose bridges spoil the fit is
        halved, down to single gaps.
        """
        for _ in range(3):
            open_gaps = gaps(problem.segments)
            if not open_gaps:
                break
            before = state.active
            state, problem = self._bridge_group(state, problem, open_gaps)
            state, _ = self._select(state, problem, FINAL_WEIGHT, "subset search, bridged")
            state, _ = self._come_home(state, problem)
            if (state.active == before).all():
                break
        return state, problem

    def _bridge_group(
        self, state: State, problem: Collocation, group: list[Gap]
    ) -> tuple[State, Collocation]:
        problem = self._weighted(problem, FINAL_WEIGHT)
        joined, curves = join(
            problem.segments, _splines(problem, state), group, self.trajectories, self._law(state),
            self.spacing,
        )  # fmt: skip
        bridged = self._problem(joined)
        trial = replace(state, control_points=_fit_curves(bridged, curves))
        for weight in SEARCH_WEIGHTS:
            bridged = self._weighted(bridged, weight)
            trial = bridged.solve(trial, tolerance=1.0, max_steps=10)
        # A bridge takes away the freedom of one initial condition: so much may the fit lose.
        freedom = self.d * len(group) + bridged.x.size - problem.x.size
        loss = bridged.objective(trial) - problem.objective(state)
        if loss < freedom + 4 * np.sqrt(2 * freedom):
            return trial, bridged
        if len(group) == 1:
            return state, problem
        for half in (group[: len(group) // 2], group[len(group) // 2 :]):
            state, problem = self._bridge_group(state, problem, half)
        return state, problem

    def _law(self, state: State) -> PolynomialSystem:
        names = variable_names(self.d)
        law = PolynomialSystem(names, self.exponents, state.coefficients)
        return law.shift(state.offset)

    def _polish(self, state: State, problem: Collocation) -> tuple[State, Collocation]:
        """Refit with the law exact, on finer knots until that no longer matters."""
        problem = self._weighted(problem, FINAL_WEIGHT)
        state = problem.solve(state, tolerance=1e-4)
        columns = np.flatnonzero(state.free())
        for _ in range(3):
            before = state.flat()[columns]
            finer = self._problem([segment.refined() for segment in problem.segments])
            control = _fit_curves(finer, _splines(problem, state))
            self.noise = self._residual_noise(problem, state)
            problem = self._weighted(finer, FINAL_WEIGHT)
            state = problem.solve(replace(state, control_points=control), tolerance=1e-4)
            spread = np.sqrt(np.diag(inverse(problem.linearise(state, columns).information)))
            # Half the spacing, a sixteenth of the error: so much is left of what it just was.
            error = np.abs(state.flat()[columns] - before) / 15
            if (error < np.maximum(0.1 * spread, SPLINE_ERROR)).all():
                break
        # A term that only made up for the error of coarser splines goes, and the noise, known
        # better now, may change what is worth its penalty.
        state, _ = self._select(state, problem, FINAL_WEIGHT, "polish")
        return problem.solve(state, tolerance=1e-4), problem

    def _residual_noise(self, problem: Collocation, state: State) -> np.ndarray:
        """Standard deviation of the data residual, less the freedom that the fit used up."""
        used = state.free().sum() / self.d + len(problem.segments)
        residual, _ = problem.data_residual(state.control_points)
        return np.maximum(
            np.sqrt((residual**2).sum(axis=0) / max(len(residual) - used, 1.0)), CLEANEST
        )


def _key(state: State) -> tuple[bytes, bytes]:
    """Same for states with the same terms and axes."""
    return state.active.tobytes(), state.moving.tobytes()


def _rms_speed(splines: Sequence[BSpline]) -> float:
    slopes = [spline.derivative()(spline.t[DEGREE:-DEGREE]) for spline in splines]
    return float(np.sqrt((np.concatenate(slopes) ** 2).mean()))


def _stretches(
    trajectories: Sequence[Trajectory], longest_step: float
) -> list[tuple[int, Trajectory]]:
    pieces = [
        (i, piece)
        for i, trajectory in enumerate(trajectories)
        for piece in cut(trajectory, longest_step)
    ]
    longest = max(len(t) for _, (t, _) in pieces)
    return [piece for piece in pieces if len(piece[1][0]) >= min(SHORTEST_STRETCH, longest)]


def _fit_curves(
    problem: Collocation, curves: Sequence[Callable[[np.ndarray], np.ndarray]]
) -> np.ndarray:
    control = []
    for segment, curve in zip(problem.segments, curves, strict=True):
        b = segment.breakpoints
        dense = np.append((b[:-1, None] + np.diff(b)[:, None] * np.arange(4) / 4).ravel(), b[-1])
        control.append(
            make_lsq_spline(dense, curve(dense), clamped_knots(b), DEGREE, method="norm-eq").c
        )
    return np.concatenate(control)


def _splines(problem: Collocation, state: State) -> list[BSpline]:
    return [BSpline(*pieces, DEGREE) for pieces in problem.splines(state.control_points)]


def _proposed(
    state: State,
    curve_step: np.ndarray,
    curve_response: np.ndarray,
    columns: np.ndarray,
    solution: np.ndarray,
) -> State:
    """The state that the quadratic model promises for a solution of the subset search."""
    l, d = state.coefficients.shape
    step = solution - state.flat()[columns]
    flat = state.flat()
    flat[columns] = solution
    coefficients = flat[: l * d].reshape(d, l).T
    return replace(
        state,
        control_points=state.control_points + curve_step + curve_response @ step,
        coefficients=coefficients,
        active=coefficients != 0,
        offset=flat[l * d :],
    )
