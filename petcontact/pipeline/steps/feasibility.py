"""Whether contact can hold the first loads at all, found before any matrix is built."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ...compliance.bodies import BodiesSystem
from ...compliance.body.rigid import RigidBody
from ...contact.methods.registry import method_of
from ...errors import SolverError
from ..choice import has_compressed
from ..discrete.discretise import Discrete
from ..eliminate import operators_of
from .diagnosis import unheld
from .increment import PreparedProblem
from .load_steps import HALVINGS, first_increment
from .start import NAMES


def check_feasible(discrete: Discrete, comm: Any) -> None:
    """Refuse loads that no admissible traction holds where matrices take long: those of compressed bodies.

    The first step is looked at, at its least load that would be tried: what contact can hold is convex.

    Raises
    ------
    SolverError
        If nothing holds a body or an obstacle, with its name.
    """
    problem = discrete.problem
    compressed = has_compressed(problem.bem, discrete.meshes)
    if problem.method.start not in NAMES or not discrete.interfaces or not compressed:
        return
    bodies = [RigidBody(*operators_of(discrete, b)) for b in range(len(discrete.meshes))]
    x = [discrete.meshes[face.body].x[face.nodes] for face in discrete.interfaces]
    centres = [np.array(o.centre_in(discrete.meshes[0].dim)) for o in problem.obstacle]
    system = BodiesSystem(bodies, discrete.interfaces, x, centres, comm)
    first = first_increment(PreparedProblem(discrete, system, method_of(problem.method, None, problem.method), comm))
    divisible = bool(problem.step) or not discrete.holds_normals
    least = first.target * 0.5**HALVINGS if divisible else first.target
    where = f" at any load of step {first.step.name or first.number!r}" if problem.step else ""
    found = unheld(dataclasses.replace(first, target=least), where)
    system.close()
    if found:
        raise SolverError("equilibrium", found, "hold the body, press it more or let friction be larger")
