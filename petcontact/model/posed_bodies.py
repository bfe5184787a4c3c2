"""The bodies of a problem with what acts on them in every step, as functions of the place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from ..errors import in_body
from ..given import body_data, conditions
from ..given.interface_data import Law
from ..given.values import Given, as_given
from .bodies import Body, Contact, Displacement, Periodic, Symmetry, Traction
from .load_steps import Step, condition_after
from .loads import NO_LOADS, VolumeLoads
from .onward import at_rest


def posed_body(
    number: int, body: Body, laws: Mapping[str, Law], steps: Sequence[Step]
) -> body_data.Body:
    """Return a body of a problem with the changes of its steps.

    `laws` are those of its contact conditions, by part.

    Raises
    ------
    InputError
        If a condition would become another kind.
    """
    # a change without a body is one of the first
    names = (body.name, None) if number == 0 else (body.name,)
    steps = steps or (Step(),)
    first, conditions_of_steps = _conditions(body, names, steps)
    return body_data.Body(
        number,
        body.name,
        body.material,
        body.mesh,
        body.geometry.has_inside,
        tuple(
            conditions.Contact(c.part, laws[c.part]) if isinstance(c, Contact) else first[c.part]
            for c in body.boundary
        ),
        _loads(body.name, body.loads or NO_LOADS),
        conditions_of_steps,
        list(_loads_of_steps(body, names, steps)),
        list(_forces_of_steps(body, steps)),
    )


Conditions = dict[str, conditions.Condition]
"""Conditions by part."""


def _conditions(
    body: Body, names: Sequence[str | None], steps: Sequence[Step]
) -> tuple[Conditions, list[Conditions]]:
    """The conditions of a body at the beginning, and at the end of each step."""
    posed = {c.part: c for c in body.boundary if not isinstance(c, Contact)}
    first = values = {
        c.part: _condition(f"{in_body(body.name)}boundary[{k}] ({c.part})", c)
        for k, c in enumerate(body.boundary)
        if not isinstance(c, Contact)
    }
    result = []
    for s, step in enumerate(steps):
        for part in posed:
            if (still := at_rest(posed[part])) is not posed[part]:
                posed = {**posed, part: still}
                values = {**values, part: _condition(part, still)}
        for k, change in enumerate(step.boundary):
            if change.body in names:
                before = body.model_copy(update={"boundary": tuple(posed.values())})
                key = f"step[{s}].boundary[{k}]"
                condition = condition_after(before, change, key)
                posed = {**posed, change.part: condition}
                values = {**values, change.part: _condition(key, condition)}
        result.append(values)
    return first, result


def _loads_of_steps(
    body: Body, names: Sequence[str | None], steps: Sequence[Step]
) -> Iterator[body_data.Loads]:
    """The loads of the volume of a body at the end of each step."""
    loads = body.loads or NO_LOADS
    for step in steps:
        for each in step.loads:
            if each.body in names:
                loads = loads.model_copy(
                    update={key: getattr(each, key) for key in each.model_fields_set - {"body"}}
                )
        yield _loads(body.name, loads)


def _forces_of_steps(body: Body, steps: Sequence[Step]) -> Iterator[list[body_data.PointForce]]:
    """The forces at points of a body at the end of each step."""
    forces = list(body.point_force)
    for step in steps:
        given = {change.name: change.force for change in step.point_force}
        forces = [f.model_copy(update={"force": given.get(f.name, f.force)}) for f in forces]
        yield [body_data.PointForce(f.at, f.force) for f in forces]


def _condition(
    key: str, condition: Displacement | Traction | Symmetry | Periodic
) -> conditions.Condition:
    """The condition of a part of a body, whose place in the config errors tell."""
    part = condition.part
    if isinstance(condition, Symmetry):
        return conditions.Symmetry(part)
    if isinstance(condition, Periodic):
        return conditions.Periodic(part, condition.partner, condition.jump)
    if isinstance(condition, Displacement):
        loads = condition.traction
        return conditions.Displacement(
            part,
            tuple(
                None if value == "free" else as_given(value, f"{key}.value[{c}]")
                for c, value in enumerate(condition.value)
            ),
            None if loads is None else _vector(loads, f"{key}.traction"),
            getattr(condition, "onward", False),
        )
    if condition.pressure is not None:
        return conditions.Traction(part, pressure=as_given(condition.pressure, f"{key}.pressure"))
    return conditions.Traction(part, _vector(condition.value, f"{key}.value"))


def _vector(values: Sequence[object] | None, key: str) -> tuple[Given, ...]:
    return tuple(as_given(value, f"{key}[{c}]") for c, value in enumerate(values or ()))


def _loads(name: str, loads: VolumeLoads) -> body_data.Loads:
    key = f"{in_body(name)}loads"
    return body_data.Loads(
        _vector(loads.acceleration, f"{key}.acceleration"),
        _vector(loads.force, f"{key}.force"),
        as_given(loads.temperature, f"{key}.temperature"),
        loads.angular_velocity,
        loads.centre,
        loads.axis,
    )
