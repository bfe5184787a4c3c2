"""Rigid bodies without a mesh, and the components of what moves and loads them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pydantic

from ..errors import InputError
from ..geometry.rotation import Motions as Kind
from ..given.posed import HOLD
from ..given.tables.base import Model, Name


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
LaterMotions = Annotated[
    float | Literal["free", "hold"] | tuple[float | Literal["free", "hold"], ...],
    _components('a finite number, "free" or "hold",', "free", HOLD),
]
"""The same in a step, where a component may also stay where the step before has left it."""
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
    if count > 1 and value not in (0.0, "free", HOLD):
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
        """Displacement and rotation, component by component, each a number, "free" or "hold".

        Raises
        ------
        InputError
            If one has another number of components, or no rigid motion has it.
        """
        moved = self._along("displacement", kind, 0.0, "free", HOLD)
        return moved + self._each("rotation", len(kind.planes))

    def moved_by(self, kind: Kind) -> list[float]:
        """How far components that are "hold" move from where the step before has left them."""
        return [0.0] * kind.components

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


class MovedObstacle(Obstacle):
    """An obstacle in a step that moves it from where the step before has left it.

    Attributes
    ----------
    by : a number a component
        Displacement in the step, of the components that are "hold" [length].
    """

    by: Loads = 0.0

    def moved_by(self, kind: Kind) -> list[float]:
        """As of an obstacle; errors as of `motions`."""
        return self._along("by", kind, 0.0) + [0.0] * len(kind.planes)
