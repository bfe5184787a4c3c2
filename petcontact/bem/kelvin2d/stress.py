"""Stress inside the body: the derivative of (4.9) with respect to the point, integrated over
boundary elements.

With ζ = x - y as a complex number and t, u complex at x (Kolosov's form of the kernels, C =
1/(4π(1-ν))):

    σ_xx + σ_yy           = 2C Re ∫ t ds/ζ + 2µ 2C Im ∫ u dx/ζ²
    conj((σ_xx - σ_yy)/2 + iσ_xy) = C/2 ∫ [(3-4ν) t̄ + t ζ̄/ζ] ds/ζ + 2µ iC/2 ∫ [u (dx̄ - 2ζ̄
    dx/ζ)/ζ² - ū dx/ζ²]

Four complex integrals an element and basis function, analytic in 1/ζ and in closed form as in
`moments`.
"""

from __future__ import annotations

import numpy as np

from ...arrays import AnyArray, Array, Complex, Index
from ...mesh.basis import gauss, product_weights
from ...mesh.elements import Elements
from .arcs import CLOSE_SUM, MIDDLE, Arcs
from .integrals import shape_of
from .segments import Segments

FAR_RADIUS, FAR = 12.0, 1
"""As in `moments.Rule`; FAR is added to the far points of G and H, whose kernels are less
singular."""

Integrals = tuple[Complex, ...]


def stress_integrals(
    points: Array, elements: Elements, poisson_ratio: float
) -> tuple[Array, Array]:
    """Stress at points inside the body from boundary tractions and displacements: σ = Σ D t + 2µ Σ
    S u.

    Parameters
    ----------
    points : (m, 2) array
        Points off the boundary [length].
    elements : Elements
        n elements of order p.
    poisson_ratio : float
        ν of plane strain; for plane stress pass ν/(1+ν).

    Returns
    -------
    D : (3, 2, n(p+1), m) array
        ∫ D_ij L_b ds [-], i = xx, yy, xy of the stress at the point, j the component of the
        traction.
    S : (3, 2, n(p+1), m) array
        ∫ S_ij L_b ds [1/length], j the component of the displacement.
    """
    order, n, m = elements.order, len(elements.index), len(points)
    nodes = order + 1
    integrals = np.empty((4, n, nodes, m), dtype=np.complex128)
    point: Complex = points[:, 0] + 1j * points[:, 1]
    curved = elements.curved
    for chosen in (np.flatnonzero(~curved), np.flatnonzero(curved)):
        if len(chosen) and m:
            _fill(integrals, chosen, shape_of(elements.take(chosen)), order, point)
    line, bent, double, triple = integrals.reshape(4, n * nodes, m)
    scale = 1.0 / (4.0 * np.pi * (1.0 - poisson_ratio))
    factor = 3.0 - 4.0 * poisson_ratio
    kernel_d, kernel_s = np.empty((3, 2, n * nodes, m)), np.empty((3, 2, n * nodes, m))
    _stress(kernel_d[:, 0], scale * line.real, 0.5 * scale * (factor * line + bent))
    _stress(kernel_d[:, 1], -scale * line.imag, 0.5j * scale * (bent - factor * line))
    _stress(kernel_s[:, 0], scale * double.imag, 0.5j * scale * (triple - double))
    _stress(kernel_s[:, 1], scale * double.real, -0.5 * scale * (triple + double))
    return kernel_d, kernel_s


def _stress(out: Array, mean: Array, conjugate_deviator: AnyArray) -> None:
    """xx, yy, xy from (σ_xx + σ_yy)/2 and conj((σ_xx - σ_yy)/2 + iσ_xy)."""
    np.add(mean, conjugate_deviator.real, out=out[0])
    np.subtract(mean, conjugate_deviator.real, out=out[1])
    np.negative(conjugate_deviator.imag, out=out[2])


