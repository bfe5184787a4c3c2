"""Rigid bodies without a mesh, and the components of what moves and loads them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pydantic

from ..errors import InputError
from ..geometry.rotation import Motions as Kind
from ..given.posed import HOLD
from ..given.tables.base import (
    Directed,
    Direction,
    Finite,
    Model,
    Name,
    NotNegative,
    Point,
    Positive,
    Vector,
)
from ..given.tables.points import Columns, Rows

SHAPED = {
    "circle": ("radius",),
    "sphere": ("radius",),
    "cylinder": ("from", "to", "radius"),
    "plane": ("normal",),
    "polygon": ("vertices",),
    "box": ("lower", "upper"),
    "points": ("points",),
}
"""Keys that a shape of an obstacle needs."""
MAY: dict[str | None, tuple[str, ...]] = {
    **dict.fromkeys(SHAPED, ("hollow",)),
    "plane": ("point",),
    "polygon": ("fillet", "along", "angle", "hollow"),
    "box": ("fillet", "along", "angle", "hollow"),
    "points": ("columns", "smooth", "along", "angle", "hollow"),
}
"""Keys that a shape may have besides."""
KEYS = tuple(dict.fromkeys(key for keys in (*SHAPED.values(), *MAY.values()) for key in keys))
"""Keys of an obstacle that belong to its shape."""
SMALL = 0.1
"""Rotation up to which linear displacements are those of a turned profile, to 0.5 % [rad]."""


def _components(allowed: str, *words: str) -> pydantic.BeforeValidator:
    """Check a number, or one of some words, for every component or in an array of them.

    This is one check in place of a union, whose report would name every branch.
    """

    def one(value: object) -> float | str:
        if isinstance(value, str) and value in words:
            return value
        if (
            isinstance(value, (int, float))
            and not isinstance(value, bool)
            and abs(value) < float("inf")
        ):
            return float(value)
        raise InputError(f"must be {allowed} or an array of them, one a component")

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
"""Motions in a step, where a component may also stay where the step before has left it."""
Loads = Annotated[float | tuple[float, ...], _components("a finite number")]
"""A number for every component, or an array of them."""


def spread(value: object, count: int, key: str) -> list[Any]:
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

    One number stands for every component where it is 0 or "free". In axial problems one number is
    the component along the axis.

    In a config::

        [[obstacle]]
        name = "punch"
        displacement = ["free", -0.1]
        shape = "circle"
        centre = [0.0, 2.0]
        radius = 2.0

    Attributes
    ----------
    name : str
        Name of the obstacle.
    displacement : a number or "free" a component
        Displacement of the centre; one number is 0, or that along an axis of revolution [length].
    rotation : number or "free", in 3D one about each of x, y, z
        About the centre, counter-clockwise, small [rad].
    centre : point
        Point about which it turns, and the centre of a circle or a sphere [length].
    force : a number a component
        Force from outside on components that are free; one number as of `displacement`
        [force/length, in 3D force].
    moment : number, in 3D one about each of x, y, z
        Moment from outside about the centre, where the rotation is free [force, in 3D force ·
        length].
    shape : {"circle", "plane", "sphere", "cylinder", "polygon", "box", "points"}, optional
        With a shape, the gap of unilateral contact is by default the distance to it along the
        contact's direction. It is infinite where the ray misses. Circles are of the plane and of
        axial problems, spheres and cylinders of axial problems and of space.
    radius : float, optional
        Of a circle, a sphere or a cylinder [length].
    normal : vector, optional
        Of a plane, out of the obstacle [-]; in axial problems along the axis.
    point : point, optional
        A point of a plane; by default `centre` [length].
    from, to : points, optional
        Centres of the two flat ends of a cylinder [length].
    vertices : list of points, optional
        Corners of a polygon, in either direction [length].
    fillet : float, optional
        Radius of the corners of a polygon, or of the edges and corners of a box; 0 by default
        [length].
    lower, upper : points, optional
        Opposite corners of a box along the axes, in the plane a rectangle [length].
    points : file or rows of numbers, optional
        Columns x and y of the profile of a tool, from its centre on and in their order along it. It
        is closed where the last point is the first one; see `gap` for the file [length].
    columns : list of int, optional
        Which two columns of the points these are, from 0 on.
    smooth : float, optional
        The curve is at most so far away from the points; with 0 it goes through all [length].
    along : vector, in 3D
        Direction along which a polygon or a profile is the same [-]. Its x and y are the other two
        axes in their order; for along = [0, 1, 0] they are x and z. Of a box the direction about
        which `angle` turns it, by default z.
    angle : float, optional
        Turns a polygon, a box or a profile about `centre`, counter-clockwise, before it moves
        [degrees].
    hollow : bool
        Whether the body lies inside of the shape. A cylinder is then open at its ends.
    """

    name: Name
    displacement: Motions = 0.0
    rotation: Motions = 0.0
    centre: Loads = 0.0
    force: Loads = 0.0
    moment: Loads = 0.0
    shape: Literal["circle", "plane", "sphere", "cylinder", "polygon", "box", "points"] | None = (
        pydantic.Field(default=None, kw_only=True)
    )
    radius: Positive | None = pydantic.Field(default=None, kw_only=True)
    normal: Annotated[tuple[Finite, ...], Vector, Directed] | None = pydantic.Field(
        default=None, kw_only=True
    )
    point: Annotated[tuple[Finite, ...], Vector] | None = pydantic.Field(default=None, kw_only=True)
    # a word of Python's own
    __annotations__["from"] = Annotated[
        Annotated[tuple[Finite, ...], Vector] | None, pydantic.Field(default=None, kw_only=True)
    ]
    to: Annotated[tuple[Finite, ...], Vector] | None = pydantic.Field(default=None, kw_only=True)
    vertices: tuple[Point, ...] | None = pydantic.Field(default=None, min_length=3, kw_only=True)
    fillet: NotNegative | None = pydantic.Field(default=None, kw_only=True)
    lower: Annotated[tuple[Finite, ...], Vector] | None = pydantic.Field(default=None, kw_only=True)
    upper: Annotated[tuple[Finite, ...], Vector] | None = pydantic.Field(default=None, kw_only=True)
    points: Rows | None = pydantic.Field(default=None, kw_only=True)
    columns: Columns | None = pydantic.Field(default=None, kw_only=True)
    smooth: NotNegative | None = pydantic.Field(default=None, kw_only=True)
    along: Direction | None = pydantic.Field(default=None, kw_only=True)
    angle: Finite | None = pydantic.Field(default=None, kw_only=True)
    hollow: bool = pydantic.Field(default=False, kw_only=True)

    @pydantic.model_validator(mode="after")
    def _keys_fit_shape(self) -> Obstacle:
        """Refuse keys that the shape has not, or that are missing."""
        given = [key for key in KEYS if getattr(self, key) not in (None, False)]
        if self.shape is None:
            for key in given:
                raise InputError(f"{key}: belongs to a shape; give shape, as in shape = 'circle'")
            return self
        needed = SHAPED[self.shape]
        allowed = (*needed, *MAY[self.shape])
        for key in given:
            if key not in allowed:
                raise InputError(
                    f"{key}: a {self.shape} has none; its keys are {', '.join(allowed)}"
                )
        for key in needed:
            if key not in given:
                raise InputError(f"{key}: this key is required of a {self.shape}")
        if self.shape == "cylinder" and getattr(self, "from") == self.to:
            raise InputError("from and to are the same point: a cylinder has a length")
        if "angle" in MAY[self.shape]:
            self._check_rotation()
        return self

    def _check_rotation(self) -> None:
        """Refuse a motion that turns a profile too far for linear displacements."""
        turns = self.rotation if isinstance(self.rotation, tuple) else (self.rotation,)
        if any(isinstance(turn, float) and abs(turn) > SMALL for turn in turns):
            raise InputError(
                f"rotation: is a small motion, at most {SMALL} rad with shape = {self.shape!r}; "
                "angle (in degrees) turns it before"
            )

    def motions(self, kind: Kind) -> list[object]:
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

    def _along(self, key: str, kind: Kind, *still: object) -> list[Any]:
        """The components of a vector, of which those across an axis of revolution are 0."""
        value = getattr(self, key)
        if kind.across and not isinstance(value, tuple):
            return [0.0 if axis in kind.across else value for axis in range(kind.dim)]
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
        """How far components that are "hold" move from where they are, by `by`; errors as of
        `motions`."""
        return self._along("by", kind, 0.0) + [0.0] * len(kind.planes)
