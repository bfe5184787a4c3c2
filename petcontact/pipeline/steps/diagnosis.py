"""Why an increment failed, what nothing holds, and what else a user should hear of a solve."""

from __future__ import annotations

import itertools
import math

import numpy as np

from ...arrays import Array
from ...contact.criterion import equilibrium_defect
from ...contact.equilibrium import unbalanced_load
from ...contact.law_protocol import OPEN
from ...contact.state import ContactState
from ...geometry.superelement import CondensedSurface
from ...model.load_steps import changed_obstacle
from ...results.records import StepResult
from ..judge.warnings import unusual
from ..pose.discretise import Discrete
from .increment import Increment, PreparedProblem, amplitudes

MOTIONS = {
    2: ("along x", "along y", "to turn"),
    3: ("along x", "along y", "along z", "to turn about x", "to turn about y", "to turn about z"),
}
"""Of an obstacle, by the number of dimensions."""
JUMPS = (
    "; a friction_bound falls to 0 where contact opens: there may be no solution, give a "
    "friction_coefficient"
)
"""What is added where nothing else says why there is none."""
JAM = 1e-3
"""Pressure, over the largest that there was, that stays where nothing jams."""
IMBALANCE = 1e-3
"""Of a pair (`PairResult.imbalance`), that is reported."""
SAGGING, NEXT = 0.1, 2.0
"""Height of curved faces over facets, over what contact closes, that is reported; where gaps are so
many times that."""
FAR_OFF = 1e3
"""Rigid motions over what loads and tractions strain, from which on a body is not held."""
LOOSE, ROUGH, FOLLOWS = 1e-9, 5e-3, 0.1
"""How much contact resists a motion, over the one that it resists most, up to which it does not, or
by the error of its normals only; the latter is reported where such a motion is more than a share of
the others."""
FAR = 0.05
"""Initial gap or overlap, over the size of the body, that is reported."""


def is_unbalanced(increment: Increment) -> bool:
    """Whether no admissible traction holds the loads."""
    return unbalanced_load(increment.system.modes, increment.problem.discrete.law) is not None


def second_solution(increment: Increment, outcome: ContactState) -> list[str]:
    """What is yet to be reported where an increment with contact tractions is solved by none as
    well.

    σ = 0 is a solution where the loads alone close nothing. With friction that does not depend on
    pressure there is one solution; with Coulomb's law there may be others, where friction holds
    what would part (A. Klarbring, Examples of non-uniqueness and non-existence of solutions to
    quasistatic contact problems with friction, Ing.-Archiv 60 (1990) 529).
    """
    system, law = increment.system, increment.problem.discrete.law
    added, free = (
        np.abs(outcome.v - system.u_0).max(initial=0.0),
        np.abs(system.u_0).max(initial=0.0),
    )
    if not outcome.converged or system.modes is not None or added <= 1e-6 * free or free == 0.0:
        return []
    if law.project(outcome.rho * system.u_0).any():
        return []
    note = (
        f"step {increment.name!r}: surfaces that part everywhere are a solution, too: with "
        f"Coulomb's law there are two "
        'here; another start, as method.start = "frictionless", may find it'
    )
    return [note] * (note not in increment.problem.discrete.warnings)


