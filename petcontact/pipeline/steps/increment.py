"""One increment of a load step: its contact problem, its solution, and the state after it."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array
from ...compliance.interface import Interface
from ...contact.criterion import Criterion, displaced_by
from ...contact.idle_bodies import amplitudes, with_least_motion
from ...contact.iteration import Iteration
from ...contact.law_protocol import ContactLaw
from ...contact.state import ContactState, Start
from ...contact.system import ContactSystem, Modes
from ...errors import SolverError
from ...given.posed import Step
from ...results.records import shares_of_states, weights_of
from ...round_off import CHAINED, ROUNDED, SUMMED, WRITTEN, of_vectors
from ...runtime.ranks import agreed_reason
from ..judge.increments import BLOCKS
from .prepared import IncrementState, ObstacleMotion, PreparedProblem

Monitor = Callable[[ContactState], str | None]
"""A function that is called with the state after each iteration. If it returns a reason, the solve
ends."""


@dataclass
class Increment:
    """The contact problem at a load factor of a step, from the state after the increment before.

    Attributes
    ----------
    problem : PreparedProblem
    step : Step
    number : int
        Of the step, from 1.
    obstacles : list of ObstacleMotion
    before : IncrementState
    target : float
        Load factor in (0, 1].
    begun : float
        Load factor of the state before.
    origin : float, optional
        Number of the step at whose end this one begins, if that is not the one before; 1.4 where
        0.4 of the second step was reached.
    cycle : int
        Number of cycles done at its end; 0 outside of cycles.
    layer : (M,) array, optional
        Wear of the increment: the gap opens by `layer` times p, beyond the depth worn before
        [length/stress].
    sliding : str
        Name of the contact that slips as a whole at its end, which ends the step.
    """

    problem: PreparedProblem
    step: Step
    number: int
    obstacles: list[ObstacleMotion]
    before: IncrementState
    target: float
    begun: float = 0.0
    origin: float | None = None
    cycle: int = 0
    layer: Array | None = None
    sliding: str = ""

    @property
    def ends(self) -> bool:
        """Whether the step ends with it."""
        return self.target == 1.0 or bool(self.sliding)

    def ending_at(self, target: float) -> Increment:
        """Return the increment from the same state to another load factor of the step."""
        return replace(self, target=target)

    def then(self, target: float, before: IncrementState) -> Increment:
        """Return the increment that follows this one."""
        return replace(self, target=target, before=before, begun=self.target)

    @property
    def name(self) -> str:
        """Name of the load step."""
        return self.step.name or f"step {self.number}"

    @functools.cached_property
    def shares(self) -> Array:
        """Weights of the load states, (K,)."""
        shares = shares_of_states(self.number, self.target, self.origin)
        return weights_of(shares, len(self.problem.system.base))

    @functools.cached_property
    def law(self) -> ContactLaw:
        """The law at this load factor."""
        return self.problem.discrete.laws.at(self.shares)

    @functools.cached_property
    def system(self) -> ContactSystem:
        """v = u_0 + S σ + M α, E σ + f = 0 with the slip since the increment before, and the
        gap."""
        system, d = self.problem.system, self.problem.system.components
        base, modes, balance = self.shares @ system.base, [system.modes], [system.balance]
        resultant = [self.shares @ system.resultant]
        for motion, mode in zip(self.obstacles, system.obstacle_modes, strict=True):
            position, load = motion.position_and_load(self.target)
            base += mode[:, ~motion.free] @ position[~motion.free]
            modes.append(mode[:, motion.free])
            balance.append(system.weighted(mode)[motion.free])
            resultant.append(load[motion.free])
        u_0 = base.reshape(-1, system.k)
        shift = np.zeros_like(u_0)
        shift[:, : d - 1] = -self.before.slip
        if system.k == d:
            shift[:, -1] = -np.where(np.isfinite(system.gap), system.gap, 0.0) - self.before.worn
        moved, load = np.concatenate(modes, axis=1), np.concatenate(resultant)
        rigid = Modes(
            moved.reshape(*u_0.shape, len(load)),
            np.concatenate(balance).reshape(len(load), *u_0.shape),
            load,
        )
        size = (np.abs(u_0) + np.abs(shift)).max(axis=1, keepdims=True, initial=0.0)
        together = np.where(np.abs(u_0 + shift) > ROUNDED * size, u_0 + shift, 0.0)
        return system.increment_system(
            together, self.problem.resisted(rigid, self.law), self.shares, self.layer
        )

    def solved(self, monitor: Monitor | None = None) -> ContactState:
        """Return the outcome of the method; if a linear solve fails, the last iterate.

        Raises
        ------
        SolverError
            If there is no iterate to keep.
        """
        posed, last = self.problem.discrete.posed, list[ContactState]()
        where = (
            f"step {self.number} ({self.name}), load factor {self.target:.4g}"
            if posed.steps
            else ""
        )
        where += f", cycle {self.cycle}" if self.cycle > 1 else ""

        def keep(state: ContactState) -> str | None:
            last[:] = [state]
            state.where = where
            return agreed_reason(monitor(state) if monitor is not None else None)

        start = self._start()
        if start is None and posed.method.start == "frictionless":
            start = self.system.u_0, np.zeros_like(self.system.u_0)
        iteration = Iteration(
            Criterion(posed.method.tolerance, posed.method.stop),
            posed.method.max_iterations,
            start,
            keep,
            self.before.rho,
            self.problem.system.slices,
            self.problem.block_factors,
        )
        try:
            return self._with_least_motion(
                self._without_round_off(self.problem.method(self.system, self.law, iteration))
            )
        except SolverError as error:
            if not last:
                raise
            return replace(last[0], reason=str(error), converged=False, stopped=True, error=True)

    def _without_round_off(self, outcome: ContactState) -> ContactState:
        """Return the outcome with tractions and overlaps set to zero where they are round-off.

        Examples are pairs without a load, as at a ball that no race loads, and bodies that only
        move as rigid ones.
        """
        acted, left = (
            float(np.abs(sigma).max(initial=0.0)) for sigma in (self.before.sigma, outcome.sigma)
        )
        over, share = (
            (self.before, CHAINED) if (gone := left < CHAINED * acted) else (outcome, ROUNDED)
        )
        sigma, v, least = outcome.sigma.copy(), outcome.v.copy(), share * max(acted, left)
        pairs = self.problem.system.slices if outcome.converged else []
        strained = displaced_by(self.system, v, sigma, pairs)
        noise = of_vectors(v, self.system.u_0, share=SUMMED)
        for where in pairs:
            pressed = noise[where][sigma[where].any(axis=1)]
            if np.abs(strained[where]).max(initial=0.0) < pressed.max(initial=0.0):
                sigma[where] = 0.0
            if np.abs(sigma[where]).max(initial=0.0) < least and (gone or sigma[where].any()):
                still = np.abs(v[where]) < CHAINED * np.abs(self.system.apply(over.sigma)).max()
                sigma[where], v[where] = 0.0, np.where(still, 0.0, v[where])
        return replace(outcome, sigma=sigma, v=v)

    def _with_least_motion(self, outcome: ContactState) -> ContactState:
        """Return the outcome with bodies that carry nothing as near as may be to where they began
        the increment."""
        began = [self.before.alpha]
        began += [x[m.free] for x, m in zip(self.before.positions, self.obstacles, strict=True)]
        return with_least_motion(self.system, self.law, outcome, np.concatenate(began))

    def _start(self) -> Start | None:
        """Return the start of the method: the same increment of another path or mesh, else the
        state before, extrapolated by the trend of the step."""
        if (key := (self.number, self.cycle, self.target)) in self.problem.starts:
            return self.problem.starts[key]()
        start, trend, way = self.before.start, self.before.trend, self.target - self.begun
        if start is None or trend is None or self.begun == 0.0:
            return start
        return start[0] + way * trend[0], start[1] + way * trend[1]

    def after(self, outcome: ContactState) -> IncrementState:
        """Return the state after this increment."""
        system, before = self.problem.system, self.before
        free_of_bodies, free_of_obstacles = np.split(
            amplitudes(self.system, outcome), [system.modes.shape[1]]
        )
        positions, loads = self._obstacles_after(outcome, free_of_obstacles)
        slip = before.slip + outcome.v[:, : system.components - 1]
        worn = (
            before.worn
            if self.layer is None
            else before.worn + self.layer * np.maximum(-outcome.sigma[:, -1], 0.0)
        )
        end, trend = (outcome.v, outcome.sigma), None
        if before.start is not None:
            velocity, rate = [
                (now - old) / (self.target - self.begun)
                for now, old in zip(end, before.start, strict=True)
            ]
            velocity[:, : system.components - 1], trend = 0.0, (velocity, rate)
        return IncrementState(
            slip,
            end,
            free_of_bodies,
            positions,
            loads,
            outcome.sigma,
            worn,
            outcome.states_from(
                before.states,
                before.sigma,
                before.slip,
                max(
                    WRITTEN,
                    BLOCKS * outcome.history.left(self.problem.discrete.posed.method.tolerance),
                    *(BLOCKS * body.tolerance for body in system.bodies),
                ),
            ),
            trend,
            float(np.max(outcome.rho)),
        )

    def _obstacles_after(self, outcome: ContactState, free: Array) -> tuple[Array, Array]:
        """Return positions and loads (o, q) of the obstacles, from the amplitudes of their free
        motions."""
        system, taken = self.problem.system, 0
        positions, loads = self.before.positions.copy(), self.before.loads.copy()
        for k, motion in enumerate(self.obstacles):
            positions[k], load = motion.position_and_load(self.target)
            count = int(motion.free.sum())
            positions[k][motion.free] = free[taken : taken + count]
            taken += count
            feels = system.weighted(system.obstacle_modes[k]) @ outcome.sigma.ravel()
            loads[k] = np.where(motion.free, load, -feels)
        return positions, loads


def given_overlap(face: Interface, shares: Array) -> float:
    """Return the largest overlap that is given to an interface, beside that of its preload, at
    weights of the load states (K,) [length]."""
    return 0.0 if face.overlap is None else float((shares @ face.overlap).max(initial=-np.inf))
