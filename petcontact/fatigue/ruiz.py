"""The parameters of Ruiz for fretting: work of friction, and that times the tension along the
surface.

C. Ruiz, P. H. B. Boddington, K. C. Chen, Experimental Mechanics 24 (1984) 208. At each moment of a
cycle let δ be how far the slip is from the middle of its path, σ_t the shear traction, and σ_T the
normal stress along the surface in the direction of δ. Then F1 = max |σ_t| δ and F2 = max <σ_T>
|σ_t| δ, where <σ_T> is 0 in compression.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..arrays import Array, Index
from ..contact.friction_law import lengths
from ..results.data import SolutionData
from ..results.evaluated import NOWHERE
from ..results.records import PairResult, StepResult
from .smallest_ball import smallest_ball
from .stress_cycle import Sites


def slip_from_the_middle(slip: Array) -> Array:
    """Slip (k, m, d-1) over a cycle less the middle of the smallest ball round its path
    [length]."""
    return slip - smallest_ball(np.moveaxis(slip, 0, 1))[0]


def friction_work(slip: Array, shear: Array) -> Array:
    """|σ_t| δ (k, m) of slip and shear tractions (k, m, d-1) over a cycle [stress·length].

    Examples
    --------
    >>> slip, shear = np.array([[[0.5]], [[0.1]]]), np.array([[[-30.0]], [[30.0]]])
    >>> friction_work(slip, shear).max(axis=0).round(9).tolist()
    [6.0]
    """
    return np.asarray(
        np.linalg.norm(shear, axis=2) * np.linalg.norm(slip_from_the_middle(slip), axis=2)
    )


def _directions(vectors: Array) -> Array:
    """Unit vectors (k, m, 3) along others (k, m, d), 0 where these are."""
    size = lengths(vectors.reshape(-1, vectors.shape[2])).reshape(vectors.shape[:2])[..., None]
    unit = np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 0.0)
    return np.pad(unit, ((0, 0), (0, 0), (0, 3 - vectors.shape[2])))


def _both_sides(
    solution: SolutionData, pair: PairResult, name: str
) -> Iterator[tuple[str, str, Index, Array, Index]]:
    """Body, part, elements and places on both sides of an interface, and the nodes they belong
    to."""
    (body, part), nodes = solution.sides[name], solution.nodes[name]
    mesh = solution.meshes[body]
    yield body, part, mesh.element[nodes], mesh.places[nodes], np.arange(len(nodes))
    owner, partner = solution.primaries.get(name, NOWHERE)
    if owner:
        numbers, faces = solution.meshes[owner].faces(partner)
        hits = faces.cast(pair.x, pair.normal)
        met = np.flatnonzero(hits.face >= 0)
        yield owner, partner, numbers[hits.face[met]], hits.place[met], met


def ruiz_sites(
    solution: SolutionData, increments: list[StepResult], name: str
) -> Iterator[tuple[Sites, Array, Array]]:
    """On both bodies of an interface: the places, and F1 and F2 there.

    On the primary these are the places that the secondary's nodes face.
    """
    pairs = [step.pairs[name] for step in increments]
    slip = np.array([pair.slip for pair in pairs])
    way = _directions(np.einsum("kmt,mtc->kmc", slip_from_the_middle(slip), pairs[0].tangent))
    work = friction_work(slip, np.array([pair.sigma_t for pair in pairs]))
    for owner, part, element, place, rows in _both_sides(solution, pairs[0], name):
        states = [
            solution.body_fields(owner, step).on_boundary(element, place) for step in increments
        ]
        stress = np.array([state.tensor for state in states])
        tension = np.maximum(np.einsum("kmi,kmij,kmj->km", way[:, rows], stress, way[:, rows]), 0.0)
        along = solution.meshes[owner].sites_at(element, place).along
        sites = Sites(
            owner, np.full(len(rows), part), states[0].x, np.zeros(len(rows)), along, stress
        )
        yield (sites, work[:, rows].max(axis=0), (tension * work[:, rows]).max(axis=0))
