"""Panels of other faces beside contact: their orders in planes of symmetry."""

import numpy as np

from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.panelling import box_mesh
from petcontact.record import replace
from petcontact.refinement.panels.panel_cuts import with_equal_orders


def test_panels_of_a_plane_of_symmetry_have_the_order_of_contact_beside_them():
    box = BoxSurface(np.array([0.0, 0.0, -4.0]), np.array([4.0, 4.0, 0.0]))
    mesh = box_mesh(box, lambda part: 1.0, 1, 1.0)
    top = mesh.part == mesh.part_names.index("top")
    mesh = replace(mesh, order=np.where(top, 2, 1))
    found = with_equal_orders(mesh, top, ["left"])
    beside = found.order[found.part == found.part_names.index("left")]
    assert sorted(beside) == 12 * [1] + 4 * [2]
    others = ~np.isin(found.part, [found.part_names.index(part) for part in ("left", "top")])
    assert np.all(found.order[others] == 1)
    assert with_equal_orders(mesh, top, []) is mesh
