"""Kelvin's solution of rings as a `Kernel`: bodies of revolution on their generating curves.

What holds for `RingKernel` (two components) and `TwistedRingKernel` (three):

- A point of the half plane is (r, z), r >= 0, z the axis. The curve has the body on its left and
  carries no elements on the axis; its normal n = (n_r, n_z) points outward, as in the plane.
  Targets and elements are those of a `CurveMesh`.
- Components come in the order r, z, θ. θ follows the right-hand rule about +z. In elasticity
  θ knows nothing of r and z: G and H have zeros there.
- u [length] and t [stress] are values at a point of the ring. The factor R and the integral over
  the angle are in the kernels, so the equation is that of the plane:
  ½ u_i + Σ H_ij u_j = Σ G_ij t_j/s, s = `traction_scale` = 2µ/ℓ, all entries pure numbers.
- Forces are whole forces of rings: 2πR times the force per length of the ring, for each component
  (the torque of the third is R times it). On the axis only the force along z acts.
- Stress has the components of `STRESS`, in the order rr, zz, rz, θθ and, with torsion, rθ, zθ.
- Targets may lie on the axis: u_r = u_θ = 0, σ_θθ = σ_rr and σ_rz = σ_rθ = σ_zθ = 0 there.
- Rigid motions: u = (0, 1) along z, and u_θ = r with torsion. For each, ½ u + Σ H u = 0 on a
  closed curve, and Σ H u = -u inside.
- The solution decays far away: no constant is free, and loads need not be in equilibrium.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from ...arrays import Array, Index, Mask
from ...geometry.arcs import half_angles, on_arcs
from ...mesh.basis import gauss, lagrange
from ...mesh.curve_mesh import CurveMesh
from ...mesh.elements import Elements, Targets
from ..kelvin import KelvinSolution
from ..kelvin2d.corner_elements import corner_columns
from .compiled import TOLERANCE, ring_integrals
from .rings import Ring

FAR, NEAR, SEEN, REACH, RATIO = 20, 12, 33, 1.5, 0.25
STRESS = ((0, 0), (1, 1), (0, 1), (2, 2), (0, 2), (1, 2))
"""Components of stress: rr, zz, rz, θθ, and with torsion rθ, zθ."""


class RingKernel(KelvinSolution):
    """Kelvin's solution of rings, loaded along r and z."""

    dim = 2
    stress_components: ClassVar[tuple[tuple[int, int], ...]] = STRESS[:4]

    @property
    def poisson_ratio(self) -> float:
        """ν [-]."""
        return self.material.poisson_ratio

    def potential(self, distance: Array) -> Array:
        """-ln(r/ℓ): that of the plane, which is the ring's from near."""
        return np.asarray(-np.log(distance / self.unit_length))

    def measure(self, at: Array) -> Array:
        """As in `Kernel`: 2πr."""
        return np.asarray(2.0 * np.pi * at[:, 0])

    def corner_columns(
        self, mesh: CurveMesh, rows: Index, nodes: Index
    ) -> Iterator[tuple[int, Array, Array]]:
        """As in `Kernel`."""
        return corner_columns(self, mesh, rows, nodes)

    def integrals(self, targets: Targets, elements: Elements) -> tuple[Array, Array]:
        """As in `Kernel`."""
        tolerance = self.tolerance or TOLERANCE
        nu, unit = self.poisson_ratio, self.unit_length
        return ring_integrals(targets, elements, nu, unit, tolerance, self.dim)

    def stress_integrals(self, targets: Targets, elements: Elements) -> tuple[Array, Array]:
        """As in `Kernel`, the components those of `stress_components`."""
        d, nu = self.dim, self.poisson_ratio

        def values(ring: Ring) -> Array:
            each = [[ring.stress(i, j, a, nu) for a in range(d)] for i, j in self.stress_components]
            return np.moveaxis(np.array(each), 2, 0)

        found = _Pairs(targets, elements).integrate(values, (2, len(self.stress_components), d))
        return found[0], found[1] * self.unit_length

    def field(
        self, targets: Targets, elements: Elements, u: Array, traction: Array
    ) -> tuple[Array, Array, Array]:
        """As `bem.kernels.field_of` of one state: u (m, d), stress (m, components), and what is
        wound round each point, by the rigid translation along z."""
        (g, h), (dd, ss) = (
            self.integrals(targets, elements),
            self.stress_integrals(targets, elements),
        )
        moved = np.einsum("ijkm,kj->mi", g, traction) - np.einsum("ijkm,kj->mi", h, u)
        stressed = np.einsum("ijkm,kj->mi", dd, traction) + np.einsum("ijkm,kj->mi", ss, u)
        return moved, stressed, -h[1, 1].sum(axis=0)

    def point_displacement(self, x: Array, at: Array, force: Array) -> Array:
        """u (n, d) [length] at points (n, 2) for whole forces (f, d) of rings through (f, 2)."""
        result = np.zeros((len(x), self.dim))
        for place, load in zip(at, force, strict=True):
            ring = _ring_through(x, place)
            for i in range(self.dim):
                for a in range(self.dim):
                    u = ring.displacement(i, a, self.poisson_ratio) / ring.R
                    result[:, i] += u * load[a]
        return result / (4.0 * np.pi * self.material.shear_modulus)

    def point_stress(self, x: Array, at: Array, force: Array) -> Array:
        """Stress (n, components) of the same forces [stress]."""
        result = np.zeros((len(x), len(self.stress_components)))
        for place, load in zip(at, force, strict=True):
            ring = _ring_through(x, place)
            for c, (i, j) in enumerate(self.stress_components):
                for a in range(self.dim):
                    by_t = ring.stress(i, j, a, self.poisson_ratio)[0] / ring.R
                    result[:, c] += by_t * load[a]
        return result / (2.0 * np.pi)


