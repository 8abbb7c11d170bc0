"""Whether a discovered law should be trusted: each warning in words, with advice.

A warning is a necessary sign of trouble, not a sufficient one: a law without one may be wrong. What
is looked at: where the motion takes place, terms beyond the library (omitted-term score test),
other origins, other laws, the fit and its samples.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import beta, chi2

from ..arrays import Bools, Floats, Ints
from .collocation import CLEANEST, Collocation, Fit, Linearisation, Status
from .data import Trajectory, typical_step
from .frames import away, freed
from .l0 import (
    LEAST,
    closest_rival,
    far_neighbours,
    minimiser,
    newcomers,
    prior_prices,
    subset_search,
)
from .library import monomial_exponents, monomials, shift_generators, shift_matrix, velocity_names
from .mechanics import Round, on_circle, on_sphere
from .model import PolynomialSystem, State, place, spoken
from .noise import passing, residual_noise
from .path import RESOLVED, Path
from .problem import COARSE, SURE, Problem, term_penalties

# --------------------------------------------------------------------------------------------------
# Where a motion takes place, looked at before any law: a coordinate at rest, a line, a plane, a
# circle, a sphere, one closed orbit.
#
# There the terms of a library depend on each other, and many laws fit alike. A motion is on a
# shape if its distance from it, less the noise, is nothing of the size of the shape: not because
# noise may hide it, but because the data are good enough to tell.

Complexes = NDArray[np.complex128]

CLOSE = 0.005
"""Distance from a shape, over the size of the shape, that is none: scales and cameras are off by
as much."""
RETRACED = 0.05
"""The same of a curve on which a motion turns back, as nothing does that is not bound to one."""
FEWEST = 5
"""Positions that are always on a circle, or nearly."""
TOLD = 0.1
"""Distance, over the size of the shape, that noise must not hide."""
FAINT = 0.5
"""The same of a coordinate at rest, over its noise."""
PLAIN = 3.0
"""Standard errors between what a squared distance is and what it may be."""
LAPS = 1.6
"""Laps of a closed orbit that have to be seen."""
SWEPT = 1.5
"""Ways along an arc, over its length: what turns back on it, or goes round, is bound to it."""
COARSEST = np.pi / 2
"""Angle between samples up to which they tell which way they went."""
PIECES = 50
"""Averages of the angle that tell the way along an arc."""
NEARLY = 0.3
"""Distance of two laps, in standard deviations of the motion, at which it is looked at closer."""
SPARE = 1
"""Numbers of an orbit beyond the coefficients of a law that it takes to test it."""
HARMONICS = 25
"""Of a closed orbit, at most."""
ENOUGH = 3000
"""Samples of a closed orbit that are looked at, at most."""
CANDIDATES = 4
"""Periods that are tried, at most."""
IMITATED = 0.02
"""What a cubic leaves of a sine, over the slope, that hardly tells them apart."""
CANCELLED = 300.0
"""Terms of an equation, their sizes added, over their sum: from here on they cancel."""


def shapes(
    runs: Sequence[Trajectory], noise: Floats, names: Sequence[str], terms: Ints
) -> Iterator[str]:
    """What there is to say of where a motion takes place, with what to do about it.

    Parameters
    ----------
    runs : sequence of (t, x)
        The data, in the user's units.
    noise : ndarray, shape (d,)
        Estimated standard deviation of the errors of each coordinate.
    names : sequence of str
        Of the coordinates.
    terms : ndarray of int, shape (d,)
        How many coefficients of each coordinate's equation the data have to settle.
    """
    x = np.concatenate([values for _, values in runs])
    moves = _moving(x, noise)
    for j in np.flatnonzero(~moves).tolist():
        yield f"{names[j]} moves by no more than a part of its noise: leave it out"
    if not moves.any():
        return
    names = [name for name, moving in zip(names, moves, strict=True) if moving]
    x, noise, terms = x[:, moves], noise[moves], terms[moves]
    yield from _flat_or_round(x, noise, names)
    if len(runs) == 1:
        yield from _closed(runs[0][0], x, noise, terms)


def _moving(x: Floats, noise: Floats) -> Bools:
    """Which coordinates move by more than a part of their noise, (d,)."""
    away = x - x.mean(axis=0)
    part = [_distance(away[:, [j]], size)[1] / size for j, size in enumerate(noise)]
    return np.array(part) > FAINT


def _flat_or_round(x: Floats, noise: Floats, names: Sequence[str]) -> Iterator[str]:
    """What there is to say of a line, a plane, a circle or a sphere."""
    directions, flat = _across(x, noise)
    where = _round(x, noise, flat)
    if where is not None:
        yield _told(where)
        return
    if flat:
        d = x.shape[1]
        shape = {1: "on a line", 2: "in a plane"}.get(d - flat, f"in {d - flat} of {d} dimensions")
        relations = [_relation(row, x, names) for row in directions[:flat]]
        yield (
            f"the motion stays {shape} ({'; '.join(relations)}): there its coordinates depend "
            f"on each other and many laws fit alike; give {d - flat} of them, or add runs that "
            "leave it"
        )


def is_on_circle(x: Floats, noise: Floats) -> bool:
    """Whether positions, (n, d), are bound to a circle, if their errors, (d,), are so large."""
    if x.shape[1] not in (2, 3) or len(x) <= FEWEST:
        return False
    moves = _moving(x, noise)
    if moves.sum() < 2:
        return False
    x, noise = x[:, moves], noise[moves]
    where = _round(x, noise, _across(x, noise)[1])
    return where is not None and len(where.axes) == 2


def _across(x: Floats, noise: Floats) -> tuple[Floats, int]:
    """Normals of a motion, (d, d), the narrowest first, and across how many of them it is flat."""
    d, scale = x.shape[1], x.std(axis=0)
    standard = (x - x.mean(axis=0)) / scale
    _, directions = np.linalg.eigh(standard.T @ standard)
    wide = [
        _on(standard @ normal[:, None], float(np.linalg.norm(normal * noise / scale)), 1.0)
        for normal in directions.T[: d - 1]
    ]
    return directions.T / scale, wide.index(False) if False in wide else d - 1


def _relation(normal: Floats, x: Floats, names: Sequence[str]) -> str:
    """What is constant along a motion, as text."""
    share = np.abs(normal) * x.std(axis=0)
    normal = np.where(share > CLOSE * share.max(), normal / normal[share.argmax()], 0.0)
    named = sorted(zip(normal, names, strict=True), key=lambda part: part[0] != 1)
    sides = " ".join(f"{'-' if a < 0 else '+'} {abs(a):.4g} {name}" for a, name in named if a)
    constant = float(normal @ x.mean(axis=0))
    nil = abs(constant) < 1e-3 * float(np.linalg.norm(normal * x.std(axis=0)))
    plain = sides.replace(" 1 ", " ").removeprefix("+ ")
    return f"{plain} = {0 if nil else constant:.4g}"


def _round(x: Floats, noise: Floats, flat: int) -> Round | None:
    """The circle or sphere of a motion that is flat across so many directions, if it is on one.

    Of two coordinates that go round, one may be the speed of the other, or hunt it: only what turns
    back on its arc is a bob.
    """
    d = x.shape[1]
    planar = d - flat == 2
    if not (planar and d <= 3 or d == 3 and not flat):
        return None
    try:
        where = on_circle(x) if planar else on_sphere(x)
    except ValueError:  # nothing round is closer than what is flat
        return None
    widths = np.sqrt(np.maximum(np.linalg.eigvalsh(np.cov(x.T)), 0.0))
    toward = x - where.centre
    reach = np.linalg.norm(toward, axis=1)
    outward = (toward / reach[:, None]) ** 2
    off, error = (reach - where.radius)[:, None], float(np.sqrt((outward @ noise**2).mean()))
    if not planar:
        return where if _on(off, error, widths[0]) else None
    back, around = _ways(where.angle)
    bound = back or (d > 2 and around)
    return where if bound and _on(off, error, widths[-2], RETRACED if back else CLOSE) else None


def _told(where: Round) -> str:
    shape, free = (
        ("circle", "its angle is free: on_circle finds it")
        if len(where.axes) == 2
        else ("sphere", "its angles are free: on_sphere finds them")
    )
    centre = ", ".join(
        f"{_to_error(c, e):.4g} +- {e:.1g}"
        for c, e in zip(where.centre, where.centre_errors, strict=True)
    )
    return (
        f"the motion stays on a {shape} (centre {centre}; radius {where.radius:.5g} +- "
        f"{where.radius_error:.1g}): there its coordinates depend on each other and many laws fit "
        f"alike; {free}, and order=2 a law"
    )


def _to_error(value: float, error: float) -> float:
    """A number without the digits that its error, one of them excepted, leaves no meaning."""
    return round(value, 1 - int(np.floor(np.log10(max(error, LEAST))))) + 0.0


def _ways(angle: Floats) -> tuple[bool, bool]:
    """Whether a motion along an arc turns back on it, and whether it goes half round.

    If a step is a large part of a turn, the way between samples is not known.
    """
    if np.quantile(np.abs(np.diff(angle)), 0.9) > COARSEST:
        return False, False
    pieces = [piece.mean() for piece in np.array_split(angle, min(PIECES, len(angle)))]
    length = float(np.ptp(pieces))
    return bool(np.abs(np.diff(pieces)).sum() > SWEPT * length), length > np.pi


def _closed(t: Floats, x: Floats, noise: Floats, terms: Ints) -> Iterator[str]:
    """Is the motion one lap after the other on the same orbit, and that too plain for a law?"""
    scale = x.std(axis=0)
    standard, errors = (x - x.mean(axis=0)) / scale, float(np.sqrt(((noise / scale) ** 2).mean()))
    thin = slice(None, None, -(-len(t) // ENOUGH))
    for period in _periods(t, standard, errors):
        orbit = _Orbit.near(t[thin] - t[0], standard[thin], period)
        if _on(orbit.residual, errors, 1.0):
            scant = np.flatnonzero(orbit.numbers() <= terms + SPARE)
            if len(scant):
                told, wanted = orbit.numbers()[scant[0]], terms[scant[0]]
                yield (
                    f"the motion repeats one closed orbit (period {orbit.period:.4g}) of which the "
                    f"data tell {told} numbers, where a law has {wanted} coefficients: what it "
                    "says off this orbit is not tested; add runs from other starts"
                )
            return


def _periods(t: Floats, x: Floats, noise: float) -> list[float]:
    """Lags after which a motion is near where it was, the shortest first; a few at most."""
    size = min(len(t), ENOUGH)
    even = np.linspace(t[0], t[-1], size)
    u = np.stack([np.interp(even, t, column) for column in x.T], axis=1)
    spectrum = np.abs(np.fft.rfft(u, 2 * size, axis=0)) ** 2
    together = np.fft.irfft(spectrum, 2 * size, axis=0)[:size].sum(axis=1)
    squares = np.append(0.0, np.cumsum((u**2).sum(axis=1)))
    lags = np.arange(int(size / LAPS))
    later, earlier = squares[-1] - squares[lags], squares[size - lags]
    apart = (later + earlier - 2 * together[lags]) / np.minimum(later, earlier) / 2
    first = int((apart > 0.5).argmax())
    inner = apart[1:-1]
    low = (inner <= apart[:-2]) & (inner <= apart[2:]) & (inner < NEARLY**2 + noise**2)
    found = np.flatnonzero(low) + 1
    return [float(even[k] - t[0]) for k in found[found > first][:CANDIDATES]] if first else []


@dataclass(frozen=True, eq=False)
class _Orbit:
    """A closed orbit through samples, as a Fourier series in the time.

    Parameters
    ----------
    period : float
    waves : ndarray of complex, shape (k, d)
        Amplitudes of the harmonics.
    residual : ndarray, shape (n, d)
        What the series leaves of the samples, made up for the freedom that it used.
    """

    period: float
    waves: Complexes
    residual: Floats

    @classmethod
    def near(cls, t: Floats, x: Floats, period: float) -> _Orbit:
        """The orbit with the period near one that fits best."""
        laps = t[-1] / period
        most = int(np.clip(len(t) / laps / 6, 1, HARMONICS))
        for harmonics in sorted({min(2, most), min(6, most), most}):
            reach = 0.5 / laps / harmonics

            def left(log: float, around: float = period, harmonics: int = harmonics) -> float:
                return float((_series(t, x, around * np.exp(log), harmonics)[1] ** 2).sum())

            found = minimize_scalar(
                left, bounds=(-reach, reach), method="bounded", options={"xatol": 1e-4 * reach}
            )
            period *= float(np.exp(found.x))
        waves, residual = _series(t, x, period, most)
        unused = max(1 - (2 * most + 1) / len(t), 0.1)
        return cls(period, waves, residual / np.sqrt(unused))

    def numbers(self) -> Ints:
        """How many numbers of each coordinate stand out from the noise, (d,).

        Counted from a time at which the largest first harmonic is at its height.
        """
        strongest = self.waves[0, np.abs(self.waves[0]).argmax()]
        turns = (strongest.conj() / np.abs(strongest)) ** np.arange(1, len(self.waves) + 1)
        parts = self.waves * turns[:, None]
        error = np.sqrt(2 * (self.residual**2).mean(axis=0) / len(self.residual))
        return np.asarray(
            sum((np.abs(part) > PLAIN * error).sum(axis=0) for part in (parts.real, parts.imag))
        )


def _series(t: Floats, x: Floats, period: float, harmonics: int) -> tuple[Complexes, Floats]:
    """Amplitudes of harmonics, (k, d), that fit samples best, and what they leave, (n, d)."""
    first = np.exp(2j * np.pi / period * t)
    powers = np.cumprod(np.repeat(first[:, None], harmonics, axis=1), axis=1)
    terms = np.hstack([np.ones((len(t), 1)), powers.real, powers.imag])
    gram = terms.T @ terms + 1e-9 * len(t) * np.eye(terms.shape[1])
    found = np.linalg.solve(gram, terms.T @ x)
    return found[1 : 1 + harmonics] - 1j * found[1 + harmonics :], x - terms @ found


def cancelling(law: PolynomialSystem, x: Floats) -> Iterator[str]:
    """The equations of a law whose terms cancel along a motion, seen from its middle.

    Of a law that is no polynomial, and has no other frame, those of a line and a sine.
    """
    if not law.is_polynomial:
        yield from _line_and_sine(law, x)
        return
    middle = x.mean(axis=0)
    central, away = law.shift(-middle), x - middle
    sums = central(away)
    for j, name in enumerate(law.names):
        parts = np.abs(central.coefficients[:, j] * monomials(away, central.exponents)).sum(axis=1)
        times = float(np.sqrt((parts**2).mean() / max((sums[:, j] ** 2).mean(), LEAST)))
        if times > CANCELLED:
            yield (
                f"the terms of d{name}/dt cancel (their sizes add up to {times:.1g} times their "
                "sum): something is constant on these data; look for it, or add runs from other "
                "starts"
            )


def tied(names: Sequence[str], x: Floats) -> Iterator[str]:
    """What to say if along a motion, (n, d), velocities follow from places or from each other.

    So it is with a spring that is equally stiff in all directions, and two throws in space.
    """
    m = len(names) // 2
    if tuple(names[m:]) != velocity_names(names[:m]):
        return
    with np.errstate(divide="ignore", invalid="ignore"):  # a velocity that is constant is tied
        together = np.nan_to_num(np.corrcoef(x.T))
    if np.linalg.eigvalsh(together)[0] < CLOSE**2:
        yield (
            "places and velocities depend on each other on these data (one of them is linear in "
            "the others): many laws fit alike; add runs from other starts"
        )


def _line_and_sine(law: PolynomialSystem, x: Floats) -> Iterator[str]:
    """Equations with x and sin(x) which x and x^3 imitate: neither is simpler."""
    single = law.exponents.sum(axis=1) == 1
    slopes = law(x)
    for i, name in enumerate(law.names):
        sines = [k for k, f in enumerate(law.functions) if f.name == f"sin({name})"]
        for k in sines:
            line, sine = (single & (law.exponents[:, column] == 1) for column in (i, law.d + k))
            value, odd = law.functions[k].value(x), np.stack([x[:, i], x[:, i] ** 3], axis=1)
            left = value - odd @ np.linalg.lstsq(odd, value, rcond=None)[0]
            for j in np.flatnonzero(law.support[line].any(axis=0) & law.support[sine].any(axis=0)):
                part = law.coefficients[sine, j] * left
                if (part**2).mean() < IMITATED**2 * (slopes[:, j] ** 2).mean():
                    yield (
                        f"{name} and sin({name}) in d{law.names[j]}/dt are nearly {name} and "
                        f"{name}^3 on these data: the two cannot be told apart; add runs of a "
                        "larger amplitude"
                    )


def _on(residual: Floats, noise: float, size: float, close: float = CLOSE) -> bool:
    """Whether distances from a shape of some size, (n, k), are those of noise."""
    least, most = _distance(residual, noise)
    return bool(least < close * size and most < TOLD * size)


def _distance(residual: Floats, noise: float) -> tuple[float, float]:
    """Root mean square of a distance less its noise, at least and at most.

    What it is more than the noise, or what it has in common with its neighbour, whichever is more.
    """
    square = float((residual**2).mean())
    shared = float((residual[1:] * residual[:-1]).mean())
    more = max(square - noise**2, shared)
    unsure = PLAIN * square * np.sqrt(2 / residual.size)
    return float(np.sqrt(max(more - unsure, 0.0))), float(np.sqrt(max(more, 0.0) + unsure))


# --------------------------------------------------------------------------------------------------
# Beyond the library: whether terms of higher degree explain what a law leaves of its data.
#
# A cubic imitates a sine, the drag of air or the pull of a planet on the path that was recorded,
# and nowhere else. What it leaves is small but follows the state, so that terms of the next two
# degrees explain it: Rao's score test, of all of them together and of the best of them. And where
# noise hides what it leaves, a law with one of them may fit as well.

HIGHER = 2
"""Degrees beyond that of the library: an odd function needs two."""
BUDGET = 2e7
"""Most entries of the derivatives of the data, or the curve, in the terms that are tried."""
CHANCE_OF_ALL, CHANCE_OF_ONE = 1e-4, 1e-3
"""Probability below which what all higher terms explain, or the best of them, is no chance."""
SLIGHT = 1.5
"""Times that what all higher terms explain by chance, where errors are all but independent, such as
those of tracks in compressed video (1.2 was seen)."""
MOST = 0.9
"""Share of what is left that a term explains which a law lacks: errors that last, of an integrator
or a lens, are spread over several (up to two thirds were seen)."""
FEW = 4
"""Errors that are left, to a term, at which all terms together are few: chance leaves more than
that share."""


@dataclass(frozen=True)
class Beyond:
    """What terms of higher degree would explain, and the best of those that a law has not.

    Parameters
    ----------
    gain : float
        What all of them lower the objective by, in chi-square units.
    count : int
        How many there are.
    best : float
        What the best term does that the law has not, one of theirs or of the library.
    tried : int
        How many these are.
    left : float
        The objective, of which they explain a part.
    term : str
        The best of them, and its equation.
    """

    gain: float
    count: int
    best: float
    tried: int
    left: float
    term: str

    @property
    def significant(self) -> bool:
        """Whether that is more than chance makes."""
        return bool(self.count and (self._all or self._one))

    @property
    def decisive(self) -> bool:
        """Whether one term, or few, explain nearly all that is left, be that noise or not."""
        few, most = FEW * self.count < self.left, MOST * self.left
        return bool(self._alone and self.best > most or few and self.count and self.gain > most)

    @property
    def _alone(self) -> bool:
        # Of as many independent errors as are left, one direction seldom has such a share.
        share, others = min(self.best / self.left, 1.0), max(self.left - 1, 0.0) / 2
        return bool(others and beta.sf(share, 0.5, others) * self.tried < CHANCE_OF_ONE)

    @property
    def _all(self) -> bool:
        return bool(self.gain > SLIGHT * chi2.isf(CHANCE_OF_ALL, self.count))

    @property
    def _one(self) -> bool:
        return bool(chi2.sf(self.best, 1) * self.tried < CHANCE_OF_ONE)


@dataclass(frozen=True)
class Wider:
    """A fit among the candidates of a library and the terms of the next degrees.

    Parameters
    ----------
    law : PolynomialSystem
        In the wider library, of which it has the old terms alone.
    state : State
        The same.
    collocation : Collocation
        The same.
    searched, further : ndarray of int
        Places in the coefficients, equation by equation: of the old candidates, and of the terms
        that the library has not, not even as a function of another name.
    prices : ndarray
        Of all places.
    """

    law: PolynomialSystem
    state: State
    collocation: Collocation
    searched: Ints
    further: Ints
    prices: Floats

    @property
    def columns(self) -> Ints:
        """Places of all candidates and further terms."""
        return np.sort(np.concatenate([self.searched, self.further]))

    @cached_property
    def model(self) -> Linearisation:
        """The quadratic model around the fit, in all candidates and moving axes."""
        axes = self.law.coefficients.size + np.flatnonzero(self.state.moving)
        return self.collocation.linearise(self.state, np.concatenate([self.columns, axes]))

    @property
    def candidates(self) -> Linearisation:
        """The same with the axes as they are: the same law in another frame would count."""
        return self.model.of(self.columns)

    @cached_property
    def beyond(self) -> Beyond:
        """The score test of the terms that the law has not."""
        own = np.flatnonzero(self.state.free())
        others = np.concatenate([self.further, np.setdiff1d(self.searched, own)])
        model = self.model.of(np.concatenate([own, others]))
        estimate, variance = newcomers(model.information, model.gradient, len(own))
        single = estimate**2 / variance
        model = self.model.of(np.concatenate([own, self.further]))
        return Beyond(
            gain=float(model.newton()[1] - model.fall),
            count=len(self.further),
            best=float(single.max(initial=0.0)),
            tried=len(others),
            left=float(self.collocation.objective(self.state)),
            term=place(self.law, int(others[single.argmax()])) if len(others) else "",
        )


def widened(problem: Problem, fit: Fit) -> Wider:
    """The last fit among terms beyond its library; of a fraction, in its numerators."""
    form, size, d = problem.form, len(problem.exponents), problem.d
    equations = np.flatnonzero(form.candidates.any(axis=0))
    grid = fit.collocation.grid
    budget = BUDGET / max(grid.x.size, grid.r * d) / len(equations)
    law, exponents = problem.law(fit.state), problem.exponents
    exponents = _higher(exponents, form.states, budget)
    l, new = len(exponents), len(exponents) - size

    def padded(array: NDArray[Any]) -> NDArray[Any]:
        return np.vstack([array, np.zeros((new, array.shape[1]), array.dtype)])

    places = np.arange(d * l).reshape(d, l)
    shared = places.copy()
    shared[:, :size] = places[:, :size].ravel()[form.shared].reshape(d, size)
    known = padded(fit.collocation.known)
    wider = Wider(
        law=replace(law, exponents=exponents, coefficients=padded(law.coefficients)),
        state=replace(
            fit.state,
            coefficients=padded(fit.state.coefficients),
            active=padded(fit.state.active),
            shared=shared.ravel(),
        ),
        # With a known part of its own shape: a collocation is made for its library.
        collocation=replace(fit.collocation, exponents=exponents, known=known),
        searched=places[:, :size].ravel()[form.searched],
        further=places[equations, size:].ravel(),
        prices=np.tile(term_penalties(exponents, problem.measured[0][1].shape[1], SURE), d),
    )
    return _renamed_left_out(wider) if form.functions else wider


def _renamed_left_out(wider: Wider) -> Wider:
    """The same without further terms that the candidates make, as a function may be a monomial."""
    model = wider.model.of(np.concatenate([wider.searched, wider.further]))
    _, variance = newcomers(model.information, model.gradient, len(wider.searched))
    return replace(wider, further=wider.further[np.isfinite(variance)])


def _higher(exponents: Ints, d: int, budget: float) -> Ints:
    """A library with the monomials of the next degrees; of few variables each, if they are many.

    Its first ``d`` columns are the variables, of which functions may be further ones.
    """
    plain = exponents[(exponents[:, d:] == 0).all(axis=1), :d]
    higher = monomial_exponents(d, int(plain.sum(axis=1).max(initial=0)) + HIGHER)
    higher = higher[~(higher[:, None] == plain).all(axis=2).any(axis=1)]
    for variables in (d, 2, 1):
        kept = higher[(higher > 0).sum(axis=1) <= variables]
        if len(kept) <= budget:
            unused = ((0, 0), (0, exponents.shape[1] - d))
            return np.concatenate([exponents, np.pad(kept, unused)])
    return exponents


def beyond_the_library(wider: Wider, noisy: bool) -> Iterator[str]:
    """A warning if the law is an approximation on these data.

    Errors that last may follow the state, too; they are no reason to doubt, unless a single term,
    or the few that a single coordinate has, explain nearly all of them. What is ``noisy`` has
    errors of single samples.
    """
    found = wider.beyond
    if found.decisive or (noisy and found.significant):
        yield (
            f"terms that the law has not explain what it leaves ({found.term}: chi-square "
            f"{found.best:.4g}, all {found.count} of higher degree together {found.gain:.4g}): it "
            "may be an approximation along these data, as of a sine or a drag; raise the degree, "
            "or name its terms with library="
        )


# --------------------------------------------------------------------------------------------------
# Whether a law has its origin elsewhere, or would do as well around another.
#
# An axis whose origin is that of the data is a claim: of all places in the box of the data it
# would be just there. It is believed if the data hold it to be so likelier than chance makes it.

NEAR_TIE = 4.0
"""Two laws whose criteria differ by less than this (a likelihood ratio of 7) are not told apart."""
CLAIMED = 6.0
"""Twice the logarithm of the odds, 20 to 1, at which a coincidence is believed (strong evidence by
Kass and Raftery 1995)."""
AWAY = "another origin"
"""That of a law is said to be elsewhere than where it was found."""
VANISHED = 1e-6
"""What is left of a term in another frame, over the parts that cancel in it, if it vanishes."""


Rival = tuple[str, str, float]
"""Which other origin, along which axis, and by how much the criterion rises there."""


def elsewhere(
    problem: Problem, state: State, whole: Linearisation, law: PolynomialSystem
) -> Iterator[Rival]:
    """Other laws that fit almost as well, one axis nearer home or one away from it.

    Parameters
    ----------
    problem : Problem
        Its prices.
    state : State
        Of the last fit.
    whole : Linearisation
        Around it, of all candidates and moving axes.
    law : PolynomialSystem
        The law in the frame of the data.
    """
    exponents = problem.exponents
    # The offset stays where it is: with it free, the same law in another frame would count.
    model = whole.of(problem.form.searched)
    own = problem.price(state)
    for axis, there in _neighbours(problem, state):
        for value, rival in _cheapest_two(problem, state, model, there):
            cost = value + problem.axis_penalty * there.moving.sum() - own
            if not cost < NEAR_TIE:
                break  # the next costs more
            matrix = shift_matrix(exponents, rival.offset - problem.home)
            parts = np.abs(matrix) @ np.abs(rival.coefficients)
            terms = (np.abs(matrix @ rival.coefficients) > VANISHED * parts) | (problem.known != 0)
            if (terms != law.support).any():
                where = AWAY if there.moving[axis] else "the origin of the data"
                yield where, problem.form.names[axis], cost
                break


def pinned(
    problem: Problem,
    state: State,
    model: Linearisation,
    law: PolynomialSystem,
    tolerated: float,
) -> Iterator[Rival]:
    """Axes that may as well be a little off home, by which the law would have other terms.

    Where other axes have left, none is at home for the asking: then to be there is a coincidence,
    as much as the box is wider than the origin is uncertain. A move costs twice its logarithm.

    Parameters
    ----------
    problem, state, model, law
        See `elsewhere`.
    tolerated : float
        Errors that have to be tolerated, over those that the law leaves.
    """
    for axis, gain, room, moved in freed(problem, state, model, tolerated):
        new = (np.abs(moved) > VANISHED * np.abs(moved).max(initial=0.0)) & ~law.support
        if state.moving.any() and new.any() and room - gain < CLAIMED:
            yield AWAY, problem.form.names[axis], room - gain


def untold_origins(found: Sequence[Rival], remedy: str) -> Iterator[str]:
    """One line for all axes along which other terms fit almost as well around another origin.

    Parameters
    ----------
    found : sequence of (str, str, float)
    remedy : str
        What to do about it.
    """
    for where in dict.fromkeys(where for where, _, _ in found):
        axes = dict.fromkeys(name for other, name, _ in found if other == where)
        least = min(cost for other, _, cost in found if other == where)
        yield (
            f"the data hardly tell where the law's origin is in {' and in '.join(axes)}: other "
            f"terms around {where} fit almost as well (criterion {least:+.1f}); use {remedy}"
        )


def _neighbours(problem: Problem, state: State) -> Iterator[tuple[int, State]]:
    """The same law with an axis at home that is not, or away from where it is, and which."""
    axes = np.eye(problem.d, dtype=bool)[state.moving]
    nearer = [(np.where(home, problem.home, state.offset), state.moving & ~home) for home in axes]
    for origin, moving in [*nearer, *away(problem, state)]:
        moved = shift_matrix(problem.exponents, state.offset - origin) @ state.coefficients
        axis = int(np.argmax(moving != state.moving))
        yield axis, replace(state, coefficients=moved, offset=origin, moving=moving)


def _cheapest_two(
    problem: Problem, state: State, model: Linearisation, there: State
) -> Iterator[tuple[float, State]]:
    """The cheapest law around a state in another frame and its closest rival, with their costs."""
    # The quadratic model around the law knows them: what a move does to polynomials is exact.
    columns, size = problem.columns(there), state.coefficients.size
    back = shift_matrix(problem.exponents, there.offset - state.offset)
    axes = np.flatnonzero(there.moving)
    rates = -shift_generators(problem.exponents)[axes] @ there.coefficients
    changes = np.vstack([np.eye(size), rates.transpose(0, 2, 1).reshape(-1, size)])
    changes = changes[np.append(problem.form.searched, np.arange(size, len(changes)))]
    changes = (changes @ np.kron(np.eye(problem.d), back.T))[:, model.columns]
    step = (back @ there.coefficients - state.coefficients).T.ravel()[model.columns]
    pull, present = model.gradient - model.information @ step, there.flat()[columns]
    quadratic = changes @ model.information @ changes.T, changes @ pull, present
    risen = float(-step @ (model.gradient + pull))
    prices = np.append(problem.prices, np.full(problem.d, -np.inf))[columns]
    support, solution, value = subset_search(*quadratic, prices, (present != 0) | (columns >= size))
    flat = there.flat()
    flat[columns] = solution
    yield risen + value, there.moved(there.control_points, flat)
    cost, dropped, added = closest_rival(*quadratic, prices, support)
    support[dropped], support[added] = False, True
    flat[columns] = minimiser(*quadratic, support)
    yield risen + value + cost, there.moved(there.control_points, flat)


# --------------------------------------------------------------------------------------------------
# Whether a discovered law should be trusted: each warning in words, with advice.
#
# A warning is a necessary sign of trouble, not a sufficient one: a law without one may be wrong.

MISFIT = 1.5
"""Residual over estimated noise beyond which the law does not fit."""
TURNS = 1.5
"""Turns of the motion that a trajectory should cover."""
REPEATED = 10.0
"""Turns that tell kicks from a wrong law, which misses the same whenever the motion comes by."""
LONGEST_STEP = 1.0
"""Longest typical time step, in time scales of the motion (about 6 to a turn)."""
OUTLIER = 30.0
"""Distance of a sample from those around it, over how far nine samples in ten are from the median,
and over the typical distance of those around it, that no motion explains. Noise of 50 % makes 6."""
GUARD, REACH = 2, 8
"""The samples around one are those from 3 to 8 before and after it: so up to three errors in a row
are compared with what is none."""
CHANCE = 1e-4
"""Probability below which what the left-out terms explain together is no chance."""
RIVAL = 0.5
"""Width of another plateau, over that of the law's own, from which on the law is contested."""
UNMET = 1e-2
"""Root mean square residual of the law along the curve, relative to the speed."""
WILD = 2.0
"""The same residual over that of the kicks of the motion."""
APART = 0.2
"""Root mean square distance of the law's two frames along the curve, relative to the speed: more
than terms that cannot be told from zero make."""
UNLIKELY = 0.02
"""Odds of laws with other coefficients from which on the errors of a law are none to rely on."""
MEANING = {
    Status.MAX_STEPS: "its coefficients may be off by more than their errors",
    Status.STALLED: "terms may be indistinguishable on these data",
}
"""What a fit that ended so may mean."""
BEYOND_COUNTING = 100.0
"""Times a noise beyond which it was all but none, and its multiples say nothing."""


