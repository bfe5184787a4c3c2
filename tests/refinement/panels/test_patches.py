"""Rings of panels on curved faces: the surface stays closed, panels stay on it, their sides follow
the edge of the zone."""

import numpy as np
import pytest

from petcontact import OutlineSide, Revolved
from petcontact.geometry.quadratic import QuadraticCells
from petcontact.geometry.round_surfaces import CylinderSurface, SphereSurface
from petcontact.mesh.panelling import round_mesh
from petcontact.refinement.panels.patches import patches_of
from petcontact.refinement.panels.rings import ringed, sector
from petcontact.refinement.panels.zone import ContactEllipse

BALL = SphereSurface(np.zeros(3), 1.0)
CYLINDER = CylinderSurface(np.array([0.0, 0.0, -2.0]), np.array([0.0, 0.0, 2.0]), 1.0)
HALF = Revolved(
    loops=[
        [
            OutlineSide(part="bottom", to=(1.0, 0.0), radius=1.0),
            OutlineSide(part="top", to=(0.0, 0.0)),
            OutlineSide(part="axis", to=(0.0, -1.0)),
        ]
    ]
).outline()


def zone_at(point, a, b):
    normal = point / np.linalg.norm(point)
    first = np.cross(normal, [0.3, 0.5, 0.8])
    first /= np.linalg.norm(first)
    return ContactEllipse(point, np.column_stack([a * first, b * np.cross(normal, first)]))


def normal_integral(mesh):
    """Zero over a closed surface."""
    total, t, w = np.zeros(3), *np.polynomial.legendre.leggauss(4)
    square, weight = np.stack(np.meshgrid(t, t), axis=-1).reshape(-1, 2), np.outer(w, w).ravel()
    a, b = 0.5 * (square.T + 1.0)
    rules = {
        4: (square, weight),
        3: (np.column_stack([a, b * (1.0 - a)]), 0.25 * weight * (1.0 - a)),
    }
    for corners, (place, weights) in rules.items():
        mine = np.isnan(mesh.corners[:, 3, 0]) == (corners == 3)
        cells = QuadraticCells(
            np.concatenate(
                [mesh.corners[mine, :corners], mesh.middles[mine, : 2 * corners - 3]], axis=1
            )
        )
        along = cells.at(cells.each(place))[1]
        total += np.einsum("nqk,q->k", np.cross(along[:, :, 0], along[:, :, 1]), weights)
    return total


def with_rings(surface, part, zone, rings, size):
    first = round_mesh(surface, size, 1)
    patches = patches_of(surface, first, first, part, zone, sector(rings))
    return first, next(
        (made for patch in patches if (made := ringed(patch, zone, rings)) is not None), None
    )


def check(surface, part, zone, rings, size):
    """The mesh with rings, where everything is as it should be."""
    first, mesh = with_rings(surface, part, zone, rings, size)
    assert mesh is not None
    assert np.abs(normal_integral(mesh)).max() < 1e-12 * mesh.weight.sum()
    assert mesh.weight.sum() == pytest.approx(first.weight.sum(), rel=3e-3)
    nodes = mesh.nodes_of(part)
    inner = zone.distance(mesh.x[nodes]) < 1.0
    a, b = np.linalg.norm(zone.axes, axis=0)
    assert mesh.weight[nodes][inner].sum() == pytest.approx(np.pi * a * b, rel=0.03)
    count, some = (np.bincount(mesh.element[nodes], which) for which in (None, inner))
    assert np.all((some == 0) | (some == count))
    return mesh


@pytest.mark.parametrize(
    ("rings", "a", "x"),
    [(1, 0.125, 0.25), (2, 0.125, 0.25), (3, 0.1, 0.0), (3, 0.02, 0.35), (2, 0.2, 0.3)],
)
def test_where_panels_would_be_too_distorted_another_patch_has_rings(rings, a, x):
    """The first of these had none with the first patch."""
    check(BALL, "bottom", zone_at(np.array([x, x, -np.sqrt(1.0 - 2.0 * x**2)]), a, a), rings, 0.4)


@pytest.mark.parametrize(("a", "off"), [(0.05, 0.0), (0.2, 0.0), (0.1, 0.02), (0.02, 0.3)])
def test_rings_lie_about_the_pole_of_a_body_of_revolution_and_beside_it(a, off):
    point = np.array([off, 0.0, -np.sqrt(1.0 - off**2)])
    check(HALF, "bottom", zone_at(point, a, a), 2, 0.4)


def test_rings_lie_on_the_side_of_a_cylinder():
    check(
        CYLINDER,
        "side",
        ContactEllipse(np.array([0.0, 1.0, 0.1]), np.array([[0.1, 0.0], [0.0, 0.0], [0.0, 0.2]])),
        2,
        0.5,
    )


@pytest.mark.parametrize("off", [0.0, 0.02, -0.02])
def test_rings_lie_on_the_disc_of_a_cylinder_wherever_the_zone_is(off):
    """A zone is that of the other side of the contact, which may be curved: the middle of its
    pressure is off the disc."""
    zone = ContactEllipse(
        np.array([0.2, -0.1, 2.0 + off]), np.array([[0.15, 0.0], [0.0, 0.15], [0.0, 0.0]])
    )
    mesh = check(CYLINDER, "top", zone, 2, 0.5)
    assert np.abs(mesh.x[mesh.nodes_of("top")][:, 2] - 2.0).max() < 1e-12
