"""u_t along the bottom side of a solution, as the adaptive solve sees it."""

from __future__ import annotations

import numpy as np

from petcontact.mesh.curve_mesh import CurveMesh
from petcontact.refinement.contact_line import ContactLine


def line_of(solution) -> ContactLine:
    """u_t along the bottom side."""
    mesh: CurveMesh = solution.mesh
    contact = solution.contact
    element = mesh.element[contact.nodes]
    mine = np.unique(element)
    breaks = np.append(mesh.side_start[mine], mesh.side_start[mine[-1]] + mesh.length[mine[-1]])
    sign = np.where(contact.state == 1, -np.sign(contact.sigma_t[:, 0]), 0.0).astype(np.int64)
    return ContactLine(
        contact.arc_length,
        contact.weight,
        element,
        breaks,
        contact.u_t[:, 0],
        contact.sigma_t[:, 0],
        contact.friction_bound,
        sign,
    )
