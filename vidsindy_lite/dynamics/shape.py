"""Where a motion takes place, looked at before any law: a coordinate at rest, a line, a plane, a
circle, a sphere, one closed orbit.

There the terms of a library depend on each other, and many laws fit alike. A motion is on a shape
if its distance from it, less the noise, is nothing of the size of the shape: not because noise may
hide it, but because the data are good enough to tell.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ..arrays import Bools, Floats, Ints
from .library import monomials, velocity_names
from .polynomials import PolynomialSystem
from .rounds import Round, on_circle, on_sphere
from .trajectories import Trajectory

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
SURE = 3.0
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
LEAST = 1e-300
"""Keeps a quotient finite where nothing is left."""
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
            sum((np.abs(part) > SURE * error).sum(axis=0) for part in (parts.real, parts.imag))
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
    unsure = SURE * square * np.sqrt(2 / residual.size)
    return float(np.sqrt(max(more - unsure, 0.0))), float(np.sqrt(max(more, 0.0) + unsure))
