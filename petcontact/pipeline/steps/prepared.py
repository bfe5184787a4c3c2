"""A problem whose bodies are eliminated, and the state that each of its increments leaves."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...arrays import Array, Mask, States
from ...compliance.reduced_bodies import BodiesSystem
from ...contact.active_set.block_factors import BlockFactors
from ...contact.iteration import ContactMethod
from ...contact.law_protocol import OPEN, ContactLaw
from ...contact.methods.starts import stuck_everywhere
from ...contact.state import Start
from ...contact.system import Modes
from ...geometry.rotation import Motions
from ...given.interface_data import Law, PosedInterface
from ...given.posed import HOLD, WHOLE_LOAD, Obstacle, Step
from ...untyped import Comm
from ..judge.between_nodes import Sampling, places_between
from ..pose.discretise import Discrete
from .traction_errors import TractionErrors, traction_errors

HALVINGS = 8
"""How often an increment that fails is halved."""


@dataclass
class ObstacleMotion:
    """The q motions of one obstacle in a step, each of them given, or free under a load; or the
    overlap of a preloaded interface, as the first of them.

    Attributes
    ----------
    free : (q,) bool array
    position, load : (2, q) arrays
        At the start and the end of the step: displacement and rotation where given, force and
        moment where free.
    """

    free: Mask
    position: Array
    load: Array

    @classmethod
    def from_obstacle(
        cls, obstacle: Obstacle, state: IncrementState, number: int, motions: Motions
    ) -> ObstacleMotion:
        """Return the motion from the state of an obstacle to what the step asks for."""
        wanted, load = obstacle.motions(motions), np.array(obstacle.loads(motions))
        free = np.array([value == "free" for value in wanted])
        start, by = state.positions[number], obstacle.moved_by(motions)
        end = np.array(
            [
                old + way if value == HOLD else 0.0 if value == "free" else float(value)
                for value, old, way in zip(wanted, start, by, strict=True)
            ]
        )
        return cls(free, np.array([start, end]), np.array([state.loads[number], load]))

    @classmethod
    def from_law(cls, law: Law, state: IncrementState, number: int) -> ObstacleMotion:
        """Return the change of the overlap of an interface: free under a preload, else locked."""
        start, load = state.positions[number], state.loads[number]
        free = np.zeros(len(start), dtype=bool)
        force = np.zeros(len(start))
        if isinstance(law.preload, float):
            free[0], force[0] = True, law.preload * (-1.0 if law.normal == "bonded" else 1.0)
        return cls(free, np.array([start, start]), np.array([load, force]))

    def position_and_load(self, factor: float) -> tuple[Array, ...]:
        """Return position and load at a load factor of the step."""
        return tuple(
            (1.0 - factor) * pair[0] + factor * pair[1] for pair in (self.position, self.load)
        )


@dataclass
class IncrementState:
    """The state after an increment, from which the next one starts.

    Attributes
    ----------
    slip : (M, d-1) array
        w [length].
    start : pair of (M, k) arrays, optional
        v and σ; the tangential part of v is the slip of the last increment.
    alpha : (r,) array
        Motions of the bodies.
    positions, loads : (o, q) arrays
        Positions of the obstacles, and the loads on them from outside.
    sigma : (M, k) array
        σ [stress].
    worn : (M,) array
        Worn depth of both sides together [length].
    states : (M,) array
        0 stick, 1 slip, 2 open.
    trend : pair of (M, k) arrays, optional
        Change of v and σ over the change of the load factor; of v only the normal component is not
        zero.
    rho : float, optional
        Last ρ of the method [stress/length].
    """

    slip: Array
    start: Start | None
    alpha: Array
    positions: Array
    loads: Array
    sigma: Array
    worn: Array
    states: States
    trend: Start | None = None
    rho: float | None = None


@dataclass
class PreparedProblem:
    """A problem whose bodies are eliminated; its steps can be solved any number of times.

    Attributes
    ----------
    discrete : Discrete
    system : BodiesSystem
    method : ContactMethod
    comm : PETSc.Comm
    timings : dict of str to float
        Seconds by stage.
    start : pair of (M, k) arrays, optional
        Where the first increment starts.
    starts : dict of (int, int, float) to callable
        Returns where an increment starts that another path or mesh has, by step, cycle and load
        factor.
    factors : dict of int to list of float
        Load factors at which increments are to end, by number of the step; key 0 has the cycles at
        which jumps end.
    named : dict of str to str
        Names of the method and the rule, where they are not the problem's own.
    halvings : int
        How often an increment that fails is halved.
    needed : float
        Tolerance of compressed operators that is enough, where theirs is smaller [-].
    block_factors : BlockFactors
        Factors of the last active set, for the next increment.
    """

    discrete: Discrete
    system: BodiesSystem
    method: ContactMethod
    comm: Comm
    timings: dict[str, float] = field(default_factory=dict)
    start: Start | None = None
    starts: dict[tuple[int, int, float], Callable[[], Start]] = field(default_factory=dict)
    factors: dict[int, list[float]] = field(default_factory=dict)
    named: dict[str, str] = field(default_factory=dict)
    halvings: int = HALVINGS
    needed: float = 0.0
    block_factors: BlockFactors = field(default_factory=BlockFactors)

    @property
    def digits_lost(self) -> float:
        """The largest error of an elimination, see `ElasticBody.digits_lost`."""
        return max(
            (body.digits_lost for body in self.system.bodies if np.isfinite(body.digits_lost)),
            default=np.nan,
        )

    @functools.cached_property
    def normal_error(self) -> Array:
        """Angles between the normals of curved panels and those of the smooth surface, (M,) [rad].

        The second ones are used; their own error is smaller by an order.
        """
        meshes = self.discrete.meshes
        apart = [
            (meshes[i.body].smooth_normal - meshes[i.body].normal)[i.nodes]
            for i in self.discrete.interfaces
        ]
        return np.concatenate([np.zeros(0), *(np.linalg.norm(each, axis=1) for each in apart)])

    def resisted(self, modes: Modes, law: ContactLaw) -> Modes:
        """Return the modes without those that only errors of normals resist."""
        if not len(modes.load) or not self.normal_error.any():
            return modes
        stuck = law.linearise(stuck_everywhere(modes.motion[:, :, 0], law))
        return modes.beyond_errors(stuck, self.system.weight, self.normal_error)

    @functools.cached_property
    def places(self) -> list[Sampling | None]:
        """Places between the nodes of each contact."""
        discrete = self.discrete
        return [
            places_between(s, i, discrete.meshes)
            for s, i in zip(discrete.sides, discrete.interfaces, strict=True)
        ]

    @functools.cached_property
    def errors(self) -> list[TractionErrors]:
        """The estimators of the errors of tractions, one a contact."""
        return traction_errors(self.discrete)

    @functools.cached_property
    def contact_nodes(self) -> list[tuple[Array, Array, Array]]:
        """Points (m, d), weights (m,) and arc lengths (m,) of the nodes of each contact; arc
        lengths are 0 in space."""
        faces = zip(self.discrete.sides, self.discrete.interfaces, strict=True)
        on = [(self.discrete.meshes[side.body], face.nodes) for side, face in faces]
        return [(mesh.x[m], mesh.weight[m], mesh.sites(m).along) for mesh, m in on]

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps of the config; without any, one step to all loads."""
        return self.discrete.posed.steps or (WHOLE_LOAD,)

    @functools.cached_property
    def preloaded(self) -> list[PosedInterface]:
        """The interfaces whose overlap follows from a force, in some step."""
        return [side for side in self.discrete.sides if side.preloaded]

    def mover(self, name: str) -> int:
        """Return the number of a preloaded interface among the obstacles and these."""
        names = [side.name for side in self.preloaded]
        return len(self.discrete.posed.obstacles) + names.index(name)

    @property
    def movers(self) -> list[str]:
        """Names of what has motions of its own: obstacles, then preloaded interfaces."""
        obstacles = [f"obstacle {o.name!r}" for o in self.discrete.posed.obstacles]
        return obstacles + [f"the preload of {side.name!r}" for side in self.preloaded]

    def motions(self, number: int, state: IncrementState) -> list[ObstacleMotion]:
        """Return the motion of each obstacle, and the overlap of each preloaded interface, from its
        state to the end of step `number`."""
        kind, obstacles = self.system.motions, self.discrete.posed.obstacles_at[number]
        motions = [ObstacleMotion.from_obstacle(o, state, k, kind) for k, o in enumerate(obstacles)]
        return motions + [
            ObstacleMotion.from_law(side.laws[number], state, k)
            for k, side in enumerate(self.preloaded, len(motions))
        ]

    def begun(self) -> IncrementState:
        """Return the unloaded state, before the first increment."""
        system = self.system
        still = np.zeros((len(system.obstacle_modes), system.motions.components))
        slip = np.zeros((system.size, system.components - 1))
        alpha = np.zeros(system.modes.shape[1])
        return IncrementState(
            slip,
            self.start,
            alpha,
            still,
            still.copy(),
            np.zeros((system.size, system.k)),
            np.zeros(system.size),
            np.full(system.size, OPEN, np.int8),
        )

    def close(self) -> None:
        """Free every PETSc object."""
        self.block_factors.close()
        self.system.close()
