"""Load steps: what changes, one after the other, every value reached linearly in its step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import pydantic

from ..arrays import LARGEST_NUMBER
from ..errors import InputError, the_body
from ..given.posed import HOLD
from ..given.tables.base import Expression, Finite, Model, Vector, whole_or_auto
from ..runtime.hints import among, demand_name
from ..untyped import Keyed
from .bodies import Body, Contact, Displacement, Periodic, Traction
from .loads import LoadsChange, check_material
from .obstacles import LaterMotions, Loads, Motions, MovedObstacle, Obstacle
from .onward import check_by, moved_on, ways_of

Increments = Annotated[int | Literal["auto"], whole_or_auto(100_000)]


def _force_or_locked(value: Any) -> object:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if value != "locked" and not (number and 0.0 <= value <= LARGEST_NUMBER):
        raise InputError(f'must be a number from 0 to {LARGEST_NUMBER:g}, or "locked"')
    return value if value == "locked" else float(value)


Preload = Annotated[float | Literal["locked"], pydantic.BeforeValidator(_force_or_locked)]


class BoundaryChange(Model):
    """New values of a condition of one part.

    In a config::

        [[step]]
        name = "press"
        [[step.boundary]]
        body = "upper"
        part = "top"
        value = [0.0, -0.1]

    Attributes
    ----------
    body : str, optional
        Name of the body; needed where there are several.
    part : str
        Name of the part.
    value, pressure : as in the condition
        As in the condition that it changes; of a periodic one value is its jump. A component that
        is "hold" stays where the step before has left it, also on a part that was loaded or free.
    by : a number, an expression or "free" a component, optional
        How far components move from where the step before has left them; without `value` all
        components but those that are "free" do [length].
    traction : as in the condition, optional
        Traction on the "free" components of a displacement. What is not named stays.
    """

    body: str | None = pydantic.Field(default=None, kw_only=True)
    part: str
    value: Annotated[tuple[Expression, ...], Vector] | None = None
    pressure: Expression | None = None
    traction: Annotated[tuple[Expression, ...], Vector] | None = None
    by: Annotated[tuple[Expression, ...], Vector] | None = pydantic.Field(
        default=None, kw_only=True
    )

    @pydantic.model_validator(mode="after")
    def _one_of_two(self) -> BoundaryChange:
        if (self.value is None and self.traction is None and self.by is None) == (
            self.pressure is None
        ):
            given = "neither" if self.pressure is None else "both"
            raise ValueError(f"a change needs either value = [...] or pressure = p, got {given}")
        check_by("value", self.value, self.by)
        return self

    @property
    def goes_on(self) -> bool:
        """Whether some component stays or moves from where the step before has left it."""
        return self.by is not None or HOLD in (self.value or ())


class ObstacleChange(Model):
    """New values of an obstacle; what is not named stays.

    In a config::

        [[step]]
        name = "push"
        [[step.obstacle]]
        name = "punch"
        displacement = [0.05, -0.1]

    Attributes
    ----------
    name : str
        Name of the obstacle.
    displacement : a number, "free" or "hold" a component
        Displacement of the centre [length]; "hold" stays where the step before has left it.
    rotation : number, "free" or "hold", in 3D one about each of x, y, z
        Rotation about the centre [rad].
    by : a number or "free" a component, optional
        How far the centre moves from where the step before has left it; without `displacement` all
        components but those that are "free" do [length].
    force : a number a component
        Force by component [force/length, in 3D force].
    moment : number, in 3D one about each of x, y, z
        Moment about the centre [force, in 3D force · length].
    """

    name: str
    displacement: LaterMotions | None = None
    rotation: LaterMotions | None = None
    force: Loads | None = None
    moment: Loads | None = None
    by: Motions | None = pydantic.Field(default=None, kw_only=True)

    @pydantic.model_validator(mode="after")
    def _by_where_held(self) -> ObstacleChange:
        check_by("displacement", self.displacement, self.by)
        return self

    @property
    def goes_on(self) -> bool:
        """Whether some component stays or moves from where the step before has left it."""
        held = (self.displacement, self.rotation)
        return self.by is not None or any(
            HOLD in (value if isinstance(value, tuple) else (value,)) for value in held
        )

    def changes(self) -> Keyed:
        """Values by the key of the obstacle that they change; `by` is 0 where none is given."""
        keys = ("displacement", "rotation", "force", "moment")
        given = {key: value for key in keys if (value := getattr(self, key)) is not None}
        if self.by is None:
            return {**given, "by": 0.0}
        each = self.by if isinstance(self.by, tuple) else (self.by,)
        moved, ways = (
            values if isinstance(self.by, tuple) else values[0] for values in ways_of(None, each)
        )
        return {"displacement": moved, **given, "by": ways}


class ContactChange(Model):
    """New values of a contact, reached linearly in the step; what is not named stays.

    In a config::

        [[step]]
        name = "tighten"
        [[step.contact]]
        name = "bolt"
        preload = 12_000.0
        [[step]]
        name = "load"
        [[step.contact]]
        name = "bolt"
        preload = "locked"

    Attributes
    ----------
    name : str
        Name of the contact; of a contact condition "part", of several bodies "body.part".
    friction_coefficient, friction_bound : expression, optional
        As in the contact. A contact that has one of them gets no other one in a step.
    interference, clearance : expression, optional
        Overlap of the parts, and its opposite [length].
    preload : float or "locked", optional
        Force that the overlap brings about; "locked" keeps the overlap that was reached
        [force/length, in 3D force].
    """

    name: str
    friction_coefficient: Expression | None = None
    friction_bound: Expression | None = None
    interference: Expression | None = None
    clearance: Expression | None = None
    preload: Preload | None = None


class PointForceChange(Model):
    """A new value of a point force.

    In a config::

        [[step]]
        name = "pull"
        [[step.point_force]]
        name = "hook"
        force = [10.0, 0.0]

    Attributes
    ----------
    name : str
        Name of the point force.
    force : (fx, fy), in 3D (fx, fy, fz)
        Force by component [force/length, in 3D force].
    """

    name: str
    force: Annotated[tuple[Finite, ...], Vector]


class Step(Model):
    """One load step.

    In a config::

        [[step]]
        name = "press"
        increments = 5
        boundary = [{ part = "top", value = [0.0, -0.1] }]

    Attributes
    ----------
    name : str
        Name of the step, for verdict, files and figures.
    increments : int or "auto"
        Equal increments; "auto" begins with one and halves where the solver fails or the path error
        is too large. Steps that do not name it take 4, 16 or 64, together at most 64, if the
        error of the path would exceed the wanted accuracy; they grow with a contact that begins.
    until : "sliding", optional
        Ends the step where a whole contact slips, if that is before all its loads act. The load
        factor that is reached is a result. The next step gives a value to all that this one
        changes.
    boundary, obstacle, contact, point_force, loads : lists
        What changes; the rest keeps the values it has at the end of the step before.
    """

    name: str = ""
    increments: Increments = 1
    until: Literal["sliding"] | None = pydantic.Field(default=None, kw_only=True)
    boundary: tuple[BoundaryChange, ...] = ()
    obstacle: tuple[ObstacleChange, ...] = ()
    contact: tuple[ContactChange, ...] = ()
    point_force: tuple[PointForceChange, ...] = ()
    loads: tuple[LoadsChange, ...] = ()


def check_until(steps: Sequence[Step], friction: Sequence[bool], in_cycle: range) -> None:
    """Refuse steps that end where a contact slips, if none can, or what follows cannot begin there.

    Parameters
    ----------
    steps : sequence of Step
    friction : sequence of bool
        Whether each contact has friction.
    in_cycle : range
        Numbers of the steps of a cycle, from 1.

    Raises
    ------
    InputError
    """
    for k in [k for k, step in enumerate(steps) if step.until]:
        later = k + 1 < len(steps)
        grow_on = sorted(_given_anew(steps[k]) - _given_anew(steps[k + 1])) if later else []
        trouble = {
            "no contact has friction, and so none can slide": not any(friction),
            "a step of a cycle ends where its loads all act": k + 1 in in_cycle,
            "the two steps before a later step have it both; give it to one of them": (
                k + 2 < len(steps) and steps[k + 1].until is not None
            ),
            "all loads grow in the first step, and would grow on in the next one; let a step that "
            "changes nothing come first": later and k == 0,
            f"the next step would let it grow on: give {', '.join(grow_on[:1])} a value in "
            f"step[{k + 1}]": len(grow_on) > 0,
        }
        for text in [text for text, holds in trouble.items() if holds]:
            raise InputError(f"step[{k}].until: {text}")


def _given_anew(step: Step) -> set[str]:
    """What a step gives new values, in words."""
    lists = step.obstacle, step.contact, step.point_force
    names = [each.part for each in step.boundary] + [each.name for some in lists for each in some]
    return {*map(repr, names), *(f"the loads of {each.body or 'the body'}" for each in step.loads)}


def changed_condition(
    body: Body, change: BoundaryChange, key: str
) -> Displacement | Traction | Periodic:
    """The condition of a part with the values of a step.

    Raises
    ------
    ValueError
        If the part has no such condition, or it would become another kind.
    """
    old = _changing(body, change, f"{key}.part")
    names = ("value", "pressure", "traction")
    given = {name: v for name in names if (v := getattr(change, name)) is not None}
    subject = f"the condition of {change.part!r}"
    if isinstance(old, Periodic):
        jump = given.get("value", ())
        if len(jump) != 2 or not all(isinstance(component, float) for component in jump):
            raise InputError(f"{key}.value: {subject} is periodic, give its jump, two numbers")
        return Periodic(old.part, old.partner, jump)
    for name in given.keys() - type(old).model_fields.keys():
        letter, axes = "t" if isinstance(old, Traction) else "u", "xyz"[: len(old.value or "xy")]
        components = ", ".join(f"{letter}{axis}" for axis in axes)
        raise ValueError(
            f"{key}.{name}: {subject} is a {old.condition}, give value = [{components}]"
        )
    if isinstance(old, Traction):
        return Traction(old.part, **given)
    value = given.get("value", old.value)
    if len(value) != len(old.value):
        raise InputError(
            f"{key}.value: {subject} has {len(old.value)} components, got {len(value)}"
        )
    try:
        return Displacement(
            **{"part": old.part, "value": old.value, "traction": old.traction, **given}
        )
    except InputError as error:
        raise ValueError(f"{key}.{error}") from None


def condition_after(
    body: Body, change: BoundaryChange, key: str
) -> Displacement | Traction | Periodic:
    """The condition of a part in a step that changes it; errors as of `changed_condition`."""
    if change.goes_on:
        return moved_on(body.condition(change.part), change, key)
    return changed_condition(body, change, key)


def _changing(body: Body, change: BoundaryChange, key: str) -> Displacement | Traction | Periodic:
    """The condition of a part, if it is one that steps change; a pressure loads free parts, too."""
    part, old = change.part, body.condition(change.part)
    if old is None and change.pressure is not None:
        return Traction(part, pressure=0.0)
    if not isinstance(old, Displacement | Traction | Periodic):
        names = [c.part for c in body.boundary if isinstance(c, Displacement | Traction | Periodic)]
        hint = (
            "; it is in contact, which [[step.contact]] changes"
            if isinstance(old, Contact)
            else among(part, names, f"those of {the_body(body.name)} are")
            + "; a free part takes a pressure, or give it a condition before"
        )
        raise ValueError(f"{key}: no displacement or traction condition on {part!r}{hint}")
    return old


def check_step(key: str, step: Step, bodies: Sequence[Body], obstacles: list[str]) -> None:
    """Whether everything that a step changes exists.

    Raises
    ------
    ValueError
        One line that names the key, which starts with that of the step.
    """
    changed = list[tuple[str, str, str]]()
    for k, change in enumerate(step.boundary):
        place = f"{key}.boundary[{k}]"
        body = _body_of(change, place, bodies)
        condition_after(body, change, place)
        changed.append((f"{place}.part", "part", f"{body.name}.{change.part}"))
    for k, loads in enumerate(step.loads):
        place = f"{key}.loads[{k}]"
        check_material(place, _body_of(loads, place, bodies), loads)
    named_changes: tuple[
        tuple[str, Sequence[ObstacleChange | ContactChange | PointForceChange], list[str], str], ...
    ] = (
        ("obstacle", step.obstacle, obstacles, "obstacles are"),
        # whether they exist is asked where interfaces are made
        ("contact", step.contact, [named.name for named in step.contact], ""),
        (
            "point force",
            step.point_force,
            [named.name for body in bodies for named in body.point_force if named.name],
            "point forces with a name are",
        ),
    )
    for what, changes, names, there in named_changes:
        for k, named in enumerate(changes):
            place = f"{key}.{what.replace(' ', '_')}[{k}].name"
            demand_name(f"{place}: no {what}", named.name, names, there)
            changed.append((place, what, named.name))
    for k, (place, what, name) in enumerate(changed):
        if (what, name) in [one[1:] for one in changed[:k]]:
            raise InputError(
                f"{place}: {what} {name!r} is changed twice in this step; change it once"
            )


def _body_of(change: BoundaryChange | LoadsChange, key: str, bodies: Sequence[Body]) -> Body:
    """The body that a change names; it may name none where there is one."""
    names = [body.name for body in bodies]
    if change.body is None and len(names) > 1:
        raise InputError(f"{key}.body: this key is required where there are several bodies")
    name = change.body or names[0]
    demand_name(f"{key}.body: no body", name, names, "bodies are")
    return bodies[names.index(name)]


def changed_obstacles(obstacles: Sequence[Obstacle], step: Step) -> list[Obstacle]:
    """Return the obstacles at the end of a step."""
    changes = {change.name: change.changes() for change in step.obstacle}
    return [_changed(obstacle, changes.get(obstacle.name, {"by": 0.0})) for obstacle in obstacles]


def _changed(obstacle: Obstacle, changes: Keyed) -> Obstacle:
    """Return an obstacle in a step; `by` is of one step only."""
    if changes == {"by": 0.0} and not isinstance(obstacle, MovedObstacle):
        return obstacle
    return MovedObstacle.model_construct(**{**dict(obstacle), **changes})
