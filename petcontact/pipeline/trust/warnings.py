"""What is said of a solution that is accepted: motions that are not small, loads that do nothing, pairs that stay jammed."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ...contact.laws import OPEN
from ...geometry.rotation import rigid_motions
from ...results.steps.solution import StepResult
from ..assemble import Discrete
from ..increment import SteppedProblem, changed

JAM = 1e-3
"""Pressure, over the largest that there was, that stays where nothing jams."""
TURN, TRAVEL = 0.1, 1.0
"""Rotation [rad], and displacement over the size of the body, beyond which displacements are not small."""
UNEVEN = 0.02
"""Resultant of the tractions of a body over the sum of their sizes that is warned of, see `increments.EQUILIBRIUM`."""


def warnings_of(problem: SteppedProblem, results: list[StepResult]) -> list[str]:
    """Warnings of the increments of a problem, the worst of each kind."""
    return [*_ignored(problem), *_jammed(problem, results), *_large(problem.discrete, results)]


def _large(discrete: Discrete, results: Sequence[StepResult]) -> list[str]:
    """What is said of motions that the theory of small displacements does not allow, and of tractions without equilibrium."""
    turned, moved, slid = dict[str, float](), dict[str, float](), dict[str, float]()
    for result in results:
        for mesh, name in zip(discrete.meshes, (body.name for body in discrete.assembly.body), strict=True):
            body = result.bodies[name]
            away = mesh.x - mesh.weight @ mesh.x / mesh.weight.sum()
            size = float(np.abs(away).max())
            motions = rigid_motions(away / size).reshape(mesh.x.size, -1)
            rotation = np.linalg.lstsq(motions, body.u.ravel(), rcond=None)[0][mesh.dim :] / size
            _raise(turned, f"body {name!r}", np.abs(rotation).max())
            _raise(moved, f"body {name!r}", np.abs(body.u).max() / (2.0 * size))
        for name, obstacle in result.obstacles.items():
            _raise(turned, f"obstacle {name!r}", np.abs(obstacle.rotation).max())
        for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
            mesh, pair = discrete.meshes[side.body], result.pairs[side.name]
            area = np.bincount(mesh.element, mesh.weight)[mesh.element[interface.nodes]]
            way = np.linalg.norm(pair.slip, axis=1) * (pair.state != OPEN)
            # elements that are graded to nothing say nothing of what the surface is like further on
            _raise(slid, f"pair {side.name!r}", way.max(initial=0.0) / area.max() ** (1.0 / (mesh.dim - 1)))
    small = "; displacements are taken to be small"
    uneven = max((float(np.nan_to_num(result.residuals["equilibrium"])) for result in results), default=0.0)
    return [
        *[f"tractions are in equilibrium to {uneven:.1e} only; choose smaller elements"] * (uneven > UNEVEN),
        *(f"{name} turns by {value:.2g} rad{small}" for name, value in turned.items() if value > TURN),
        *(f"{name} moves by {value:.2g} times its size{small}" for name, value in moved.items() if value > TRAVEL),
        *(f"{name} slips by {value:.2g} elements{small}" for name, value in slid.items() if value > 1.0),
    ]


def _raise(largest: dict[str, float], key: str, value: float) -> None:
    largest[key] = max(largest.get(key, 0.0), float(value))


def _ignored(problem: SteppedProblem) -> list[str]:
    """What is said of obstacles that touch nothing, and of their loads on components whose motion is given."""
    discrete, d, told = problem.discrete, problem.system.dim, []
    for k, obstacle in enumerate(discrete.assembly.obstacle):
        if all(side.obstacle != k for side in discrete.sides):
            told.append(f"obstacle {obstacle.name!r} is in no contact")
        states = itertools.accumulate(problem.steps, changed, initial=obstacle)
        if any(load and motion != "free" for o in states for motion, load in zip(o.motions(d), o.loads(d), strict=True)):
            told.append(f"obstacle {obstacle.name!r}: a force or moment on a component whose motion is given does nothing")
    return told


def _jammed(problem: SteppedProblem, results: list[StepResult]) -> list[str]:
    """What is said of pairs that stay pressed at the end of a step that took all loads away, though no gap is negative."""
    discrete, d, told = problem.discrete, problem.system.dim, []
    obstacles = list(discrete.assembly.obstacle)
    for number, step in enumerate(problem.steps, 1):
        obstacles = [changed(o, step) for o in obstacles]
        loaded = any(loading.value[number].any() or loading.force[number].any() for loading in discrete.loadings)
        given = (motion if motion != "free" else load for o in obstacles
                 for motion, load in zip(o.motions(d), o.loads(d), strict=True))  # fmt: skip
        ends = [r for r in results if r.step == number and r.load_factor == 1.0]
        if loaded or any(given) or not ends:
            continue
        for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
            pressed = max(float(r.pairs[side.name].pressure.max(initial=0.0)) for r in results)
            left = float(ends[0].pairs[side.name].pressure.max(initial=0.0))
            if interface.gap.min(initial=np.inf) >= 0.0 and left > JAM * pressed:
                told.append(f"pair {side.name!r} stays pressed after step {step.name!r} took all loads away: it jams, and "
                            "what stays depends on the path; unload in several increments")  # fmt: skip
    return told
