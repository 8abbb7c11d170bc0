"""The result of a discovery: the law in two frames, its uncertainty, and whether to trust it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline

from ..arrays import Floats
from ..checks import check_array
from .absent import unseen
from .candidates import Library
from .history import Step
from .persistence import Plateau
from .physics import Physics, physics_of
from .polynomials import PolynomialSystem, power_of_ten

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .swing import Swing


SHOWN = 3
"""Most absent terms that are printed."""


@dataclass(frozen=True)
class Simulation:
    """What a law foretells.

    Parameters
    ----------
    t : ndarray, shape (n,)
    x : ndarray, shape (n, d)
        NaN from where the path has left all bounds.
    status : str
        ``"ok"``, or where the path diverges, or is too stiff to be followed.
    """

    t: Floats
    x: Floats
    status: str


@dataclass(frozen=True)
class Discovery:
    """A discovered law.

    Parameters
    ----------
    system : PolynomialSystem
        The law in the frame of the data.
    native : PolynomialSystem
        The law in the frame in which it is sparsest, or in one such frame if there are several:
        ``system`` is ``native.shift(offset)``, less the terms that the data cannot tell from zero.
    offset : ndarray, shape (d,)
        Origin of the native frame, in units of the data.
    covariance, native_covariance : ndarray, shape (l d, l d)
        Of the coefficients, equation by equation, if the terms are the right ones; zero for
        inactive terms.
    offset_errors : ndarray, shape (d,)
        Standard errors of the offset; zero along an axis that was not moved.
    noise : ndarray, shape (d,)
        Estimated standard deviation of the errors of single samples, in units of the data.
    model_error : ndarray, shape (d,)
        How far the motion departs from the law by itself: what random kicks add to each
        coordinate in a unit of time (standard deviation, in units of the data over the square root
        of time). Zero where the data agree with a law that holds exactly.
    warnings : tuple of str
        Why the law should not be trusted, with advice; empty if nothing was found.
    path : tuple of tuple of Plateau
        Of each equation, its laws in the native frame over the tolerated error, from the least
        errors that a law leaves up to the spread of the data. The law is the widest of those that
        begin below what has to be tolerated.
    history : tuple of Step
        How the fit went.
    curves : tuple of scipy.interpolate.BSpline
        The fitted curve, one spline per stretch of data, in units of the data.
    absent : ndarray, shape (l, d, 2)
        Of each candidate term of ``native`` that the law has not, the 95 % interval of what it
        would be if it alone were added, all else fitted again; NaN for what is in the law or no
        candidate. See `intervals` of the module ``absent`` for the formula.
    note : str
        Which order the law has and why, where both were looked for.
    orientation : ndarray, shape (m, m), optional
        Axes of a law whose orientation was learned, one a row, in those of the data: the law, its
        curve and what it simulates are in them, a place of the data is ``x @ orientation.T`` there,
        and one of theirs ``x @ orientation`` in the data. None where they are the data's own.
    swing : Swing, optional
        Where positions are bound to a circle, and no law of theirs is beyond doubt: the circle, as
        ``swing.circle``, and the law of the angle on it, ``swing.law``. None elsewhere.
    """

    system: PolynomialSystem
    native: PolynomialSystem
    offset: Floats
    covariance: Floats
    native_covariance: Floats
    offset_errors: Floats
    noise: Floats
    model_error: Floats
    warnings: tuple[str, ...]
    path: tuple[tuple[Plateau, ...], ...]
    history: tuple[Step, ...]
    curves: tuple[BSpline, ...]
    absent: Floats
    note: str = ""
    orientation: Floats | None = None
    swing: Swing | None = None

    @property
    def status(self) -> str:
        """``"ok"``, or ``"suspect"`` if there is a warning."""
        return "suspect" if self.warnings else "ok"

    @property
    def axes(self) -> str:
        """Where the axes of the law point in those of the data; empty if they are these."""
        if self.orientation is None:
            return ""
        rows = (", ".join(f"{part:.4f}" for part in row) for row in self.orientation)
        pairs = zip(self.system.names, rows, strict=False)
        return "turned, " + ", ".join(f"{name} along ({row})" for name, row in pairs)

    @property
    def coefficients(self) -> Floats:
        """``Lambda`` in the frame of the data, shape (l, d)."""
        return self.system.coefficients

    @property
    def terms(self) -> tuple[str, ...]:
        """Names of the candidate terms, length l."""
        return self.system.terms

    @property
    def standard_errors(self) -> Floats:
        """Standard errors of `coefficients`, shape (l, d)."""
        return _errors(self.covariance, self.system)

    @property
    def native_standard_errors(self) -> Floats:
        """Standard errors of the coefficients of `native`, shape (l, d)."""
        return _errors(self.native_covariance, self.native)

    def equations(self, frame: str = "data") -> str:
        """The law as text, every coefficient with its standard error.

        Parameters
        ----------
        frame : {"data", "native"}
            Which frame.
        """
        if frame not in ("data", "native"):
            raise ValueError(f"frame: must be 'data' or 'native', got {frame!r}")
        native = frame == "native"
        law = self.native if native else self.system
        errors = self.native_standard_errors if native else self.standard_errors
        lines = []
        for j, side in law.sides().items():
            above, below = (
                " ".join(
                    _with_error(sign * law.coefficients[r, j], errors[r, j], law.factors[r])
                    for r in np.flatnonzero(law.support[:, j] & rows)
                )
                for sign, rows in ((1, ~law.implicit), (-1, law.implicit))
            )
            text = above.removeprefix("+ ") or "0"
            lines.append(f"{side} = ({text}) / (1 {below})" if below else f"{side} = {text}")
        return "\n".join(lines)

    def curve(self, t: Floats) -> Floats:
        """The fitted curve, shape (n, d), in the frame of the data; NaN outside the stretches."""
        t = check_array("t", t)
        values = np.full((*t.shape, self.system.d), np.nan)
        for spline in self.curves:
            low, high = spline.t[0], spline.t[-1]
            slack = 1e-9 * (high - low)
            inside = (t >= low - slack) & (t <= high + slack)
            values[inside] = spline(np.clip(t[inside], low, high))
        return values

    def predict(self, x: Floats) -> Floats:
        """Time derivative at states, shape (n, d) or (d,), in units of the data.

        Raises
        ------
        ValueError
            If the states have another shape, or an input of the law is not known at their times.
        """
        slopes = self.system(x)
        self.system.check_inputs(np.atleast_2d(x)[:, -1])
        return slopes

    def simulate(self, x0: Floats, t: Floats) -> Simulation:
        """Follow the law from the state ``x0`` at ``t[0]``.

        Parameters
        ----------
        x0 : array_like, shape (d,)
            Where to start; of a law with inputs without the time, its last variable.
        t : array_like, shape (n,)
            Increasing times.

        Raises
        ------
        ValueError
            If the state has another shape, or an input of the law is not known at a time.
        """
        x, end = self.system.followed(t, x0)
        t, lost = np.asarray(t, dtype=float), np.isnan(x).any(axis=1)
        status = f"{end} after t = {t[lost.argmax() - 1]:g}" if lost.any() else "ok"
        return Simulation(t, x, status)

    def physics(self, down: ArrayLike | None = None) -> Physics:
        """What a law of motion says of a body: g and drag, or springs and periods; its energy.

        Parameters
        ----------
        down : array_like, shape (m,), optional
            Direction of gravity, if it is known: g is the pull along it. By default that of the
            force that acts on a body at rest.

        Returns
        -------
        Physics
            Named numbers with standard errors, carried through from those of the coefficients, as
            in ``found.physics()["g"].value``; ``print`` shows them all, and what cannot be said.

        Raises
        ------
        ValueError
            If ``down`` is no direction.
        """
        return physics_of(self.system, self.covariance, self.curves, down)

    def plot_path(self) -> Figure:
        """Draw `path`: the terms of each equation over the error that is tolerated.

        Returns
        -------
        matplotlib.figure.Figure
            One panel an equation. The law is drawn broad: it should be the widest plateau by far.
        """
        from .drawing import draw_path  # which imports matplotlib

        return draw_path(self.path, self.native.support, self.system.sides())

    def save(self, path: str | os.PathLike) -> None:
        """Write everything to a text file (JSON), with all digits; `load` reads it.

        Raises
        ------
        ValueError
            If the file cannot be there: it is a folder, or its folder does not exist.
        """
        from .storage import write  # which needs this class

        write(self, path)

    @staticmethod
    def load(path: str | os.PathLike, library: Library | None = None) -> Discovery:
        """Read a discovery that `save` has written.

        Parameters
        ----------
        path : str or path
            The file.
        library : Library, optional
            That holds the functions of one's own in the law, if there are any: a file holds their
            names, and enough of their values to tell others.

        Raises
        ------
        FileNotFoundError
            If there is no such file.
        ValueError
            If the file holds none, or the library not all functions of the law, or others.
        """
        from .storage import read  # which needs this class

        return read(path, library)

    def statement(self) -> str:
        """The law as text, and what was found out beside it: all but the warnings."""
        lines = [self.equations()]
        if self.swing is not None:
            lines = [str(self.swing), "a law of its positions, one of many that fit alike:", *lines]
        if self.model_error.any():
            sizes = zip(self.model_error, self.system.names, strict=True)
            kicks = ", ".join(f"{size:.2g} in {name}" for size, name in sizes if size)
            lines.append(f"as if kicked at random, by {kicks} over a unit of time")
        if said := self.physics().headline:
            lines.append(said)
        if terms := list(unseen(self.native, self.offset, self.curves, self.absent)):
            frame = "in its own frame, " if self.offset.any() else ""
            more = f" and {len(terms) - SHOWN} more" if len(terms) > SHOWN else ""
            lines.append(
                f"not seen, though they may be as large as terms of the law: {frame}"
                f"{', '.join(terms[:SHOWN])}{more}"
            )
        if self.orientation is not None:
            lines.append(f"axes: {self.axes}; the error bars hold theirs")
        if self.note:
            lines.append(f"note: {self.note}")
        return "\n".join(lines)

    def __str__(self) -> str:
        return "\n".join([self.statement(), *(f"warning: {text}" for text in self.warnings)])


def _errors(covariance: Floats, law: PolynomialSystem) -> Floats:
    variance = np.maximum(np.diag(covariance), 0.0)
    return np.sqrt(variance).reshape(law.coefficients.shape[::-1]).T


def _with_error(value: float, error: float, term: str) -> str:
    """A term of an equation with two digits of its error; one that is known has none."""
    power = power_of_ten(max(abs(value), error))
    size, spread = abs(value) / 10.0**power, error / 10.0**power
    number = f"{size:g}"
    if error > 0:
        digits = int(np.clip(1 - np.floor(np.log10(spread)), 0, 12))
        number = f"({size:.{digits}f} ± {spread:.{digits}f})"
    number += f"e{power}" if power else ""
    return f"{'-' if value < 0 else '+'} {number}" + ("" if term == "1" else f" {term}")
