"""Contacts smaller than panels are expected where Hertz' theory has them, and nowhere else."""

import numpy as np
import pytest

from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.panelling import box_mesh
from petcontact.refinement.panels.quartering import cut
from petcontact.refinement.panels.small_contact import small_contact

BOX = BoxSurface(np.array([-3.0, -3.0, -3.0]), np.array([3.0, 3.0, 0.0]))
MESH = box_mesh(BOX, lambda part: 1.0, 1, 1.0)
TOP = MESH.nodes_of("top")
CENTRE = np.array([0.3, 0.2])


def expected(gap, force, closed=4):
    """Of a force that the nodes of the smallest gaps carry."""
    pressure = np.zeros(len(TOP))
    near = np.argsort(gap)[:closed]
    pressure[near] = force / MESH.weight[TOP][near].sum()
    return small_contact(MESH, TOP, pressure, gap, 1.0)


def parabola(k_1, k_2, angle):
    c, s = np.cos(angle), np.sin(angle)
    x = (MESH.x[TOP, :2] - CENTRE) @ np.array([[c, -s], [s, c]])
    return 0.5 * (k_1 * x[:, 0] ** 2 + k_2 * x[:, 1] ** 2)


@pytest.mark.parametrize("force", [1e-9, 1e-5, 1e-3])
def test_a_sphere_gives_the_circle_of_hertz(force):
    found = expected(parabola(2.0, 2.0, 0.0), force)
    radius = np.cbrt(0.75 * force * 0.5)
    np.testing.assert_allclose(found.half, radius, rtol=1e-9)
    np.testing.assert_allclose(found.centre, [*CENTRE, 0.0], atol=1e-9)


def test_an_ellipse_has_its_axes_and_about_its_widths():
    """Of k_2/k_1 = 1/4: a/b 2.49 and √(ab) 1.02 c by Johnson's figure 4.4."""
    found = expected(parabola(2.0, 0.5, 0.7), 1e-4)
    np.testing.assert_allclose(np.abs(found.axes[0]), [np.cos(0.7), np.sin(0.7), 0.0], atol=1e-9)
    assert found.half[1] / found.half[0] == pytest.approx(2.49, rel=0.05)
    assert np.sqrt(found.half.prod()) == pytest.approx(1.02 * np.cbrt(0.75e-4 / 1.0), rel=0.05)


def test_a_cylinder_gives_the_strip_of_hertz():
    gap = parabola(2.0, 0.0, 0.0)
    column = np.isclose(gap, gap.min())
    found = expected(gap, 1e-3, np.count_nonzero(column))
    assert found.half[0] == pytest.approx(np.sqrt(4.0 * 1e-3 / (np.pi * 6.0 * 2.0)), rel=0.1)
    assert found.half[1] == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize(
    ("gap", "force", "closed"),
    [
        (parabola(2.0, 2.0, 0.0), 2.0, 4),
        (parabola(0.0, 0.0, 0.0), 1e-3, len(TOP)),
        (MESH.x[TOP, 0] + 3.0, 1e-3, 12),
        (parabola(2.0, 2.0, 0.0), 0.0, 4),
        (np.minimum(*(np.abs(MESH.x[TOP, 0] - x) for x in (-2.0, 2.0))), 1e-6, 24),
    ],
    ids=["as large as panels", "a flat punch", "a tilted one", "no contact", "two contacts"],
)
def test_nothing_else_is_a_small_contact(gap, force, closed):
    assert expected(gap, force, closed) is None


def test_only_panels_near_the_contact_are_cut_until_they_are_small():
    found, mesh = expected(parabola(2.0, 2.0, 0.0), 1e-4), MESH
    for _ in range(12):
        marked = found.too_large(mesh, "top")
        if not marked.any():
            break
        mesh = cut(mesh, marked, BOX)
    nodes = mesh.nodes_of("top")
    distance = np.linalg.norm(mesh.x[nodes] - found.centre, axis=1) / found.half[0]
    assert np.sqrt(4.0 * mesh.weight[nodes][distance < 1.0].max()) <= 0.5 * found.half[0] * (
        1.0 + 1e-9
    )
    assert 60 < np.count_nonzero(distance < 1.5) < 250 and len(nodes) < 600
