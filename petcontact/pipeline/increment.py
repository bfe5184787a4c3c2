"""One increment of a load step: its contact problem, what it leaves behind, and why it failed if it did."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..arrays import Array, Mask
from ..compliance.bodies import BodiesSystem
from ..compliance.reduced import ComposedSystem
from ..contact.criterion import equilibrium_defect, natural_residuals
from ..contact.equilibrium import unheld
from ..contact.laws import EXCESS, dissipation, law_excess
from ..contact.state import ContactState, Start
from ..contact.system import Modes
from ..geometry.rotation import axial, moment
from ..model.assembly import Obstacle
from ..model.load_steps import Step
from ..results.steps.solution import BodyResult, ObstacleResult, PairResult, StepResult
from .assemble import Discrete
from .trust.elastic import ELASTIC_LIMIT
from .trust.increments import imbalance, objection
from .trust.overlaps import Between, between, overlaps

MOTIONS = {
    2: ("along x", "along y", "to turn"),
    3: ("along x", "along y", "along z", "to turn about x", "to turn about y", "to turn about z"),
}  # fmt: skip
"""Of an obstacle, by the number of dimensions."""


@dataclass
class Freedoms:
    """One obstacle on its way through a step: its q = d(d+1)/2 motions, given or free under loads.

    Attributes
    ----------
    free : (q,) bool array
    position, load : (2, q) arrays
        At the start and the end of the step: displacement and rotation where given, force and moment where free.
    """

    free: Mask
    position: Array
    load: Array


@dataclass
class Progress:
    """What one increment hands to the next.

    Attributes
    ----------
    slip : (M, d-1) array
        w [length].
    start : pair of (M, d) arrays, optional
        v (its tangential part since the increment before) and σ.
    alpha : (r,) array
        Motions of the bodies.
    positions, loads : (o, q) arrays
        Of the obstacles; loads from outside.
    sigma : (M, d) array
        σ [stress].
    """

    slip: Array
    start: Start | None
    alpha: Array
    positions: Array
    loads: Array
    sigma: Array


@dataclass
class SteppedProblem:
    """An assembly, eliminated: any number of runs through its steps."""

    discrete: Discrete
    system: BodiesSystem
    comm: Any
    timings: dict[str, float] = field(default_factory=dict)

    @property
    def digits_lost(self) -> float:
        """The largest error of an elimination, see `BodyCompliance.digits_lost`."""
        return max((body.digits_lost for body in self.system.bodies if np.isfinite(body.digits_lost)), default=np.nan)

    @cached_property
    def between(self) -> list[Between | None]:
        """Places between the nodes of each contact."""
        discrete = self.discrete
        return [between(s, i, discrete.meshes) for s, i in zip(discrete.sides, discrete.interfaces, strict=True)]

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps of the config; one that reaches all values where there are none."""
        return self.discrete.assembly.step or (Step(name="load"),)