def diagnose(
    problem: Problem,
    fit: Fit,
    model: Linearisation,
    path: Path,
    law: PolynomialSystem,
) -> tuple[str, ...]:
    """Reasons not to trust a law.

    Parameters
    ----------
    problem : Problem
        The data, and the noise as it was estimated before any law was known.
    fit : Fit
        The final fit, its noise re-estimated from the residual.
    model : Linearisation
        Around it, of all candidates.
    path : Path
        On which its terms were chosen.
    law : PolynomialSystem
        The law in the frame of the data.
    """
    wider = widened(problem, fit)
    return (
        *outliers(problem.measured),
        *_shape(problem, fit),
        *_misfit(problem, fit, wider),
        *_doubtful_sigma(problem, fit),
        *_unfinished(fit),
        *_unmet(problem, fit),
        *_another_in_the_data(problem, fit, law),
        *_selection(problem, fit, model, wider, path, law),
        *_sampling(problem),
        *_standstill(law, _remedy(fit)),
    )


def outliers(trajectories: Sequence[Trajectory]) -> list[str]:
    """Samples so far from those around them that they must be errors.

    Parameters
    ----------
    trajectories : sequence of Trajectory
        The data in the user's units.
    """
    found = []
    for t, x in trajectories:
        far: set[int] = set()
        for column in x.T[np.isfinite(x).any(axis=0)]:
            seen = np.flatnonzero(np.isfinite(column))
            values = column[seen]
            away = np.abs(values - np.median(values))
            spread = np.quantile(away, 0.9)
            rows = np.flatnonzero((away > OUTLIER * spread) & (spread > 0)).tolist()
            far |= {int(seen[row]) for row in rows if _leaps(values, row)}
        found += [
            f"t = {t[row]:g}, x = ({', '.join(f'{v:g}' for v in x[row])})" for row in sorted(far)
        ]
    if not found:
        return []
    more = f" and {len(found) - 3} more" if len(found) > 3 else ""
    return [
        f"a sample lies far from those before and after it: {'; '.join(found[:3])}{more}: no "
        "motion explains that; put NaN in its place"
    ]


