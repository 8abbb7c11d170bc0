"""The result of a discovery: the law in two frames, its uncertainty, and whether to trust it; as a
file, and its path of laws as a picture."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline
from tqdm import tqdm

from ..arrays import Bools, Floats
from ..checks import MALFORMED, check_array, check_choice, check_instance, check_output, shown
from ..storage import check_file, read_tree, write_json
from ..values import built, decoded, encoded
from .bspline import smooth
from .collocation import Fit, WithCurve
from .data import Trajectory
from .library import Function, Library, extended, of_pieces
from .mechanics import NAME, Physics, Quantity, Round, on_circle, physics_of
from .model import PolynomialSystem, place, with_error

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Plateau:
    """A range of tolerated errors over which the law of one equation has the same terms.

    Parameters
    ----------
    equation : int
        Column of the coefficients.
    low, high : float
        Tolerated errors, relative to the spread of the data.
    terms : ndarray of bool, shape (l,)
        Which terms the equation has, in the law's own frame.
    """

    equation: int
    low: float
    high: float
    terms: Bools

    @property
    def decades(self) -> float:
        """Width of the range in decades."""
        return float(np.log10(self.high / self.low))


@dataclass(frozen=True, eq=False)
class Path:
    """The laws of all equations around a fit, from the errors that it leaves up to no law at all.

    Parameters
    ----------
    fit : Fit
        Around which the laws are found.
    model : WithCurve
        Its quadratic model: `Problem.model`.
    own : float
        The errors that the fit was weighted with; those of the law, where kicks are larger.
    level : float
        Errors that have to be tolerated: a plateau that begins above them is no law of these data.
    plateaus : tuple of tuple of Plateau
        Of each equation, from the smallest tolerated error up.
    """

    fit: Fit
    model: WithCurve
    own: float
    level: float
    plateaus: tuple[tuple[Plateau, ...], ...]

    @property
    def lowest(self) -> float:
        """The smallest tolerated error."""
        return self.plateaus[0][0].low

    @property
    def tolerated(self) -> float:
        """Errors that have to be tolerated, times those that the fit was weighted with."""
        return max(self.level / self.own, 1.0)

    def width(self, plateau: Plateau) -> float:
        """How far a plateau reaches beyond the errors there are, in decades."""
        return max(replace(plateau, low=max(plateau.low, self.own)).decades, 0.0)

    def widest(self) -> list[Plateau]:
        """The widest plateau of each equation, of those that begin at or below the level."""
        near = ((p for p in path if p.low <= self.level) for path in self.plateaus)
        return [max(plateaus, key=lambda p: p.decades) for plateaus in near]

    def of(self, active: Bools) -> list[Plateau]:
        """The lowest plateau with the terms of each equation of a law, or the lowest of all."""
        return [
            next((p for p in path if (p.terms == terms).all()), path[0])
            for path, terms in zip(self.plateaus, active.T, strict=True)
        ]


@dataclass(frozen=True)
class Step:
    """One line of the history of a discovery.

    Parameters
    ----------
    stage : str
        What was done.
    seconds : float
        Time since the start.
    data_loss : float
        Mean square residual of the data over the noise variance.
    physics_loss : float
        Mean square residual of the law in standard units.
    terms : int
        Number of active terms.
    """

    stage: str
    seconds: float
    data_loss: float
    physics_loss: float
    terms: int


@dataclass(frozen=True)
class History:
    """The steps of a discovery so far, in the order of time, and how much of it is left.

    Parameters
    ----------
    steps : list of Step
    began : float
        On the clock of `time.perf_counter`.
    end : float
        When no further round begins, on that clock.
    bar : tqdm, optional
        Moves with every round.
    """

    steps: list[Step] = field(default_factory=list)
    began: float = field(default_factory=time.perf_counter)
    end: float = np.inf
    bar: tqdm | None = None

    @property
    def over(self) -> bool:
        """Whether there is no time left."""
        return time.perf_counter() > self.end

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is to be told if the time was not enough."""
        told = "the time limit of `discover` ended the search: this is the best law so far"
        return (told,) if self.over else ()

    def another(self) -> bool:
        """Count a round, and say whether there is time for another."""
        if self.bar is not None:
            self.bar.update()
        return not self.over

    def add(self, stage: str, fit: Fit) -> None:
        """Add what a fit has reached, and let the bar show the time."""
        if self.bar is not None:
            self.bar.update(0)
        state, collocation = fit.state, fit.collocation
        data = collocation.data_loss(state.control_points)
        self.steps.append(
            Step(
                stage=stage,
                seconds=time.perf_counter() - self.began,
                data_loss=data / collocation.counts.sum(),
                physics_loss=float((collocation.physics_residual(state) ** 2).mean()),
                terms=int(state.active.sum()),
            )
        )


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
        candidate. See `intervals` of the module ``inference`` for the formula.
    note : str
        Which order the law has and why, where both were looked for.
    orientation : ndarray, shape (m, m), optional
        Axes of a law whose orientation was learned, one a row, in those of the data: the law, its
        curve and what it simulates are in them, a place of the data is ``x @ orientation.T`` there,
        and one of theirs ``x @ orientation`` in the data. None where they are the data's own.
    swing : Swing, optional
        Where positions are bound to a circle, and no law of theirs is beyond doubt: the circle, as
        ``swing.circle``, and the law of the angle on it, ``swing.law``. None elsewhere.
    across : tuple of scipy.interpolate.BSpline
        Curves across the gaps between stretches in which the law leads from one side to the other.
    force : str
        What `physics` calls a constant force: ``"g"``, or ``"pull"`` of what something bears.
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
    across: tuple[BSpline, ...] = ()
    force: str = "g"

    @property
    def status(self) -> str:
        """``"ok"``, or ``"suspect"`` if there is a warning."""
        return "suspect" if self.warnings else "ok"

    @property
    def axes(self) -> str:
        """Where the axes of the law point in those of the data; empty if they are these."""
        if self.orientation is None:
            return ""
        rounded = np.round(self.orientation, 4) + 0.0  # none of them -0
        if (rounded == np.eye(*rounded.shape)).all():
            return ""
        rows = (", ".join(f"{part:.4f}" for part in row) for row in rounded)
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
        check_choice("frame", frame, ("data", "native"))
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
        """The fitted curve, shape (n, d), in the frame of the data.

        In gaps, too, across which the law leads; NaN elsewhere.
        """
        return of_pieces((*self.curves, *self.across), check_array("t", t))

    def predict(self, x: Floats) -> Floats:
        """Time derivative at states, shape (n, d) or (d,), in units of the data.

        What is named like the variables, as columns of a data frame are, may have any order.

        Raises
        ------
        ValueError
            If states have another shape or names, or an input is not known at their times.
        """
        x = check_array("x", x, self.system.names)
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

        Of a body on a circle, see `swing`, that of its angle, which knows no directions.

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
        if self.swing is not None:
            return self.swing.law.physics()
        return physics_of(self.system, self.covariance, self.curves, down, self.force)

    def plot_path(self) -> Figure:
        """Draw `path`: the terms of each equation over the error that is tolerated.

        Returns
        -------
        matplotlib.figure.Figure
            One panel an equation. The law is drawn broad: it should be the widest plateau by far.
        """
        import matplotlib.pyplot as plt
        from matplotlib.ticker import MaxNLocator

        sides = self.system.sides()
        figure, panels = plt.subplots(
            1, len(sides), figsize=(2.9 * len(sides), 2.8), sharex=True, sharey=True,
            squeeze=False, layout="constrained",
        )  # fmt: skip
        for axes, (j, side) in zip(panels[0], sides.items(), strict=True):
            edges = [self.path[j][0].low, *(plateau.high for plateau in self.path[j])]
            counts = [int(plateau.terms.sum()) for plateau in self.path[j]]
            axes.stairs(counts, edges, color="0.4", baseline=None, label="all laws")
            for own in (p for p in self.path[j] if (p.terms == self.native.support[:, j]).all()):
                axes.hlines(own.terms.sum(), own.low, own.high, color="C1", lw=5, label="the law")
            axes.set(xscale="log", xlabel="tolerated error\n/ standard deviation", title=side)
            axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        panels[0, 0].set(ylabel="terms", ylim=(0, None))
        drawn = [axes.get_legend_handles_labels() for axes in panels[0]]
        shown = {label: one for pair in drawn for one, label in zip(*pair, strict=True)}
        figure.legend(shown.values(), shown, loc="outside upper center", ncols=2)
        return figure

    def save(self, path: str | os.PathLike) -> None:
        """Write everything to a text file (JSON), with all digits; `load` reads it.

        Raises
        ------
        ValueError
            If the file cannot be there: it is a folder.
        """
        file = check_output("path", path)
        content = {
            "format": FORMAT,
            "functions": encoded(_values(self), str),
            "discovery": encoded(self, attrgetter("__name__"), (Function,)),
        }
        write_json(file, content)

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
        file = check_file("path", path, "file of a discovery")
        if library is not None:
            check_instance("library", library, Library)
        content = read_tree("path", file, ".json")
        message = f"path: must be a file that Discovery.save has written, got '{file}'"
        if not isinstance(content, dict) or content.get("format") != FORMAT:
            raise ValueError(f"{message}, whose format is not {FORMAT!r}")
        try:
            found = decoded(content["discovery"], _built)
            values = decoded(content.get("functions"), _built)
            _check_shapes(found)
            if values is not None:  # of a file of today
                shape = _PLACES, len(found.system.functions)
                values = check_array("functions", values).reshape(shape)
        except MALFORMED as error:
            raise ValueError(f"{message}: {shown(error)}") from error
        found = _with_functions(found, library, values)
        if found.swing is None:
            return found
        swung = _with_functions(found.swing.law)
        return replace(found, swing=replace(found.swing, law=swung))

    def statement(self) -> str:
        """The law as text, and what was found out beside it: all but the warnings."""
        lines, said = [self.equations()], self.physics().headline
        if self.swing is not None:
            positions = "a law of its positions, one of many that fit alike:"
            lines, said = [str(self.swing), said, positions, *lines], ""
        if self.model_error.any():
            sizes = zip(self.model_error, self.system.names, strict=True)
            noise = ", ".join(f"{size:.2g} in {name}" for size, name in sizes if size)
            lines.append(f"process noise: {noise} over a unit of time")
        lines.append(said)
        if terms := list(unseen(self.native, self.offset, self.curves, self.absent)):
            frame = "in its own frame, " if self.offset.any() else ""
            more = f" and {len(terms) - 3} more" if len(terms) > 3 else ""
            lines.append(
                f"not seen, though they may be as large as terms of the law: {frame}"
                f"{', '.join(terms[:3])}{more}"
            )
        if self.axes:
            lines.append(f"axes: {self.axes}; the error bars hold theirs")
        if self.note:
            lines.append(f"note: {self.note}")
        return "\n".join(filter(None, lines))

    def __str__(self) -> str:
        return "\n".join([self.statement(), *(f"warning: {text}" for text in self.warnings)])

    def __repr__(self) -> str:
        return f"<Discovery of {', '.join(self.system.names)}: {self.status}>"