class TwistedRingKernel(RingKernel):
    """Kelvin's solution of rings, loaded along r, z and θ."""

    dim = 3
    stress_components = STRESS


def _ring_through(x: Array, place: Array) -> Ring:
    """The ring of a force as seen from points; one on the axis is thin instead."""
    step = place - x
    distance = np.hypot(*step.T)
    # a ring of 1e-9 of the distances is a point to round-off
    radius = max(float(place[0]), 1e-9 * float(distance.max(initial=1e-150)))
    step[:, 0] += radius - place[0]
    step[distance < 1e-12 * distance.max(initial=1e-150)] = 1e-150 + distance.max(initial=0.0)
    one = np.ones(len(x))
    return Ring(x[:, 0], radius * one, step[:, 0], step[:, 1], 0.0 * one, one)


def _half(elements: Elements) -> Array:
    chord = np.hypot(*(elements.end - elements.start).T)
    angle = half_angles(chord, elements.curvature)
    return np.asarray(0.5 * chord / np.sinc(angle / np.pi))


class _Pairs:
    """Elements, targets, and which of them are near each other."""

    def __init__(self, targets: Targets, elements: Elements) -> None:
        self.targets, self.elements, self.half = targets, elements, _half(elements)
        angle = half_angles(np.hypot(*(elements.end - elements.start).T), elements.curvature)
        self.angle, n, self.seen = angle, len(elements.index), np.linspace(-1.0, 1.0, SEEN)
        distance = np.empty((n, len(targets.point)))
        self.foot = np.empty_like(distance)
        for e in range(n):
            points, _ = self.at(e, self.seen)
            apart = np.hypot(*(targets.point[:, None] - points).transpose(2, 0, 1))
            nearest = apart.argmin(axis=1)
            distance[e], self.foot[e] = apart.min(axis=1), self.seen[nearest]
        self.own = elements.index[:, None] == targets.element
        self.foot = np.where(self.own, targets.xi, self.foot)
        self.distance = np.where(self.own, 0.0, distance / self.half[:, None])
        self.near: Mask = self.distance < 2.0 * REACH

    def at(self, e: int, s: Array) -> tuple[Array, Array]:
        """Points and normals of an element."""
        return on_arcs(self.elements.start[e], self.elements.end[e], self.angle[e], s)

    def integrate(self, values: Callable[[Ring], Array], shape: tuple[int, ...]) -> Array:
        """Kernels against the bases, (*shape, n(p+1), m)."""
        nodes, m = self.elements.order + 1, len(self.targets.point)
        result = np.zeros((*shape, len(self.half) * nodes, m))
        for e in range(len(self.half)):
            here = slice(e * nodes, (e + 1) * nodes)
            far = np.flatnonzero(~self.near[e])
            if len(far):
                s, w = gauss(FAR - 1)
                result[..., here, far] = self._some(e, far, s, w, values)
            for column in np.flatnonzero(self.near[e]).tolist():
                s, w = _graded(self.foot[e, column], self.distance[e, column])
                result[..., here, column] = self._some(e, np.array([column]), s, w, values)[..., 0]
        return result

    def _some(
        self,
        e: int,
        columns: Index,
        s: Array,
        w: Array,
        values: Callable[[Ring], Array],
    ) -> Array:
        point, (x, n) = self.targets.point[columns], self.at(e, s)
        step = x - point[:, None]
        if self.own[e, columns].any():
            # from the node on, without differences of coordinates
            a = self.angle[e] * (s - self.targets.xi[columns[0]])
            tangent = np.array([-n[:, 1], n[:, 0]]).T
            along, across = np.sinc(a / np.pi), 0.5 * a * np.sinc(0.5 * a / np.pi) ** 2
            size = self.half[e] * (s - self.targets.xi[columns[0]])
            step[0] = size[:, None] * (along[:, None] * tangent + across[:, None] * n)
        wide = np.broadcast_to
        to = step.shape[:2]
        ring = Ring(
            *(wide(v, to) for v in (point[:, :1], x[:, 0])),
            *step.transpose(2, 0, 1),
            *(wide(v, to) for v in n.T),
        )
        basis = lagrange(self.elements.order, s) * (w * self.half[e])
        return np.asarray(np.einsum("...mq,kq->...km", values(ring), basis))


def _graded(foot: float, distance: float) -> tuple[Array, Array]:
    """Gauss points graded towards a place."""
    x, w = gauss(NEAR - 1)
    least = max(0.1 * distance, 1e-11)
    points, weights = [], []
    for sign, length in ((-1.0, 1.0 + foot), (1.0, 1.0 - foot)):
        last = length
        while last > 0.0:
            first = last * RATIO if last > least else 0.0
            half = 0.5 * (last - first)
            points.append(foot + sign * (first + half * (1.0 + x)))
            weights.append(half * w)
            last = first
    return np.concatenate(points), np.concatenate(weights)
