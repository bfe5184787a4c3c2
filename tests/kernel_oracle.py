"""Slow and obviously right: Kelvin's kernels as printed, composite Gauss quadrature graded towards
the target and the ends.

Everything in extended precision (80 bit where the platform has it), with distances taken from the
nearer end.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass

import numpy as np
from kelvin_oracle import kelvin, stress_of_kelvin

from petcontact.bem.kelvin2d.integrals import Elements, Targets
from petcontact.mesh.basis import gauss as basis_points

Real, Complex = np.longdouble, np.clongdouble


@functools.cache
def gauss(points):
    """Gauss-Legendre in extended precision: Newton's method from numpy's points."""
    x = np.polynomial.legendre.leggauss(points)[0].astype(Real)
    for _ in range(3):
        below, value = np.ones_like(x), x.copy()
        for k in range(2, points + 1):
            below, value = value, ((2 * k - 1) * x * value - (k - 1) * below) / Real(k)
        slope = points * (x * value - below) / (x * x - 1)
        x = x - value / slope
    return x, 2 / ((1 - x * x) * slope * slope)


def basis(order, s):
    """Lagrange polynomials through the Gauss points as products, (p+1, k)."""
    x, _ = gauss(order + 1)
    factors = [
        [(s - x[j]) / (x[b] - x[j]) for j in range(order + 1) if j != b] for b in range(order + 1)
    ]
    return np.array([functools.reduce(np.multiply, f, np.ones_like(s)) for f in factors])


@dataclass(eq=False)
class Element:
    """One element by its end points and curvature."""

    start: np.ndarray
    end: np.ndarray
    curvature: float
    order: int

    def __post_init__(self):
        self.first, self.last = (Complex(p[0]) + 1j * Real(p[1]) for p in (self.start, self.end))
        self.kappa = Real(self.curvature)
        chord = self.last - self.first
        self.angle = np.arcsin(self.kappa * np.abs(chord) / 2)
        self.half = self.angle / self.kappa if self.curvature else np.abs(chord) / 2
        turn = np.exp(1j * self.angle)
        self.tangent_first, self.tangent_last = (
            chord / np.abs(chord) / turn,
            chord / np.abs(chord) * turn,
        )

    def _along(self, tangent, offset):
        """Vector from a point with this tangent to the point `offset` further in s."""
        if not self.curvature:
            return tangent * self.half * offset
        return (
            tangent
            * np.exp(0.5j * self.angle * offset)
            * np.sin(self.angle * offset / 2)
            * 2
            / self.kappa
        )

    def vector(self, point, from_first, from_last):
        """x - y and the unit tangent at x, from the distances s+1 and s-1 in the parameter."""
        near_first = from_first < -from_last
        r = np.where(
            near_first,
            self.first - point + self._along(self.tangent_first, from_first),
            self.last - point + self._along(self.tangent_last, from_last),
        )
        tangent = np.where(
            near_first,
            self.tangent_first * np.exp(1j * self.angle * from_first),
            self.tangent_last * np.exp(1j * self.angle * from_last),
        )
        return r, tangent

    def at(self, s):
        """The point at parameter s as a pair of floats."""
        z = self.first + self._along(self.tangent_first, Real(s) + 1)
        return np.array([float(z.real), float(z.imag)])

    def elements(self, line=-1):
        """As the kernels want it."""
        return Elements(
            np.array([self.start]),
            np.array([self.end]),
            np.array([self.curvature]),
            self.order,
            np.array([line]),
            np.array([0]),
        )


def free(points):
    """Targets that belong to no element."""
    none = np.full(len(points), -1)
    return Targets(np.asarray(points, dtype=float), none, none, np.zeros(len(points)))


def drawn(rng, order, angle):
    """An element anywhere of any size, and its chord."""
    start, turn, size = rng.normal(size=2), rng.uniform(0, 2 * np.pi), 10.0 ** rng.uniform(-2, 1)
    end = start + size * np.array([np.cos(turn), np.sin(turn)])
    return Element(start, end, 2 * np.sin(angle) / size, order), size


def around(element, s, distance, turn):
    """The point at a distance from the point s of the element, at an angle to the tangent there."""
    bent = element.angle if element.curvature else 0.0
    direction = complex(element.tangent_first * np.exp(1j * bent * (s + 1))) * np.exp(1j * turn)
    return element.at(s) + distance * np.array([direction.real, direction.imag])


def nodes_of(elements, shapes):
    """The collocation nodes as targets."""
    xi, n = basis_points(elements.order)[0], len(elements.index)
    nodes = len(xi)
    point = np.array([shape.at(s) for shape in shapes for s in xi])
    return Targets(
        point, np.repeat(elements.line, nodes), np.repeat(elements.index, nodes), np.tile(xi, n)
    )


def outline(vertices, shares, order, curvature=None):
    """Elements of a polygon whose sides are divided at shares, or bent as a whole; their nodes."""
    start, end, line = [], [], []
    for k, corner in enumerate(np.array(vertices, float)):
        following = np.array(vertices[(k + 1) % len(vertices)], float)
        points = corner + np.array(shares)[:, None] * (following - corner)
        points[-1] = following
        start.append(points[:-1]), end.append(points[1:]), line.append(np.full(len(points) - 1, k))
    start, end, line = np.concatenate(start), np.concatenate(end), np.concatenate(line)
    bent = np.zeros(len(start)) if curvature is None else np.array(curvature, float)
    line = np.where(bent == 0.0, line, -1)
    elements = Elements(start, end, bent, order, line, np.arange(len(start)))
    shapes = [Element(start[e], end[e], bent[e], order) for e in range(len(start))]
    return elements, nodes_of(elements, shapes)


def real(r, tangent):
    """Vectors (k, 2) and the normals on the right of a direction."""
    return np.stack([r.real, r.imag], axis=-1), np.stack([tangent.imag, -tangent.real], axis=-1)


def nearest(element, point):
    """Parameter of the point of the element next to a target, and its distance."""
    return _nearest(element, tuple(point))


@functools.lru_cache(maxsize=64)
def _nearest(element, point):
    """Golden section from samples."""
    y = Complex(point[0]) + 1j * Real(point[1])

    def distance(s):
        return np.abs(element.vector(y, s + 1, s - 1)[0])

    samples = np.linspace(-1, 1, 201).astype(Real)
    place = int(np.argmin(distance(samples)))
    low, high = samples[max(place - 1, 0)], samples[min(place + 1, 200)]
    for _ in range(75):
        inner = np.array([low + (high - low) * Real(0.382), low + (high - low) * Real(0.618)])
        at = distance(inner)
        low, high = (low, inner[1]) if at[0] < at[1] else (inner[0], high)
    candidates = np.array([Real(-1), (low + high) / 2, Real(1)])
    best = int(np.argmin(distance(candidates)))
    return candidates[best], float(distance(candidates)[best])


def _panels(element, point):
    """s+1, s-1 and weights of a rule on panels that halve towards the nearest point, down to its
    distance."""
    centre, distance = nearest(element, point)
    levels = 2 + max(0, int(np.ceil(np.log2(float(element.half) / distance))))
    steps = Real(2) ** (1 - np.arange(levels + 1))
    edges = np.concatenate([centre - steps, centre + steps])
    edges = np.unique(np.concatenate([edges[np.abs(edges) < 1], [Real(-1), centre, Real(1)]]))
    x, weight = gauss(24)
    half = (edges[1:] - edges[:-1])[:, None] / 2
    from_first = (edges[:-1] + 1)[:, None] + half * (1 + x)
    from_last = (edges[1:] - 1)[:, None] - half * (1 - x)
    return from_first.ravel(), from_last.ravel(), (half * weight).ravel()


def _integrals(element, point, kernels):
    """Of kernels of vectors and normals against the basis, at a point off the element."""
    y = Complex(point[0]) + 1j * Real(point[1])
    from_first, from_last, weight = _panels(element, point)
    s = np.where(from_first < 1, from_first - 1, from_last + 1)
    against = basis(element.order, s) * weight * element.half
    values = kernels(*real(*element.vector(y, from_first, from_last)))
    return [value @ against.T for value in values]


def reference(element, point, poisson_ratio, length):
    """G and H, (2, 2, p+1), at a point off the element."""
    return _integrals(element, point, lambda r, n: kelvin(r, n, poisson_ratio, length))


def reference_stress(element, point, poisson_ratio):
    """D and S of the stress Σ D t + 2µ Σ S u, (3, 2, p+1), at a point off the element."""
    return _integrals(element, point, lambda r, n: stress_of_kelvin(r, n, poisson_ratio))


def reference_self(element, xi, poisson_ratio, length):
    """G and the principal value of H at a node: both sides of it taken together, where the singular
    parts cancel."""
    xi = Real(xi)
    near, far = 1 - abs(xi), 1 + abs(xi)
    x, weight = gauss(20)
    ends = [near * Real(2) ** -k for k in range(61)] + [Real(0)]
    pieces = [(low, high, (-1, 1)) for high, low in itertools.pairwise(ends)]
    if far > near:
        ends = near * (far / near) ** (np.arange(9) / Real(8))
        pieces += [(low, high, (-np.sign(xi),)) for low, high in itertools.pairwise(ends)]
    g, h = np.zeros((2, 2, 2, element.order + 1), Real)
    # The node itself is the origin: the tangent there, and x - y along the element from it.
    tangent = element.tangent_first * np.exp(1j * element.angle * (xi + 1))
    for low, high, signs in pieces:
        for sign in signs:
            offset = sign * ((low + high) / 2 + (high - low) / 2 * x)
            r = element._along(tangent, offset)
            direction = tangent * np.exp(1j * element.angle * offset)
            u, t = kelvin(*real(r, direction), poisson_ratio, length)
            against = basis(element.order, xi + offset) * (high - low) / 2 * weight * element.half
            g, h = g + u @ against.T, h + t @ against.T
    return g, h


def block_error(values, expected):
    """Largest error over the largest entry."""
    return float(np.max(np.abs(values - expected)) / np.max(np.abs(expected)))