def _fill(out: Complex, numbers: Index, shape: Segments | Arcs, order: int, point: Complex) -> None:
    """Fill the four integrals of elements `numbers`, (n, p+1, m), by Gauss quadrature, and those
    that are not far by closed forms."""
    points = shape.far_points(order) + FAR
    step = max(1, (1 << 17) // (points * len(point)))
    for first in range(0, len(numbers), step):
        rows = slice(first, min(first + step, len(numbers)))
        some = shape.take(rows)
        x, dx = some.nodes(points)
        with np.errstate(
            divide="ignore", invalid="ignore", over="ignore"
        ):  # of pairs that are taken once more
            values = _quadrature(
                order, x.T[:, :, None], dx.T[:, :, None], some.half[:, None, None], point
            )
        for whole, part in zip(out, values, strict=True):
            whole[numbers[rows]] = part
        element, column = np.nonzero(
            np.abs(point - some.middle[:, None]) < some.reach(FAR_RADIUS)[:, None]
        )
        near = some.take(element)
        left, right, h = near.coordinates(point[column])
        is_close = np.sqrt(left * left + h * h) + np.sqrt(right * right + h * h) < CLOSE_SUM
        chosen = np.flatnonzero(is_close)
        if len(chosen):
            values = _closed_form(near.take(chosen), order, left[chosen], right[chosen], h[chosen])
            _scatter(out, numbers[rows][element[chosen]], column[chosen], values)
        chosen = np.flatnonzero(~is_close)
        if len(chosen):
            x, dx = near.take(chosen).nodes(MIDDLE)
            values = _quadrature(order, x, dx, near.half[chosen], point[column[chosen]])
            _scatter(out, numbers[rows][element[chosen]], column[chosen], values)


def _scatter(out: Complex, element: Index, column: Index, values: Integrals) -> None:
    for whole, part in zip(out, values, strict=True):
        whole[element, :, column] = part.T


def _quadrature(order: int, x: Complex, dx: Complex, half: Array, point: Complex) -> Integrals:
    """∫ ds/ζ, ∫ ζ̄ ds/ζ², ∫ dx/ζ², ∫ (dx̄ - 2ζ̄ dx/ζ)/ζ² against the basis, over the second axis
    from the end."""
    _, product = product_weights(order, x.shape[-2])
    zeta: Complex = x - point
    inverse: Complex = 1.0 / zeta
    ratio: Complex = zeta.conjugate() * inverse
    scaled: Complex = dx * inverse * inverse
    triple: Complex = dx.conjugate() * inverse * inverse - 2.0 * ratio * scaled
    line: Complex = half * inverse
    return product @ line, product @ (ratio * line), product @ scaled, product @ triple


def _closed_form(
    shape: Segments | Arcs, order: int, left: Array, right: Array, h: Array
) -> Integrals:
    """The integrals of `_quadrature` for one close point an element, (p+1, k).

    With x = α(s-z)/2, P = exp(-iαz) and Q = i exp(-iαξ) sinh(αh), 1/ζ = κP/(2τ) (cot x - i) and
    ζ̄ = 2/(κτ) [P exp(-ix) sin x + Q] on an arc; exp(-2ix) = 1 - 2i exp(-ix) sin x leads everything
    back to the integrals of cot x, 1/sin² x and cos x/sin³ x.
    """
    parts = shape.powers(order, left, right, h)
    angle, phase, lift = shape.bend(0.5 * (left + right), h)
    weight = gauss(order)[1][:, None]
    conjugate_tangent: Complex = shape.tangent.conjugate()
    turn: Complex = conjugate_tangent * phase
    frame: Complex = conjugate_tangent * turn * turn
    first: Complex = parts.first - 0.5j * angle * weight
    # exp(-2ix) against the basis
    wave: Complex = parts.wave / phase
    bent: Complex = phase * (first - 1j * angle * wave) + 2.0 * lift * (
        parts.second - 1j * angle * first
    )
    conjugate: Complex = phase * (parts.second - 2j * angle * first - angle**2 * wave)
    triple: Complex = phase * (parts.second - 1j * angle * first) + lift * (
        2.0 * parts.third - 1j * angle * parts.second
    )
    double: Complex = turn / shape.half * parts.second
    return turn * first, frame * bent, double, frame / shape.half * (conjugate - 2.0 * triple)
