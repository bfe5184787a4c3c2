"""Load steps: what changes, one after the other, every value reached linearly in its step; and what they move, obstacles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

import pydantic

from ..errors import InputError
from .base import Expression, Finite, Model, Name, Vector
from .loads import LoadsChange


def _increments(value: Any) -> int | str:
    """One check instead of a union, whose report would name every branch."""
    if value == "auto":
        return "auto"
    if isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= 100_000:
        return value
    raise ValueError('must be a whole number from 1 to 100000, or "auto"')


Increments = Annotated[int | Literal["auto"], pydantic.BeforeValidator(_increments)]


def _number(value: Any) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < float("inf"):
        return float(value)
    raise ValueError("must be a finite number or an array of them, one a component")


def _freedom(value: Any) -> float | str:
    try:
        return "free" if isinstance(value, str) and value == "free" else _number(value)
    except ValueError:
        raise ValueError('must be a finite number or "free", or an array of them, one a component') from None


def _components(one: Callable[[Any], Any]) -> pydantic.BeforeValidator:
    """One check of a number or an array instead of a union, whose report would name every branch."""
    return pydantic.BeforeValidator(
        lambda value: tuple(map(one, value)) if isinstance(value, (list, tuple)) else one(value)
    )  # fmt: skip


Motions = Annotated[float | Literal["free"] | tuple[float | Literal["free"], ...], _components(_freedom)]
"""A number or "free" for every component, or an array of them."""
Loads = Annotated[float | tuple[float, ...], _components(_number)]
"""A number for every component, or an array of them."""


def spread(value: Any, count: int, key: str) -> list[Any]:
    """The `count` components of a vector that is given by them, or by one number where this is 0 or "free".

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
    if count > 1 and value not in (0.0, "free"):
        raise InputError(f"{key}: needs {count} components here, got {value!r}")
    return [value] * count


class Obstacle(Model):
    """A rigid body without a mesh: it moves by given components, or by those that are "free" under its force and moment.

    One number stands for every component where it is 0 or "free".

    Attributes
    ----------
    name : str
        Of the obstacle.
    displacement : a number or "free" a component
        Of the centre [length].
    rotation : number or "free", in space one about each of x, y, z
        About the centre, counter-clockwise, small [rad].
    centre : point
        What it turns about [length].
    force : a number a component
        From outside, where the component is free [force/length, in space force].
    moment : number, in space one about each of x, y, z
        From outside about the centre, where the rotation is free [force, in space force · length].
    """

    name: Name
    displacement: Motions = 0.0
    rotation: Motions = 0.0
    centre: Loads = 0.0
    force: Loads = 0.0
    moment: Loads = 0.0

    def motions(self, d: int) -> list[Any]:
        """Displacement and rotation in d dimensions, component by component, each a number or "free".

        Raises
        ------
        InputError
            If one has another number of components.
        """
        return self._each("displacement", d) + self._each("rotation", d * (d - 1) // 2)

    def loads(self, d: int) -> list[float]:
        """Force and moment, likewise."""
        return self._each("force", d) + self._each("moment", d * (d - 1) // 2)

    def centre_in(self, d: int) -> list[float]:
        """The centre, likewise."""
        return self._each("centre", d)

    def _each(self, key: str, count: int) -> list[Any]:
        return spread(getattr(self, key), count, f"obstacle {self.name!r}: {key}")


class BoundaryChange(Model):
    """New values of a condition of one part.

    Attributes
    ----------
    body : str, optional
        Needed where there are several.
    part : str
        Name of the part.
    value, pressure : as in the condition
        As in the condition that it changes.
    """

    body: str | None = pydantic.Field(default=None, kw_only=True)
    part: str
    value: Annotated[tuple[Expression, ...], Vector] | None = None
    pressure: Expression | None = None

    @pydantic.model_validator(mode="after")
    def _one_of_two(self) -> BoundaryChange:
        if (self.value is None) == (self.pressure is None):
            raise ValueError("a change needs either value = [...] or pressure = p")
        return self


class ObstacleChange(Model):
    """New values of an obstacle; what is not named stays.

    Attributes
    ----------
    name : str
        Of the obstacle.
    displacement : a number or "free" a component
        [length]
    rotation : number or "free", in space one about each of x, y, z
        [rad]
    force : a number a component
        [force/length, in space force]
    moment : number, in space one about each of x, y, z
        [force, in space force · length]
    """

    name: str
    displacement: Motions | None = None
    rotation: Motions | None = None
    force: Loads | None = None
    moment: Loads | None = None


class PointForceChange(Model):
    """A new value of a point force.

    Attributes
    ----------
    name : str
        Of the point force.
    force : (fx, fy), in space (fx, fy, fz)
        [force/length, in space force]
    """

    name: str
    force: Annotated[tuple[Finite, ...], Vector]


class Step(Model):
    """One load step.

    Attributes
    ----------
    name : str
        For verdict, files and figures.
    increments : int or "auto"
        Equal increments; "auto" begins with one and halves where the solver fails or the path error is too large.
    boundary, obstacle, point_force, loads : lists
        What changes; the rest keeps the values it has at the end of the step before.
    """

    name: str = ""
    increments: Increments = 1
    boundary: tuple[BoundaryChange, ...] = ()
    obstacle: tuple[ObstacleChange, ...] = ()
    point_force: tuple[PointForceChange, ...] = ()
    loads: tuple[LoadsChange, ...] = ()