def zero_energy_motions(increment: Increment, outcome: ContactState) -> list[str]:
    """What is yet to be reported of motions at the end of a step that closed and sticking nodes do
    not resist, or hardly."""
    problem, modes, law = increment.problem, increment.system.modes, increment.problem.discrete.law
    if modes is None or increment.target < 1.0 or not outcome.converged:
        return []
    # v alone may be what an iteration left of nothing
    moved = max(np.abs(outcome.v).max(initial=0.0), np.abs(increment.system.u_0).max(initial=0.0))
    size = np.abs(outcome.sigma).max(initial=0.0) / (moved or 1.0)
    derivative = law.linearise(size * outcome.v - outcome.sigma)
    resisted = np.einsum("iab,ibr->iar", derivative, modes.motion / modes.size).reshape(
        -1, len(modes.load)
    )
    values, vectors = np.linalg.svd(np.linalg.qr(resisted, mode="r"))[1:]
    values = np.append(values, np.zeros(len(vectors) - len(values))) / max(
        1.0, values.max(initial=0.0)
    )
    rough, found = (values > LOOSE) & (values <= ROUGH), list[str]()
    if rough.any():
        moving = np.abs(vectors @ (amplitudes(increment.system, outcome) * modes.size))
        rough &= moving > FOLLOWS * moving[values > ROUGH].max(initial=0.0)
    if rough.any():  # a ball in a cup turns by what the roughness of its panels makes of it
        found.append(
            f"contact resists {_named(increment, vectors[rough])} by the roughness of the mesh "
            f"only: what they "
            f"come to, up to {moving[rough].max():.2g}, means nothing; friction would hold them"
        )
    if (values <= LOOSE).any():
        found.append(
            f"nothing holds {_named(increment, vectors[values <= LOOSE])}; chosen as the least "
            f"there is"
        )
    notes = [f"step {increment.step.name or increment.number!r}: {text}" for text in found]
    return [note for note in notes if note not in problem.discrete.warnings]


def _named(increment: Increment, loose: Array) -> str:
    """Motions (q, r) of unit size, by the bodies and obstacles that move."""
    problem, system, share = (
        increment.problem,
        increment.problem.system,
        np.linalg.norm(loose, axis=0),
    )
    posed, owners = problem.discrete.problem, list[str]()
    for body, eliminated in zip(posed.body, system.bodies, strict=True):
        owners += [f"body {body.name!r}"] * eliminated.modes.shape[2]
    for obstacle, motion in zip(posed.obstacle, increment.obstacles, strict=True):
        owners += [f"obstacle {obstacle.name!r}"] * int(motion.free.sum())
    names = list(
        dict.fromkeys(owner for owner, part in zip(owners, share, strict=True) if part > 1e-6)
    )
    return f"{len(loose)} motion{'s' if len(loose) > 1 else ''} of {' and '.join(names)}"


def failure(increment: Increment, outcome: ContactState) -> str:
    """What a failed increment says: which body nothing holds, there or at the end of the step, or
    how the method ended."""
    problem, system = increment.problem, increment.system
    unsure = JUMPS if getattr(problem.discrete.law, "jumps", False) else ""
    stepped = problem.discrete.problem.step or increment.target < 1.0
    where = f" at load factor {increment.target:.4g}{_of_step(increment)}" if stepped else ""
    if text := unheld(increment, where):
        return text
    if text := unheld_at_the_end(increment):
        return f"{text}{unsure}"
    push = None
    defect = equilibrium_defect(system, outcome.sigma)
    if system.modes is not None and defect > problem.discrete.problem.method.tolerance:
        push = system.modes.unbalanced(outcome.sigma)
    if push is None:
        push = _run_away(increment, outcome)
    if push is None:
        return f"{outcome.reason}{where}{unsure}"
    return f"no equilibrium{where}: {_pushed(increment, push)}{unsure}"


def unheld_at_the_end(increment: Increment) -> str:
    """`unheld` of the whole step, of which an increment was tried."""
    return unheld(
        increment.to(1.0),
        f" at the end{_of_step(increment)}, of which {increment.target:.4g} was tried",
    )


def _of_step(increment: Increment) -> str:
    return (
        f" of step {increment.step.name or increment.number!r}"
        if increment.problem.discrete.problem.step
        else ""
    )


def unheld(increment: Increment, where: str = "") -> str:
    """Which body or obstacle no admissible traction holds, in words; "" where all loads can be
    held."""
    push = unbalanced_load(increment.system.modes, increment.problem.discrete.law)
    return "" if push is None else f"no equilibrium{where}: {_pushed(increment, push)}"


