"""The tail of nodal values against functions whose Legendre coefficients are known, and rims."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.geometry.outline import as_outline
from petcontact.geometry.surface import BoxSurface
from petcontact.given.tables.solver_options import MeshOptions
from petcontact.mesh.grading import mesh_outline
from petcontact.mesh.panelling import box_mesh
from petcontact.model.shapes.plane import Polygon, Rectangle
from petcontact.refinement.panels.sides import Sides
from petcontact.refinement.panels.tail import MARGIN, RIM, Tails, rim_distance

BOX = BoxSurface(np.array([-2.0, -1.0, 0.0]), np.array([2.0, 1.0, 1.0]))


def inner(mesh, nodes):
    """Which nodes of whole elements lie on those away from the rims."""
    element, nearest = mesh.element[nodes], np.full(mesh.n_elements, np.inf)
    size = np.bincount(mesh.element, mesh.weight) ** (1.0 / (mesh.dim - 1))
    np.minimum.at(nearest, element, rim_distance(mesh, nodes, size[element]))
    return (nearest > size)[element]


def test_legendre_polynomial_on_its_panel():
    """x² on panels of width h: P_2 of coefficient (h/2)² 2/3, whose mean square is 1/5."""
    mesh = box_mesh(BOX, lambda part: 0.25, 2, 1.0)
    nodes = mesh.nodes_of("top")
    found, away = Tails(mesh, nodes).errors(mesh.x[nodes, :1] ** 2), inner(mesh, nodes)
    assert found[away] == pytest.approx(MARGIN[2] * 0.125**2 * 2.0 / 3.0 / np.sqrt(5.0))
    assert found[~away].max() == pytest.approx(RIM * found[away].max())


def test_constant_elements_take_slopes_from_their_neighbours():
    for dim, mesh in ((3, box_mesh(BOX, lambda part: 0.25, 0, 1.0)), (2, meshes_of_order_0())):
        nodes = mesh.nodes_of("top")
        away = inner(mesh, nodes)
        x = mesh.x[nodes, 0]
        found = Tails(mesh, nodes).errors(np.column_stack([3.0 * x, 4.0 * x]))
        assert away.any() and found[away] == pytest.approx(
            MARGIN[0] * 5.0 * 0.25 / np.sqrt(12.0)
        ), dim


def meshes_of_order_0():
    return mesh_outline(
        as_outline(Rectangle((0.0, 0.0), (2.0, 1.0)).outline(), "a test"),
        MeshOptions(element_size=0.25),
    )


def test_pressure_beyond_sides_at_which_contact_ends():
    """p² = 0.52 - x on the panels up to x = 0.5, two wide in y: its integral from there on."""
    mesh = box_mesh(BOX, lambda part: 0.25, 2, 1.0)
    nodes = mesh.nodes_of("top")
    x, faced = mesh.x[nodes, 0], np.ones(len(nodes), dtype=bool)
    closed, sides = x < 0.5, Sides(mesh, nodes)
    pressure = np.sqrt(np.where(closed, 0.52 - x, 0.0))
    assert sides.missed_squares(pressure, closed, faced).sum() == pytest.approx(0.02**2)
    assert not sides.missed_squares(pressure, closed, ~faced).any()
    # an equal p may go on to the next nodes, those of Gauss in the next panels
    first = 0.125 * (1.0 - np.sqrt(0.6))
    assert sides.missed_squares(1.0 * closed, closed, faced).sum() == pytest.approx(2.0 * first)
    # beside an edge that presses p grows towards the side
    rising = np.where(closed, 1.0 / np.sqrt(0.51 - np.minimum(x, 0.5)), 0.0)
    assert not sides.missed_squares(rising, closed, faced).any()


def test_last_two_degrees_count_where_contact_ends_within_an_element():
    """x² on panels of order 3 has no last degree; each has the P_2 of the test above."""
    mesh = box_mesh(BOX, lambda part: 0.25, 3, 1.0)
    nodes = mesh.nodes_of("top")
    x, faced = mesh.x[nodes, 0], np.ones(len(nodes), dtype=bool)
    found = Tails(mesh, nodes).pressure_errors(x**2, x > 0.6, faced)
    ends, away = (x > 0.5) & (x < 0.75), inner(mesh, nodes)
    assert found[ends & away] == pytest.approx(0.125**2 * 2.0 / 3.0 / np.sqrt(5.0))
    assert found[~ends & away] == pytest.approx(0.0, abs=1e-12)


def test_a_plane_of_symmetry_is_no_rim():
    """A block goes on there with its image; a parallelogram and its image have a corner."""
    mesh = box_mesh(BOX, lambda part: 0.5, 1, 1.0)
    nodes = mesh.nodes_of("top")
    x, y = mesh.x[nodes, :2].T
    found = rim_distance(mesh, nodes, 0.9, ["left", "front"])
    nearest = np.minimum(2.0 - x, 1.0 - y)
    assert found == pytest.approx(np.where(nearest <= 0.9, nearest, np.inf))
    for lean, away in ((0.0, 0.875), (1.0, 0.125)):
        corners = ((0.0, 0.0), (1.0, 0.0), (1.0 + lean, 1.0), (lean, 1.0))
        shape = Polygon(corners, parts=("bottom", "right", "top", "left"))
        outline = as_outline(shape.outline(), "a test")
        mesh = mesh_outline(outline, MeshOptions(element_size=0.25, order=0))
        nodes = mesh.nodes_of("bottom")
        first = nodes[mesh.x[nodes, 0].argmin()]
        assert rim_distance(mesh, np.array([first]), mirrors=["left"]) == pytest.approx(away)
