"""All warnings of the room: why a result should not be trusted, and advice."""

from __future__ import annotations

from collections.abc import Sequence


def unconverged_cameras(steps: int) -> str:
    """The search for the smallest reprojection error ran out of steps."""
    return (
        f"the search for the cameras did not converge in {steps} evaluations: their scales and "
        "angles may be off; check the positions and normals, or give more of what is known"
    )


def far_from_measured(camera: int, what: str, times: float) -> str:
    """A measurement contradicts the tracks and the other measurements."""
    return (
        f"the {what} of cameras[{camera}] is {times:.0f} times its error from what was measured: "
        "check it, and how the others were measured"
    )


def either_hand() -> str:
    """Perspective does not tell a path from its mirror image."""
    return (
        "whether the path is the true one or its mirror image cannot be told, as the cameras are "
        "too far away: measure roughly where they stand, or come closer"
    )


def undecided_outliers() -> str:
    """Fit and outliers kept changing each other."""
    return (
        "which frames hold outliers of a track cannot be told: leaving some out makes others look "
        "wrong; check the tracks, the positions and the normals"
    )


def unsettled_points(count: int, frames: int) -> str:
    """The search for some points ran out of steps."""
    return (
        f"the target's place is uncertain in {count} of {frames} frames, where the lines of sight "
        "hardly cross: the cameras look along nearly the same line there, or one of them is wrong"
    )


def unsettled_lags(steps: int) -> str:
    """The search for fractions of a frame ran out of steps."""
    return (
        f"the search for the lags of the videos did not converge in {steps} steps: give the lags "
        "if you know them"
    )


def no_lags(lags: str, residual: float) -> str:
    """Nothing that was tried makes the views agree."""
    left = f"leave {residual:.2g} pixels" if residual < float("inf") else "no cameras fit"
    return (
        f"no lags of the videos make the views agree: ({lags}) frames were taken, which {left}; "
        "check the rig, or give the lags if you know them"
    )


def ambiguous_lags(choices: Sequence[str]) -> str:
    """Several lags fit."""
    lags = " or ".join(f"({choice})" for choice in choices)
    return (
        f"the lags of the videos cannot be told: {lags} frames fit about equally well, because the "
        "motion repeats itself; give the lags if you know them"
    )


def blurred_lag(video: int, lag: float) -> str:
    """Many lags of one video fit."""
    return (
        f"the lag of video {video} cannot be told, because the target moves too little or too "
        f"slowly: {lag:g} frames were taken; give the lags if you know them"
    )
