"""Moments of the kernels against the Lagrange basis, in an element's own complex coordinate.

The element is s in [-1, 1] and the target z = ξ + ih, h > 0 on the left of the direction start ->
end (inside the body). Every integral over a straight element is a linear combination of ∫ L_b
ln|s-z| ds and ∫ L_b/(s-z)^k ds, k = 1, 2, 3.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Complex, Mask
from ...mesh.basis import lagrange_coefficients
from ...record import record


@record
class PointCounts:
    """How the moments of one order are taken at every distance, each to about 1e-13.

    Attributes
    ----------
    far, far_radius
        Gauss points for targets with |z| > far_radius.
    middle, close_sum
        Gauss points for the others with |z+1| + |z-1| > close_sum; closed form inside, where its
        recursion keeps its digits.
    """

    far: int
    far_radius: float
    middle: int
    close_sum: float


RULES = {
    0: PointCounts(6, 11.0, 11, 5.5),
    1: PointCounts(6, 11.0, 12, 5.5),
    2: PointCounts(7, 11.0, 12, 5.5),
    3: PointCounts(7, 12.0, 14, 4.6),
    4: PointCounts(8, 11.0, 18, 3.6),
    5: PointCounts(8, 12.0, 22, 3.0),
}


@record
class Parts:
    """Integrals over elements of half the angle α for one target each, as arrays (p+1, n), x =
    α(s-z)/2.

    Attributes
    ----------
    first, second, third
        ∫ L_b α/2 cot x ds, ∫ L_b (α/2)²/sin² x ds, ∫ L_b (α/2)³ cos x/sin³ x ds; ∫ L_b/(s-z)^k ds
        for α = 0.
    wave
        ∫ L_b exp(-iαs) ds.
    """

    first: Complex
    second: Complex
    third: Complex
    wave: Complex


def powers(
    order: int, left: Array, right: Array, h: Array, on_line: Mask, highest: int
) -> tuple[Array, list[Complex]]:
    """Return ∫ L_b ln|s-z| ds and ∫ L_b/(s-z)^k ds, k = 1 ... highest, in closed form for close
    targets.

    With Legendre polynomials in place of L_b the integrals of 1/(s-z) are -2Q_k(z), from the
    three-term recursion (DLMF 14.10.3); those of the logarithm and of the higher powers follow from
    (2k+1) P_k = (P_{k+1} - P_{k-1})'. The recursion loses digits like ρ^k, which is why there are
    `RULES`.

    Parameters
    ----------
    order : int
    left, right : (m,) arrays
        ξ+1 and ξ-1, each as accurate as a target close to that end asks for.
    h : (m,) array
    on_line : (m,) bool array
        Targets on the element's line, where h = 0 exactly; on the element itself the principal
        value is taken, and the higher powers mean nothing.
    highest : int
        At most 3.

    Returns
    -------
    (p+1, m) array and list of (p+1, m) complex arrays
    """
    z = 0.5 * (left + right) + 1j * h
    c = np.empty((order + 2, len(h)), dtype=np.complex128)
    c[0], log_0 = _first(left, right, h, on_line)
    c[1] = z * c[0] + 2.0
    for k in range(1, order + 1):
        c[k + 1] = ((2 * k + 1) * z * c[k] - k * c[k - 1]) / (k + 1)
    log = np.empty((order + 1, len(h)))
    log[0] = log_0
    for k in range(1, order + 1):
        log[k] = (c[k - 1].real - c[k + 1].real) / (2 * k + 1)
    to_basis = lagrange_coefficients(order)
    result = [c[: order + 1]]
    start = 2.0 / (left * right - h * h + 1j * h * (left + right))  # 2/(z²-1)
    for power in range(2, highest + 1):
        lower = result[-1]
        d = np.empty((order + 1, len(h)), dtype=np.complex128)
        d[0] = start
        if order > 0:
            d[1] = z * start + lower[0]
        for k in range(1, order):
            d[k + 1] = d[k - 1] + (2 * k + 1) / (power - 1) * lower[k]
        result.append(d)
        start = -0.5 * z * start * start
    return to_basis @ log, [to_basis @ moments for moments in result]


def _first(left: Array, right: Array, h: Array, on_line: Mask) -> tuple[Complex, Array]:
    """Return ∫ ds/(s-z) and ∫ ln|s-z| ds over [-1, 1], to round-off at every distance."""
    square_1, square_2 = left * left + h * h, right * right + h * h
    angle = np.arctan2(2.0 * h, left * right + h * h)
    angle[on_line] = 0.0
    total = left + right
    ratio = np.copysign(
        0.5 * np.log1p(2.0 * np.abs(total) / np.minimum(square_1, square_2)), -total
    )
    log = 0.5 * (np.log(square_1) + np.log(square_2)) - 0.5 * total * ratio + h * angle - 2.0
    return ratio + 1j * angle, log
