"""From video files to equations: `observe`, then `discover` on the path that it reconstructs."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Floats
from .cameras import AffineCamera, Rig
from .checks import check_instance, check_integer, check_positive, check_rows, shown
from .dynamics import (
    Discovery,
    Form,
    Library,
    PolynomialSystem,
    Quantity,
    Swing,
    check_library,
    check_order,
    check_orientation,
    discover,
    variable_names,
)
from .observation import Observation, observe, observe_tracks
from .refusal import refusing
from .vision import Hint, TrackFile, read_tracks

_OTHER_CLOCK = 1e-3  # share by which given and stated frame rates may differ without a word


@dataclass(frozen=True, eq=False)
class VideoDiscovery(Observation):
    """An observation and the law that it obeys; its warnings are those of both.

    Parameters
    ----------
    discovery : Discovery
        The law in the frame of the rig and in its own, sparsest frame; in other axes if these were
        learned.
    """

    discovery: Discovery

    @property
    def fitted(self) -> Floats:
        """The path that obeys the law, in the shape of ``x`` and with a fraction of its noise.

        In gaps, too, that the law bridges; NaN elsewhere.
        """
        law = self.discovery
        m = law.system.states // law.system.order
        turn = np.eye(self.x.shape[1])[:m] if law.orientation is None else law.orientation
        still = np.nanmean(self.x - self.x @ turn.T @ turn, axis=0)  # of what the law does not move
        return law.curve(self.t)[:, :m] @ turn + still

    @property
    def swing(self) -> Swing | None:
        """The circle to which the target is bound, and the law of its angle; None elsewhere."""
        return self.discovery.swing

    @property
    def g(self) -> Quantity | None:
        """The pull of gravity on what flies, or swings on a circle; None of other motions."""
        if self.swing is not None:
            return self.swing.g
        return next((q for q in self.discovery.physics() if q.name == "g"), None)

    @property
    def period(self) -> Quantity | None:
        """Of small swings: of the coordinate or mode that moves most; None if nothing swings."""
        law = self.discovery if self.swing is None else self.swing.law
        said = [q for q in law.physics() if q.name.startswith("period")]
        return min(said, key=lambda q: self._left_of(float(q.value)), default=None)

    def _left_of(self, period: float) -> float:
        """Squares that oscillations of one period leave of the path."""
        seen = np.isfinite(self.x[:, 0])
        phase = 2 * np.pi * self.t[seen] / period
        waves = np.column_stack([np.ones_like(phase), np.cos(phase), np.sin(phase)])
        left = self.x[seen] - waves @ np.linalg.lstsq(waves, self.x[seen], rcond=None)[0]
        return float((left**2).sum())

    @property
    def driven(self) -> str:
        """Which of several targets drive which others, and by what terms; empty for one target."""
        return _driven(self.discovery.system) if self.targets > 1 else ""

    def __str__(self) -> str:
        warnings = (f"warning: {text}" for text in self.warnings)
        notes = [f"frame: {self.rig.note}"] if self.rig.note else []
        notes += [f"targets: {self.driven}"] if self.driven else []
        return "\n".join([self.discovery.statement(), *notes, *warnings])


def discover_from_videos(
    paths: Sequence[str | Path],
    rig: Rig | None = None,
    t: ArrayLike | None = None,
    *,
    lags: Sequence[float] | None = None,
    detector: str | os.PathLike = "auto",
    hints: Sequence[Hint | None] | None = None,
    targets: int = 1,
    degree: int | None = None,
    library: Library | None = None,
    order: int | str = "auto",
    origin: str = "learn",
    orientation: str = "data",
    seed: int = 0,
    progress: bool | None = None,
) -> VideoDiscovery:
    """Discover the governing equations of a target filmed by several fixed cameras.

    This is `observe`, then `discover` on the path that it reconstructs.

    Parameters
    ----------
    paths, rig, t, lags, detector, hints, targets, progress
        See `observe`. The unit of time is that of the equations. The law of several targets is one
        for all: x1, x2, x3 are the place of the first, x4, x5, x6 of the second, and so on.
    degree, library, order, origin, orientation, seed
        See `discover`.

    Returns
    -------
    VideoDiscovery

    Raises
    ------
    FileNotFoundError, ValueError
        See `observe` and `discover`. What can be told before a video is tracked is.
    """
    check_integer("targets", targets, least=1)
    how, unasked = _checked(degree, library, order, origin, orientation, seed, targets)
    how |= {"progress": progress}
    seen = observe(
        paths, rig, t, lags=lags, detector=detector, hints=hints, targets=targets,
        progress=progress,
    )  # fmt: skip
    names = [Path(path).name for path in paths]
    return _with_law(seen, names, how, unasked)


def discover_from_tracks(
    tracks: Sequence[ArrayLike | str | os.PathLike],
    rig: Rig,
    t: ArrayLike | Sequence[ArrayLike] | None = None,
    *,
    fps: float | None = None,
    individual: str | None = None,
    lags: Sequence[float] | None = None,
    degree: int | None = None,
    library: Library | None = None,
    order: int | str = "auto",
    origin: str = "learn",
    orientation: str = "data",
    seed: int = 0,
    progress: bool | None = None,
) -> VideoDiscovery:
    """Discover the governing equations of a target from tracks that are there already.

    This is `observe_tracks`, then `discover` on the path that it reconstructs.

    Parameters
    ----------
    tracks : sequence of array_like, shape (n_i, 2), or of path
        Pixels of the target, one track per camera of the rig, NaN where it was not seen; or text
        files of them, as DLTdv, Argus, Tracker (OSP), Kinovea, TrackMate, DeepLabCut, SLEAP,
        detectors of boxes and this package write them. A file may hold the tracks of several
        cameras.
    rig, t, lags
        See `observe_tracks`.
    fps : float, optional
        Frames of every camera in one unit of time, in place of ``t``. Without either, files have
        to state the times of their rows.
    individual : str, optional
        Which of several targets of the files, by its name there; see `read_tracks`.
    degree, library, order, origin, orientation, seed, progress
        See `discover_from_videos`.

    Returns
    -------
    VideoDiscovery

    Raises
    ------
    FileNotFoundError, ValueError
        If a file is missing or holds no track, if times are given twice or not at all, or as
        `observe_tracks` and `discover` do.
    """
    how, unasked = _checked(degree, library, order, origin, orientation, seed)
    how |= {"progress": progress}
    check_instance("rig", rig, Rig)
    read = _read(tracks, rig, individual)
    names, pixels = [track.name for track in read], [track.pixels for track in read]
    times, doubts = _times(read, t, fps)
    seen = observe_tracks(pixels, rig, times, lags=lags, names=names, progress=progress)
    doubts = [*(warning for track in read for warning in track.warnings), *doubts]
    seen = replace(seen, warnings=(*seen.warnings, *doubts))
    return _with_law(seen, names, how, unasked)


def _checked(
    degree: int | None,
    library: Library | None,
    order: int | str,
    origin: str,
    orientation: str,
    seed: int,
    targets: int = 1,
) -> tuple[dict[str, Any], bool]:
    """What `discover` takes beside the path, checked before anything is tracked.

    And whether nothing is asked of the law.
    """
    terms = check_library(degree, library)
    check_order(order, origin)
    check_orientation(orientation, terms, 3 * targets, origin)
    Form.of(variable_names(3 * targets), terms, 2 if order == 2 else 1)
    check_integer("seed", seed)
    chosen = {"order": order, "origin": origin, "orientation": orientation}
    unasked = degree is None and library is None and order == "auto"
    return {"library": terms, "seed": seed} | chosen, unasked


def _driven(law: PolynomialSystem) -> str:
    """Which of several targets, of three coordinates each, drive which others by what terms."""
    target = np.arange(law.d) % (law.d // law.order) // 3 + 1  # of places, and of velocities
    by: dict[tuple[int, int], list[str]] = {}
    for j, side in law.sides().items():
        for row in np.flatnonzero(law.support[:, j]):
            for other in set(target[law.exponents[row, : law.d] > 0]) - {target[j]}:
                pair = int(other), int(target[j])
                by.setdefault(pair, []).append(f"{law.terms[row]} in {side}")
    free = [str(i) for i in np.unique(target) if all(i != driven for _, driven in by)]
    said = [f"{i} drives {j} by {', '.join(terms)}" for (i, j), terms in sorted(by.items())]
    alone = f"{' and '.join(free)} {'moves' if len(free) == 1 else 'move'} independently"
    return "; ".join([alone] * bool(free) + said)


def _read(
    tracks: Sequence[ArrayLike | str | os.PathLike], rig: Rig, individual: str | None
) -> list[TrackFile]:
    """All tracks, those of files read, v down in the images of the rig."""
    if not isinstance(tracks, list | tuple | np.ndarray):
        raise ValueError(f"tracks: must be a list of arrays or of files, got {shown(tracks)}")
    read: list[TrackFile] = []
    for track in tracks:
        if isinstance(track, str | os.PathLike):
            read += read_tracks(track, individual)
        else:
            name = f"tracks[{len(read)}]"
            read.append(TrackFile(name, check_rows(name, cast("ArrayLike", track), 2), None))
    # Files that count frames from the start of their videos may begin at different ones.
    first = min((track.start for track in read), default=0)
    for i, (track, camera) in enumerate(zip(read, rig.cameras, strict=False)):
        read[i] = replace(track, pixels=track.downwards(camera.image_size[1]))
    return [replace(track, pixels=_later(track.pixels, track.start - first)) for track in read]


def _later(pixels: Floats, frames: int) -> Floats:
    """A track after so many frames without a target."""
    return np.pad(pixels, ((frames, 0), (0, 0)), constant_values=np.nan)


def _times(
    read: Sequence[TrackFile], t: ArrayLike | Sequence[ArrayLike] | None, fps: float | None
) -> tuple[ArrayLike | Sequence[ArrayLike], list[str]]:
    """The times that are given, or those that files state; and which files contradict them."""
    if t is not None and fps is not None:
        raise ValueError(f"fps: must not be given with t, got {shown(fps)}")
    if t is not None:
        return t, []
    if fps is not None:
        rate = check_positive("fps", fps)
        return [np.arange(len(track.pixels)) / rate for track in read], _contradicted(read, rate)
    stated = [track.t for track in read if track.t is not None]
    if len(stated) < len(read):
        silent = next(track.name for track in read if track.t is None)
        raise ValueError(f"t: must be given, or fps, as {silent} states no times")
    return stated, []


def _contradicted(read: Sequence[TrackFile], fps: float) -> list[str]:
    """Which files state other frames in a unit of time than the given ones."""
    stated = [
        (track.name, 1 / np.median(np.diff(track.t)))
        for track in read
        if track.t is not None and len(track.t) > 1
    ]
    return [
        f"fps: {fps:g} frames in a unit of time are taken as given, though {name} states {rate:.4g}"
        for name, rate in stated
        if abs(rate / fps - 1) > _OTHER_CLOCK
    ]


def _with_law(
    seen: Observation,
    names: Sequence[str],
    how: dict[str, Any],
    default: bool,
) -> VideoDiscovery:
    """An observation with the law that it obeys, given what else `discover` takes.

    In a frame that is any affine map of space, the default is a law that is linear in any other.
    """
    if default and isinstance(seen.rig.cameras[0], AffineCamera):
        how |= {"library": Library.polynomial(1), "order": 2}
    moves = np.nanmin(seen.x, axis=0) < np.nanmax(seen.x, axis=0)  # in a plane or on a line
    with refusing("law", seen.tracks, names):
        found = discover(seen.t, seen.x[:, moves], systematic=seen.systematic[..., moves], **how)
    # Who keeps the law alone keeps the doubts about what it was found in.
    law = replace(found, warnings=(*seen.warnings, *found.warnings))
    return VideoDiscovery(**vars(seen) | {"warnings": law.warnings}, discovery=law)