def _leaps(values: Floats, row: int) -> bool:
    """Whether a sample is far from those around it, too, and not part of a motion far away."""
    before, after = values[max(row - REACH, 0) : max(row - GUARD, 0)], values[row + GUARD + 1 :]
    beside = np.concatenate((before, after[: REACH - GUARD]))
    middle = np.median(beside)
    return bool(abs(values[row] - middle) > OUTLIER * np.median(np.abs(beside - middle)))


def _shape(problem: Problem, fit: Fit) -> Iterator[str]:
    """What follows from where the motion takes place."""
    measured = problem.measured[0][1].shape[1]
    noise = (problem.noise * problem.units.scale)[:measured]
    terms = fit.state.active.sum(axis=0)[-measured:]
    if problem.form.functions:
        terms = np.zeros_like(terms)  # who names a sine knows more than one orbit tells
    rows = [np.isfinite(values).all(axis=1) for _, values in problem.measured]
    whole = [(t[r], x[r]) for r, (t, x) in zip(rows, problem.measured, strict=True) if r.any()]
    if whole:
        yield from shapes(whole, noise, problem.form.names[:measured], terms)
    x, _ = fit.collocation.node_states(fit.state.control_points)
    yield from cancelling(problem.law(fit.state), x - fit.state.offset)
    states = problem.form.states
    yield from tied(problem.form.names[:states], x[:, :states])