def _run_away(increment: Increment, outcome: ContactState) -> Array | None:
    """Motions (r,) that a method which found no solution ended with, where they dwarf all that is
    strained."""
    motion, system = amplitudes(increment.system, outcome), increment.system
    if system.modes is None or not np.all(np.isfinite(motion)):
        return None
    strained = max(
        np.abs(system.u_0).max(initial=0.0), np.abs(system.apply(outcome.sigma)).max(initial=0.0)
    )
    return (
        motion
        if np.abs(system.modes.motion @ motion).max(initial=0.0) > FAR_OFF * strained
        else None
    )


def _pushed(increment: Increment, push: Array) -> str:
    """The body or obstacle that the loads push along a motion that nothing holds, in words."""
    system, posed = increment.problem.system, increment.problem.discrete.problem
    worst, text = 0.0, "the loads"
    for b, body in enumerate(system.bodies):
        mine = system.motion(b, push[: system.modes.shape[1]])
        along = np.abs(mine).max(initial=0.0)
        if along > worst:
            motion = body.modes @ mine
            weight = body.mesh.weight / body.mesh.weight.sum()
            worst = float(along)
            text = (
                f"body {posed.body[b].name!r} cannot be held: the load {_direction(motion, weight)}"
            )
    taken = system.modes.shape[1]
    for k, of_obstacle in enumerate(increment.obstacles):
        names = np.array(MOTIONS[system.dim][: len(of_obstacle.free)])[of_obstacle.free]
        mine = push[taken : taken + len(names)]
        taken += len(names)
        if np.abs(mine).max(initial=0.0) > worst:
            worst = float(np.abs(mine).max())
            name, way = posed.obstacle[k].name, names[np.argmax(np.abs(mine))]
            text = f"obstacle {name!r} cannot be held: the load pushes it {way}"
    return f"{text} beyond what contact and friction allow"


def _direction(motion: Array, weight: Array) -> str:
    mean = weight @ motion
    spread = float(np.sqrt(weight @ np.sum((motion - mean) ** 2, axis=1)))
    if spread > np.linalg.norm(mean):
        return "turns it"
    axis = int(np.argmax(np.abs(mean)))
    if np.abs(np.delete(mean, axis)).max() < 1e-6 * abs(mean[axis]):
        return f"pushes it along {'-' if mean[axis] < 0 else '+'}{'xyz'[axis]}"
    return (
        f"pushes it along "
        f"({', '.join(f'{component:.3g}' for component in mean / np.linalg.norm(mean))})"
    )


def warnings_of(problem: PreparedProblem, results: list[StepResult]) -> list[str]:
    """All that is to be reported of a solve that ended."""
    posed = [*problem.discrete.warnings, *problem.discrete.mesh_warnings]
    return [
        *posed,
        *_ignored(problem),
        *_jammed(problem, results),
        *_unlike(problem, results),
        *unusual(problem.discrete, results),
    ]


def _unlike(problem: PreparedProblem, results: list[StepResult]) -> list[str]:
    """Pairs whose two sides feel different forces, or differ in shape by more than is small next to
    what contact closes."""
    found = []
    for interface in problem.discrete.interfaces:
        pairs = [result.pairs[interface.name] for result in results]
        left = max((pair.imbalance for pair in pairs), default=0.0)
        if left > IMBALANCE:
            found.append(
                f"pair {interface.name!r}: the moments on its two sides differ by {left:.1e} of "
                f"all that acts "
                "there: friction across a gap or an overlap that is not small next to the face"
            )
        closed = [
            float(np.abs(interface.gap[pair.state != OPEN]).max(initial=0.0)) for pair in pairs
        ]
        # where nothing touches, the smallest gap is what facets may hide
        approach = max(closed, default=0.0) or float(np.abs(interface.gap).min(initial=np.inf))
        beside = interface.gap <= NEXT * approach
        sag = 0.0 if interface.sag is None else float(interface.sag[beside].max(initial=0.0))
        if sag > SAGGING * approach:
            found.append(
                f"pair {interface.name!r}: its elements miss the curved faces that they stand for "
                f"by up "
                f"to {sag:.2g}, next to {approach:.2g} that contact closes or leaves open: p is as "
                "rough; use smaller elements, or give the gap as an expression"
            )
    return found