def _errors(covariance: Floats, law: PolynomialSystem) -> Floats:
    variance = np.maximum(np.diag(covariance), 0.0)
    return np.sqrt(variance).reshape(law.coefficients.shape[::-1]).T


def _with_error(value: float, error: float, term: str) -> str:
    """A term of an equation with two digits of its error; one that is known has none."""
    number, power = with_error(np.abs(value), error)
    number = (f"({number})" if error > 0 else number) + (f"e{power}" if power else "")
    return f"{'-' if value < 0 else '+'} {number}" + ("" if term == "1" else f" {term}")


def unseen(
    law: PolynomialSystem, offset: Floats, curves: Sequence[BSpline], absent: Floats
) -> Iterator[str]:
    """Absent terms that may make more of a slope than one of the law does, the largest first.

    How much a term makes of a slope is its root mean square along the curve. Where the origin was
    moved, a term of any size is what a further move makes up for: the same law in another frame.
    """
    x = np.concatenate([curve(np.unique(curve.t)) for curve in curves]) - offset
    size = np.sqrt((law.library(x) ** 2).mean(axis=0))[:, None]
    own = np.where(law.support, size * np.abs(law.coefficients), np.inf).min(axis=0)
    endless = 0.0 if offset.any() else np.inf
    most = np.nan_to_num(np.abs(absent).max(axis=2), nan=0.0, posinf=endless)
    with np.errstate(invalid="ignore"):  # of an equation without terms
        reach = size * most / own
    for entry in np.argsort(-reach, axis=None, kind="stable")[: int((reach > 1).sum())].tolist():
        row, j = divmod(entry, law.d)
        low, high = absent[row, j]
        between = f"{low:.2g} to {high:.2g}" if np.isfinite(most[row, j]) else "of any size"
        yield f"{place(law, j * len(law.terms) + row)} ({between})"


