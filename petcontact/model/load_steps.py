"""Load steps: what changes, one after the other, every value reached linearly in its step; and what
they move, obstacles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import pydantic

from ..errors import InputError
from ..geometry.rotation import Motions as Kind
from ..given.tables.base import Expression, Finite, Model, Name, Vector, whole_or_auto
from ..runtime.hints import among, demand_name
from .bodies import Body, Displacement, Periodic, Traction
from .loads import LoadsChange, check_material

Increments = Annotated[int | Literal["auto"], whole_or_auto(100_000)]


def _components(allowed: str, *words: str) -> pydantic.BeforeValidator:
    """Check a number, or one of some words, for every component or in an array of them.

    This is one check in place of a union, whose report would name every branch.
    """

    def one(value: Any) -> float | str:
        if isinstance(value, str) and value in words:
            return value
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not abs(value) < float("inf"):
            raise InputError(f"must be {allowed} or an array of them, one a component")
        return float(value)

    return pydantic.BeforeValidator(
        lambda value: tuple(map(one, value)) if isinstance(value, (list, tuple)) else one(value)
    )


Motions = Annotated[
    float | Literal["free"] | tuple[float | Literal["free"], ...],
    _components('a finite number or "free",', "free"),
]
"""A number or "free" for every component, or an array of them."""
Loads = Annotated[float | tuple[float, ...], _components("a finite number")]
"""A number for every component, or an array of them."""


def spread(value: Any, count: int, key: str) -> list[Any]:
    """The `count` components of a vector that is given by them, or by one number where this is 0 or
    "free".

    Raises
    ------
    InputError
        If it has another number of components.
    """
    if isinstance(value, tuple):
        if len(value) != count:
            needed = "a number" if count == 1 else f"{count} components"
            raise InputError(f"{key}: needs {needed} here, got {len(value)} components")
        return list(value)
    if count == 0 and value != 0.0:
        raise InputError(f"{key}: nothing turns about the axis here; leave it out, got {value!r}")
    if count > 1 and value not in (0.0, "free"):
        raise InputError(f"{key}: needs {count} components here, got {value!r}")
    return [value] * count


class Obstacle(Model):
    """A rigid body without a mesh: it moves by given components, or by those that are "free" under
    its force and moment.

    One number stands for every component where it is 0 or "free".

    In a config::

        [[obstacle]]
        name = "punch"
        displacement = ["free", -0.1]

    Attributes
    ----------
    name : str
        Name of the obstacle.
    displacement : a number or "free" a component
        Displacement of the centre [length].
    rotation : number or "free", in 3D one about each of x, y, z
        About the centre, counter-clockwise, small [rad].
    centre : point
        Point about which it turns [length].
    force : a number a component
        Force from outside on components that are free [force/length, in 3D force].
    moment : number, in 3D one about each of x, y, z
        Moment from outside about the centre, where the rotation is free [force, in 3D force ·
        length].
    """

    name: Name
    displacement: Motions = 0.0
    rotation: Motions = 0.0
    centre: Loads = 0.0
    force: Loads = 0.0
    moment: Loads = 0.0

    def motions(self, kind: Kind) -> list[Any]:
        """Displacement and rotation, component by component, each a number or "free".

        Raises
        ------
        InputError
            If one has another number of components, or no rigid motion has it.
        """
        moved = self._along("displacement", kind, 0.0, "free")
        return moved + self._each("rotation", len(kind.planes))

    def loads(self, kind: Kind) -> list[float]:
        """Force and moment, component by component; errors as of `motions`."""
        return self._along("force", kind, 0.0) + self._each("moment", len(kind.planes))

    def _along(self, key: str, kind: Kind, *still: Any) -> list[Any]:
        """The components of a vector, of which those across an axis of revolution are 0."""
        values = self._each(key, kind.dim)
        for axis in kind.across:
            if values[axis] not in still:
                raise InputError(
                    f"obstacle {self.name!r}: {key}[{axis}]: it moves along the axis of revolution "
                    f"only, got {values[axis]!r}"
                )
            values[axis] = 0.0
        return values

    def centre_in(self, d: int) -> list[float]:
        """Centre of rotation in d dimensions; errors as of `motions`."""
        return self._each("centre", d)

    def _each(self, key: str, count: int) -> list[Any]:
        return spread(getattr(self, key), count, f"obstacle {self.name!r}: {key}")


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
        As in the condition that it changes; of a periodic one value is its jump.
    traction : as in the condition, optional
        Traction on the "free" components of a displacement. What is not named stays.
    """

    body: str | None = pydantic.Field(default=None, kw_only=True)
    part: str
    value: Annotated[tuple[Expression, ...], Vector] | None = None
    pressure: Expression | None = None
    traction: Annotated[tuple[Expression, ...], Vector] | None = None

    @pydantic.model_validator(mode="after")
    def _one_of_two(self) -> BoundaryChange:
        if (self.value is None and self.traction is None) == (self.pressure is None):
            given = "neither" if self.pressure is None else "both"
            raise ValueError(f"a change needs either value = [...] or pressure = p, got {given}")
        return self


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
    displacement : a number or "free" a component
        Displacement of the centre [length].
    rotation : number or "free", in 3D one about each of x, y, z
        Rotation about the centre [rad].
    force : a number a component
        Force by component [force/length, in 3D force].
    moment : number, in 3D one about each of x, y, z
        Moment about the centre [force, in 3D force · length].
    """

    name: str
    displacement: Motions | None = None
    rotation: Motions | None = None
    force: Loads | None = None
    moment: Loads | None = None


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
    boundary, obstacle, point_force, loads : lists
        What changes; the rest keeps the values it has at the end of the step before.
    """

    name: str = ""
    increments: Increments = 1
    boundary: tuple[BoundaryChange, ...] = ()
    obstacle: tuple[ObstacleChange, ...] = ()
    point_force: tuple[PointForceChange, ...] = ()
    loads: tuple[LoadsChange, ...] = ()


