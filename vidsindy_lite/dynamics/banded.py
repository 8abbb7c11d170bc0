"""Normal matrices of splines, in lower banded storage, and what goes with them.

A point of a curve touches few control points, so its normal matrix is a narrow band, and so is the
Cholesky factor of that.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.linalg.blas import dtrsm

from ..arrays import Floats

BLOCK = 48
"""Rows that `solve_factored` takes at once, at least."""
UNROLLED = 400
"""Blocks of which the triangles are held at once."""


def normal_band(rows: sparse.csr_array, weights: Floats | None = None, alike: int = 1) -> Floats:
    """Lower banded storage of ``rows' W rows``, for rows as `splines.rows_from` makes them.

    ``W`` is diagonal, with weights (n,) of the rows; by default the identity. So many rows one
    after the other as are ``alike`` have the same columns.
    """
    n, size = rows.shape
    values, first = rows.data.reshape(n // alike, alike, -1), rows.indices.reshape(n, -1)[::alike]
    weighted = values if weights is None else values * weights.reshape(-1, alike, 1)
    products = weighted.transpose(0, 2, 1) @ values
    width = values.shape[2]
    band = np.empty((width, size))
    for lag in range(width):
        below = products.diagonal(-lag, axis1=1, axis2=2)
        band[lag] = np.bincount(first[:, : width - lag].ravel(), below.ravel(), minlength=size)
    return band


def solve_factored(factor: Floats, right: Floats) -> None:
    """Solve ``L L' x = right`` for many right-hand sides, (n, m), in their place.

    ``L`` is in lower banded storage. LAPACK takes one right-hand side after the other; block by
    block, all of them at once are three times as fast.
    """
    reach, n = len(factor) - 1, len(right)
    size = max(BLOCK, 2 * reach)
    blocks = [right[start : start + size] for start in range(0, n, size)]
    last, parts = len(blocks) - 1, range(0, len(blocks), UNROLLED)

    def unrolled(part: int) -> list[tuple[int, Floats, Floats, Floats]]:
        """Blocks of a part: number, triangle, what reaches on to the next, and right-hand side."""
        rows = _unrolled(factor[:, part * size : (part + UNROLLED) * size], size)
        numbered = enumerate(zip(rows, blocks[part : part + UNROLLED], strict=True), part)
        return [
            (k, row[: len(here), : len(here)].T, row[size + 1 - reach :, :reach], here)
            for k, (row, here) in numbered
        ]

    there: list[tuple[int, Floats, Floats, Floats]] = []
    for part in parts:
        there = unrolled(part)
        for k, triangle, onward, here in there:
            dtrsm(1.0, triangle, here.T, 1, 1, 1, overwrite_b=1)
            if k < last:
                after = blocks[k + 1][:reach]
                after -= onward.T[: len(after)] @ here[-reach:]
    for part in reversed(parts):
        if part != parts[-1]:
            there = unrolled(part)
        for k, triangle, onward, here in reversed(there):
            if k < last:
                after = blocks[k + 1][:reach]
                here[-reach:] -= onward[:, : len(after)] @ after
            dtrsm(1.0, triangle, here.T, 1, 1, overwrite_b=1)


def _unrolled(factor: Floats, size: int) -> Floats:
    """Columns of a banded matrix in blocks of a size, each as rows, (blocks, size + 1, size).

    Rows of one more than a block, read as rows of a block: so each column begins one place further
    on than the last. What reaches on to the next block then lies before the diagonal.
    """
    width, n = factor.shape
    count = -(-n // size)
    columns = np.zeros((count, size, size + 1))
    padded = np.pad(factor, ((0, 0), (0, count * size - n)))
    columns[:, :, :width] = padded.reshape(width, count, size).transpose(1, 2, 0)
    return columns.reshape(count, size + 1, size)
