"""Rigs of which nothing is measured but perhaps the lenses: where they stand, or an affine map.

Two pinholes that see the same points determine where they stand relative to each other, but for the
unit of length (the essential matrix, by the five-point method); of the points that they see, any
other camera's place follows. A focal length of which nothing is known is tried from long lenses to
wide ones. From the starts with the smallest residuals all cameras, and their focal lengths as far
as they are uncertain, are adjusted (`adjust`), and the best is taken.

Nothing in the images tells the unit of length, nor how the rig stands in the room. So the first
camera gives the axes, x to the right and y up in its image and z towards it; the middle of the path
is the origin, and the distance from the first camera to the second is the unit. Handedness is told
by perspective: pinholes have to explain the tracks better than parallel projections.

Where they do not, as of cameras far away, or of frames that were cut out: parallel projections of
one path make a matrix of rank three of the centred tracks of all views, whatever the lenses, where
the cameras stand, and which part of their frames was cut out; of rank two if the path lies in a
plane, of rank one on a line. So the lags are those that leave least beyond the smallest rank that
leaves about as little as three, and the path is known but for an affine map of space. What no such
map changes is known: frequencies and dampings of a linear law.

Hartley and Zisserman 2004, "Multiple View Geometry"; Nister 2004, PAMI 26 (five points); Tomasi and
Kanade 1992, IJCV 9 (factorisation).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import combinations, product
from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import least_squares

from ..arrays import Floats
from .adjust import PARTS, Adjustment, adjust, known_to, lasting
from .clocks import OVERLAP, Footage, Lags, dips, untold_lags
from .models import ROUNDING, AffineCamera, PerspectiveCamera, at_once, missed
from .rig import ALIKE, BETTER, FINE, GROSS, Rig, check_views

_FEWEST = 8  # frames in common of a pair
_VIEWS = np.geomspace(2, 90, 15)  # degrees across an image: what lenses have
_STEPS = 30  # of each search

_NOTE = (
    "nothing is known of the cameras: the path is known but for an affine map, its axes are those "
    "of its spread, largest first; of a linear law frequencies and dampings do not depend on it"
)


def posed(tracks: Sequence[Floats], rig: Rig, synchronous: bool = True) -> Rig:
    """The rig with places and directions found from tracks, if it has none.

    Parameters
    ----------
    tracks : sequence of ndarray, shape (n, 2)
        At the same instants, ...
    rig : Rig
        See `Rig.is_measured`.
    synchronous : bool
        ... or but for small lags, which are then learned as well, and forgotten.

    Raises
    ------
    ValueError
        If the tracks do not tell where the cameras stand, or parallel projections, which have fewer
        unknowns and either hand, explain them about as well.
    """
    if rig.is_measured:
        return rig
    check_views(tracks, rig)
    footage, fits = Footage.of(tracks), []
    parallel = _left(footage, np.zeros(len(tracks)), range(len(tracks)), 3)
    # These must be worse by a chi-square of 25.
    most = min(GROSS, parallel * float(np.exp(-12.5 / np.isfinite(tracks[0]).sum())))
    for _, cameras in sorted(_starts(tracks, rig), key=lambda start: start[0])[:4]:
        # Known are the place of the first camera, and of all others only their lenses.
        errors = np.array([known_to(camera) for camera in cameras])
        for part in ("normal", "angle", "position"):
            errors[:, PARTS[part]] = np.where(np.arange(len(errors))[:, None] > 0, np.inf, 0.0)
        errors[1, PARTS["position"]] = 1.0  # or nothing would hold the unit of length
        if not synchronous:
            errors[1:, PARTS["lag"]] = np.inf
        fit = adjust(footage, cameras, errors, most=_STEPS)
        apart = np.ptp(np.array([c.position for c in fit.cameras[:2]]), axis=0)
        if np.isfinite(fit.misses).any() and apart.any():
            fits.append(fit)
    best = min(fits, key=lambda fit: fit.noise, default=None)
    if best is None or best.noise > most:
        left = "no start" if best is None else f"views that are {best.noise:.1f} pixels apart"
        raise ValueError(
            "rig: the tracks must tell where the cameras stand, as nothing of it is measured, got "
            f"{left} (videos that do not start within a frame or two of each other, a focal length "
            "that is far off, cameras too far away, a target that moves on a line or in a plane?)"
        )
    return _framed(rig, best)


def _starts(
    tracks: Sequence[Floats], rig: Rig
) -> Iterator[tuple[float, tuple[PerspectiveCamera, ...]]]:
    """Cameras by any pair, with each choice of unknown lenses.

    And by how many pixels they miss the tracks; the first one is at home.
    """
    some = Footage.of(tracks).some.aligned
    given = [camera for camera in rig.cameras if isinstance(camera, PerspectiveCamera)]
    for view in _VIEWS if any(camera.scale is None for camera in given) else _VIEWS[:1]:
        lenses = [_lens(camera, view) for camera in given]
        views = at_once(lenses, some)
        # Directions (X, Y) / Z in OpenCV's axes, right and down.
        rays = [
            lens.centred(track) / lens.focal_length * [1, -1]
            for lens, track in zip(lenses, views, strict=True)
        ]
        for pair in combinations(range(len(rays)), 2):
            cameras = _around(rays, lenses, pair)
            if cameras is None:
                continue
            misses = np.hstack(missed(cameras, views))
            seen = np.isfinite(misses)
            if seen.any():  # points that none can see are missed, too
                yield float(np.median(np.abs(misses[seen])) / seen.mean()), cameras


def _lens(camera: PerspectiveCamera, view: float) -> PerspectiveCamera:
    """A camera of such a field of view, if that is unknown."""
    if camera.scale is not None:
        return camera
    scale = 2 * np.tan(np.deg2rad(view) / 2) / camera.image_size[0]
    # The error of the logarithm of an unknown focal length.
    return camera.moved(scale=float(scale), angle=0.0, scale_error=0.5)


def _around(
    rays: Sequence[Floats], cameras: Sequence[PerspectiveCamera], pair: tuple[int, int]
) -> tuple[PerspectiveCamera, ...] | None:
    """The cameras around what two of them see, the first at home; None if they tell nothing.

    The second is a unit from it.
    """
    i, j = pair
    both = np.isfinite(rays[i]).all(axis=1) & np.isfinite(rays[j]).all(axis=1)
    if both.sum() < _FEWEST:
        return None
    seen, centre = (rays[i][both], rays[j][both]), np.eye(3)
    points = np.full((len(rays[0]), 3), np.nan)
    turns, shifts = np.array([np.eye(3)] * len(rays)), np.zeros((len(rays), 3))
    try:
        essential, mask = cv2.findEssentialMat(
            *seen, centre, method=cv2.USAC_ACCURATE, prob=0.9999,
            threshold=GROSS / min(cameras[k].focal_length for k in pair),
        )  # fmt: skip
        _, turns[j], shift, front, homogeneous = cv2.recoverPose(
            essential, *seen, centre, distanceThresh=50.0, mask=mask
        )
        shifts[j] = shift[:, 0]
        points[both] = np.where(front > 0, (homogeneous[:3] / homogeneous[3]).T, np.nan)
        for k in set(range(len(cameras))) - set(pair):
            told = np.isfinite(points).all(axis=1) & np.isfinite(rays[k]).all(axis=1)
            if told.sum() < _FEWEST:
                return None
            done, axis, place, _ = cv2.solvePnPRansac(
                points[told], rays[k][told], centre, None, flags=cv2.SOLVEPNP_SQPNP,
                reprojectionError=3 * GROSS / cameras[k].focal_length,
            )  # fmt: skip
            if not done:
                return None
            turns[k], shifts[k] = cv2.Rodrigues(axis)[0], place[:, 0]
        turns = turns @ turns[0].T
        shifts = shifts - turns @ shifts[0]
        each = zip(cameras, turns * [1, -1, -1], shifts / np.linalg.norm(shifts[1]), strict=True)
        return tuple(camera.posed(turn, shift) for camera, turn, shift in each)
    except (cv2.error, ValueError):  # points too close together, or of nothing that moves
        return None


def _framed(rig: Rig, fit: Adjustment) -> Rig:
    """The cameras around the middle of the path, the second one so far from the first as is known.

    They are as good as measured by eye: what the tracks tell is learned later.
    """
    distance = 1.0 if rig.distance is None else rig.distance
    places = np.array([camera.position for camera in fit.cameras]) - np.nanmean(fit.points, axis=0)
    places *= distance / np.linalg.norm(places[1] - places[0])
    each = zip(fit.cameras, places, strict=True)
    first, *others = (replace(camera, position=place) for camera, place in each)
    loose = [replace(camera, position_error=distance, normal_error=45.0) for camera in others]
    return Rig((first, *loose), note=_note(rig))


def _note(rig: Rig) -> str:
    """What cannot be known of a rig that nobody has measured."""
    told = "the unit of length is the distance from the first camera to the second"
    if rig.distance is not None:
        told = f"the first camera is {rig.distance:g} from the second"
    if any(camera.scale is None for camera in rig.cameras):
        told += "; focal lengths are those that the tracks tell"
    return (
        "nothing is measured of where the cameras stand: x is to the right and y up in the image "
        f"of the first camera, z points towards it, the origin is the middle of the path, {told}"
    )


class Factorised(NamedTuple):
    """Cameras of one affine frame, when their videos began, and the path's variance along its axes.

    That is in units of the noise of a pixel; of the first axes alone, if it moves along these.
    """

    rig: Rig
    lags: Lags
    variance: Floats

    def places(self, tracks: Sequence[Floats]) -> Floats:
        """The path, (n, 3), that is likeliest where its images and its spread are known.

        Two views may tell hardly anything of one direction (probabilistic principal components,
        Tipping and Bishop 1999). NaN where fewer than two see the target.
        """
        moving, count = len(self.variance), len(tracks)
        origin, *ends = (
            np.hstack([camera.image(point[None]) for camera in self.rig.cameras])
            for point in np.eye(4, 3, k=-1)[: moving + 1]
        )
        axes, pixels = np.concatenate(ends) - origin, np.hstack(tracks)
        seen = np.isfinite(pixels)
        information = np.einsum("ij,nj,kj->nik", axes, seen, axes) + np.diag(1 / self.variance)
        pull = np.where(seen, pixels - origin, 0.0) @ axes.T
        x = np.zeros((len(pixels), 3))
        x[:, :moving] = np.linalg.solve(information, pull[..., None])[..., 0]
        x[seen.reshape(-1, count, 2).all(axis=2).sum(axis=1) < 2] = np.nan
        return x


def factorised(films: Footage, rig: Rig, synchronous: bool = False) -> Factorised | None:
    """Cameras of which nothing is known as affine maps; None if no lags make the views agree.

    Parameters
    ----------
    films : Footage
    rig : Rig
        See `Rig.is_measured`; of its cameras the sizes of the images count.
    synchronous : bool
        Whether the lags are those of the footage; they are found if not.
    """
    count, ranks = len(films.curves), range(1, 4)
    # Else lags would lean to half frames: a curve has less noise between two samples than in them.
    curves = [curve.averaged(rate) for curve, rate in zip(films.curves, films.rates, strict=True)]
    some = replace(films, curves=tuple(curves)).some
    found = [_best(some, rank, synchronous) for rank in ranks]
    enough = max(BETTER * found[-1][0], FINE)
    rank = next(rank for rank, (left, *_) in zip(ranks, found, strict=True) if left <= enough)
    least, best, errors, others = found[rank - 1]
    if not np.isfinite(least):
        return None
    images = _images(films, best, range(count))
    off, beyond = (_beyond(images, r) for r in (0, rank))
    moved, missed = (
        np.nanmean((each**2).reshape(-1, count, 2), axis=(0, 2)) for each in (off, beyond)
    )
    left = _noise(beyond, rank)
    # Times what is left by which a target must move, rms, in every view.
    if not (moved > 5.0**2 * missed).all():
        return None
    middle, sizes, axes = _spread(images)
    seen = np.isfinite(images).all(axis=1).sum()
    downs = np.split(np.sqrt(count) * axes[:3].T, count)
    places, shapes = np.split(middle, count), [camera.image_size for camera in rig.cameras]
    cameras = tuple(map(AffineCamera.of, downs, places, shapes))
    doubts, rough = [], _noise(np.diff(beyond, axis=0), rank) / np.sqrt(2)
    if left > min(GROSS, max(ALIKE * rough, 10 * FINE)):  # what lasts is no noise
        doubts.append(
            f"views agree on one motion but for {left:.2g} pixels: noisy tracks, cameras too near "
            "for parallel projections, or a view of another time or of something else"
        )
    if others and rank > 1:  # on a line the motion is the same, whole periods apart
        doubts.append(untold_lags([best, *others]))
    told = Lags(best, films.rates, errors, left, tuple(doubts), clocks=films.clocks)
    variance = sizes[:rank] ** 2 / (seen * count * max(left, ROUNDING) ** 2)
    return Factorised(Rig(cameras, note=_NOTE), told, variance)


def _least(footage: Footage) -> float:
    """Frames of the first video that all must show."""
    return OVERLAP * float(footage.lengths.min())


def _left(footage: Footage, lags: Floats, places: Sequence[int], rank: int) -> float:
    """Noise of the pixels that is left beyond a rank; infinite of too few common frames."""
    images = _images(footage, lags, places)
    count = np.isfinite(images).all(axis=1).sum()
    step = footage.span / max(len(footage.instants) - 1, 1)
    if count <= images.shape[1] or count * step < _least(footage):
        return np.inf
    return _noise(_beyond(images, rank), rank)


def _noise(beyond: Floats, rank: int) -> float:
    """Of the pixels, by what is left of them beyond a rank, so many of each row being free."""
    free = np.maximum(np.isfinite(beyond).sum(axis=1) - rank, 0).sum()
    return float(np.sqrt(np.nansum(beyond**2) / free))


def _best(
    footage: Footage, rank: int, synchronous: bool
) -> tuple[float, Floats, Floats, list[Floats]]:
    """What the lags leave beyond a rank that leave least, those lags, and their errors.

    Unless they are known. And others, more than a frame apart, that leave hardly more.
    Of two views, lags are promising that leave less than their neighbours; of three, these are
    tried together, and further views one by one. Of those that leave about as little, the
    shortest count.
    """
    count, lags, others = len(footage.curves), np.zeros(1), list[Floats]()
    if synchronous:
        return _left(footage, footage.lags, range(count), rank), footage.lags, np.zeros(count), []
    promising = [_promising(footage, i, rank)[:20] or [0.0] for i in range(1, count)]
    for further in (product(*promising[:2]), *map(product, promising[2:])):
        every = [(*lags, *new) for new in further]
        views = range(len(every[0]))
        every.append(tuple(footage.lags[: len(views)]))
        tried = sorted((_left(footage, np.array(late), views, rank), late) for late in every)
        found = [_polished(footage, np.array(late), rank) for _, late in tried[:10]]
        left = np.array([_left(footage, late, views, rank) for late, _ in found])
        alike = np.flatnonzero(left <= max(ALIKE * left.min(), FINE))
        shortest = min(alike, key=lambda k: np.abs(found[k][0]).sum())
        (lags, errors), least = found[shortest], float(left[shortest])
        close = np.flatnonzero(left <= max(BETTER * least, FINE))
        others = [found[k][0] for k in close if np.abs(found[k][0] - lags).max() > 1]
    return least, lags, errors, others


def _promising(footage: Footage, i: int, rank: int) -> list[float]:
    """Whole lags of a view at which less is left than at their neighbours, the best first."""
    lengths = footage.lengths
    tried = np.arange(np.ceil(_least(footage) - lengths[i]), lengths[0] - _least(footage) + 1)
    every = np.outer(tried, np.eye(len(lengths))[i])
    return dips(tried, np.array([_left(footage, lags, (0, i), rank) for lags in every]))


def _polished(footage: Footage, lags: Floats, rank: int) -> tuple[Floats, Floats]:
    """The lags of the first views, to fractions of a frame, that leave least near by.

    And their standard errors, of errors that may last for many frames, as those of `adjust`.
    """

    count = len(lags)

    def beyond(others: Floats) -> Floats:
        return _beyond(_images(footage, np.append(0.0, others), range(count)), rank)

    found = least_squares(lambda others: np.nan_to_num(beyond(others)).ravel(), lags[1:],
                          diff_step=1e-3, max_nfev=_STEPS)  # fmt: skip
    left, errors = beyond(found.x), np.full(count - 1, np.inf)
    information = found.jac.T @ found.jac
    if np.linalg.cond(information) <= 1 / np.finfo(float).eps:
        variance = lasting(left) * _noise(left, rank) ** 2
        errors = np.sqrt(variance * np.diag(np.linalg.inv(information)))
    return np.append(0.0, found.x), np.append(0.0, errors)


def _images(footage: Footage, lags: Floats, places: Sequence[int]) -> Floats:
    """Tracks of some views that begin so late, side by side, (n, 2 m)."""
    return np.hstack([_image(footage, i, float(lags[i])) for i in places])


@lru_cache(maxsize=512)  # a search tries the same lags of one view beside many of the others
def _image(footage: Footage, i: int, lag: float) -> Floats:
    """The track of one view that begins so late, (n, 2)."""
    return footage.curves[i].at((footage.instants - lag) * footage.rates[i])


def _spread(images: Floats) -> tuple[Floats, Floats, Floats]:
    """Middle of the rows in which no view is missing, and how far they spread along which axes."""
    whole = images[np.isfinite(images).all(axis=1)]
    middle = whole.mean(axis=0) if len(whole) else np.zeros(images.shape[1])
    return middle, *np.linalg.svd(whole - middle, full_matrices=False)[1:]


def _beyond(images: Floats, rank: int) -> Floats:
    """What rows differ from their middle beyond so many of the axes; NaN where none or one sees.

    Two views contradict a lag as well as all, and a chance that all agree in few frames.
    """
    middle, _, axes = _spread(images)
    off, left = images - middle, np.full_like(images, np.nan)
    bits = 1 << np.arange(images.shape[1] // 2)
    seen = np.isfinite(images[:, ::2]) @ bits
    for views in set(seen.tolist()):
        shown = np.repeat(views & bits > 0, 2)
        if shown.sum() >= 4:
            part = np.ix_(seen == views, shown)
            along, _ = np.linalg.qr(axes[:rank, shown].T)
            some = off[part]
            left[part] = some - some @ along @ along.T
    return left
