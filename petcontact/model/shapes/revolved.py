"""Bodies of revolution that a config may name."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
import pydantic

from ...geometry.outline import Outline, oriented
from ...geometry.revolved.turned_surface import RevolvedSurface
from ...given.tables.base import Direction, Shape, SpacePoint
from .plane import Circle, OutlineSide, loops_of

Degrees = Annotated[float, pydantic.Field(strict=True, gt=0.0, le=360.0)]


class Revolved(Shape):
    """A plane section, turned about an axis: curved panels, in parts named like the sides of the
    section.

    The section is given in (r, z), r >= 0 away from the axis and z along it, by loops as those of
    `shape = "outline"`. Where the body is solid on the axis, a side lies on it, whose name says
    nothing. A body turned by less than a full circle has two plane faces more, the parts start and
    end; it begins in the half plane through the axis and x (y where the axis is along x), and is
    turned right-handed about the axis.

    In a config::

        [geometry]
        shape = "revolved"
        loops = [{ part = "ring", center = [5.0, 0.0], radius = 1.0 }]

    Attributes
    ----------
    shape : "revolved", in 3D
        The shape.
    loops : list of loops
        A loop is a list of sides, the first of which starts where the last one ends, or a circle.
    angle : float
        Angle by which the section is turned, up to 360 [degrees].
    centre : point with three coordinates
        Where r = 0 and z = 0 [length].
    axis : vector
        Direction of z [-].
    """

    shape: Literal["revolved"] = pydantic.Field(default="revolved", kw_only=True)
    loops: tuple[tuple[OutlineSide, ...] | Circle, ...] = pydantic.Field(min_length=1)
    angle: Degrees = 360.0
    centre: SpacePoint = (0.0, 0.0, 0.0)
    axis: Direction = (0.0, 0.0, 1.0)

    def outline(self) -> RevolvedSurface:
        """The surface.

        Raises
        ------
        InputError
            If an arc does not exist, sides have no length, cross or touch, or the section passes
            the axis.
        """
        along = np.array(self.axis) / np.linalg.norm(self.axis)
        start = np.eye(3)[1 if along[1] == along[2] == 0.0 else 0]
        start = start - (start @ along) * along
        start /= np.linalg.norm(start)
        frame = np.array([start, np.cross(along, start), along])
        section = Outline(oriented(loops_of(self.loops, True)))
        return RevolvedSurface(section, np.array(self.centre), frame, math.radians(self.angle))
