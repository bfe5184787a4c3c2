"""Whether surfaces overlap, at the nodes and between them, where a method that sees nodes only does not look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ...arrays import Array, Mask, States
from ...compliance.bodies import BodiesSystem, Interface
from ...compliance.reduced import ComposedSystem
from ...contact.laws import OPEN
from ...contact.state import ContactState
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.hits import along
from ...model.expressions import evaluate
from ..sides import Side

ROUND_OFF = 1e-11
"""Of displacements that add up to a gap."""


@dataclass(frozen=True)
class Between:
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


def between(side: Side, interface: Interface, meshes: list[BoundaryMesh]) -> Between | None:
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
    return Between(x, gap, scipy.sparse.csr_array(values))


def overlaps(
    system: BodiesSystem, unilateral: Mask, places: list[Between | None], reduced: ComposedSystem, outcome: ContactState
) -> tuple[float, float, str]:
    """The largest overlap at nodes and between them, each over itself and what the tractions of that contact displace.

    Returns
    -------
    at_nodes, between : float
        In [0, 1].
    where : str
        The latter in words.
    """
    d = system.dim
    rigid = 0.0 if reduced.modes is None else reduced.modes.motion @ outcome.alpha
    every = outcome.v - reduced.u_0 - rigid
    noise = ROUND_OFF * (np.abs(reduced.u_0) + np.abs(rigid) + np.abs(every).max(initial=0.0))[:, -1]
    at_nodes, worst, text = 0.0, 0.0, ""
    for where, face, between_nodes in zip(system.slices, system.interfaces, places, strict=True):
        moved = every[where, -1]
        if system.compliance is not None:
            # of this contact alone
            rows = slice(d * where.start, d * where.stop)
            moved = (system.compliance[rows, rows] @ outcome.sigma[where].ravel())[d - 1 :: d]
        scale = float(np.abs(moved).max(initial=0.0))
        seen = unilateral[where] & np.isfinite(face.gap)
        depth = float((outcome.v[where, -1] - noise[where])[seen].max(initial=0.0))
        at_nodes = max(at_nodes, _share(depth, scale))
        if between_nodes is None:
            continue
        depth, x = between_nodes.overlap(outcome.v[where, -1], face.gap, outcome.states[where])
        share = _share(depth - float(noise[where].max(initial=0.0)), scale)
        if share > worst:
            place = ", ".join(f"{coordinate:.6g}" for coordinate in x)
            worst, text = share, f"pair {face.name!r} by {depth:.3g} at ({place})"
    return at_nodes, worst, text


def _share(depth: float, scale: float) -> float:
    return depth / (depth + scale) if depth > 0.0 else 0.0
