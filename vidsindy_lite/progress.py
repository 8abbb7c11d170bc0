"""Progress bars that show themselves where a person watches, and work takes a while."""

from __future__ import annotations

import sys
from multiprocessing import current_process
from typing import Any

from tqdm import tqdm


def watched() -> bool:
    """Whether a person sees a progress bar: in a terminal or a notebook, not in a worker."""
    seen = sys.stderr.isatty() or "ipykernel" in sys.modules
    return seen and current_process().name == "MainProcess"


def bar(progress: bool | None, desc: str, **how: Any) -> tqdm:
    """A progress bar with a label, which `tqdm` makes from the rest.

    It is shown or not as ``progress`` says; by default after two seconds, if somebody watches.
    """
    shown = watched() if progress is None else progress
    return tqdm(desc=desc, disable=not shown, delay=0 if progress else 2, **how)
