"""Bodies: their material, and what is given on their parts and inside them in every step."""

from __future__ import annotations

from dataclasses import dataclass

from ..record import record
from .conditions import Condition, Displacement, Symmetry
from .tables.material import Material
from .tables.solver_options import MeshOptions
from .values import Given, Number

NO_RISE = Number("loads.temperature", 0.0)
"""The temperature of a body that nothing heats."""


@record
class PointForce:
    """A force [force/length, in space force] at a point inside a body [length]."""

    at: tuple[float, ...]
    force: tuple[float, ...]


@record
class Loads:
    """Loads of the volume of a body.

    Attributes
    ----------
    acceleration : tuple of Given
        Force per volume over the density, by component [length/time²]; empty without.
    force : tuple of Given
        Force per volume, by component [force/volume]; empty without.
    temperature : Given
        Rise over the state without stress [temperature].
    angular_velocity : float
        [1/time]
    centre : tuple of float, optional
        A point on the axis of rotation [length].
    axis : tuple of float, optional
        Direction of the axis in space.
    """

    acceleration: tuple[Given, ...] = ()
    force: tuple[Given, ...] = ()
    temperature: Given = NO_RISE
    angular_velocity: float = 0.0
    centre: tuple[float, ...] | None = None
    axis: tuple[float, ...] | None = None

    @property
    def is_none(self) -> bool:
        """Whether no load is given."""
        data = (*self.acceleration, *self.force, self.temperature)
        return self.angular_velocity == 0.0 and all(datum.is_zero for datum in data)

    @property
    def vectors(self) -> dict[str, tuple[Given | float, ...]]:
        """What has as many components as the body has dimensions, where it is given."""
        given = {
            "acceleration": self.acceleration,
            "force": self.force,
            "centre": self.centre,
            "axis": self.axis,
        }
        return {key: vector for key, vector in given.items() if vector}


@dataclass(frozen=True, eq=False)
class Body:
    """An elastic body, and what acts on it at the end of each step; there is at least one step.

    Attributes
    ----------
    number : int
    name : str
    material : Material
    mesh : MeshOptions
    has_inside : bool
        Whether its inside is known: not that of a superelement.
    boundary : tuple of Condition
        Conditions at the beginning; contact is among them.
    volume : Loads
        Loads of its volume at the beginning.
    conditions : list of dict
        Conditions by part at the end of each step, without contact. A condition that a step leaves
        alone stays the same object.
    loads : list of Loads
        Loads of its volume at the end of each step.
    forces : list of lists of PointForce
        Forces at points inside at the end of each step; the points stay the same.
    """

    number: int
    name: str
    material: Material
    mesh: MeshOptions
    has_inside: bool
    boundary: tuple[Condition, ...]
    volume: Loads
    conditions: list[dict[str, Condition]]
    loads: list[Loads]
    forces: list[list[PointForce]]

    @property
    def mirrors(self) -> list[str]:
        """Parts beyond which it may go on with its image: those in planes of symmetry, and those
        with one component held, as on rollers."""
        return [
            part
            for part, condition in self.conditions[0].items()
            if isinstance(condition, Symmetry)
            or (isinstance(condition, Displacement) and condition.free.count(False) == 1)
        ]

    @property
    def points(self) -> list[tuple[float, ...]]:
        """Where point forces act [length]."""
        return [force.at for force in self.forces[0]]

    def loads_volume_as(self, other: Body) -> bool:
        """Whether material and volume loads are those of another body."""
        return self.material == other.material and self.loads == other.loads
