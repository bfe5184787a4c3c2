"""Loads inside a body: point forces; weight, rotation and temperature of its volume; and how load
steps change them."""

from __future__ import annotations

from typing import Annotated, Any

import pydantic

from ..errors import InputError, the_body
from ..given.tables.base import Coordinate, Direction, Expression, Finite, Model, Vector


def _in_volume(value: object) -> object:
    if isinstance(value, tuple):
        raise InputError("must be a number or an expression; a volume has no nodes")
    return value


Inside = Annotated[Expression, pydantic.AfterValidator(_in_volume)]
"""An expression in the coordinates, at all points of a body."""


class PointForce(Model):
    """A force at a point of the body [force/length of thickness, in 3D force].

    In a config::

        [[point_force]]
        name = "hook"
        at = [0.0, 1.0]
        force = [5.0, 0.0]

    Attributes
    ----------
    at : point
        Place of the force: inside the body, not on its boundary [length].
    force : (fx, fy), in 3D (fx, fy, fz)
        Force by component [force/length, in 3D force].
    name : str
        Name by which load steps change it.
    """

    at: Annotated[tuple[Coordinate, ...], Vector]
    force: Annotated[tuple[Finite, ...], Vector]
    name: str = ""


class VolumeLoads(Model):
    """Forces and temperature in a body; expressions are in x, y, in 3D x, y, z.

    In a config::

        [loads]
        acceleration = [0.0, -9810.0]
        temperature = "80 + 20*x/50"

    Attributes
    ----------
    acceleration : a number or an expression a component, optional
        Force per volume over the density, that of gravity for example [length/time²].
    force : a number or an expression a component, optional
        Force per volume [force/volume].
    angular_velocity : float
        ω of a rotation whose centrifugal force, density·ω²·distance, acts [1/time].
    centre : point, optional
        A point on the axis of rotation; the origin by default [length].
    axis : vector, optional, in 3D
        Axis of rotation in 3D; along z by default [-].
    temperature : number or expression
        Rise of the temperature over the state without stress [temperature].
    """

    acceleration: Annotated[tuple[Inside, ...], Vector] | None = None
    force: Annotated[tuple[Inside, ...], Vector] | None = None
    angular_velocity: Finite = 0.0
    centre: Annotated[tuple[Coordinate, ...], Vector] | None = None
    axis: Direction | None = None
    temperature: Inside = 0.0

    @property
    def needs(self) -> list[tuple[str, str]]:
        """Keys of loads that are given, and the key of the material that each needs."""
        given = {
            "acceleration": any(component != 0.0 for component in self.acceleration or ()),
            "angular_velocity": self.angular_velocity != 0.0,
            "temperature": self.temperature != 0.0,
        }
        return [
            (key, "thermal_expansion" if key == "temperature" else "density")
            for key, is_given in given.items()
            if is_given
        ]


class LoadsChange(VolumeLoads):
    """New volume loads of a body; what is not named stays. Loads are reached linearly: of a
    rotation its force.

    In a config::

        [[step]]
        name = "spin"
        [[step.loads]]
        body = "hub"
        angular_velocity = 900.0

    Attributes
    ----------
    body : str, optional
        Name of the body; needed where there are several.
    """

    body: str | None = None


def check_material(key: str, body: Any, loads: VolumeLoads) -> None:
    """Whether the material has what loads need, other than 0.

    Raises
    ------
    ValueError
    """
    for load, needed in loads.needs:
        if getattr(body.material, needed) is None:
            raise InputError(f"{key}.{load}: the material of {the_body(body.name)} has no {needed}")
        if getattr(body.material, needed) == 0.0:
            raise InputError(
                f"{key}.{load}: does nothing, the {needed} of {the_body(body.name)} is 0"
            )


NO_LOADS = VolumeLoads.model_construct()
