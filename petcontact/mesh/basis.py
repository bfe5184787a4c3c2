"""Gauss-Legendre nodes and the polynomials through them, for elements of any order."""

from __future__ import annotations

import functools

import numpy as np

from ..arrays import Array

COINCIDE = 1e-7
"""Local coordinates that differ by less belong to one node."""


@functools.cache
def gauss(order: int) -> tuple[Array, Array]:
    """Return the collocation nodes of an element of order p and their weights on [-1, 1].

    Parameters
    ----------
    order : int
        p >= 0.

    Returns
    -------
    xi, weight : (p+1,) arrays, read-only
        The p+1 Gauss-Legendre points in increasing order, and weights that sum to 2.

    Raises
    ------
    ValueError
        If the order is negative.
    """
    if order < 0:
        raise ValueError(f"order {order}: elements have order 0 or more")
    nodes: tuple[Array, Array] = np.polynomial.legendre.leggauss(order + 1)
    xi, weight = nodes
    xi.setflags(write=False)
    weight.setflags(write=False)
    return xi, weight


def legendre(order: int, s: Array) -> Array:
    """Return the Legendre polynomials P_0 ... P_p at points s, (p+1, len(s))."""
    values = np.ones((order + 1, len(s)))
    if order > 0:
        values[1] = s
    for k in range(2, order + 1):
        values[k] = (values[k - 1] * s * (2 * k - 1) - values[k - 2] * (k - 1)) / k
    return values


@functools.cache
def lagrange_coefficients(order: int) -> Array:
    """Return the Legendre coefficients of the Lagrange polynomials, (p+1, p+1): L_b = Σ_k c[b, k]
    P_k.

    c[b, k] = (2k+1)/2 ∫ L_b P_k, where the p+1 Gauss points integrate exactly (degree 2p).
    """
    xi, weight = gauss(order)
    return np.ascontiguousarray((legendre(order, xi) * weight).T * (np.arange(order + 1) + 0.5))


def lagrange(order: int, s: Array) -> Array:
    """Return values of the Lagrange polynomials through the Gauss points of an element.

    Parameters
    ----------
    order : int
        p >= 0.
    s : (k,) array
        Local coordinates in [-1, 1].

    Returns
    -------
    (p+1, k) array
        L_b(s): one at node b, zero at the others.
    """
    return lagrange_coefficients(order) @ legendre(order, np.asarray(s, dtype=np.float64))


def lagrange_slopes(order: int, s: Array) -> Array:
    """Return the derivatives L_b'(s) of the Lagrange polynomials, (p+1, k)."""
    slopes = np.polynomial.legendre.legder(lagrange_coefficients(order).T)
    return np.asarray(slopes.T @ legendre(max(order - 1, 0), np.asarray(s, dtype=np.float64)))


@functools.cache
def best_slopes(order: int) -> Array:
    """Return points at which the slope of the interpolating polynomial is accurate to one more
    order.

    They are the p zeros of P'_{p+1}. The error of interpolation at the p+1 Gauss points is P_{p+1}
    times a smooth function, up to higher orders.
    """
    last = np.eye(order + 2)[order + 1]
    zeros = np.polynomial.legendre.legroots(np.polynomial.legendre.legder(last))
    roots: Array = np.sort(np.real(zeros))
    roots.setflags(write=False)
    return roots


@functools.cache
def product_weights(order: int, points: int) -> tuple[Array, Array]:
    """Return a Gauss rule against the basis: points s (q,) and w_q L_b(s_q), (p+1, q)."""
    s, weight = gauss(points - 1)
    return s, lagrange(order, s) * weight
