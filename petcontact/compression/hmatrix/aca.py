"""Adaptive cross approximation of one block, scalar and partially pivoted, recompressed:
native/hmatrix.c in numpy.

Rows of a few random nodes have to be right in the end: blocks of a traction kernel between coplanar
panels are antisymmetric, and fall into parts that know nothing of each other, so that pivots alone
may miss one.

References
----------
M. Bebendorf, S. Rjasanow, Computing 70 (2003) 1-24; L. Grasedyck, Computing 74 (2005) 205-223
(recompression).
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from .entries import Entries, block

CHECKS = 8
"""Nodes whose rows have to be right."""


def low_rank(
    entries: Entries, rows: Index, columns: Index, tolerance: float, most: int
) -> tuple[Array, Array] | None:
    """U (r, d m) and V (r, d k + q) with block ≈ Uᵀ V to the tolerance in Frobenius' norm; None
    where `most` do not do."""
    found = crosses(entries, rows, columns, tolerance, most)
    return None if found is None else recompress(*found, tolerance)


def crosses(
    entries: Entries, rows: Index, columns: Index, tolerance: float, most: int
) -> tuple[Array, Array] | None:
    """Factors of a block by adaptive cross approximation, not recompressed."""
    d, numbers, counts = (
        entries.components,
        np.arange(len(columns)),
        np.diff(entries.beside)[columns],
    )
    owner = np.concatenate([np.repeat(numbers, d), np.repeat(numbers, counts)])
    among = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    place = np.concatenate([np.tile(np.arange(d), len(columns)), d + among])
    u, v = np.empty((0, d * len(rows))), np.empty((0, len(owner)))
    free_rows, free_columns = np.ones(u.shape[1], dtype=bool), np.ones(v.shape[1], dtype=bool)
    random = np.random.default_rng([len(rows), int(rows[0]), int(columns[0])])
    row, norm, passed, checking = d * (len(rows) // 2), 0.0, 0, False
    while True:
        if checking:
            row = d * int(random.integers(len(rows)))
        node = row // d
        left = (
            block(entries, rows[node : node + 1], columns).T - u[:, d * node : d * node + d].T @ v
        )
        if checking:
            size = np.sum(left**2, axis=1)
            row = d * node + int(np.argmax(size))
            if not free_rows[row] or size.max() * u.shape[1] <= tolerance**2 * norm:
                passed += 1
                if passed == CHECKS:
                    return u, v
                continue
        free_rows[row] = False
        one = left[row - d * node]
        column = int(np.argmax(np.abs(one) * free_columns))
        if one[column] == 0.0:
            checking = True
            continue
        if len(u) == most:
            return None
        passed = 0
        free_columns[column] = False
        other = block(entries, rows, columns[owner[column], None])[place[column]] - v[:, column] @ u
        u, v = np.vstack([u, other]), np.vstack([v, one / one[column]])
        products = (u @ u[-1]) * (v @ v[-1])
        norm = max(norm + 2.0 * products[:-1].sum() + products[-1], products[-1])
        row = int(np.argmax(np.abs(other) * free_rows))
        checking = products[-1] <= tolerance**2 * norm or not free_rows[row]


def recompress(u: Array, v: Array, tolerance: float) -> tuple[Array, Array]:
    """Fewer rows of U and V by QR and SVD, those of V orthonormal."""
    (q_u, r_u), (q_v, r_v) = np.linalg.qr(u.T), np.linalg.qr(v.T)
    left, values, right = np.linalg.svd(r_u @ r_v.T)
    rest = np.append(np.cumsum(values[::-1] ** 2)[::-1], 0.0)
    rank = int(np.argmax(rest <= tolerance**2 * rest[0]))
    return (q_u @ left[:, :rank] * values[:rank]).T, right[:rank] @ q_v.T
