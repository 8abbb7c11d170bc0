"""How many threads of linear algebra there are while something is solved."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

from threadpoolctl import threadpool_limits

_lock = Lock()
_inside: list[threadpool_limits] = []  # one for each that is at work, the first of which counts


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS to one thread, and give it back what it had when the last one at work has ended.

    The limit is the process's own: who sets it while another has would take one thread for what
    was there before.
    """
    with _lock:
        _inside.append(_inside[0] if _inside else threadpool_limits(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _lock:
            limits = _inside.pop()
            if not _inside:
                limits.restore_original_limits()