def progress_after(problem: SteppedProblem, done: list[StepResult], warm: Start | None) -> Progress:
    """What the last of some increments hands on; the unloaded state where there is none."""
    system, m, d = problem.system, len(problem.system.weight), problem.system.dim
    obstacles = problem.discrete.assembly.obstacle
    if not done:
        still = np.zeros((len(obstacles), d * (d + 1) // 2))
        return Progress(np.zeros((m, d - 1)), warm, np.zeros(system.modes.shape[1]), still, still.copy(),
                        np.zeros((m, d)))  # fmt: skip
    pairs = [done[-1].pairs[face.name] for face in system.interfaces]
    slip, moved = (np.concatenate([getattr(pair, key) for pair in pairs]) for key in ("slip", "slip_increment"))
    gap = np.concatenate([pair.gap for pair in pairs])
    sigma = np.concatenate([np.column_stack([pair.sigma_t, -pair.pressure]) for pair in pairs])
    v = np.column_stack([moved, -np.where(np.isfinite(gap), gap, 0.0)])
    places = [done[-1].obstacles[o.name] for o in obstacles]
    positions = np.array([np.hstack([p.displacement, p.rotation]) for p in places]).reshape(len(places), d * (d + 1) // 2)
    loads = np.array([np.hstack([p.force, p.moment]) for p in places]).reshape(len(places), d * (d + 1) // 2)
    return Progress(slip, (v, sigma), done[-1].alpha, positions, loads, sigma)


def changed(obstacle: Obstacle, step: Step) -> Obstacle:
    """An obstacle with what a step changes of it."""
    for change in step.obstacle:
        if change.name == obstacle.name:
            given = {key: getattr(change, key) for key in ("displacement", "rotation", "force", "moment")}
            obstacle = obstacle.model_copy(update={key: value for key, value in given.items() if value is not None})
    return obstacle


def freedoms_of(obstacle: Obstacle, progress: Progress, k: int, d: int) -> Freedoms:
    """From where the obstacle is and what it feels to what the step wants."""
    wanted, load = obstacle.motions(d), np.array(obstacle.loads(d))
    free = np.array([value == "free" for value in wanted])
    end = np.array([0.0 if value == "free" else float(value) for value in wanted])
    return Freedoms(free, np.array([progress.positions[k], end]), np.array([progress.loads[k], load]))


def reduced_problem(
    system: BodiesSystem, freedoms: list[Freedoms], progress: Progress, number: int, target: float
) -> ComposedSystem:
    """The contact problem at a load factor of a step."""
    base = (1.0 - target) * system.base[number - 1] + target * system.base[number]
    modes, balance = [system.modes], [system.balance]
    resultant = [(1.0 - target) * system.resultant[number - 1] + target * system.resultant[number]]
    for freedom, mode in zip(freedoms, system.obstacle_modes, strict=True):
        position, load = ((1.0 - target) * pair[0] + target * pair[1] for pair in (freedom.position, freedom.load))
        base += mode[:, ~freedom.free] @ position[~freedom.free]
        modes.append(mode[:, freedom.free])
        balance.append(system.weighted(mode)[freedom.free])
        resultant.append(load[freedom.free])
    u_0 = base.reshape(-1, system.dim)
    u_0[:, -1] -= np.where(np.isfinite(system.gap), system.gap, 0.0)
    u_0[:, :-1] -= progress.slip
    motion, load = np.concatenate(modes, axis=1), np.concatenate(resultant)
    rigid = Modes(motion.reshape(*u_0.shape, -1), np.concatenate(balance).reshape(-1, *u_0.shape), load)
    return system.reduced(u_0, rigid)


def step_result(
    problem: SteppedProblem, freedoms: list[Freedoms], step: Step, number: int, target: float, outcome: ContactState,
    before: Progress, after: Progress, *, checked: bool,
) -> StepResult:  # fmt: skip
    discrete, system, d = problem.discrete, problem.system, problem.system.dim
    assembly = discrete.assembly
    shares = np.zeros(len(system.base))
    shares[number - 1] += 1.0 - target
    shares[number] += target
    bodies, elastic, unbalanced = {}, 0.0, 0.0
    for b, body in enumerate(system.bodies):
        alpha = system.motion(b, after.alpha)
        u, traction = body.boundary(shares, system.tractions(b, outcome.sigma), alpha)
        bodies[assembly.body[b].name] = BodyResult(u, traction)
        if checked:
            elastic = max(elastic, body.residual(shares, u, traction, alpha))
            if not discrete.boundaries[b].exterior:
                unbalanced = max(unbalanced, imbalance(body, shares, u, traction, alpha))
    reduced = reduced_problem(system, freedoms, before, number, target)
    tangential, normal = natural_residuals(discrete.law, reduced, outcome.v, outcome.sigma)
    overlap, hidden, place = overlaps(system, discrete.law.unilateral, problem.between, reduced, outcome)
    residuals = {"normal": normal, "tangential": tangential, "balance": equilibrium_defect(reduced, outcome.sigma),
                 "elastic": elastic if checked else np.nan, "equilibrium": unbalanced if checked else np.nan,
                 "elimination": problem.digits_lost, "overlap": overlap}  # fmt: skip
    status, reason = ("converged" if outcome.converged else "not converged"), outcome.reason
    if outcome.converged and not elastic <= ELASTIC_LIMIT:
        status, reason = "not converged", f"elastic residual {elastic:.1e} > {ELASTIC_LIMIT:g}"
    largest = max(float(np.abs(body.traction).max(initial=0.0)) for body in bodies.values())
    excess = law_excess(discrete.law, outcome.sigma, largest)
    if status == "converged" and not excess <= EXCESS * assembly.method.tolerance:
        status, reason = "not converged", f"tractions exceed what contact allows by {excess:.1e} of the largest traction"
    if status == "converged" and (doubt := objection(residuals, hidden, place)):
        status, reason = "not converged", doubt
    if not outcome.converged:
        reason = _why(problem, freedoms, before, number, target, outcome)
    pairs, states, radius = {}, outcome.states, discrete.law.radius(-outcome.sigma[:, -1])
    absent, spent = ~np.isfinite(system.gap), dissipation(discrete.law, before.sigma, outcome.sigma, outcome.v[:, :-1])
    for where, face, side in zip(system.slices, system.interfaces, discrete.sides, strict=True):
        mesh = discrete.meshes[side.body]
        sigma, v = outcome.sigma[where], outcome.v[where]
        weight, x = mesh.weight[face.nodes], mesh.x[face.nodes]
        traction = np.einsum("mt,mtc->mc", sigma[:, :-1], face.tangent) + sigma[:, -1:] * face.normal
        moved = v[:, :-1]
        slip = moved + before.slip[where]
        pairs[face.name] = PairResult(
            x, face.normal, face.tangent, weight, mesh.variables(face.nodes).get("s", np.zeros(len(x))),
            0.0 - sigma[:, -1], sigma[:, :-1], radius[where],
            np.where(absent[where], np.inf, 0.0 - v[:, -1]), slip, moved, states[where],
            weight @ traction, moment(x, weight[:, None] * traction),
            *(float(weight @ energy[where]) for energy in spent),
        )  # fmt: skip
    obstacles = {
        o.name: ObstacleResult(after.positions[k, :d], axial(after.positions[k, d:]), after.loads[k, :d],
                               axial(after.loads[k, d:]))
        for k, o in enumerate(assembly.obstacle)
    }  # fmt: skip
    return StepResult(
        step.name or f"step {number}", number, target, status, reason, len(outcome.history), residuals, pairs, bodies,
        obstacles, after.alpha, outcome.history,
    )  # fmt: skip


def undetermined(
    problem: SteppedProblem, freedoms: list[Freedoms], before: Progress, number: int, target: float,
    outcome: ContactState,
) -> list[str]:  # fmt: skip
    """What is yet to be said of motions at the end of a step that neither closed nor sticking nodes resist."""
    system, law = problem.system, problem.discrete.law
    modes = reduced_problem(system, freedoms, before, number, 1.0).modes
    if modes is None or target < 1.0 or not outcome.converged:
        return []
    size = np.abs(outcome.sigma).max(initial=0.0) / (np.abs(outcome.v).max(initial=0.0) or 1.0)
    derivative = law.linearise(size * outcome.v - outcome.sigma)
    resisted = np.einsum("iab,ibr->iar", derivative, modes.motion / modes.size).reshape(-1, len(modes.load))
    values, vectors = np.linalg.svd(np.linalg.qr(resisted, mode="r"))[1:]
    loose = vectors[np.append(values, np.zeros(len(vectors) - len(values))) <= 1e-9 * max(1.0, values.max(initial=0.0))]
    if not len(loose):
        return []
    moved = np.linalg.norm(loose, axis=0)
    assembly, owners = problem.discrete.assembly, list[str]()
    for body, eliminated in zip(assembly.body, system.bodies, strict=True):
        owners += [f"body {body.name!r}"] * eliminated.modes.shape[2]
    for obstacle, freedom in zip(assembly.obstacle, freedoms, strict=True):
        owners += [f"obstacle {obstacle.name!r}"] * int(freedom.free.sum())
    names = list(dict.fromkeys(owner for owner, share in zip(owners, moved, strict=True) if share > 1e-6))
    motions = f"{len(loose)} motion{'s' if len(loose) > 1 else ''} of {' and '.join(names)}"
    note = f"step {problem.steps[number - 1].name or number!r}: nothing holds {motions}; chosen as the least there is"
    return [note] * (note not in problem.discrete.warnings)


def _why(
    problem: SteppedProblem, freedoms: list[Freedoms], before: Progress, number: int, target: float,
    outcome: ContactState,
) -> str:  # fmt: skip
    """What a failed increment says: which body nothing holds, there or at the end of the step, or how the method ended."""
    reduced, end = (reduced_problem(problem.system, freedoms, before, number, t) for t in (target, 1.0))
    push = unheld(reduced.modes, problem.discrete.law)
    where = f"at load factor {target:.4g} of step {problem.steps[number - 1].name!r}"
    if push is None and (push := unheld(end.modes, problem.discrete.law)) is not None:
        where = f"at the end of step {problem.steps[number - 1].name!r}, of which {target:.4g} was tried"
    defect = equilibrium_defect(reduced, outcome.sigma)
    if push is None and reduced.modes is not None and defect > problem.discrete.assembly.method.tolerance:
        push = reduced.modes.unbalanced(outcome.sigma)
    if push is None:
        return f"{outcome.reason} {where}"
    return f"no equilibrium {where}: {_pushed(problem, freedoms, push)}"


def _pushed(problem: SteppedProblem, freedoms: list[Freedoms], push: Array) -> str:
    """The body or obstacle that the loads push along a motion that nothing holds, in words."""
    system, assembly = problem.system, problem.discrete.assembly
    worst, text = 0.0, "the loads"
    for b, body in enumerate(system.bodies):
        mine = system.motion(b, push[: system.modes.shape[1]])
        along = np.abs(mine).max(initial=0.0)
        if along > worst:
            motion = body.modes @ mine
            weight = body.mesh.weight / body.mesh.weight.sum()
            worst = float(along)
            text = f"body {assembly.body[b].name!r} cannot be held: the load {_direction(motion, weight)}"
    taken = system.modes.shape[1]
    for k, freedom in enumerate(freedoms):
        names = np.array(MOTIONS[system.dim])[freedom.free]
        mine = push[taken : taken + len(names)]
        taken += len(names)
        if np.abs(mine).max(initial=0.0) > worst:
            worst = float(np.abs(mine).max())
            name, way = assembly.obstacle[k].name, names[np.argmax(np.abs(mine))]
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
    return f"pushes it along ({', '.join(f'{component:.3g}' for component in mean / np.linalg.norm(mean))})"