# --------------------------------------------------------------------------------------------------
# A motion on a circle and the law of its angle, sought where a law of its positions is doubted.
#
# On a circle the coordinates depend on each other, and many laws of them fit alike; the angle is
# the one that is free. Of a bob on a string it obeys angle'' = -(g / L) sin(angle) - ..., with the
# angle counted from where the bob would rest.

#: What may pull at an angle and is the same after a full turn: a push, friction, and gravity in any
#: direction.
LIBRARY = (Library.polynomial(1) + Library.fourier(1)).where({"vangle": {"angle": 0}})


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
        if f"sin({NAME})" not in self.law.system.text():
            return None
        row, circle = self.law.terms.index(f"sin({NAME})"), self.circle
        pull, error = -self.law.coefficients[row, 1], self.law.standard_errors[row, 1]
        error = np.hypot(circle.radius * error, pull * circle.radius_error)
        return Quantity("g", np.asarray(circle.radius * pull), np.asarray(error))

    def __str__(self) -> str:
        radius, g = f"{self.circle.radius:.6g} ± {self.circle.radius_error:.2g}", self.g
        supposed = "if all its mass is at that radius and all axes have the same scale"
        pulled = "" if g is None else f"; {g}, {supposed}"
        law = f"on a circle of radius {radius}: {self.law.equations()}{pulled}"
        doubts = (*self.circle.warnings, *self.law.warnings)
        return "\n".join([law, *(f"doubt: {text}" for text in doubts)])


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
    own, zero, found = on_circle(x).centre_covariance, None, list[Swing]()
    for _ in range(3):  # each law tells better where the angle is zero, or is none
        circle = on_circle(x, zero, modes)
        found.append(Swing(circle, solve(*_samples(circle, own, runs))))
        rest = _rest(found[-1].law)
        if not rest:
            break
        zero = np.array([np.cos(rest), np.sin(rest)]) @ circle.axes
    least = min(swing.law.noise[0] for swing in found)
    return [swing for swing in found if swing.law.noise[0] <= 1.5 * least][-1]


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
        t, angle = t[seen], angle[seen, None]
        # Without the noise of the samples, which would explain itself.
        curve = smooth([(t, angle)], rng).splines[0](t)
        across = np.hstack([np.sin(curve), -np.cos(curve)]) @ moves
        error = np.hstack([known[seen], across])[:, None]
        for part in _rounds(angle[:, 0]):
            turn = 2 * np.pi * np.round(angle[part].mean() / (2 * np.pi))  # nearest to its middle
            angles.append((t[part], angle[part] - turn))
            errors.append(error[part])
    return angles, errors