def changed_condition(body: Body, change: Any, key: str) -> Displacement | Traction | Periodic:
    """The condition of a part with the values of a step.

    Raises
    ------
    ValueError
        If the part has no such condition, or it would become another kind.
    """
    old = _changing(body, change.part, f"{key}.part")
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


def _changing(body: Body, part: str, key: str) -> Displacement | Traction | Periodic:
    """The condition of a part, if it is one that steps change."""
    old = body.condition(part)
    if not isinstance(old, Displacement | Traction | Periodic):
        names = [c.part for c in body.boundary if isinstance(c, Displacement | Traction | Periodic)]
        hint = among(part, names, f"those of body {body.name!r} are")
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
        changed_condition(body, change, place)
        changed.append((f"{place}.part", "part", f"{body.name}.{change.part}"))
    for k, loads in enumerate(step.loads):
        place = f"{key}.loads[{k}]"
        check_material(place, _body_of(loads, place, bodies), loads)
    named_changes: tuple[tuple[str, Sequence[Any], list[str], str], ...] = (
        ("obstacle", step.obstacle, obstacles, "obstacles are"),
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


def _body_of(change: Any, key: str, bodies: Sequence[Body]) -> Body:
    """The body that a change names; it may name none where there is one."""
    names = [body.name for body in bodies]
    if change.body is None and len(names) > 1:
        raise InputError(f"{key}.body: this key is required where there are several bodies")
    name = change.body or names[0]
    demand_name(f"{key}.body: no body", name, names, "bodies are")
    return bodies[names.index(name)]


def changed_obstacles(obstacles: Sequence[Obstacle], step: Step) -> list[Obstacle]:
    """Return the obstacles at the end of a step."""
    keys = ("displacement", "rotation", "force", "moment")
    changes = {
        change.name: {key: value for key in keys if (value := getattr(change, key)) is not None}
        for change in step.obstacle
    }
    return [o.model_copy(update=changes[o.name]) if o.name in changes else o for o in obstacles]
