"""Displacement (4.9) and stress inside the body: the stress is the derivative of (4.9) with respect
to the point, integrated over boundary elements.

With ζ = x - y as a complex number and t, u complex at x (Kolosov's form of the kernels, C =
1/(4π(1-ν))):

    σ_xx + σ_yy           = 2C Re ∫ t ds/ζ + 2µ 2C Im ∫ u dx/ζ²
    conj((σ_xx - σ_yy)/2 + iσ_xy) = C/2 ∫ [(3-4ν) t̄ + t ζ̄/ζ] ds/ζ + 2µ iC/2 ∫ [u (dx̄ - 2ζ̄
    dx/ζ)/ζ² - ū dx/ζ²]

Four complex integrals an element and basis function, analytic in 1/ζ: of points that are close to
an element in closed form as in `moments`, of others by Gauss quadrature in native/plane/field.c.
"""

from __future__ import annotations

import numpy as np

from ... import native
from ...arrays import Array, Complex, Index
from ...mesh.basis import gauss
from ...mesh.elements import Elements, Targets
from .arc_elements import Arcs
from .compiled import ELEMENTS, NODES_OF, element_members, point_members
from .integrals import shape_of
from .segments import Segments

_field = native.function("petcontact_plane_field", "pipiiDDDDDB")


def field_inside(
    targets: Targets,
    elements: Elements,
    u: Array,
    traction: Array,
    poisson_ratio: float,
    length: float,
) -> tuple[Array, Array, Array]:
    """Displacement, stress and winding number at points inside the body, see `Kernel.field`.

    Parameters
    ----------
    targets : Targets
        m points off the boundary.
    elements : Elements
        n elements of order p.
    u, traction : (n(p+1), 2, s) arrays
        Displacement [length], and traction over 2µ/ℓ [length], at the nodes in s states.
    poisson_ratio : float
        ν of plane strain; for plane stress pass ν/(1+ν).
    length : float
        ℓ, which scales the argument of the logarithm [length].
    """
    n, m, states = len(elements.index), len(targets.point), u.shape[2]
    record = native.Struct(
        ELEMENTS, *element_members(elements, elements.index, poisson_ratio, length, 1.0 / length)
    )
    points = native.Struct(NODES_OF, *point_members(targets))
    u, traction = native.contiguous(u), native.contiguous(traction)
    field = np.zeros((m, 2, states)), np.zeros((m, 3, states)), np.zeros(m)
    close = np.zeros((n, m), dtype=bool)
    _field(record.address, n, points.address, m, states, u, traction, *field, close)
    u, traction = (length * u).reshape(n, -1, 2, states), traction.reshape(n, -1, 2, states)
    for curved in (False, True):
        element, row = np.nonzero(close & (elements.curved == curved)[:, None])
        if len(element):
            field[1][:] += _close(
                row,
                targets.point,
                elements.take(element),
                u[element],
                traction[element],
                poisson_ratio,
            )
    return field


def _close(
    row: Index, point: Array, elements: Elements, u: Array, traction: Array, poisson_ratio: float
) -> Array:
    """Return the stress (m, 3, s) at points (m, 2) by elements, all straight or all arcs, that one
    of them each, of number `row` (k,), is close to, from data (k, p+1, 2, s)."""
    shape, result = shape_of(elements), np.zeros((len(point), 3, u.shape[3]))
    local = shape.coordinates(point[row, 0] + 1j * point[row, 1])
    line, bent, double, triple = (
        values.T[..., None] for values in _closed_form(shape, elements.order, *local)
    )
    moved: Complex = u[:, :, 0] + 1j * u[:, :, 1]
    pushed: Complex = traction[:, :, 0] + 1j * traction[:, :, 1]
    factor = 3.0 - 4.0 * poisson_ratio
    mean = ((line * pushed).real + (double * moved).imag).sum(axis=1)
    turned = 1j * (triple * moved - double * moved.conj())
    deviator = 0.5 * (factor * line * pushed.conj() + bent * pushed + turned).sum(axis=1)
    stress = np.stack([mean + deviator.real, mean - deviator.real, -deviator.imag], axis=1)
    np.add.at(result, row, stress / (4.0 * np.pi * (1.0 - poisson_ratio)))
    return result


def _closed_form(
    shape: Segments | Arcs, order: int, left: Array, right: Array, h: Array
) -> tuple[Complex, ...]:
    """∫ ds/ζ, ∫ ζ̄ ds/ζ², ∫ dx/ζ², ∫ (dx̄ - 2ζ̄ dx/ζ)/ζ² against the basis for one close point an
    element, (p+1, k).

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
