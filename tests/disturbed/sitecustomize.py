"""Disturbs every track and trajectory of a Python process by a little, to see what hangs on it.

With this folder first on PYTHONPATH and VIDSINDY_DISTURB set to "size:seed", e.g. "1e-9:1", the
functions of `TARGETS` return their numbers times 1 + size * a normal random number of that seed; so
does every process that such a process starts. Results of sweeps then go to a folder of their own.
"""

import os
import sys
from dataclasses import fields, is_dataclass, replace
from functools import wraps
from importlib.abc import MetaPathFinder
from importlib.machinery import PathFinder
from pathlib import Path
from tempfile import gettempdir

# What returns a track or a trajectory, by the module that defines it.
TARGETS = {
    "vidsindy_lite.vision.tracking": ["track"],
    "vidsindy_lite.cameras.rig": ["reconstruct"],
    "vidsindy_lite.dynamics.model": ["PolynomialSystem.simulate", "runge_kutta_4"],
}


def disturbed(function, size, seed):
    """The same function with its result disturbed: an array, or the floats of a dataclass."""
    import numpy as np

    def disturb(value):
        if isinstance(value, np.ndarray) and value.dtype == float:
            # The shape counts: views of one motion must not all be off in the same way.
            rng = np.random.default_rng([seed, *value.shape])
            return value * (1 + size * rng.standard_normal(value.shape))
        if is_dataclass(value):
            parts = {field.name: getattr(value, field.name) for field in fields(value)}
            return replace(value, **{name: disturb(part) for name, part in parts.items()})
        return value

    @wraps(function)
    def wrapper(*args, **options):
        return disturb(function(*args, **options))

    return wrapper


class Disturb(MetaPathFinder):
    """Replaces the targets of a module as soon as it is loaded, before anyone imports them."""

    def __init__(self, size, seed):
        self.size, self.seed = size, seed

    def find_spec(self, name, path, target=None):
        if name not in TARGETS:
            return None
        spec = PathFinder.find_spec(name, path)
        load = spec.loader.exec_module

        def load_and_replace(module):
            load(module)
            for dotted in TARGETS[name]:
                *outer, last = dotted.split(".")
                owner = getattr(module, outer[0]) if outer else module
                setattr(owner, last, disturbed(getattr(owner, last), self.size, self.seed))

        spec.loader.exec_module = load_and_replace
        return spec


# Of no use where the format of no address is checked, and takes a second to import.
sys.modules["rfc3987_syntax"] = None
if setting := os.environ.get("VIDSINDY_DISTURB"):
    size, _, seed = setting.partition(":")
    sys.meta_path.insert(0, Disturb(float(size), int(seed)))
    cache = Path(os.environ.get("VIDSINDY_CACHE", Path(gettempdir()) / "vidsindy_disturbed"))
    if cache.name != setting:  # a process that was started by a disturbed one has it already
        os.environ["VIDSINDY_CACHE"] = str(cache / setting)
