"""Polynomials in d variables: arrays (D+1,)*d of coefficients, whose indices are the exponents.

Operations keep the shape; the caller leaves room for what rises in degree (see `padded`).
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array, Index


def degrees(p: Array) -> Index:
    """Total degree of each monomial."""
    return np.asarray(np.add.reduce(np.indices(p.shape)))


def padded(p: Array, size: int) -> Array:
    """The same with `size` coefficients an axis; what is cut off is of higher degree than there is."""
    result = np.zeros((size,) * p.ndim)
    kept = tuple(slice(0, min(size, count)) for count in p.shape)
    result[kept] = p[kept]
    return result


def derivative(p: Array, axis: int) -> Array:
    """Derivative along an axis, a polynomial."""
    exponent = np.indices(p.shape)[axis]
    return np.roll(exponent * p, -1, axis)


def laplacian(p: Array) -> Array:
    """The sum of the second derivatives."""
    return np.asarray(sum(derivative(derivative(p, axis), axis) for axis in range(p.ndim)))


def times(p: Array, axis: int, power: int = 1) -> Array:
    """A power of a variable times p."""
    return np.roll(p, power, axis)


def times_square(p: Array) -> Array:
    """The polynomial times r²."""
    return np.asarray(sum(times(p, axis, 2) for axis in range(p.ndim)))


def inverse_laplacian(p: Array) -> Array:
    """q with lap q = p that turns with the axes, two degrees higher.

    Of a part h of p of degree m it is Σ_j c_j r^(2j+2) lap^j h, c_j = (-1)^j / (2^(j+1) (j+1)! Π_{i<=j} (d + 2m - 2i)).
    """
    own, terms = degrees(p), list[Array]()
    while p.any():
        j = len(terms)
        # what is of degree e after j Laplacians was of degree e + 2j
        product = np.prod([p.ndim + 2.0 * (own + 2 * j) - 2 * i for i in range(j + 1)], axis=0)
        terms.append((-1) ** j * p / (2.0 ** (j + 1) * math.factorial(j + 1) * product))
        p = laplacian(p)
    result = np.zeros_like(p)
    for term in reversed(terms):
        result = times_square(result + term)
    return result


def values(p: Array, x: Array) -> Array:
    """Values (m,) at x (m, d), by Horner's rule along each axis."""
    result = p[..., None]
    for along in x.T:
        coefficients, result = result[::-1], np.zeros(1)
        for coefficient in coefficients:
            result = result * along + coefficient
    return result
