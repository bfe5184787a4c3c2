"""Whether contact can hold the loads of all steps, found before any matrix is built."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...compliance.body.rigid import RigidBody
from ...compliance.reduced_bodies import BodiesSystem
from ...contact.methods.registry import method_of
from ...errors import NoEquilibrium
from ...untyped import Comm
from ..choice import has_compressed
from ..eliminate import operators_of
from ..pose.discretise import Discrete
from ..pose.load_states import later_data
from .diagnosis import is_unbalanced, unheld
from .halves import PATH_ERROR
from .increment import Increment
from .prepared import PreparedProblem
from .step_loop import whole_step


def check_feasible(discrete: Discrete, comm: Comm) -> None:
    """Refuse loads that no admissible traction holds where matrices take long: those of compressed
    bodies.

    All steps are looked at, at their ends: what contact can hold is convex. A step with `increments
    = "auto"` looks for the load that can just be held, and is solved up to there.

    Raises
    ------
    NoEquilibrium
        If nothing holds a body or an obstacle, with its name, that of the step, and how much of it
        can be held.
    """
    if not discrete.interfaces or not has_compressed(discrete.posed.bem, discrete.meshes):
        return
    prepared = _rigid(discrete, comm)
    posed = (discrete.posed.bodies, discrete.meshes, discrete.interfaces)
    for number, step in enumerate(prepared.steps, 1):
        data = later_data(
            *posed,
            number,
            prepared.discrete.data,
            [(0.0 * mesh.x, 0.0 * mesh.x) for mesh in discrete.meshes],
        )
        if data is not None:
            prepared = _rigid(dataclasses.replace(discrete, data=data), comm)
        where = f" at the end of step {step.name or number!r}" if discrete.posed.steps else ""
        if message := unheld(whole := whole_step(prepared, number), where):
            held = held_share(whole)
            if step.increments == "auto" and held > 0.0:
                return
            load = "step" if discrete.posed.steps else "load"
            share = f": contact can hold {held:.3f} of the {load}" * (held > 0.0)
            raise NoEquilibrium(
                "equilibrium",
                f"{message}{share}",
                "hold the body, press it more or let friction be larger",
            )


def held_share(step: Increment) -> float:
    """The largest share of a step whose loads contact can hold, within `PATH_ERROR`: what it can
    hold is convex."""
    low, high = 0.0, 1.0
    while high - low > PATH_ERROR:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_unbalanced(step.ending_at(middle)) else (middle, high)
    return low


def _rigid(discrete: Discrete, comm: Comm) -> PreparedProblem:
    """The problem with bodies that are not strained."""
    bodies = [RigidBody(*operators_of(discrete, b)) for b in range(len(discrete.meshes))]
    x = [discrete.meshes[face.body].x[face.nodes] for face in discrete.interfaces]
    centres = [np.array(o.centre_in(discrete.meshes[0].dim)) for o in discrete.posed.obstacles]
    method = discrete.posed.method
    system = BodiesSystem(bodies, discrete.interfaces, x, centres, comm)
    return PreparedProblem(discrete, system, method_of(method, None, method), comm)
