"""Kelvin's kernels over flat panels: quadrature on subdivided panels, rigid motion, the linear
patch."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from marks import slow
from panel_oracle import a_panel, worst

from petcontact.bem.kelvin3d.integrals import integrals
from petcontact.geometry.gmsh import read_msh
from petcontact.geometry.gmsh_surface import gmsh_surface
from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.panelling import box_mesh, facet_mesh

NU = 0.3
BRACKET = str(Path(__file__).parents[3] / "configs" / "space_bracket.msh")


@pytest.mark.parametrize("corners", [3, slow(4)])
@pytest.mark.parametrize("order", range(4))
@settings(max_examples=1, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_closed_form_and_gauss_points_against_subdivision(
    corners: int, order: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    panel = a_panel(corners, order, rng)
    places = [[*rng.uniform(-1.3, 1.3, 2), rng.choice([-h, h])] for h in (1e-6, 0.02, 0.5, 2.0)]
    points = panel.centre[0] + np.array([*places, [1.2, 0.1, 0.0]]) @ panel.frame[0]
    assert worst(points, panel, NU) <= 1e-9


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("body", ["graded box", "bracket"])
def test_rigid_motion_and_linear_patch(body: str, order: int) -> None:
    """On quadrilaterals, and on triangles of a file, whose nodes lie on the lines of other panels'
    edges."""
    if body == "bracket":
        mesh = facet_mesh(gmsh_surface(read_msh(BRACKET), BRACKET), order)
    else:
        box = BoxSurface(np.zeros(3), np.array([3.0, 2.0, 1.0]))
        mesh = box_mesh(box, lambda part: 1.0, order, 1.4)
    rng = np.random.default_rng(order)
    nodes = np.sort(rng.choice(mesh.n_nodes, 60, replace=False))
    gradient = rng.normal(size=(3, 3))
    spin, strain = gradient - gradient.T, gradient + gradient.T
    stress = strain + NU / (1.0 - 2.0 * NU) * np.trace(strain) * np.eye(3)  # over 2µ
    moved = [np.tile([1.0, -2.0, 0.5], (mesh.n_nodes, 1)), mesh.x @ spin.T, mesh.x @ strain]
    defects = [0.5 * u[nodes] for u in moved]
    for batch in mesh.batches():
        g, h = integrals(mesh.x[nodes], batch.elements, NU)
        for defect, u in zip(defects, moved, strict=True):
            defect += np.einsum("ijkm,kj->mi", h, u[batch.nodes])
        defects[2] -= np.einsum("ijkm,kj->mi", g, (mesh.normal @ stress)[batch.nodes])
    for defect, u in zip(defects, moved, strict=True):
        assert np.abs(defect).max() < 1e-10 * np.abs(u).max()
