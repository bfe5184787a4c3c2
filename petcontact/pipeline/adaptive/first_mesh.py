"""The first mesh of a body in space: that of its options, or one that is small enough for contact and for bending."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...arrays import Mask
from ...geometry.surface import BOX_PARTS, Boundary, BoxSurface, SolidSurface
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...model.problem import Contact, Problem
from ...model.solver_options import MeshOptions
from ...refinement.meshes import mesh_of
from ...refinement.panels.quartering import cut
from ..trust.meshes import SHARE, STIFF
from ..trust.thickness import slenderness

FIRST = 36
"""Panels on a face in contact of the first mesh, about; on others a quarter of them."""
ROUND = 16
"""The same on round bodies, whose panels are of one size."""
LONGEST = 1.5
"""Panels of the first mesh over the shortest edge of the box."""
FIRST_SHARE = 0.5
"""Of the nodes of the budget, that the first mesh of a thin body may have."""
MULTIPLES = (1.0, 1.5, 2.0, 2.5)
"""Of the size over the thickness from which bending is off by a tenth; beyond the last one it is not solved at all."""


def first_options(one: Problem, boundary: Boundary, *, bilateral: bool) -> Problem:
    """With the options of the first mesh: order 2 for u_t, which is smooth, else 1, as good a node and cheaper."""
    if not one.mesh.automatic:
        return one
    options: dict[str, Any] = {"order": 2 if bilateral else 1}
    touching = [c.part for c in one.boundary if isinstance(c, Contact)]
    if isinstance(boundary, BoxSurface):
        extent = boundary.upper - boundary.lower
        longest = LONGEST * float(extent.min())
        area = {part: float(np.delete(extent, axis).prod()) for part, (axis, _) in BOX_PARTS.items()}
        sizes = {part: min(longest, math.sqrt(area[part] / FIRST)) for part in touching}
        options |= {"element_size": min(longest, 2.0 * min(sizes.values())), "element_sizes": sizes, "exponent": 1.0}
    elif isinstance(boundary, SolidSurface) and boundary.known:
        usual = mesh_of(one.model_copy(update={"mesh": MeshOptions(order=0)}), boundary)
        options["element_size"] = min(math.sqrt(usual.weight[usual.nodes_of(part)].sum() / ROUND) for part in touching)
    return one.model_copy(update={"mesh": MeshOptions(**options)})


def thick_enough(one: Problem, boundary: SolidSurface, mesh: SurfaceMesh, nodes: float) -> tuple[SurfaceMesh, float]:
    """The first mesh of a body with panels that are small beside its thickness, and the multiple that they keep to.

    Parameters
    ----------
    one : Problem
        The body with the options of its first mesh.
    boundary : SolidSurface
        Onto which the panels are brought that are cut.
    mesh : SurfaceMesh
        That the options make.
    nodes : float
        Of the budget; the mesh has a share of them where the last multiple does with so many, and is left as it is where
        that takes more than all.
    """
    ratio, count = slenderness(mesh) / np.array(STIFF)[mesh.order], np.bincount(mesh.element)
    needed = [float(count @ np.maximum(1.0, ratio / m) ** 2) for m in MULTIPLES]
    multiple = next((m for m, number in zip(MULTIPLES, needed, strict=True) if number <= FIRST_SHARE * nodes), MULTIPLES[-1])
    if needed[-1] > nodes or not slender(mesh, multiple).any():
        return mesh, multiple
    # panels are halved: the first ones are such that the last halves are just small enough
    worst, size = float(ratio.max()) / multiple, one.mesh.element_size
    assert size is not None
    options = one.mesh.model_copy(update={"element_size": size / (worst / 2.0 ** math.floor(math.log2(worst)))})
    mesh = as_surface(mesh_of(one.model_copy(update={"mesh": options}), boundary))
    while (over := slender(mesh, multiple)).any():
        mesh = cut(mesh, over, boundary)
    return mesh, multiple


def slender(mesh: SurfaceMesh, multiple: float) -> Mask:
    """Panels that are too large beside the thickness behind them, along both coordinates, (n_elements, 2); none where they
    are a small share of the body."""
    over, area = slenderness(mesh) > multiple * np.array(STIFF)[mesh.order], np.bincount(mesh.element, mesh.weight)
    return np.repeat(over & bool(area[over].sum() > SHARE * area.sum()), 2).reshape(-1, 2)
