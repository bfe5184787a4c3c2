"""The state that an increment has left, from its result: where the next increment starts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...geometry.rotation import Axial, Motions
from ...results.records import StepResult, weights_of
from .increment import given_overlap
from .prepared import IncrementState, PreparedProblem


def state_after(problem: PreparedProblem, done: list[StepResult]) -> IncrementState:
    """Return the state after the last increment, or the unloaded state if there is none."""
    system, begun = problem.system, problem.begun()
    if not done:
        return begun
    pairs = [done[-1].pairs[face.name] for face in system.interfaces]

    def of_nodes(key: str, like: Array) -> Array:
        # where nothing is in contact there is no pair
        return np.concatenate([like[:0], *(getattr(pair, key) for pair in pairs)])

    slip, v, sigma = (of_nodes(key, begun.slip) for key in ("slip", "slip_increment", "sigma_t"))
    if system.k == system.components:
        gap = of_nodes("gap", begun.worn)
        v = np.column_stack([v, -np.where(np.isfinite(gap), gap, 0.0)])
        sigma = np.column_stack([sigma, -of_nodes("pressure", begun.worn)])
    positions, loads = _places(problem, done[-1])
    worn = [np.zeros(len(pair.x)) if pair.wear is None else pair.wear.sum(axis=1) for pair in pairs]
    return IncrementState(
        slip,
        (v, sigma),
        done[-1].alpha,
        positions,
        loads,
        sigma,
        np.concatenate([begun.worn[:0], *worn]),
        np.concatenate([begun.states[:0], *(pair.state for pair in pairs)]),
    )


def _places(problem: PreparedProblem, done: StepResult) -> tuple[Array, Array]:
    """Return positions and loads (o, q) of the obstacles, then overlaps and forces of preloads."""
    motions = problem.system.motions
    poses = [done.obstacles[o.name] for o in problem.discrete.posed.obstacles]
    pressed = np.array([_preload(problem, done, side.name) for side in problem.preloaded])
    ends = np.zeros((2, len(pressed), motions.components))
    ends[:, :, 0] = pressed.reshape(-1, 2).T
    return (
        np.vstack([_each([(p.displacement, p.rotation) for p in poses], motions), ends[0]]),
        np.vstack([_each([(p.force, p.moment) for p in poses], motions), ends[1]]),
    )


def _preload(problem: PreparedProblem, done: StepResult, name: str) -> tuple[float, float]:
    """Return the overlap that the preload of an interface has brought about, and the force."""
    face = next(face for face in problem.system.interfaces if face.name == name)
    pair, shares = done.pairs[name], weights_of(done.shares, len(problem.system.base))
    return pair.overlap - given_overlap(face, shares), float(pair.weight @ pair.pressure)


def _each(vectors: Sequence[tuple[Array, Axial]], motions: Motions) -> Array:
    """Return the components (o, q) of the vectors and axial vectors of obstacles."""
    rows = [np.hstack(pair)[: motions.components] for pair in vectors]
    return np.array(rows).reshape(len(rows), motions.components)
