"""Kernels of rings: exact fields of bodies of revolution, which their equations keep."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.bem.revolution.kernel import TwistedRingKernel
from petcontact.geometry.arcs import half_angles, on_arcs
from petcontact.mesh.basis import gauss
from petcontact.mesh.elements import Elements, Targets
from petcontact.model.problem import Material

NU = 0.3
CYLINDER = [((0, 0), (1, 0), 0.0), ((1, 0), (1, 1), 0.0), ((1, 1), (0, 1), 0.0)]
BALL = [((0, -1), (0, 1), 1.0)]
PLATE = [((1, 0), (2, 0), 0.0), ((2, 0), (2, 1), 0.0), ((2, 1), (1, 1), 0.0), ((1, 1), (1, 0), 0.0)]


def curve(pieces, order, n):
    """Elements, nodes and normals of a curve of sides and arcs (start, end, curvature), n each."""
    start, end, curvature = [], [], []
    for a, b, bent in pieces:
        chord = np.array([np.hypot(*np.subtract(b, a))])
        angle = half_angles(chord, np.array([bent]))[0]
        x, _ = on_arcs(np.array(a, float), np.array(b, float), angle, np.linspace(-1.0, 1.0, n + 1))
        x[0], x[-1] = a, b
        start.append(x[:-1]), end.append(x[1:]), curvature.append(np.full(n, bent))
    start, end, curvature = (np.concatenate(part) for part in (start, end, curvature))
    line = np.where(curvature == 0.0, np.repeat(np.arange(len(pieces)), n), -1)
    elements = Elements(start, end, curvature, order, line, np.arange(len(start)))
    (xi, _), each = gauss(order), np.repeat(np.arange(len(start)), order + 1)
    angle = half_angles(np.hypot(*(end - start).T), curvature)
    xi = np.tile(xi, len(start))
    x, normal = on_arcs(start[each], end[each], angle[each], xi)
    return elements, Targets(x, line[each], each, xi), normal


def kernel():
    return TwistedRingKernel(Material(young_modulus=1.0, poisson_ratio=NU), 1.0)


def residual(g, h, u, t):
    return 0.5 * u + np.einsum("ijkm,kj->mi", h, u) - np.einsum("ijkm,kj->mi", g, t)


@pytest.mark.parametrize("pieces", [CYLINDER, BALL, PLATE])
def test_rigid_motions_along_and_about_the_axis(pieces):
    elements, targets, _ = curve(pieces, 1, 2)
    g, h = kernel().integrals(targets, elements)
    u = np.zeros((len(targets.xi), 3))
    u[:, 1] = 1.0
    assert np.abs(residual(g, h, u, 0.0 * u)).max() < 1e-9
    if pieces is not BALL:  # r is linear on sides
        u[:, 1], u[:, 2] = 0.0, targets.point[:, 0]
        assert np.abs(residual(g, h, u, 0.0 * u)).max() < 1e-9