def _misfit(problem: Problem, fit: Fit, wider: Wider) -> Iterator[str]:
    residual = residual_noise(fit)
    seen = (fit.collocation.counts > 0) & (residual > RESOLVED)
    ratio = np.where(seen, residual / problem.noise, 0.0)
    misses = ~(ratio < MISFIT)
    # A curve without a law follows errors that last, too: they are no misfit.
    if misses.any() and wider.beyond.count and not wider.beyond.significant:
        misses &= ~passing(fit, len(wider.law.terms))
    if misses.any():
        j = int(np.where(misses, ratio, 0.0).argmax())
        told = "sigma" if problem.measured_errors else "the noise estimated beforehand"
        many = ratio[j] > BEYOND_COUNTING
        times = f"more than {BEYOND_COUNTING:g}" if many else f"{ratio[j]:.1f}"
        yield (
            f"the curve misses the data of {problem.form.names[j]} by "
            f"{residual[j] * problem.units.scale[j]:.3g} ({100 * residual[j]:.3g} % of its spread, "
            f"{times} times {told}): errors may last for several samples, the law may lie outside "
            "the library (raise the degree), or the motion may not be autonomous"
        )


def _doubtful_sigma(problem: Problem, fit: Fit) -> Iterator[str]:
    """Are the errors that were given larger than what is left?"""
    ratio = problem.noise / residual_noise(fit) if problem.measured_errors else np.zeros(problem.d)
    j = int(ratio.argmax())
    if ratio[j] > MISFIT:
        yield (
            f"sigma of {problem.form.names[j]} is {ratio[j]:.3g} times the errors that the law "
            "leaves: the error bars are too wide, and terms may be lost; leave it out, and the "
            "errors are estimated"
        )