def _rounds(angle: Floats, most: float = 4 * 2 * np.pi) -> list[Bools]:
    """Which samples are a run of its own, of a few turns at most; the law is that of each turn.

    Beside an angle that grows on and on, what pulls at it is small.
    """
    gone = np.maximum.accumulate(np.abs(angle - angle[0]))
    number = max(int(np.ceil(gone[-1] / most)), 1)
    part = np.minimum(number * gone / max(gone[-1], most), number - 0.5).astype(int)
    return [part == k for k in range(number)]


def _rest(law: Discovery) -> float:
    """The angle at which nothing pulls, if that is told from zero; otherwise zero.

    What goes over the top may have no place of rest near the middle of its motion: then its sine
    and cosine say.
    """
    places = [quantity for quantity in law.physics().quantities if quantity.name == "rest"]
    if not places:
        sine = law.coefficients[law.terms.index(f"sin({NAME})"), 1]
        cosine = law.coefficients[law.terms.index(f"cos({NAME})"), 1]
        return float(np.arctan2(cosine, 0.0 - sine))
    return sum(float(q.value[0]) for q in places if abs(q.value[0]) > q.error[0])


# --------------------------------------------------------------------------------------------------
# A discovery as a text file: JSON in which every number keeps all its digits.

FORMAT = "vidsindy_lite discovery, version 1"
_PLACES = 20  # on a curve, at which a file holds the values of functions
TYPES: dict[str, Any] = {
    kind.__name__: kind for kind in (Discovery, PolynomialSystem, Plateau, Step, Swing, Round)
}


