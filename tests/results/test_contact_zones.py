"""The area of contact of exact pressures and gaps at the nodes of panels, whose edges lie anywhere,
and the edges of a contact that lies where the arc lengths of its part begin."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from marks import slow

from petcontact.contact.law_protocol import OPEN, STICK
from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.curve_mesh import CurveMesh
from petcontact.mesh.panelling import box_mesh
from petcontact.results.contact_zones import areas, hidden_slip, pair_edges

MODULUS = 1.1


def westergaard(x, period, half):
    """p and gap of waves pressed on a half space (Johnson, Contact Mechanics, 13.2), of an
    amplitude of 1."""
    way = np.sin(np.pi * (x[:, 0] / period - np.round(x[:, 0] / period)))
    end, root = (
        np.sin(np.pi * half / period),
        np.emath.sqrt(way**2 - np.sin(np.pi * half / period) ** 2),
    )
    p = 2.0 * np.pi * MODULUS / period * np.sqrt(1.0 - way**2) * root.imag
    outside = np.log((np.abs(way) + root.real) / end)
    return p, 2.0 * (np.abs(way) * root.real - end**2 * outside) * (root.real > 0.0)


def hertz(x, radius, _):
    """p and gap of a sphere of radius 1 (Johnson, 3.41 and 3.42)."""
    r = np.hypot(x[:, 0] - 1.03, x[:, 1] - 0.98) / radius
    p = 2.0 * MODULUS / np.pi * radius * np.sqrt(np.maximum(1.0 - r**2, 0.0))
    r = np.maximum(r, 1.0)
    moved = ((2.0 - r**2) * np.arcsin(1.0 / r) + np.sqrt(r**2 - 1.0)) / np.pi
    return p, radius**2 * (0.5 * r**2 - 1.0 + moved)


@pytest.mark.parametrize(
    ("order", "exact", "size", "half", "area"),
    [
        # the last nodes of panels that end at 1/12 are closed: the edge lies beyond these
        (1, westergaard, 1.0 / 3.0, 0.0795, 1.908),
        slow(2, westergaard, 0.5, 0.14, 2.24),
        slow(1, westergaard, 2.0 / 3.0, 0.155, 1.86),
        slow(1, hertz, 0.35, 0.0, np.pi * 0.35**2),
        (2, hertz, 0.5, 0.0, np.pi * 0.5**2),
    ],
)
def test_edges_between_nodes_of_two_panels(order, exact, size, half, area):
    box = BoxSurface(np.array([0.0, 0.0, -2.0]), np.array([2.0, 2.0, 0.0]))
    mesh = box_mesh(box, lambda part: 1.0 / 12.0 if part == "top" else 2.0, order, 1.0)
    nodes = mesh.nodes_of("top")
    p, gap = exact(mesh.x[nodes], size, half)
    pair = SimpleNamespace(
        x=mesh.x[nodes],
        weight=mesh.weight[nodes],
        pressure=p,
        gap=gap,
        state=np.where(p > 0.0, STICK, OPEN),
    )
    (found, told), (slips, _) = areas(mesh, nodes, pair, 2.0 / MODULUS)
    assert abs(found - area) < min(told, 0.04 * area) and told < 0.27 * area
    assert slips == 0.0


@pytest.mark.parametrize("dim", [2, 3])
def test_what_may_slip_where_q_is_more_than_friction_between_nodes(dim):
    """Dugdale's length, twice, of half a face of which all nodes stick, though g falls below q at
    its end, or though contact ends beside it: it was 0. Nothing may slip where neither is so, or
    where there is no bound."""
    if dim == 3:
        mesh = box_mesh(BoxSurface(np.zeros(3), np.ones(3)), lambda _: 0.5, 2, 1.0)
    else:
        ends, none = np.array([[1.0, 0.0], [0.5, 0.0], [0.0, 0.0]]), np.zeros(2, dtype=np.int64)
        arguments = none + 2, none, none - 1, np.zeros(2), ("top",)
        mesh = CurveMesh(ends[:2], ends[1:], np.zeros(2), *arguments)
    nodes = mesh.nodes_of("top")
    x = mesh.x[nodes, 0]
    falls = np.where(x > 0.5, 1.8 * (x - 0.75), 0.0)

    def may_slip(bound, closed=1.0):
        pair = SimpleNamespace(
            state=np.where(x < closed, STICK, OPEN),
            sigma_t=np.tile(0.25 * np.eye(dim - 1)[:1], (len(nodes), 1)),
            bound=bound,
        )
        return hidden_slip(mesh, nodes, pair, 2.0 / MODULUS, ())

    for given in ((0.6 - falls,), (0.6 + 0.0 * x, 0.5)):
        area, slip, energy, q = may_slip(*given)
        assert area == pytest.approx((0.25 * np.pi * 0.25 / 0.6) ** 2)
        assert q == pytest.approx(0.25) and energy == pytest.approx(0.6 * slip * area)
        assert slip > 0.0
    for bound in (0.8 - falls, np.full(len(nodes), np.inf)):
        assert may_slip(bound) == (0.0, 0.0, 0.0, 0.0)


def pressed(start, turn=2.0 * np.pi, contact=1.0, half=0.3, nodes=200):
    """A circle, or an arc of it, of radius 1 whose arc lengths begin at the angle `start`, closed
    within `half` of the angle `contact` with Hertz's pressure."""
    s = (np.arange(nodes) + 0.5) * turn / nodes
    angle = start + s
    away = np.abs((angle - contact + np.pi) % (2.0 * np.pi) - np.pi)
    closed, still = away < half, np.zeros((nodes, 1))
    return SimpleNamespace(
        arc_length=s,
        x=np.column_stack([np.cos(angle), np.sin(angle)]),
        state=np.where(closed, 0, 2),
        gap=np.maximum(away - half, 0.0) ** 1.5,
        pressure=np.sqrt(np.maximum(half**2 - away**2, 0.0)),
        sigma_t=still,
        slip_increment=still,
        bound=np.full(nodes, np.inf),
    )


@pytest.mark.parametrize("start", [0.0, 0.75, 1.0, 1.28, 4.0])
def test_edges_are_the_same_wherever_the_circle_begins(start):
    found = pair_edges(pressed(start))
    places = sorted((start + edge.s) % (2.0 * np.pi) for edge in found)
    assert places == pytest.approx([0.7, 1.3], abs=0.01)
    assert [edge.width for edge in found] == pytest.approx([0.3, 0.3], abs=0.03)
    assert all(0.0 <= edge.s < 2.0 * np.pi for edge in found)


def test_an_arc_has_ends():
    found = pair_edges(pressed(1.0, turn=5.0))
    assert [edge.s for edge in found] == pytest.approx([0.3], abs=0.01)
    assert found[0].width == pytest.approx(0.15, abs=0.03)