def _unfinished(fit: Fit) -> Iterator[str]:
    if fit.status is not Status.CONVERGED:
        yield (
            f"the last fit did not converge ({fit.status.value}): {MEANING[fit.status]}; use "
            f"{_remedy(fit)}, or a lower degree"
        )


def _unmet(problem: Problem, fit: Fit) -> Iterator[str]:
    residual = float(np.sqrt((fit.collocation.physics_residual(fit.state) ** 2).mean()))
    if not residual < max(UNMET, WILD * float(problem.process_noise.max())):
        yield (
            f"the law is not met along the curve (residual {residual:.2g} of the speed): the fit "
            f"did not converge; use {_remedy(fit)}, or another degree"
        )


def _another_in_the_data(problem: Problem, fit: Fit, law: PolynomialSystem) -> Iterator[str]:
    units, (x, _) = problem.units, fit.collocation.node_states(fit.state.control_points)
    native = problem.law(fit.state)(x - fit.state.offset)
    slopes = law(units.point(x)) * units.time / units.scale
    apart = float(np.sqrt(((slopes - native) ** 2).mean()))
    if not apart < APART:
        yield (
            f"the law in the frame of the data is not that in its own frame (apart by {apart:.2g} "
            "of the speed): terms that belong together were told apart; use the native law"
        )