def _with_functions(
    found: Discovery, library: Library | None = None, written: Floats | None = None
) -> Discovery:
    """A discovery with the functions of which a file holds the names, and values `_values`.

    One's own, if the law uses them, are those of a library that holds them.
    """
    system, native = found.system, found.native
    m, names = system.states // system.order, cast("tuple[str, ...]", system.functions)
    multiples = re.findall(r"(?:sin|cos)\((\d+) ", " ".join(names))
    _, held = Library.fourier(max(map(int, multiples), default=1)).resolve(system.names, m)
    held += () if library is None else library.resolve(system.names, m)[1]
    known = {function.name: function for function in held}
    rows = (system.support | native.support).any(axis=1)
    used = system.exponents[rows, system.d : system.d + len(names)].any(axis=0)
    for name in np.array(names)[used].tolist():
        if name not in known:
            raise ValueError(
                f"library: must hold the function {name!r} of the law, as a file holds its name "
                f"alone; got {library or 'none'}"
            )
    functions = tuple(known.get(name, Function.unknown(name)) for name in names)
    own, native = (replace(law, functions=functions) for law in (system, native))
    found = replace(found, system=own, native=native)
    if written is None:
        return found
    values = np.where(used, _values(found), written)
    size = np.abs(written).max(axis=0, where=np.isfinite(written), initial=0.0)
    alike = np.isclose(values, written, rtol=0, atol=1e-6 * size, equal_nan=True).all(axis=0)
    if not alike.all():
        raise ValueError(
            f"library: must hold the function {names[int(alike.argmin())]!r} that the law was "
            "found with, got another of that name"
        )
    return found


def _values(found: Discovery) -> Floats:
    """What the functions of a law are at some places on its curve, (n, k)."""
    d, knots = found.system.d, np.concatenate([curve.t for curve in found.curves])
    x = found.curve(np.quantile(knots, np.linspace(0, 1, _PLACES), method="nearest"))
    return extended(x, found.system.functions)[:, d:]


def _built(kind: str, parts: dict[str, Any]) -> Any:
    """What a file holds under the name of a type; functions are there by their names."""
    if kind not in TYPES:
        raise ValueError(f"a type must be one of {', '.join(TYPES)}, got {shown(kind)}")
    return built(TYPES[kind], parts, TYPES | {"Function": str})


def _check_shapes(found: Any) -> None:
    """Refuse a discovery whose parts are of different laws."""
    if not isinstance(found, Discovery):
        raise ValueError(f"it must hold a Discovery, got {type(found).__name__}")
    d, here, native = found.system.d, *(len(law.exponents) for law in (found.system, found.native))
    shapes = {
        "offset": (d,), "offset_errors": (d,), "noise": (d,), "model_error": (d,),
        "covariance": (here * d, here * d), "native_covariance": (native * d, native * d),
        "absent": (native, d, 2),
    }  # fmt: skip
    for name, shape in shapes.items():
        if getattr(found, name).shape != shape:
            raise ValueError(f"{name} must have shape {shape}, got {getattr(found, name).shape}")
    if not found.curves or found.native.d != d:
        raise ValueError(f"it must hold curves, and two laws of {d} variables")
