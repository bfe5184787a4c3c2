"""Checks that a converged increment must pass beyond the residuals of its equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...compliance.body.eliminated import ElasticBody
from ...results.records import StepResult
from ...results.report import Finding
from ...round_off import TINY, WRITTEN
from .findings import as_kind, judged, limit_of, new_finding

REFINE = (
    "refine the mesh there (smaller elements, --adapt, or no [mesh] at all; in the plane "
    "mesh.graded_points with mesh.grading)"
)
"""Advice for surfaces that overlap between nodes."""
BLOCKS = 5.0
"""Accepted residual of a compressed body over the tolerance of its compression [-]. The tolerance
bounds each block by itself. Three bolted bodies had 1 to 2.2 times the tolerance at 1e-4 and 1e-5,
one body or two blocks less. So do nodes after methods that end at a change: their tractions were
0.1 to 3.1 times the tolerance away from where a step that gives nothing should leave them."""
STILL = 1e-3
"""Strained part of u over its rigid motion, up to which a body only moves [-]. Slits
between curved panels of different sizes, as adaptive meshes have them, strain such a body by
0.0005."""
MISSED = {
    "elimination": (
        "a body is too thin for its mesh: its elimination is off by {value:.1e}, at most "
        "{limit:g} is accepted",
        "choose smaller elements",
    ),
    "equilibrium": (
        "the tractions of a body are not in equilibrium: {value:.1e} of their sum is left, at most "
        "{limit:g} is accepted",
        "choose smaller elements",
    ),
    "overlap": (
        "surfaces overlap by {value:.1e} of what contact displaces",
        "choose a smaller tolerance",
    ),
}
"""Message and advice for each residual that is too large, by the kind of the finding."""


def imbalance(
    body: ElasticBody, shares: Array, u: Array, traction: Array, sigma: Array, alpha: Array
) -> float:
    """Return the resultant force or moment on a body over the sum of all sizes, at most 1 [-].

    The larger of the two ratios is returned. On a body that only contact holds, the resultant is
    zero by construction. There the value is the multipliers of its rigid motions, over the largest
    displacement that strains the body. Tractions below the round-off of the displacement are not
    counted. On compressed operators their tolerance also makes small tractions on a body that
    nothing loads and that moves as a whole; these are not counted either.

    Parameters
    ----------
    body : ElasticBody
        A body of finite size.
    shares : (K,) array
        Share of each load state.
    u, traction : (n, d) arrays
        [length], [stress]
    sigma : (m, k) array
        Tractions at contact nodes [stress].
    alpha : (r,) array
        Amplitudes of the rigid motions.
    """
    mesh = body.mesh
    x, force = mesh.x, mesh.weight[:, None] * traction
    if body.data.point.size:
        x = np.concatenate([x, body.data.point])
        force = np.concatenate([force, np.tensordot(shares, mesh.depth * body.data.force, 1)])
    if body.data.volume is not None:
        x = np.concatenate([x, mesh.x])
        force = np.concatenate(
            [force, -mesh.weight[:, None] * np.tensordot(shares, body.data.volume[2], 1)]
        )
    motions = mesh.motions.modes(x, mesh.weight @ mesh.x / mesh.weight.sum())
    size = np.abs(force).max(initial=0.0) or 1.0  # squares of tiny forces underflow
    force = force / size
    loads = np.einsum("ic,icr->ir", force, motions)
    reach = np.linalg.norm(motions, axis=1)
    arms = reach * np.linalg.norm(force, axis=1)[:, None]
    acting = (
        sigma.any()
        or len(force) > len(u)
        or np.tensordot(shares, body.data.known_traction, 1).any()
    )
    noise = WRITTEN if acting else max(WRITTEN, _noise(body, u, motions[: len(u)]))
    with np.errstate(over="ignore"):  # forces may be too tiny to divide by
        least = (
            noise
            * body.operators.traction_scale
            * (np.abs(u).max(initial=0.0) / size)
            * mesh.weight.sum()
        )
    smallest = least * reach.max(axis=0) + TINY
    worst = float((np.abs(loads.sum(axis=0)) / np.maximum(arms.sum(axis=0), smallest)).max())
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
    """Return the relative noise of u if it explains all by which u is not a rigid motion, else 0
    [-].

    The noise is `STILL`, or `BLOCKS` times the tolerance of the compression if that is larger.
    """
    rigid = motions.reshape(u.size, -1)
    strained = u.ravel() - rigid @ np.linalg.lstsq(rigid, u.ravel(), rcond=None)[0]
    most = max(STILL, BLOCKS * body.tolerance)
    return most if np.abs(strained).max() <= most * np.abs(u).max() else 0.0


def increment_findings(residuals: dict[str, float], between: Finding | None) -> list[Finding]:
    """Return the reasons why a converged increment is not accepted.

    Parameters
    ----------
    residuals : dict
        Values of equilibrium, overlap and elimination; nan is not judged.
    between : Finding, optional
        The largest overlap between nodes, if it is judged.
    """
    findings = [
        new_finding(
            kind,
            text.format(value=residuals[kind], limit=limit_of(kind)),
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
    """Return the first end of a step with a large overlap between nodes, and its index.

    The overlap is compared with the displacement of the whole path. A step may begin a contact that
    is smaller than an element. It is accepted if any step displaces the surfaces by about ten times
    the overlap.
    """
    most = max(
        (float(np.nan_to_num(result.residuals["displaced"])) for result in results), default=0.0
    )
    for k, result in enumerate(results):
        depth = result.residuals["between"]
        between = overlap_of(result)
        ends = result.status == "converged" and result.ends
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
    """Return the overlap between nodes with which an increment was accepted, or None."""
    return next(
        (finding for finding in result.findings if finding.kind == "overlap on the way"), None
    )