def _selection(
    problem: Problem,
    fit: Fit,
    model: Linearisation,
    wider: Wider,
    path: Path,
    law: PolynomialSystem,
) -> Iterator[str]:
    remedy, clean = _remedy(fit), _is_clean(fit)
    yield from _contested(problem, fit.state, path, remedy)
    if clean and not problem.kicked:
        return  # what is left is the error of the splines, not noise: it settles nothing
    tolerant = clean or max(plateau.low for plateau in path.of(fit.state.active)) > path.lowest
    yield from beyond_the_library(wider, noisy=not tolerant)
    origins = list(pinned(problem, fit.state, model, law, path.tolerated))
    if not tolerant:  # weaker errors than those tolerated say nothing about the law
        # The offset stays where it is: with it free, the same law in another frame would count.
        yield from _left_over(model.of(problem.form.searched), fit.state)
        yield from _far_neighbours(wider, remedy)
        origins += elsewhere(problem.cautious, fit.state, model, law)
    yield from untold_origins(origins, remedy)


def _is_clean(fit: Fit) -> bool:
    """Whether the data have no errors that the splines could tell from their own."""
    return bool((fit.collocation.data_weights**-0.5 <= CLEANEST).all())


def _remedy(fit: Fit) -> str:
    """What data would settle it: what is clean cannot be cleaner."""
    if _is_clean(fit):
        return "a longer trajectory, denser samples or other starts"
    return "cleaner samples or a longer trajectory"


