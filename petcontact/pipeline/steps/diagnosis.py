"""Reasons why an increment failed, and motions that nothing holds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array
from ...contact.criterion import equilibrium_defect
from ...contact.equilibrium import unbalanced_load
from ...contact.idle_bodies import amplitudes
from ...contact.state import ContactState
from ...errors import the_body
from ...geometry.rotation import Motions
from ...results.report import Finding
from ...round_off import WRITTEN
from ..judge.findings import new_finding
from ..judge.increments import STILL
from .hulls import forces_at_corners
from .increment import Increment
from .sliding import slipping_words

MOTIONS = {
    (2, 2): ("along x", "along y"),
    (2, 3): ("along x", "along y", "to turn"),
    (3, 4): ("along x", "along y", "along θ", "to turn about the axis"),
    (3, 6): (
        *("along x", "along y", "along z"),
        *("to turn about x", "to turn about y", "to turn about z"),
    ),
}
"""Names of an obstacle's motions, by the number of displacement components and of motions."""


def is_unbalanced(increment: Increment) -> bool:
    """Return whether no admissible traction holds the loads."""
    return _unbalanced(increment) is not None


def _unbalanced(increment: Increment) -> Array | None:
    """Return the part of the loads that no admissible traction holds, (r,), or None.

    It is None if tractions hold the loads, either at the nodes or at the corners of elements.
    """
    modes, law = increment.system.modes, increment.law
    push = unbalanced_load(modes, law, costs=_costs(increment))
    if push is None or unbalanced_load(modes, law, forces_at_corners(increment)) is None:
        return None
    return push  # with tractions at the nodes: those at corners weigh the motions differently


def _costs(increment: Increment) -> Array:
    """Return the costs (r,) of the loads that nothing holds: what tips lacks a couple, not a force,
    though another force would hold it, too."""
    system, turns = increment.problem.system, list[bool]()
    for body in system.bodies:
        mean = np.tensordot(body.mesh.weight / body.mesh.weight.sum(), body.modes, 1)
        turns += list(np.abs(body.modes - mean).max(axis=(0, 1)) > np.abs(mean).max(axis=0))
    for motion in increment.obstacles:
        turns += list((np.arange(len(motion.free)) >= system.components)[motion.free])
    return np.where(turns, 1e-3, 1.0)


def second_solution(increment: Increment, outcome: ContactState) -> Iterator[Finding]:
    """Find an increment that has contact tractions although σ = 0 is also a solution.

    σ = 0 is a solution if the loads alone close no contact. If friction does not depend on
    pressure, there is one solution. With Coulomb's law there may be others, in which friction holds
    surfaces that would separate.

    Source: A. Klarbring, Examples of non-uniqueness and non-existence of solutions to quasistatic
    contact problems with friction, Ing.-Archiv 60 (1990) 529.
    """
    system, law = increment.system, increment.law
    added = np.abs(outcome.v - system.u_0).max(initial=0.0)
    free = np.abs(system.u_0).max(initial=0.0)
    if not outcome.converged or system.modes is not None or added <= 1e-6 * free or free == 0.0:
        return
    if not law.project(outcome.rho * system.u_0).any():
        yield new_finding(
            "second solution",
            "surfaces that part everywhere are a solution, too: with Coulomb's law there are two "
            "here",
            f"step {increment.name!r}",
            advice='another start, as method.start = "frictionless", may find it',
        )


def zero_energy_motions(increment: Increment, outcome: ContactState) -> Iterator[Finding]:
    """Find motions at the end of a step that closed and sticking nodes hardly resist, or not at
    all."""
    modes, law = increment.system.modes, increment.law
    if modes is None or increment.target < 1.0 or not outcome.converged:
        return
    # v alone may be round-off of an iteration
    moved = max(np.abs(outcome.v).max(initial=0.0), np.abs(increment.system.u_0).max(initial=0.0))
    size = np.abs(outcome.sigma).max(initial=0.0) / (moved or 1.0)
    derivative = law.linearise(size * outcome.v - outcome.sigma)
    followed = modes.motion / modes.size @ modes.basis @ modes.basis.T
    resisted = np.einsum("iab,ibr->iar", derivative, followed).reshape(-1, len(modes.load))
    values, vectors = np.linalg.svd(np.linalg.qr(resisted, mode="r"))[1:]
    # relative to the motion that contact resists most
    values = np.append(values, np.zeros(len(vectors) - len(values))) / max(
        1.0, values.max(initial=0.0)
    )
    if (values <= WRITTEN).any():
        yield new_finding(
            "loose motion",
            f"nothing holds {_named(increment, vectors[values <= WRITTEN])}",
            f"step {increment.step.name or increment.number!r}",
            advice="the smallest was chosen, and no stress depends on it",
            limit=WRITTEN,
        )


def _named(increment: Increment, loose: Array) -> str:
    """Return a text that names the bodies and obstacles that move in motions (q, r) of unit
    size."""
    problem, share = increment.problem, np.linalg.norm(loose, axis=0)
    posed, owners = problem.discrete.posed, list[str]()
    for body, eliminated in zip(posed.bodies, problem.system.bodies, strict=True):
        owners += [the_body(body.name)] * eliminated.modes.shape[2]
    for mover, motion in zip(problem.movers, increment.obstacles, strict=True):
        owners += [mover] * int(motion.free.sum())
    names = list(
        dict.fromkeys(owner for owner, part in zip(owners, share, strict=True) if part > 1e-6)
    )
    return f"{len(loose)} motion{'s' if len(loose) > 1 else ''} of {' and '.join(names)}"


