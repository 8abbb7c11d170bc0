"""Rolling shutters: the rows of an image are read one after the other.

The row v of the frame k is read at the instant k + readout (v - (H - 1) / 2) / H, in frames: a lag
that depends on where the target is. Between frames a track is interpolated, as for any lag.
"""

import numpy as np
from scipy.interpolate import make_interp_spline

from ..arrays import Floats

_LARGEST = 0.49  # frames; so instants never overtake each other, whatever an outlier says


def steadied(track: Floats, readout: float, height: int) -> Floats:
    """What a camera that reads all rows at once would have seen: the track at whole frames."""
    seen = np.flatnonzero(np.isfinite(track).all(axis=1))
    if readout == 0 or len(seen) < 4:
        return track
    behind = readout * (track[seen, 1] - (height - 1) / 2) / height
    instants = seen + np.clip(behind, -_LARGEST, _LARGEST)
    still = track.copy()
    still[seen] = make_interp_spline(instants, track[seen], k=3)(seen)
    return still
