"""Zones of stick and slip in words."""

from __future__ import annotations

import numpy as np

from ...fields.boundary.places import sizes
from ...mesh.curve_mesh import as_curve
from ...refinement.zones import Zone
from ..data import SolutionData
from .text import digits


def zones_of(solution: SolutionData, part: str) -> list[str]:
    """Zones of a part, their ends with the digits that two meshes agree on, or that the elements
    resolve in the middle of which they may lie."""

    def half(at: float) -> float:
        mesh = as_curve(solution.meshes[solution.sides[part][0]])
        nodes = mesh.nodes_of(part)
        nearest = nodes[np.argmin(np.abs(mesh.arc_length[nodes] - at))]
        return float(sizes(mesh)[mesh.element[nearest]])

    errors = solution.accuracy.zone_errors
    errors = errors or [(half(zone.start), half(zone.end)) for zone in solution.zones]
    return [
        _zone(zone, *pair)
        for zone, pair in zip(solution.zones, errors, strict=True)
        if zone.part == part
    ]


def _zone(zone: Zone, start_error: float, end_error: float) -> str:
    sign = {0: "", 1: " +", -1: " -"}[zone.sign]
    start, end = (
        f"{at:.{digits(error, at)}g}"
        for at, error in ((zone.start, start_error), (zone.end, end_error))
    )
    return f"{zone.name}{sign} {start} .. {end}"