def failure(increment: Increment, outcome: ContactState) -> str:
    """Return the message of a failed increment.

    It names the body that nothing holds, in this increment or at the end of the step. Otherwise it
    says how the method ended.
    """
    problem, system = increment.problem, increment.system
    stepped = problem.discrete.posed.steps or increment.target < 1.0
    where = f" at load factor {increment.target:.4g}{_of_step(increment)}" if stepped else ""
    if text := unheld(increment, where):
        return f"{text}{slipping_words(increment)}"
    if text := unheld_at_the_end(increment):
        return text
    push = None
    defect = equilibrium_defect(system, outcome.sigma)
    if system.modes is not None and defect > problem.discrete.posed.method.tolerance:
        push = system.modes.unbalanced(outcome.sigma)
    if push is None and system.modes is not None:
        motion = amplitudes(system, outcome)
        strained = np.abs(system.u_0).max() + np.abs(system.apply(outcome.sigma)).max()
        if strained < STILL * np.abs(system.modes.motion @ motion).max():
            push = motion
    if push is None:
        return f"{outcome.reason}{where}{slipping_words(increment)}"
    name, way = _pushed(increment, push)
    if unbalanced_load(system.modes, increment.law) is not None:
        return (
            f"did not converge{where}: the load {way.replace('it', name, 1)}, which forces at the "
            f"corners of elements can hold and forces at their nodes cannot; smaller elements may"
        )
    return (
        f"did not converge{where}: {name} is not in equilibrium in the last iterate, the load "
        f"{way}; that contact and friction cannot hold it is not proved"
    )


def unheld_at_the_end(increment: Increment) -> str:
    """Return `unheld` of the whole step, of which an increment was tried."""
    return unheld(
        increment.ending_at(1.0),
        f" at the end{_of_step(increment)}, of which {increment.target:.4g} was tried",
    )


def _of_step(increment: Increment) -> str:
    return (
        f" of step {increment.step.name or increment.number!r}"
        if increment.problem.discrete.posed.steps
        else ""
    )


def unheld(increment: Increment, where: str = "") -> str:
    """Return a text that names the body or obstacle that no admissible traction holds.

    It is empty if all loads can be held.
    """
    push = _unbalanced(increment)
    if push is None:
        return ""
    name, way = _pushed(increment, push)
    system = increment.problem.system
    held = any(body.modes.shape[2] < system.motions.count for body in system.bodies)
    grounded = any(face.primary is None for face in system.interfaces)
    advice = (
        "give it a displacement or friction, or press it on its contact"
        if held or grounded
        else "nothing has a displacement: give one to the body that carries the others"
    )
    problem = increment.problem
    preloads = zip(problem.preloaded, increment.obstacles[-len(problem.preloaded) :], strict=False)
    given = [
        f"; {side.name!r} carries its preload of {abs(motion.load[1, 0]):.4g}, no more and no "
        "less, until a later step locks it"
        for side, motion in preloads
        if motion.free[0]
    ]
    return (
        f"no equilibrium{where}: {name} cannot be held: the load {way} beyond what contact and "
        f"friction allow{''.join(given)}; {advice}"
    )


def _pushed(increment: Increment, push: Array) -> tuple[str, str]:
    """Return the name of the body or obstacle that the loads push, and a text on how they move
    it."""
    system, posed = increment.problem.system, increment.problem.discrete.posed
    worst, name, way = 0.0, "a body", "moves it"
    for b, body in enumerate(system.bodies):
        own_push = system.motion(b, push[: system.modes.shape[1]])
        along = np.abs(own_push).max(initial=0.0)
        if along > worst:
            motion = body.modes @ own_push
            weight = body.mesh.weight / body.mesh.weight.sum()
            worst = float(along)
            name, way = the_body(posed.bodies[b].name), _direction(motion, weight, system.motions)
    taken = system.modes.shape[1]
    for k, of_obstacle in enumerate(increment.obstacles):
        names = np.array(MOTIONS[system.components, len(of_obstacle.free)])[of_obstacle.free]
        own_push = push[taken : taken + len(names)]
        taken += len(names)
        if np.abs(own_push).max(initial=0.0) > worst:
            worst = float(np.abs(own_push).max())
            name = increment.problem.movers[k]
            way = f"pushes it {names[np.argmax(np.abs(own_push))]}"
            way = way if k < len(posed.obstacles) else "exceeds it"
    return name, way


def _direction(motion: Array, weight: Array, motions: Motions) -> str:
    # out of a half section nothing is translated, but turned
    mean = weight @ motion * np.isin(np.arange(motions.dim), motions.along)
    spread = float(np.sqrt(weight @ np.sum((motion - mean) ** 2, axis=1)))
    if spread > np.linalg.norm(mean):
        return "turns it"
    axis = int(np.argmax(np.abs(mean)))
    if np.abs(np.delete(mean, axis)).max() < 1e-6 * abs(mean[axis]):
        return f"pushes it along {'-' if mean[axis] < 0 else '+'}{'xyz'[axis]}"
    return (
        "pushes it along "
        f"({', '.join(f'{component:.3g}' for component in mean / np.linalg.norm(mean))})"
    )