def _ignored(problem: PreparedProblem) -> list[str]:
    """Obstacles that touch nothing, and their loads on components whose motion is given."""
    discrete, kind, found = problem.discrete, problem.system.motions, []
    for k, obstacle in enumerate(discrete.problem.obstacle):
        if all(side.obstacle != k for side in discrete.sides):
            found.append(f"obstacle {obstacle.name!r} is in no contact")
        states = itertools.accumulate(problem.steps, changed_obstacle, initial=obstacle)
        if any(
            load and motion != "free"
            for o in states
            for motion, load in zip(o.motions(kind), o.loads(kind), strict=True)
        ):
            found.append(
                f"obstacle {obstacle.name!r}: a force or moment on a component whose motion is "
                f"given does nothing"
            )
    return found


def _jammed(problem: PreparedProblem, results: list[StepResult]) -> list[str]:
    """Pairs that stay pressed at the end of a step that took all loads away; an overlap of bodies
    is a load, too."""
    discrete, kind = problem.discrete, problem.system.motions
    found: list[str] = []
    if any(interface.gap.min(initial=np.inf) < 0.0 for interface in discrete.interfaces):
        return found
    obstacles = list(discrete.problem.obstacle)
    for number, step in enumerate(problem.steps, 1):
        obstacles = [changed_obstacle(o, step) for o in obstacles]
        loaded = any(data.loaded[number] for data in discrete.data)
        loaded = loaded or any(
            isinstance(boundary, CondensedSurface) for boundary in discrete.boundaries
        )
        given = (
            motion if motion != "free" else load
            for o in obstacles
            for motion, load in zip(o.motions(kind), o.loads(kind), strict=True)
        )
        ends = [r for r in results if r.step == number and r.load_factor == 1.0]
        if loaded or any(given) or not ends:
            continue
        for side in discrete.sides:
            pressed = max(float(r.pairs[side.name].pressure.max(initial=0.0)) for r in results)
            left = float(ends[0].pairs[side.name].pressure.max(initial=0.0))
            if left > JAM * pressed:
                found.append(
                    f"pair {side.name!r} stays pressed after step {step.name!r} took all loads "
                    f"away: it jams, and "
                    "what stays depends on the path; unload in several increments"
                )
    return found


def reached(discrete: Discrete, results: list[StepResult]) -> str:
    """How a converged solve ended, and what to look at."""
    if not discrete.sides:
        defect = max(float(np.nan_to_num(result.residuals["elastic"])) for result in results)
        return f"nothing is in contact, elastic residual {defect:.1e}"
    if discrete.holds_normals and not discrete.problem.step:
        return results[-1].reason
    worst = {
        key: max(0.0 if math.isnan(r.residuals[key]) else float(r.residuals[key]) for r in results)
        for key in ("normal", "tangential", "balance", "elastic", "equilibrium")
    }
    # a balance of 0 is none: nothing is held by contact only
    text = "residuals " + ", ".join(
        f"{key} {value:.1e}" for key, value in worst.items() if key != "balance" or value
    )
    if all(np.all(pair.state == 2) for pair in results[-1].pairs.values()):
        gaps = {
            name: pair.gap[np.isfinite(pair.gap)].min(initial=np.inf)
            for name, pair in results[-1].pairs.items()
        }
        apart = "; ".join(
            f"pair {name!r} "
            + (
                "faces nothing"
                if np.isinf(gap)
                else f"lies {gap:.3g} apart"
                if gap > 0.0
                else "touches without pressure"
            )
            for name, gap in gaps.items()
        )
        text += f"; no contact anywhere ({apart})"
    for side, d in zip(discrete.sides, discrete.distance, strict=True):
        if np.isfinite(d) and abs(d) > FAR * discrete.boundaries[side.body].diameter:
            how = f"lies {d:.3g} apart" if d > 0.0 else f"overlaps by {-d:.3g}"
            text += f"; pair {side.name!r} {how}, far for the theory of small displacements"
    return text
