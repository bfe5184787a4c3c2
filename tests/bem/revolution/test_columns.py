"""Columns of the operators of rings by compiled code, against those from the integrals."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.bem.column_fillers import PlainFiller
from petcontact.bem.kernel import ColumnData
from petcontact.bem.revolution.compiled import compiled_columns
from petcontact.bem.revolution.kernel import RingKernel, TwistedRingKernel
from petcontact.mesh.curve_mesh import CurveMesh
from petcontact.model.problem import Material


def half_ring():
    """A half ring with a hole of half its radius: two arcs and two sides, orders 0 to 5, 90 nodes."""
    corners = np.array([[1.0, 0.0], [2.0, 0.0], [0.0, 2.0], [0.0, 1.0]])
    curvature = [0.0, 0.5, 0.0, -1.0]
    start, end, bent, part = [], [], [], []
    for k in (0, 1, 3):
        a, b = corners[k], corners[(k + 1) % 4]
        t = np.linspace(0.0, 1.0, 9)[:, None]
        points = a + t * (b - a)
        if curvature[k]:
            points *= np.hypot(*a) / np.hypot(*points.T)[:, None]
        start.append(points[:-1]), end.append(points[1:])
        bent.append(np.full(8, curvature[k])), part.append(np.full(8, len(part)))
    start, end, bent, part = (np.concatenate(each) for each in (start, end, bent, part))
    order = np.arange(len(part)) % 6
    line = np.where(bent == 0.0, part, -1)
    return CurveMesh(start, end, bent, order, part, line, 0.0 * bent, ("a", "b", "c"), 1.5)


@pytest.mark.parametrize("kind", [RingKernel, TwistedRingKernel])
def test_columns_are_those_of_the_integrals(kind):
    mesh, rng = half_ring(), np.random.default_rng(1)
    kernel = kind(Material(young_modulus=2.0, poisson_ratio=0.25), mesh.unit_length)
    n, d, count = mesh.n_nodes, kernel.dim, rng.integers(0, 3, mesh.n_nodes)
    first = np.concatenate([[0], np.cumsum(count)])
    frame = np.linalg.qr(rng.normal(size=(n, d, d)))[0]
    sides = rng.normal(size=(2, first[-1], d)) * rng.integers(0, 2, (2, first[-1], 1))
    data = ColumnData(rng.integers(0, 2, (n, d)).astype(bool), frame, first, *sides)
    rows, columns = (np.sort(rng.permutation(n)[:70]) for _ in range(2))
    found = []
    for filler in (compiled_columns(kernel, mesh, data), PlainFiller(kernel, mesh, data)):
        system = np.full((len(columns), d, len(rows), d), np.nan)
        beside = np.full((count[columns].sum(), len(rows), d), np.nan)
        filler.fill(rows, columns, system, beside)
        found.append((system, beside))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-14)
