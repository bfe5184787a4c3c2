"""Jumps across the edges of panels, with hanging nodes, and what they do to the pressure."""

from __future__ import annotations

import numpy as np
import pytest
from facets import quartered

from petcontact.bem.kernels import kernel_for
from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.panelling import box_mesh
from petcontact.model.bodies import Material
from petcontact.model.problem import Problem
from petcontact.refinement.meshes import mesh_of
from petcontact.refinement.panels.jumps import EdgeJumps, strained
from petcontact.refinement.panels.marks import element_sizes

BOX = BoxSurface(np.array([-1.0, -1.0, 0.0]), np.array([1.0, 1.0, 1.0]))


@pytest.fixture
def hanging():
    """Four panels on the top, one of them cut into four."""
    mesh = box_mesh(BOX, lambda part: 1.0, 1, 1.0)
    low = mesh.corners[:, :, :2].max(axis=1).max(axis=1) < 1e-9
    return quartered(mesh, (mesh.part == mesh.part_names.index("top")) & low)


def test_what_is_continuous_does_not_jump_and_a_step_does(hanging):
    edges = EdgeJumps(hanging, "top")
    assert np.abs(edges.of(hanging.x @ np.diag([1.0, 2.0, 3.0]))).max() < 1e-12
    # both sides of x = 0, each seen from the panels on it, two long
    found = edges.of(np.sign(hanging.x[:, :1]))
    assert set(np.round(found, 12)) == {0.0, 2.0}
    assert edges.length[found > 1.0].sum() == pytest.approx(4.0)


def test_the_far_side_of_a_ring_is_not_beside_the_rim_of_this_one_and_turning_strains_nothing():
    sides = [
        {"part": "bottom", "to": [1.0, 0.0]},
        {"part": "outer", "to": [1.0, 1.0]},
        {"part": "top", "to": [0.6, 1.0]},
        {"part": "bore", "to": [0.6, 0.0]},
    ]
    ring = Problem.model_validate(
        {
            "material": {"young_modulus": 1.0, "poisson_ratio": 0.3},
            "mesh": {"element_size": 0.3, "order": 1},
            "geometry": {"shape": "revolved", "loops": [sides]},
            "boundary": [{"part": "bottom", "condition": "displacement", "value": [0, 0, 0]}],
        }
    )
    mesh = mesh_of(ring, ring.geometry.outline())
    edges = EdgeJumps(mesh, "outer")
    centre = np.stack([np.bincount(mesh.element, mesh.weight * c) for c in mesh.x.T], axis=1)
    centre /= np.bincount(mesh.element, mesh.weight)[:, None]
    apart = np.linalg.norm(centre[edges.element] - centre[edges.other], axis=1)
    assert len(apart) > 50 and apart.max() < 0.6
    turned = np.cross([0.3, -0.2, 0.9], mesh.x)
    assert edges.of(turned).max() > 1e-3 and edges.of(strained(mesh, turned)).max() < 1e-12


def test_the_pressure_beside_a_jump_grows_as_panels_shrink(hanging):
    edges, kernel, size = (
        EdgeJumps(hanging, "top"),
        kernel_for(hanging, Material(1.0, 0.3)),
        element_sizes(hanging),
    )
    square = edges.pressure_squares(np.sign(hanging.x[:, :1]), size, kernel)
    found, beyond = square > 1e-9, size[edges.other]
    per_length = square[found] / edges.length[found]
    assert (
        per_length * beyond[found] == pytest.approx(per_length[0] * beyond[found][0])
        and np.ptp(beyond[found]) == 0.5
    )
    double = edges.pressure_squares(2.0 * np.sign(hanging.x[:, :1]), size, kernel)
    assert double == pytest.approx(4.0 * square)
    assert (
        not edges.pressure_squares(
            np.sign(hanging.x[:, :1]), size, kernel_for(hanging, Material(1.0, 0.4999999))
        ).max()
        > 1e-10
    )
