"""Interpolative decomposition: the columns of a block are combinations of a few of them."""

from __future__ import annotations

import functools

import numpy as np
import scipy

from ...arrays import Array, Index
from ...record import record

SPARE = 6  # rows that must be left over for the rank to be believed


@functools.lru_cache(maxsize=4)
def _gaussian(rows: int, columns: int) -> Array:
    return np.random.default_rng(2019).standard_normal((rows, columns))


def _next_power(count: int) -> int:
    return 1 << max(9, (count - 1).bit_length())


@record
class PivotedQR:
    """Pivoted QR of a block or of a sketch of it: triangle r (l, n), pivots (n,), numerical rank,
    and length of the largest column."""

    r: Array
    pivots: Index
    rank: int
    scale: float

    def interpolation(self, rank: int) -> tuple[Index, Index, Array]:
        """Return the kept (k,) and the other (n-k,) columns, both increasing, and Z (k, n-k) with
        block[:, other] ≈ block[:, kept] Z."""
        kept, dropped = self.pivots[:rank], self.pivots[rank:]
        # Columns kept beyond the numerical rank take no part: what they would contribute is noise
        # over noise.
        z, factored = np.zeros((rank, len(dropped))), min(rank, self.rank)
        if factored and len(dropped):
            z[:factored], _ = scipy.linalg.lapack.dtrtrs(
                self.r[:factored, :factored], self.r[:factored, rank:]
            )
        by_kept, by_other = np.argsort(kept), np.argsort(dropped)
        return kept[by_kept], dropped[by_other], np.ascontiguousarray(z[by_kept][:, by_other])


def pivoted_qr(block: Array, weights: Array, tolerance: float, guess: int) -> PivotedQR:
    """Return the pivoted QR of a Gaussian sketch of a block (m, n) with weighted rows. The sketch
    grows until it shows the rank.

    Parameters
    ----------
    block : (m, n) array
    weights : (m,) array
        Rows of weight zero take no part.
    tolerance : float
        The rank is the number of pivots above this multiple of the largest column.
    guess : int
        Expected rank.
    """
    m, n = np.count_nonzero(weights), block.shape[1]
    if m == 0 or n == 0:
        return PivotedQR(np.zeros((0, n)), np.arange(n), 0, 0.0)
    # rows of a sketch beyond the rank that it is expected to show
    width = guess + 12
    while True:
        exact = width >= min(m, n)
        rows = min(m, n + SPARE) if exact else width
        if rows < m:
            mixer = _gaussian(_next_power(rows), _next_power(len(block)))[:rows, : len(block)]
            sketch = (mixer * (weights / np.sqrt(rows))) @ block
        else:
            sketch = (block * weights[:, None])[weights > 0.0]
        r, pivots, _, _, info = scipy.linalg.lapack.dgeqp3(np.asfortranarray(sketch), overwrite_a=1)
        assert info == 0
        pivot = np.abs(np.diagonal(r))
        scale = float(pivot[0])
        rank = int(np.count_nonzero(pivot > tolerance * scale))
        if exact or rank <= width - SPARE:
            return PivotedQR(r, pivots.astype(np.int64) - 1, rank, scale)
        width *= 2
