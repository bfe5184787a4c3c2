"""What panels that are cut do not mend: they stay on those of the first mesh where no exact surface is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import scipy

from ...contact.law_protocol import OPEN
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.sag import sag
from ...results.solution import Solution
from ..discrete.discretise import Discrete


def with_missed_curves(
    discrete: Discrete, solution: Solution, first: Mapping[str, BoundaryMesh], accuracy: float
) -> Solution:
    """Warned of panels in contact that miss the curved faces they stand for by more than a share of what contact closes.

    Parameters
    ----------
    discrete : Discrete
        Of the last mesh.
    solution : Solution
        On it.
    first : mapping
        Body to its first mesh.
    accuracy : float
        The share: p is about as far off.
    """
    found = list[str]()
    for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        closed = np.any([step.pairs[interface.name].state != OPEN for step in solution.steps], axis=0)
        approach = float(np.abs(interface.gap[closed]).max(initial=0.0))
        place = discrete.meshes[side.body].x[interface.nodes[closed]]
        for number, part in [(side.body, side.part), *([side.primary] if side.primary else [])]:
            body = discrete.problem.body[number]
            if getattr(body.geometry.outline(), "known", True) or not approach > 0.0:
                continue
            mesh = first[body.name]
            numbers, faces = mesh.faces(part)
            near = np.full(mesh.n_elements, np.inf)
            np.minimum.at(near, mesh.element, scipy.spatial.cKDTree(place).query(mesh.x)[0])
            beside = near <= np.sqrt(np.bincount(mesh.element, mesh.weight))
            height = float(sag(faces)[beside[numbers]].max(initial=0.0))
            if height > accuracy * approach:
                found.append(f"pair {interface.name!r}: finer panels lie on those of the first mesh of {body.name!r}, which "
                             f"miss its curved faces by about {height:.2g}, next to {approach:.2g} that contact closes: p "
                             "is as rough, which the estimate does not see; begin with a smaller mesh.element_size, or a "
                             "finer file")  # fmt: skip
    warnings = [*solution.info.get("warnings", []), *found]
    return replace(solution, info={**solution.info, "warnings": warnings}) if found else solution
