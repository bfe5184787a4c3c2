"""A body with its conditions and loads at the end of each load step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .bodies import Body, Contact, Displacement, Periodic, Symmetry, Traction
from .load_steps import Step, changed_condition
from .loads import NO_LOADS, PointForce, VolumeLoads


@dataclass(frozen=True)
class LoadedBody:
    """A body, and what acts on it at the end of each step; a problem without steps has one.

    Attributes
    ----------
    number : int
    body : Body
    conditions : list of dict
        Conditions by part. A condition that a step leaves alone stays the same object.
    loads : list of VolumeLoads
        Loads of its volume.
    forces : list of lists of PointForce
        Forces at points inside.
    """

    number: int
    body: Body
    conditions: list[dict[str, Displacement | Traction | Symmetry | Periodic]]
    loads: list[VolumeLoads]
    forces: list[list[PointForce]]


def loaded_bodies(bodies: Sequence[Body], steps: Sequence[Step]) -> tuple[LoadedBody, ...]:
    """Return the bodies of a problem with the changes of its steps.

    Raises
    ------
    InputError
        If a condition would become another kind.
    """
    return tuple(_loaded(number, body, bodies[0].name, steps) for number, body in enumerate(bodies))


def _loaded(number: int, body: Body, first: str, steps: Sequence[Step]) -> LoadedBody:
    loaded = LoadedBody(number, body, [], [], [])
    conditions = {c.part: c for c in body.boundary if not isinstance(c, Contact)}
    loads, forces = body.loads or NO_LOADS, list(body.point_force)
    for s, step in enumerate(steps or (Step(),)):
        for k, change in enumerate(step.boundary):
            if (change.body or first) == body.name:
                now = body.model_copy(update={"boundary": tuple(conditions.values())})
                changed = changed_condition(now, change, f"step[{s}].boundary[{k}]")
                conditions = {**conditions, change.part: changed}
        for more in step.loads:
            if (more.body or first) == body.name:
                given = {key: getattr(more, key) for key in more.model_fields_set - {"body"}}
                loads = loads.model_copy(update=given)
        pushed = {change.name: change.force for change in step.point_force}
        forces = [f.model_copy(update={"force": pushed.get(f.name, f.force)}) for f in forces]
        loaded.conditions.append(conditions)
        loaded.loads.append(loads)
        loaded.forces.append(forces)
    return loaded
