"""What round-off is: eps times the sum of the sizes of what was added, in the quantity's own unit.

A number is known to a share of the sizes that it was computed from, not of itself: a tangential
displacement of 0 beside a normal one of .05 is known to the digits of .05, and so is the gap of
bodies that just touch. The shares below say how a number came about; thresholds are one of them
times such a sum. Where a number lies within its round-off of a threshold, both outcomes are right.

Examples
--------
>>> v, u_0 = np.array([[0.0, 0.0]]), np.array([[3e-18, -0.05]])
>>> bool(np.abs(u_0[0, 0]) < of_vectors(v, u_0, share=ROUNDED)[0, 0])
True
"""

from __future__ import annotations

import math

import numpy as np

from .arrays import Array, Index

EPS = float(np.finfo(np.float64).eps)
"""Distance from 1 to the next number: one operation is off by half of it, relative."""
TINY = 1e-300
"""The least divisor, of what may be 0: numbers up to 1e8 over it do not overflow."""
ROUNDED = 64.0 * EPS
"""1.4e-14, of what a few operations give: coordinates, gaps, loads at a factor. n operations are
off by n eps / 2 at most (Higham, Accuracy and Stability of Numerical Algorithms, section 3.1)."""
SUMMED = 512.0 * EPS
"""1.1e-13, of sums over nodes: n terms are off by √n eps / 2 as a rule (ibid., section 2.8), and
meshes have up to a million."""
SOLVED = 4096.0 * EPS
"""9.1e-13, of what a factorisation gives: eliminations of bodies that are not thin leave 1e-14 to
1e-12 of a known solution (`ElasticBody.digits_lost`)."""
CHAINED = 2.0**19 * EPS
"""1.2e-10, of what is solved for with solutions: rigid motions from a compliance, sets of contact
from those before. Two factorisations of condition 1e5 and less leave it."""
WRITTEN = 1e-9
"""Of numbers in files: programs write 10 digits and more, and meet them again as the same place;
also what Krylov methods leave that end at 1e-12 of the load."""
HALF = math.sqrt(EPS)
"""1.5e-8, of what is found by its square or as a minimum: half of the digits."""
SINGLE = 8.0 * float(np.finfo(np.float32).eps)
"""9.5e-7, of coordinates and matrices of programs that work or write in single precision."""


def of_vectors(*terms: Array, share: float) -> Array:
    """Round-off of vectors that are a sum of terms (m, k), the same for all components, (m, 1)."""
    return np.asarray(share * sum(np.abs(term).sum(axis=1, keepdims=True) for term in terms))


def first_largest(values: Array) -> int:
    """The number of the first of values (n,) that is the largest but for round-off: of a body that
    is symmetric it is on the same side on every machine.

    >>> first_largest(np.array([1.0, 3.0 - 1e-9, 3.0]))
    1
    """
    most = values.max()
    return int(np.argmax(values >= most - HALF * np.abs(most)))


def to_single(values: Array | float) -> Array:
    """Values to `SINGLE` of themselves: what differs by less is equal, but at one place in so many.

    >>> to_single(np.array([1.0, 1.0 + 1e-9, 1.1, np.inf])) == [1.0, 1.0, 1.1, np.inf]
    array([ True,  True, False,  True])
    """
    mantissa, power = np.frexp(values)
    return np.asarray(SINGLE * np.ldexp(np.round(mantissa / SINGLE), power))


def largest_first(values: Array) -> Index:
    """The numbers of values (n,), the largest first; of those that are equal but for round-off the
    first comes first.

    >>> largest_first(np.array([1.0, 3.0 - 1e-9, 3.0, 4.0]))
    array([3, 1, 2, 0])
    """
    return np.argsort(-to_single(values), kind="stable")


def whole(value: float) -> int:
    """The nearest whole number of a positive one, a half being rounded up whatever its last digits
    are.

    >>> whole(2.5), whole(1.5 / 0.6), whole(2.5 - 1e-13), whole(2.49)
    (3, 3, 3, 2)
    """
    return math.floor(value * (1.0 + WRITTEN) + 0.5)


def least_pieces(length: Array | float) -> Index:
    """The least numbers of pieces, at least 1, of which each is at most 1 long but for round-off.

    >>> least_pieces(np.array([3.0 + 1e-13, 3.1, 0.0]))
    array([3, 4, 1])
    """
    return np.asarray(np.maximum(1, np.ceil(np.multiply(length, 1.0 - WRITTEN))), dtype=np.int64)