def _range(low: float, high: float) -> str:
    """Two ends with as many digits as tell them apart."""
    for digits in range(1, 4):
        ends = f"{low:.{digits}g}", f"{high:.{digits}g}"
        if ends[0] != ends[1]:
            return f"from {ends[0]} to {ends[1]}"
    return f"at {ends[0]}"


def _contested(problem: Problem, state: State, path: Path, remedy: str) -> Iterator[str]:
    """Is another plateau more than half as wide, where errors last also one of larger errors?"""
    lasting, law = problem.shared or path.level > path.lowest, problem.law(state)
    for own, plateaus in zip(path.of(state.active), path.plateaus, strict=True):
        near = [plateau for plateau in plateaus if plateau.low <= path.level]
        same = [plateau for plateau in near if (plateau.terms == own.terms).all()]
        own = max(same, key=path.width, default=own)
        others = [
            plateau
            for plateau in plateaus
            if (plateau.terms != own.terms).any() and (plateau in near or lasting and same)
        ]
        rival = max(others, key=path.width, default=None)
        if rival and path.width(rival) > RIVAL * path.width(own):
            changed = np.flatnonzero(rival.terms != own.terms).tolist()
            change = ", ".join(
                f"{'with' if rival.terms[k] else 'without'} {spoken(law, k, own.equation)}"
                for k in changed
            )
            yield (
                f"d{law.names[own.equation]}/dt is settled by how large an error is tolerated: "
                f"it stays the same {_range(own.low, own.high)} of the spread of the data, and "
                f"{change} {_range(rival.low, rival.high)}; use {remedy}"
            )


