"""Slow and obviously right: Kelvin's kernels in space as printed, summed round the ring and along
the element by points that crowd about the target."""

from __future__ import annotations

import numpy as np
from kelvin_oracle import kelvin

from petcontact.mesh.basis import gauss, lagrange

PANELS, POINTS, GRADE = 12, 16, 0.3
FIELD = [0, 2, 1]
"""Which of x, y, z are r, z, θ at a point (r, 0, z)."""


def ring_kernels(r, R, step, normal, nu):
    """2µ R ∫ U and R ∫ T over the angle, (k, 3, 3).

    r : float; R (k,); step (k, 2) is (R - r, Z - z), normal (k, 2). Components are r, z, θ.
    """
    x, w = gauss(POINTS - 1)
    near = np.maximum(np.hypot(*step.T) / R, 1e-14)[:, None]
    panels = PANELS if near.min() < 0.1 else 4
    u = (np.arange(panels)[:, None] + 0.5 * (1.0 + x)).ravel() / panels
    reach = np.arcsinh(np.pi / near)
    angle = near * np.sinh(reach * u)
    weight = 2.0 * near * np.cosh(reach * u) * reach * np.tile(w, panels) / (2.0 * panels)
    cos, sin, q = np.cos(angle), np.sin(angle), 2.0 * np.sin(0.5 * angle) ** 2
    dr, dz, R = step[:, :1], step[:, 1:] + 0.0 * angle, R[:, None]
    d = np.stack([dr - R * q, R * sin, dz], axis=-1)
    nr, nz, none = normal[:, :1], normal[:, 1:], 0.0 * angle
    n = np.stack([nr * cos, nr * sin, nz + none], axis=-1)
    rows = [[cos, sin, none], [none, none, none + 1.0], [-sin, cos, none]]
    ring = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    whole = (R * weight)[:, :, None, None]
    # what is odd in the angle adds up to nothing
    even = np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 1]])
    return [
        (whole * np.einsum("ijka,kasj->kais", part[FIELD], ring, optimize=True)).sum(axis=1) * even
        for part in kelvin(d, n, nu)
    ]


class Arc:
    """An element by its first point, the direction there, its length and its curvature."""

    def __init__(self, start, direction, length, curvature):
        self.start, self.curvature = np.array(start, float), curvature
        self.half, self.direction = 0.5 * length, direction
        self.end = self.start + self.chord(-1.0, np.array([2.0]))[0]

    def angle(self, s):
        return self.direction + self.curvature * self.half * (s + 1.0)

    def chord(self, first, offset):
        """From s = `first` to points as much further, (k, 2)."""
        turn = 0.5 * self.curvature * self.half * offset
        size = self.half * offset * np.sinc(turn / np.pi)
        angle = self.angle(first) + turn
        return size[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)

    def left(self, s):
        angle = self.angle(s)
        return np.array([-np.sin(angle), np.cos(angle)])

    def beside(self, s, distance):
        """The point at a distance on the left of the point s."""
        return self.start + self.chord(-1.0, np.array([s + 1.0]))[0] + distance * self.left(s)

    def kernels(self, s, distance, nu):
        """Points and weights in s, and `ring_kernels` there, of a target beside s (beyond an end: of
        a point of the line or circle); at distance 0 in pairs about s, for the principal value."""
        r, crowd = self.beside(s, distance)[0], _pairs if distance == 0.0 else _crowded
        offset, weight = crowd(s, abs(distance) / self.half)
        at = s + offset
        step = self.chord(s, offset) - distance * self.left(s)
        normal = -np.stack([-np.sin(self.angle(at)), np.cos(self.angle(at))], axis=1)
        found = ring_kernels(r, r + step[:, 0], step, normal, nu)
        return at, weight * self.half, found

    def integrals(self, s, distance, nu, orders):
        """U and T against the bases of some orders, (..., p+1)."""
        at, weight, found = self.kernels(s, distance, nu)
        return {
            p: [np.einsum("kij,bk->ijb", part, lagrange(p, at) * weight) for part in found]
            for p in orders
        }


def _crowded(s, distance):
    base = min(max(s, -1.0), 1.0)
    least = 0.05 * max(distance, abs(s - base))
    points, weights = [], []
    for sign, length in ((-1.0, base + 1.0), (1.0, 1.0 - base)):
        last = length
        while last > 0.0:
            last = _panel(base - s, sign, last, least, points, weights)
    return np.concatenate(points), np.concatenate(weights)


def _pairs(s, _):
    """Panels that mirror each other about s, then the rest of the longer side."""
    short, points, weights = min(s + 1.0, 1.0 - s), [], []
    last = short
    while last > 0.0:
        for sign in (-1.0, 1.0):
            first = _panel(0.0, sign, last, 1e-13, points, weights)
        last = first
    sign, last = (-1.0, s + 1.0) if s > 0.0 else (1.0, 1.0 - s)
    while last > short * (1.0 + 1e-12):
        first = max(GRADE * last, short)
        _between(0.0, sign, first, last, points, weights)
        last = first
    return np.concatenate(points), np.concatenate(weights)


def _panel(base, sign, last, least, points, weights):
    first = GRADE * last if last > least else 0.0
    _between(base, sign, first, last, points, weights)
    return first


def _between(base, sign, first, last, points, weights):
    x, w = gauss(POINTS - 1)
    half = 0.5 * (last - first)
    points.append(base + sign * (first + half * (1.0 + x)))
    weights.append(half * w)
