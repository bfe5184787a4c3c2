"""Rigid bodies without a mesh, and the components of what moves and loads them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

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
    SpacePoint,
    Vector,
)
from ..given.tables.points import Columns, Rows

if TYPE_CHECKING:
    from ..given.shapes import Aimed


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

    One number stands for every component where it is 0 or "free".

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
        Displacement of the centre [length].
    rotation : number or "free", in 3D one about each of x, y, z
        About the centre, counter-clockwise, small [rad].
    centre : point
        Point about which it turns, and the centre of a circle or a sphere [length].
    force : a number a component
        Force from outside on components that are free [force/length, in 3D force].
    moment : number, in 3D one about each of x, y, z
        Moment from outside about the centre, where the rotation is free [force, in 3D force ·
        length].
    shape : {"circle", "plane", "sphere", "cylinder", "polygon", "box", "points"}, optional
        With a shape, the gap of unilateral contact is by default the distance to it along the
        contact's direction. It is infinite where the ray misses. A circle is of the plane and of
        axial problems, a sphere of axial problems and of space, a cylinder of space.
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
        SpacePoint | None, pydantic.Field(default=None, kw_only=True)
    ]
    to: SpacePoint | None = pydantic.Field(default=None, kw_only=True)
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
        from .tools import check_keys

        check_keys(self)
        return self

    def aimed(self, direction: tuple[float, ...] | None, *, axial: bool) -> Aimed:
        """The shape as rays along a unit vector, or along outward normals, meet it.

        Raises
        ------
        InputError
            If the problem has no such shape, or it is not one of revolution in an axial problem.
        """
        assert self.shape is not None
        from ..given.shapes import Aimed
        from .tools import shape_of

        return Aimed(self.name, self.shape, shape_of(self, axial), direction, self.hollow)

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
