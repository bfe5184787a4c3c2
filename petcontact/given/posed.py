"""A problem as it is solved: numbers, arrays and functions of the place, no texts of the config."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from ..geometry.rotation import Motions
from ..geometry.surface import Boundary
from ..record import record
from ..round_off import ROUNDED
from .body_data import Body
from .interface_data import PosedInterface
from .tables.solver_options import Bem, Method


@record
class Step:
    """One load step.

    Attributes
    ----------
    name : str
    increments : int or "auto"
    is_divided : bool
        Whether the config names the increments.
    until : "sliding", optional
        What ends it before all its loads act: a whole contact slips.
    """

    name: str = ""
    increments: int | Literal["auto"] = 1
    is_divided: bool = False
    until: str | None = None


HOLD = "hold"
"""Word for a component that stays where the step before has left it, or moves on from there."""
WHOLE_LOAD = Step("load")
"""The step of a problem that names none."""


@record
class Cycle:
    """Steps that are done again and again while contacts wear.

    Attributes
    ----------
    steps : range
        Numbers of the steps, from 1.
    count : int
        How often they are done.
    jump : int or "auto"
        Cycles that are taken at once.
    tolerance : float
        Largest change of p in a jump over p where the jump is "auto" [-].
    """

    steps: range
    count: int
    jump: int | Literal["auto"]
    tolerance: float


class Obstacle(Protocol):
    """A rigid body: its motions and loads, component by component."""

    @property
    def name(self) -> str:
        """Name of the obstacle."""
        ...

    def motions(self, kind: Motions) -> list[Any]:
        """Displacement and rotation by component, each a number, "free" or "hold"."""
        ...

    def moved_by(self, kind: Motions) -> list[float]:
        """How far components that are "hold" move from where the step before has left them."""
        ...

    def loads(self, kind: Motions) -> list[float]:
        """Force and moment by component."""
        ...

    def centre_in(self, d: int) -> list[float]:
        """Centre of rotation in d dimensions [length]."""
        ...


@dataclass(frozen=True, eq=False)
class Posed:
    """A problem without its config. Its meshes come later.

    Attributes
    ----------
    kind : {"elastic", "bilateral", "contact"}
        What a solve looks for, see `Problem.kind`.
    axial, twisted : bool
        Whether bodies are those of revolution, and whether they turn about their axis.
    bodies : tuple of Body
    interfaces : tuple of PosedInterface
        Contact conditions, then contact pairs.
    obstacles_at : tuple of tuples of Obstacle
        Before the first step, and at the end of each.
    steps : tuple of Step
        None where the loads are applied at once.
    cycle : Cycle, optional
    method : Method
    bem : Bem
    petsc : mapping
        PETSc options.
    outline_of : callable
        Function from the number of a body to its outline or surface.
    """

    kind: Literal["elastic", "bilateral", "contact"]
    axial: bool
    twisted: bool
    bodies: tuple[Body, ...]
    interfaces: tuple[PosedInterface, ...]
    obstacles_at: tuple[tuple[Obstacle, ...], ...]
    steps: tuple[Step, ...]
    cycle: Cycle | None
    method: Method
    bem: Bem
    petsc: Mapping[str, str | int | float | bool]
    outline_of: Callable[[int], Boundary]

    @functools.cached_property
    def boundaries(self) -> list[Boundary]:
        """The outline or surface of each body."""
        return [self.outline_of(body.number) for body in self.bodies]

    @property
    def idle_traction(self) -> float:
        """The traction up to which what touches carries nothing, the round-off of a strain
        [stress]."""
        return ROUNDED * min(body.material.young_modulus for body in self.bodies)

    def softness(self, side: PosedInterface) -> float:
        """Return 1/E* of the bodies that meet at an interface [1/stress]."""
        materials = [self.bodies[number].material for number in side.bodies]
        return sum(0.5 * (1.0 - m.plane_strain_ratio) / m.shear_modulus for m in materials)

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The obstacles before the first step."""
        return self.obstacles_at[0]

    @property
    def cycle_steps(self) -> range:
        """Numbers of the steps of the cycle, from 1; none without a cycle."""
        return range(0) if self.cycle is None else self.cycle.steps

    @property
    def holds_normals(self) -> bool:
        """Whether all normal displacements of contact are data of the bodies."""
        return all(interface.holds_normal for interface in self.interfaces)
