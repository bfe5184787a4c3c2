"""Places between the nodes, where a method that sees nodes only does not look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ...arrays import Array, States
from ...compliance.bodies import Interface
from ...contact.law_protocol import OPEN
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.ray_casting import along
from ...model.expressions import evaluate
from ..discrete.interfaces import InterfaceSpec


@dataclass(frozen=True)
class Places:
    """Places between the nodes of one unilateral contact.

    Attributes
    ----------
    x : (q, d) array
        [length]
    gap : (q,) array
        Initial gap, infinite where nothing is faced [length].
    values : (q, m) sparse array
        Values at the nodes of the contact to values at the places.
    """

    x: Array
    gap: Array
    values: scipy.sparse.csr_array

    def overlap(self, v_n: Array, gap: Array, states: States) -> tuple[float, Array]:
        """The largest overlap in elements whose nodes are all open, at least 0 [length], and where it is, (d,).

        Parameters
        ----------
        v_n, gap : (m,) arrays
            What nodes overlap beyond the gap, and the gap [length].
        states : (m,) array
            0 stick, 1 slip, 2 open.
        """
        faced = np.isfinite(gap)
        closer = np.where(faced, v_n + np.where(faced, gap, 0.0), 0.0)
        touched = np.abs(self.values) @ (1.0 * ((states != OPEN) | ~faced)) > 0.0
        over = np.where(touched, -np.inf, self.values @ closer - self.gap)
        worst = int(np.argmax(over)) if len(over) else -1
        if worst < 0 or not over[worst] > 0.0:
            return 0.0, np.full(self.x.shape[1], np.nan)
        return float(over[worst]), self.x[worst]


def places_between(side: InterfaceSpec, interface: Interface, meshes: list[BoundaryMesh]) -> Places | None:
    """Places between the nodes of a contact; None where its parts cannot separate, or the gap is known at nodes only."""
    at_nodes_only = not isinstance(side.law.gap, (int, float, str)) and not callable(side.law.gap)
    if side.law.normal != "unilateral" or at_nodes_only:
        return None
    mesh = meshes[side.body]
    elements, faces = mesh.faces(side.part)
    number, place = faces.samples()
    x, normal = faces.at(number, place)
    element = elements[number]
    if side.law.gap != "geometry":
        names = mesh.variables_at(element, place)
        gap = evaluate(side.law.gap, names, len(x), f"{side.key}.gap", finite=False)
        gap = np.where(np.isnan(gap), np.inf, gap)
    elif side.primary is not None:
        b, part = side.primary
        opposite = meshes[b].faces(part)[1]
        gap = opposite.cast(x, np.array(along(side.direction, normal))).distance
    else:
        gap = np.zeros(len(x))
    values = mesh.basis_at(element, place)[:, interface.nodes]
    return Places(x, gap, scipy.sparse.csr_array(values))
