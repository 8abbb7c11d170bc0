"""A motion on a circle and the law of its angle, sought where a law of its positions is doubted.

On a circle the coordinates depend on each other, and many laws of them fit alike; the angle is the
one that is free. Of a bob on a string it obeys angle'' = -(g / L) sin(angle) - ..., with the angle
counted from where the bob would rest.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats
from .candidates import Library
from .discovery import Discovery
from .physics import Quantity
from .rounds import Round, on_circle
from .smoothing import smooth
from .trajectories import Trajectory

LIBRARY = Library.polynomial(1) + Library.fourier(1)
"""What may pull at an angle: a push, a spring, friction, and gravity in any direction."""
NAME = "angle"
SUPPOSED = "if all its mass is at that radius and all axes have the same scale"
TURNS = 3
"""Most laws of an angle, each of which tells better where it is zero."""
OVER = 4 * 2 * np.pi
"""Most that a run goes round: beside an angle that grows on and on, what pulls at it is small."""


@dataclass(frozen=True, eq=False)
class Swing:
    """A motion on a circle, as `Discovery.swing`.

    Parameters
    ----------
    circle : Round
        Where it takes place: centre, radius and angle, zero where the motion would rest.
    law : Discovery
        Of the angle, in radians: ``angle'' = f(angle, vangle)``.
    """

    circle: Round
    law: Discovery

    @property
    def g(self) -> Quantity | None:
        """What pulls at it; None if no sine is in the law.

        If all its mass is at that radius, and all axes have the same scale: along an arc, a scale
        that is off by one per cent makes two of the radius, and the data hardly tell.
        """
        row, circle = self.law.terms.index(f"sin({NAME})"), self.circle
        pull, error = -self.law.coefficients[row, 1], self.law.standard_errors[row, 1]
        if not pull:
            return None
        error = np.hypot(circle.radius * error, pull * circle.radius_error)
        return Quantity("g", np.asarray(circle.radius * pull), np.asarray(error))

    def __str__(self) -> str:
        radius, g = f"{self.circle.radius:.6g} ± {self.circle.radius_error:.2g}", self.g
        pulled = "" if g is None else f"; {g}, {SUPPOSED}"
        doubts = (f"doubt: {text}" for text in (*self.circle.warnings, *self.law.warnings))
        law = f"on a circle of radius {radius}: {self.law.equations()}{pulled}"
        return "\n".join([law, *doubts])


def swinging(
    runs: Sequence[Trajectory],
    shared: Sequence[Floats],
    solve: Callable[[list[Trajectory], list[Floats]], Discovery],
) -> Swing:
    """The swing of a motion that is on a circle.

    Parameters
    ----------
    runs : sequence of (t, x)
        Its positions in the plane or in space, with NaN where it was not seen.
    shared : sequence of ndarray, shape (n, d, k)
        Errors that all positions share.
    solve : callable
        From angles, (n, 1), with the errors that they share, (n, 1, k), to their law.

    Raises
    ------
    ValueError
        If there is too little of a motion for a law.
    """
    x = np.concatenate([values for _, values in runs])
    modes = np.moveaxis(np.concatenate(list(shared)), -1, 0)
    own, zero = on_circle(x).centre_covariance, None
    for _ in range(TURNS):
        circle = on_circle(x, zero, modes)
        law = solve(*_samples(circle, own, runs))
        rest = _rest(law)
        if not rest:
            break
        zero = np.array([np.cos(rest), np.sin(rest)]) @ circle.axes
    return Swing(circle, law)


def _samples(
    circle: Round, own: Floats, runs: Sequence[Trajectory]
) -> tuple[list[Trajectory], list[Floats]]:
    """The angles of each run where they were seen, and the errors that they share, (n, 1, k).

    Those of positions, and those of the centre, of covariance ``own``, which moves the angle by
    what it moves across the line of sight from there. What goes round and round is several runs.
    """
    variances, directions = np.linalg.eigh(circle.axes @ own @ circle.axes.T)
    moves = np.sqrt(np.maximum(variances, 0.0)) * directions / circle.radius  # one a column
    sizes = np.cumsum([len(t) for t, _ in runs])[:-1]
    given = np.split(np.asarray(circle.systematic)[:, :, 0].T, sizes)
    angles, errors, rng = [], [], np.random.default_rng(0)
    for (t, _), angle, known in zip(runs, np.split(circle.angle, sizes), given, strict=True):
        seen = np.isfinite(angle)
        angles.append((t[seen], angle[seen, None]))
        # Without the noise of the samples, which would explain itself.
        curve = smooth([angles[-1]], rng).splines[0](t[seen])
        across = np.hstack([np.sin(curve), -np.cos(curve)]) @ moves
        errors.append(np.hstack([known[seen], across])[:, None])
    parts = [
        ((t[part], angle[part] - _bottom(angle[part])), error[part])
        for (t, angle), error in zip(angles, errors, strict=True)
        for part in _rounds(angle[:, 0])
    ]
    return [run for run, _ in parts], [error for _, error in parts]


def _rounds(angle: Floats) -> list[Bools]:
    """Which samples are a run of its own, of a few turns at most; the law is that of each turn."""
    gone = np.maximum.accumulate(np.abs(angle - angle[0]))
    number = max(int(np.ceil(gone[-1] / OVER)), 1)
    part = np.minimum(number * gone / max(gone[-1], OVER), number - 0.5).astype(int)
    return [part == k for k in range(number)]


def _bottom(angle: Floats) -> float:
    """The full turns nearest to the middle of a motion."""
    return float(2 * np.pi * np.round(angle.mean() / (2 * np.pi)))


def _rest(law: Discovery) -> float:
    """The angle at which nothing pulls, if that is told from zero; otherwise zero.

    What goes over the top may have no place of rest near the middle of its motion: then its sine
    and cosine say.
    """
    places = [quantity for quantity in law.physics().quantities if quantity.name == "rest"]
    if not places:
        sine, cosine = (
            law.coefficients[law.terms.index(f"{f}({NAME})"), 1] for f in ("sin", "cos")
        )
        return float(np.arctan2(cosine, 0.0 - sine))
    return sum(float(q.value[0]) for q in places if abs(q.value[0]) > q.error[0])
