"""Solids that a config may name: boxes, spheres, cylinders and bodies of revolution."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pydantic

from ...errors import InputError
from ...geometry.round_surfaces import CylinderSurface, SphereSurface
from ...geometry.surface import BoxSurface
from ...given.tables.base import Positive, Shape, SpacePoint
from .revolved import Revolved


class Box(Shape):
    """A box with edges along the axes; its faces are left x-, right x+, front y-, back y+, bottom
    z-, top z+.

    In a config::

        [geometry]
        shape = "box"
        lower = [0.0, 0.0, 0.0]
        upper = [2.0, 1.0, 1.0]

    Attributes
    ----------
    shape : "box", in 3D
        The shape.
    lower, upper : points with three coordinates
        Opposite corners [length].
    """

    shape: Literal["box"] = pydantic.Field(default="box", kw_only=True)
    lower: SpacePoint
    upper: SpacePoint

    @pydantic.model_validator(mode="after")
    def _has_volume(self) -> Box:
        if not all(a < b for a, b in zip(self.lower, self.upper, strict=True)):
            raise InputError("each coordinate of upper must be greater than that of lower")
        return self

    def outline(self) -> BoxSurface:
        """The six faces."""
        return BoxSurface(np.array(self.lower), np.array(self.upper))


class Sphere(Shape):
    """A ball of curved panels, in parts left x-, right x+, front y-, back y+, bottom z-, top z+.

    A part is where the direction from the centre is nearest to that axis.

    In a config::

        [geometry]
        shape = "sphere"
        centre = [0.0, 0.0, 1.0]
        radius = 1.0

    Attributes
    ----------
    shape : "sphere", in 3D
        The shape.
    centre : point with three coordinates
        Centre of the ball [length].
    radius : float
        Radius of the ball [length].
    """

    shape: Literal["sphere"] = pydantic.Field(default="sphere", kw_only=True)
    centre: SpacePoint
    radius: Positive

    def outline(self) -> SphereSurface:
        """The surface."""
        return SphereSurface(np.array(self.centre), self.radius)


class Cylinder(Shape):
    """A cylinder of curved panels, its discs named bottom and top, its side side.

    In a config::

        [geometry]
        shape = "cylinder"
        from = [0.0, 0.0, 0.0]
        to = [0.0, 0.0, 2.0]
        radius = 1.0

    Attributes
    ----------
    shape : "cylinder", in 3D
        The shape.
    from : point with three coordinates
        Centre of the disc bottom [length].
    to : point with three coordinates
        Centre of the disc top [length].
    radius : float
        Radius of the cylinder [length].
    """

    shape: Literal["cylinder"] = pydantic.Field(default="cylinder", kw_only=True)
    __annotations__["from"] = SpacePoint  # a word of Python's own
    to: SpacePoint
    radius: Positive

    @pydantic.model_validator(mode="after")
    def _has_a_height(self) -> Cylinder:
        if getattr(self, "from") == self.to:
            raise InputError("from and to are the same point: a cylinder has a height")
        return self

    def outline(self) -> CylinderSurface:
        """The surface."""
        return CylinderSurface(np.array(getattr(self, "from")), np.array(self.to), self.radius)


Solid = Box | Sphere | Cylinder | Revolved
