"""What a converged increment must meet beyond the residuals of its equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...compliance.body.base import ElasticBody
from ...results.records import StepResult
from ...results.report import Finding
from ...round_off import WRITTEN
from .findings import as_kind, judged, limit_of, new_finding

REFINE = (
    "refine the mesh there (smaller elements, --adapt, or no [mesh] at all; in the plane "
    "mesh.graded_points with mesh.grading)"
)
"""Advice on surfaces that overlap between nodes."""
BLOCKS = 5.0
"""Residual of a compressed body that is accepted, over the tolerance of its compression, which
bounds each block by itself: three bolted bodies had 1 to 2.2 times that, at 1e-4 and 1e-5, one body
alone or two blocks less than that."""
STILL = 1e-3
"""Displacement beside a rigid motion, over that, of a body on which nothing acts that only moves:
curved panels of different sizes, as adaptive meshes have side by side, leave slits that strain it
by .0005."""
MISSED = {
    "elimination": (
        "a body is too thin for its mesh: its elimination is off by {found:.1e}, at most {limit:g} "
        "is accepted",
        "choose smaller elements",
    ),
    "equilibrium": (
        "the tractions of a body are not in equilibrium: {found:.1e} of their sum is left, at most "
        "{limit:g} is accepted",
        "choose smaller elements",
    ),
    "overlap": (
        "surfaces overlap by {found:.1e} of what contact displaces",
        "choose a smaller tolerance",
    ),
}
"""What a residual that is too large says, and advice, by its kind."""


def imbalance(
    body: ElasticBody, shares: Array, u: Array, traction: Array, sigma: Array, alpha: Array
) -> float:
    """Resultant force and moment on a body, the larger one, over the sum of all sizes; at most 1
    [-].

    Of a body that contact holds it is zero by construction: there it is what the multipliers of its
    rigid motions say, over the largest displacement that strains it. What is round-off of the
    displacement is no traction, nor is on compressed operators what their tolerance makes of a body
    that nothing loads and that moves as a whole.

    Parameters
    ----------
    body : ElasticBody
        Of finite size.
    shares : (K,) array
        Of the load states.
    u, traction : (n, d) arrays
        [length], [stress]
    sigma : (m, k) array
        Tractions at contact nodes [stress].
    alpha : (r,) array
        Rigid motions.
    """
    mesh = body.mesh
    x, force = mesh.x, mesh.weight[:, None] * traction
    if body.data.point.size:
        x = np.concatenate([x, body.data.point])
        force = np.concatenate([force, np.tensordot(shares, body.data.force, 1)])
    if body.data.volume is not None:
        x = np.concatenate([x, mesh.x])
        force = np.concatenate(
            [force, -mesh.weight[:, None] * np.tensordot(shares, body.data.volume[2], 1)]
        )
    motions = mesh.motions.of(x, mesh.weight @ mesh.x / mesh.weight.sum())
    size = np.abs(force).max(initial=0.0) or 1.0  # squares of tiny forces underflow
    force = force / size
    each = np.einsum("ic,icr->ir", force, motions)
    reach = np.linalg.norm(motions, axis=1)
    arms = reach * np.linalg.norm(force, axis=1)[:, None]
    acting = (
        sigma.any()
        or len(force) > len(u)
        or np.tensordot(shares, body.data.known_traction, 1).any()
    )
    noise = WRITTEN if acting else max(WRITTEN, _noise(body, u, motions[: len(u)]))
    with np.errstate(over="ignore"):  # beside displacements of any size tiny forces are round-off
        least = (
            noise
            * body.operators.traction_scale
            * (np.abs(u).max(initial=0.0) / size)
            * mesh.weight.sum()
        )
    smallest = least * reach.max(axis=0) + np.finfo(float).tiny
    worst = float((np.abs(each.sum(axis=0)) / np.maximum(arms.sum(axis=0), smallest)).max())
    if body.modes.shape[2]:
        strained = max(
            body.displaced(u - body.modes @ alpha, traction),
            WRITTEN * float(np.abs(u).max(initial=0.0)),
        )
        multipliers = body.unknowns(shares, sigma)[body.operators.n_unknowns :]
        drift = float(np.abs(body.modes @ multipliers).max(initial=0.0))
        worst = max(worst, drift / strained if strained > 0.0 else 0.0)
    return worst


def _noise(body: ElasticBody, u: Array, motions: Array) -> float:
    """`STILL`, or the tolerance of the compression, where that explains all by which u is not a
    rigid motion; else 0."""
    rigid = motions.reshape(u.size, -1)
    strained = u.ravel() - rigid @ np.linalg.lstsq(rigid, u.ravel(), rcond=None)[0]
    most = max(STILL, BLOCKS * body.tolerance)
    return most if np.abs(strained).max() <= most * np.abs(u).max() else 0.0


def increment_findings(residuals: dict[str, float], between: Finding | None) -> list[Finding]:
    """Why a converged increment is not accepted.

    Parameters
    ----------
    residuals : dict
        equilibrium, overlap, elimination; what is nan is not judged.
    between : Finding, optional
        The largest overlap between nodes where it is judged.
    """
    findings = [
        new_finding(
            kind,
            text.format(found=residuals[kind], limit=limit_of(kind)),
            advice=advice,
            measured=residuals[kind],
        )
        for kind, (text, advice) in MISSED.items()
        if residuals[kind] > limit_of(kind)
    ]
    if between is not None and between.measured > limit_of("overlap between nodes"):
        findings.append(as_kind(between, "overlap between nodes", REFINE))
    return findings


def rough_step(results: Sequence[StepResult]) -> tuple[int, StepResult] | None:
    """The first end of a step, with its index, whose overlap between nodes is not small next to the
    whole path.

    A contact that a step only begins may be smaller than an element: that is accepted where a later
    step, or an earlier one, displaces the surfaces by ten times as much as they overlap here.
    """
    most = max(
        (float(np.nan_to_num(result.residuals["displaced"])) for result in results), default=0.0
    )
    for k, result in enumerate(results):
        depth = result.residuals["between"]
        between = overlap_of(result)
        ends = result.status == "converged" and result.load_factor == 1.0
        if (
            between is not None
            and ends
            and depth > limit_of("overlap between nodes") * (depth + most)
        ):
            decisive = as_kind(between, "overlap between nodes", REFINE)
            status, reason = judged([decisive], "")
            return k, replace(
                result, status=status, reason=reason, findings=(decisive, *result.findings)
            )
    return None


def overlap_of(result: StepResult) -> Finding | None:
    """The overlap between nodes that an increment was accepted with, if there is one."""
    return next((each for each in result.findings if each.kind == "overlap on the way"), None)
