"""The result of an increment on interfaces, bodies and obstacles, and its judgement."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Array
from ...compliance.reduced_bodies import Interface
from ...contact.criterion import equilibrium_defect, natural_residuals
from ...contact.friction_law import contact_norm
from ...contact.law_protocol import WITHIN, bound_excess, friction_bound, law_residual
from ...contact.laws import dissipation
from ...contact.state import ContactState
from ...geometry.rotation import Axial, axial
from ...given.interface_data import Law
from ...results.records import BodyResult, ObstacleResult, PairResult, StepResult
from ...results.report import Finding
from ...round_off import HALF
from ..judge.findings import judged, limit_of, new_finding
from ..judge.increments import BLOCKS, imbalance, increment_findings
from ..judge.overlaps import Overlap, overlaps
from ..judge.warnings import absurd, rolled_off
from .diagnosis import failure, second_solution, unheld_at_the_end, zero_energy_motions
from .increment import Increment, given_overlap
from .prepared import IncrementState

Fields = list[tuple[Array, Array]]
"""u [length] and traction [stress] on the boundary of each body, (n, d)."""


def step_result(
    increment: Increment,
    outcome: ContactState,
    after: IncrementState,
    *,
    checked: bool,
) -> StepResult:
    """Return the result of an increment; `checked` says whether it gets its elastic residual."""
    problem = increment.problem
    discrete, system = problem.discrete, problem.system
    fields = [
        body.boundary(
            increment.shares, system.tractions(b, outcome.sigma), system.motion(b, after.alpha)
        )
        for b, body in enumerate(system.bodies)
    ]
    bodies = {
        body.name: BodyResult(*of_body)
        for body, of_body in zip(discrete.posed.bodies, fields, strict=True)
    }
    moved = [float(np.abs(body.u).max(initial=0.0)) for body in bodies.values()]
    elastic, unbalanced = (
        _elastic_residuals(increment, outcome, after, fields, moved) if checked else (0.0, 0.0)
    )
    limit = max(
        limit_of("elastic residual"),
        BLOCKS * max([problem.needed, *(body.tolerance for body in system.bodies)]),
    )
    tangential, *normal = natural_residuals(
        increment.law, increment.system, outcome.v, outcome.sigma, system.slices
    )
    residuals = {
        "normal": max(normal, default=0.0),
        "tangential": tangential,
        "balance": equilibrium_defect(increment.system, outcome.sigma),
        "elastic": elastic if checked else np.nan,
        "equilibrium": unbalanced if checked else np.nan,
        "elimination": problem.digits_lost,
    }
    overlap = overlaps(
        system,
        increment.system,
        increment.law,
        problem.places,
        outcome,
        closed=increment.ends,
    )
    residuals |= {
        "overlap": overlap.at_nodes,
        "between": overlap.depth,
        "displaced": overlap.displaced,
        "pressed": overlap.pressed,
    }
    pairs = _pairs(increment, outcome, after, bodies)
    findings = _findings(increment, outcome, [*absurd(discrete, moved)], elastic, limit)
    # an increment that is not solved is judged by nothing else
    findings += (
        increment_findings(residuals, None)
        if findings
        else _solved_findings(increment, outcome, pairs, bodies, residuals, overlap)
    )
    status, reason = judged(findings, outcome.reason)
    return StepResult(
        increment.name,
        increment.number,
        increment.target,
        status,
        reason,
        len(outcome.history),
        residuals,
        pairs,
        bodies,
        _obstacles(increment, after),
        after.alpha,
        float(np.max(outcome.rho)),
        contact_norm(
            law_residual(increment.law, outcome.v, outcome.sigma, outcome.rho), system.weight
        ),
        outcome.history,
        increment.cycle,
        increment.origin,
        increment.sliding,
        tuple(findings),
    )


def _elastic_residuals(
    increment: Increment,
    outcome: ContactState,
    after: IncrementState,
    fields: Fields,
    moved: Sequence[float],
) -> tuple[float, float]:
    """Return the largest residual of the integral equations, and the largest imbalance [-].

    Bodies that are solved jointly share one accuracy: the residual of a body that hardly moves
    compared with the others means nothing, and is left out. `moved` is the largest displacement of
    each body [length].
    """
    discrete, system = increment.problem.discrete, increment.problem.system
    elastic = unbalanced = 0.0
    for b, (body, (u, traction)) in enumerate(zip(system.bodies, fields, strict=True)):
        if body.is_solved_jointly and body.displaced(u, traction) < HALF * max(moved):
            continue
        alpha, sigma = system.motion(b, after.alpha), system.tractions(b, outcome.sigma)
        acting = body, increment.shares, u, traction, sigma, alpha
        elastic = max(elastic, body.residual(*acting[1:]))
        if discrete.boundaries[b].closed:
            unbalanced = max(unbalanced, imbalance(*acting))
    return elastic, unbalanced


def _obstacles(increment: Increment, after: IncrementState) -> dict[str, ObstacleResult]:
    """Return positions and loads of the obstacles by their names."""
    d, obstacles = increment.problem.system.components, increment.problem.discrete.posed.obstacles
    return {
        obstacle.name: ObstacleResult(position[:d], axial(position[d:]), load[:d], axial(load[d:]))
        for obstacle, position, load in zip(obstacles, after.positions, after.loads, strict=False)
    }


def _findings(
    increment: Increment,
    outcome: ContactState,
    displaced: list[Finding],
    elastic: float,
    limit: float,
) -> list[Finding]:
    """Return the first reason why there is no solution, or no finding.

    Residuals are not judged if the displacements themselves are not accepted (`displaced`).
    """
    if outcome.error and (named := unheld_at_the_end(increment)):
        return [new_finding("not solved", f"{named} ({outcome.reason})")]
    if outcome.stopped:
        return [new_finding("stopped", outcome.reason)]
    if not outcome.converged:
        return [new_finding("not solved", failure(increment, outcome))]
    if displaced:
        return displaced
    if not elastic <= limit:
        text = f"check: elastic residual {elastic:.1e} > {limit:g}"
        advice = _remedy(increment)
        return [new_finding("elastic residual", text, advice=advice, measured=elastic, limit=limit)]
    excess = bound_excess(increment.law, outcome.sigma)
    if not excess <= WITHIN:
        text = f"tractions exceed what contact allows by {excess:.1e} of the bound"
        return [new_finding("friction bound", text, measured=excess, limit=WITHIN)]
    return []


def _solved_findings(
    increment: Increment,
    outcome: ContactState,
    pairs: dict[str, PairResult],
    bodies: dict[str, BodyResult],
    residuals: dict[str, float],
    overlap: Overlap,
) -> Iterator[Finding]:
    """Yield the findings of an increment whose equations are solved."""
    # no mesh has nodes at the place where a contact begins to grow; `rough_step` judges the steps
    # before the last one
    ends = increment.ends and increment.number == len(increment.problem.steps)
    yield from rolled_off(increment.problem.discrete, pairs, bodies)
    yield from _reactions(increment, pairs)
    yield from increment_findings(residuals, overlap.finding if ends else None)
    if outcome.direct:
        yield new_finding(
            "iterations",
            "iterations on compressed operators failed: a dense S was solved with in their place",
            advice="-bem_mat_type dense saves them",
        )
    missed = max(residuals["tangential"], residuals["normal"])
    if not missed <= limit_of("contact law"):
        yield new_finding(
            "contact law",
            f"the law of contact is missed by {missed:.1e} of the tractions of a pair",
            measured=missed,
        )
    if overlap.finding is not None:
        yield overlap.finding
    if overlap.pressed > limit_of("overlap under pressure"):
        yield new_finding(
            "overlap under pressure",
            f"surfaces overlap between nodes in contact: {overlap.pressed_where}, "
            f"{overlap.pressed / (1.0 - overlap.pressed):.2g} times what contact displaces: "
            "forces may be far off",
            f"step {increment.name!r}",
            advice="refine the mesh there",
            measured=overlap.pressed,
        )
    yield from zero_energy_motions(increment, outcome)
    yield from second_solution(increment, outcome)


def _reactions(increment: Increment, pairs: dict[str, PairResult]) -> Iterator[Finding]:
    """Find interfaces whose two sides do not carry opposite forces and moments.

    The couple of friction across a gap is taken into account.
    """
    for face in increment.problem.system.interfaces:
        if face.distance is None:
            continue
        pair = pairs[face.name]
        apart = np.where(np.isfinite(face.distance), face.distance, 0.0)[:, None] * face.normal
        shear = np.einsum("mt,mtc->mc", pair.sigma_t, pair.tangent)
        couple = increment.problem.system.motions.moment(apart, pair.weight[:, None] * shear)
        left = pair.imbalance_beyond(-couple)
        if not left <= limit_of("reaction"):
            yield new_finding(
                "reaction",
                f"force or moment on its two sides differ by {left:.1e} of all that acts there",
                f"pair {face.name!r}",
                measured=left,
            )


def _remedy(increment: Increment) -> str:
    """Return advice on how to make the elastic solution of this storage more accurate."""
    stored = increment.problem.system.describe()
    for name in ("hodlr", "hmatrix"):
        if name in stored:
            return f"use a smaller -bem_{name}_tol, or -bem_mat_type dense"
    prefix = "" if stored.startswith("full") else "elastic_"
    return f"use -{prefix}pc_type lu, or a smaller -{prefix}ksp_rtol"


def _pairs(
    increment: Increment,
    outcome: ContactState,
    after: IncrementState,
    bodies: dict[str, BodyResult],
) -> dict[str, PairResult]:
    """Return the results of all interfaces by their names."""
    problem, names = increment.problem, list(bodies)
    law, system = increment.law, problem.system
    bound = friction_bound(law, outcome.sigma)
    slips = outcome.v[:, : system.components - 1]
    energy = dissipation(law, increment.before.sigma, outcome.sigma, slips, bound)
    pairs = {}
    for number, (where, face) in enumerate(zip(system.slices, system.interfaces, strict=True)):
        of_nodes = np.column_stack([bound, *energy])[where]
        traction = bodies[names[face.body]].traction[face.nodes]
        pairs[face.name] = _pair(increment, outcome, after, number, of_nodes, traction)
    return pairs


def _pair(
    increment: Increment,
    outcome: ContactState,
    after: IncrementState,
    number: int,
    of_nodes: Array,
    traction: Array,
) -> PairResult:
    """Return the result of one interface.

    `of_nodes` (m, 3) are the bound of friction, the dissipated energy and its error at its nodes;
    `traction` (m, d) is that of the secondary there.
    """
    problem, system = increment.problem, increment.problem.system
    where, face, d = system.slices[number], system.interfaces[number], system.components
    (x, weight, arc_length), side = problem.contact_nodes[number], problem.discrete.sides[number]
    sigma, v, states = outcome.sigma[where], outcome.v[where], after.states[where]
    sigma_t, moved = sigma[:, : d - 1], v[:, : d - 1]
    if face.held:
        sigma_n, open_by = np.einsum("mc,mc->m", traction, face.across), np.zeros(len(x))
    else:
        sigma_n, open_by = sigma[:, -1], -v[:, -1]
    pressure = 0.0 - sigma_n
    traction = np.einsum("mt,mtc->mc", sigma_t, face.tangent) + sigma_n[:, None] * face.across
    return PairResult(
        x,
        face.normal,
        face.tangent,
        weight,
        arc_length,
        pressure,
        sigma_t,
        of_nodes[:, 0],
        np.where(np.isfinite(face.gap), open_by + 0.0, np.inf),
        moved + increment.before.slip[where],
        moved,
        states,
        weight @ traction,
        system.motions.moment(x, weight[:, None] * traction),
        float(weight @ of_nodes[:, 1]),
        float(weight @ of_nodes[:, 2]),
        *_on_primary(increment, face, traction),
        _worn(side.law, after.worn[where]),
        functools.partial(problem.errors[number], pressure, sigma_t, states),
        _overlap(increment, after, face),
        None if side.contact is None else np.where(np.isfinite(face.gap), side.choice, -1),
    )


def _worn(law: Law, depth: Array) -> Array | None:
    """Return the worn depths (m, 2) of secondary and primary; None where nothing wears."""
    if law.wear_coefficient is None:
        return None
    return depth[:, None] * [law.wear_share, 1.0 - law.wear_share]


def _overlap(increment: Increment, after: IncrementState, face: Interface) -> float:
    """Return the largest overlap that an interface was given [length]."""
    own = 0.0
    if face.preloaded:
        own = float(after.positions[increment.problem.mover(face.name), 0])
    return own + given_overlap(face, increment.shares)


def _on_primary(
    increment: Increment, face: Interface, traction: Array
) -> tuple[Array | None, Axial | None]:
    """Return force and moment on the primary's body, from tractions (m, d) on the secondary.

    They are summed over the primary's own nodes. Both are None if the primary is not a body, or
    the interface has a jump.
    """
    if (
        face.primary is None
        or face.primary_nodes is None
        or face.loads is None
        or face.jump is not None
    ):
        return None, None
    mesh = increment.problem.discrete.meshes[face.primary]
    force = -mesh.weight[face.primary_nodes, None] * (face.loads @ traction)
    return force.sum(axis=0), mesh.motions.moment(mesh.x[face.primary_nodes], force)