def _left_over(model: Linearisation, state: State) -> Iterator[str]:
    """Would all candidates together explain more than chance (Rao's score test)?"""
    gain = float(model.gradient @ model.newton()[0])
    unused = len(model.columns) - int(state.free()[model.columns].sum())
    if unused and not chi2.sf(gain, unused) > CHANCE:
        yield (
            f"the terms left out explain more than chance (chi-square {gain:.4g} for {unused}): a "
            "term may be missing, or the errors of the measurements depend on each other"
        )


def _far_neighbours(wider: Wider, remedy: str) -> Iterator[str]:
    """Has another law that may as well be true coefficients far from those of this one?"""
    model, law, state = wider.candidates, wider.law, wider.state
    columns = model.columns
    support, present = state.free()[columns], state.flat()[columns]
    if not support.any():
        return
    prices = np.tile(prior_prices(law.exponents), law.d)[columns]
    odds, dropped, added, entry, value = far_neighbours(
        model.information, model.gradient, present, prices, support
    )
    if odds > UNLIKELY:
        out, into = (" and ".join(place(law, columns[k]) for k in at) for at in (dropped, added))
        change = f"{into} instead of {out}" if out and into else f"with {into}" if into else ""
        change = change or f"without {out}"
        yield (
            f"another law may as well be true ({100 * odds:.0f} %), {change}: there "
            f"{place(law, columns[entry])} changes by {100 * (value / present[entry] - 1):+.2g} %, "
            f"far beyond its standard error; use {remedy}"
        )


def _standstill(law: PolynomialSystem, remedy: str) -> Iterator[str]:
    if law.order == 2:
        return  # what moves without a force moves evenly
    for j in np.flatnonzero(~law.support.any(axis=0)):
        name = law.names[j]
        yield f"no term was found for d{name}/dt although {name} moves: use {remedy}"


def _sampling(problem: Problem) -> Iterator[str]:
    form, step = problem.form, typical_step(problem.trajectories)
    # On a line nothing turns; a body need not, if it is seen from several starts.
    bound = form.states > 1 and (form.movable.all() or len(problem.trajectories) == 1)
    if problem.turns < TURNS and bound:
        yield (
            f"the trajectory covers only {problem.turns:.1f} turns of the motion: terms may be "
            "indistinguishable on it; record longer, or several runs from other starts"
        )
    if step > LONGEST_STEP:
        yield f"only {2 * np.pi / step:.1f} samples per turn of the motion: sample faster"
    coarse, short = problem.samples_a_turn < COARSE, problem.turns < REPEATED
    if problem.kicked and (coarse or short):
        few = f"{problem.turns:.1f} turns of {problem.samples_a_turn:.0f} samples each"
        yield (
            f"the motion is taken for kicked at random, which {few} cannot tell from a drive or a "
            f"force that nobody named: {'sample faster' if coarse else 'record longer'}, or name it"
        )
