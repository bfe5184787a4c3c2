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
    return tuple(
        LoadedBody(
            number,
            body,
            _conditions(body, bodies[0].name, steps),
            _loads(body, bodies[0].name, steps),
            _forces(body, steps),
        )
        for number, body in enumerate(bodies)
    )


def _conditions(
    body: Body, first: str, steps: Sequence[Step]
) -> list[dict[str, Displacement | Traction | Symmetry | Periodic]]:
    conditions = {c.part: c for c in body.boundary if not isinstance(c, Contact)}
    result = []
    for s, step in enumerate(steps or (None,)):
        for k, change in enumerate(step.boundary if step else ()):
            if (change.body or first) == body.name:
                now = body.model_copy(update={"boundary": tuple(conditions.values())})
                changed = changed_condition(now, change, f"step[{s}].boundary[{k}]")
                conditions = {**conditions, change.part: changed}
        result.append(conditions)
    return result


def _loads(body: Body, first: str, steps: Sequence[Step]) -> list[VolumeLoads]:
    now, result = body.loads or NO_LOADS, []
    for step in steps or (None,):
        for change in step.loads if step else ():
            if (change.body or first) == body.name:
                now = now.model_copy(
                    update={key: getattr(change, key) for key in change.model_fields_set - {"body"}}
                )
        result.append(now)
    return result


def _forces(body: Body, steps: Sequence[Step]) -> list[list[PointForce]]:
    now, result = list(body.point_force), []
    for step in steps or (None,):
        changes = {change.name: change.force for change in (step.point_force if step else ())}
        now = [f.model_copy(update={"force": changes.get(f.name, f.force)}) for f in now]
        result.append(now)
    return result
