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

    def loads_volume_as(self, other: LoadedBody) -> bool:
        """Whether material and volume loads are those of another body."""
        return self.body.material == other.body.material and self.loads == other.loads


def loaded_body(number: int, body: Body, steps: Sequence[Step]) -> LoadedBody:
    """Return a body of a problem with the changes of its steps.

    Raises
    ------
    InputError
        If a condition would become another kind.
    """
    # a change without a body is one of the first
    names = (body.name, None) if number == 0 else (body.name,)
    loaded = LoadedBody(number, body, [], [], [])
    conditions = {c.part: c for c in body.boundary if not isinstance(c, Contact)}
    loads, forces = body.loads or NO_LOADS, list(body.point_force)
    for s, step in enumerate(steps or (Step(),)):
        for k, change in enumerate(step.boundary):
            if change.body in names:
                before = body.model_copy(update={"boundary": tuple(conditions.values())})
                key = f"step[{s}].boundary[{k}]"
                conditions = {**conditions, change.part: changed_condition(before, change, key)}
        for each in step.loads:
            if each.body in names:
                loads = loads.model_copy(
                    update={key: getattr(each, key) for key in each.model_fields_set - {"body"}}
                )
        given = {change.name: change.force for change in step.point_force}
        forces = [f.model_copy(update={"force": given.get(f.name, f.force)}) for f in forces]
        loaded.conditions.append(conditions)
        loaded.loads.append(loads)
        loaded.forces.append(forces)
    return loaded
