"""The judge: what a finding of each kind means for a solution.

A check looks at one thing and returns findings. This table alone says whether a finding refuses
the problem, ends the solve, is shown as a warning, or is told beside the reason. A new check is a
function that returns findings, and a line here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

from ...errors import InputError
from ...results.report import Finding

KINDS = {
    # before the bodies are eliminated
    "thickness": "refused",
    "stiffness": "refused",
    "bending": "warning",
    "distortion": "warning",
    "matching": "warning",
    "facing": "warning",
    "fitting gap": "warning",
    "volume loads": "warning",
    # of an increment
    "stopped": "failed",
    "elastic residual": "failed",
    "not solved": "not converged",
    "displacement": "not converged",
    "friction bound": "not converged",
    "reaction": "not converged",
    "elimination": "not converged",
    "equilibrium": "not converged",
    "overlap": "not converged",
    "overlap between nodes": "not converged",
    "contact law": "not converged",
    "overlap on the way": "note",
    "overlap under pressure": "warning",
    "loose motion": "warning",
    "rough motion": "warning",
    "second solution": "warning",
    # of a solution
    "no contact": "note",
    "far apart": "note",
    "ignored load": "warning",
    "jam": "warning",
    "moments": "warning",
    "sag": "warning",
    "uneven tractions": "warning",
    "rough increments": "warning",
    "large motion": "warning",
    "path": "warning",
    "known data": "warning",
    "accuracy": "warning",
    "meshes": "warning",
    "accuracy wanted": "not converged",
    "method error": "not converged",
    "missed data": "not converged",
}
"""Severity of findings by their kind."""
SMALLER_ELEMENTS = frozenset({"elimination", "equilibrium", "overlap between nodes"})
"""Kinds of findings that smaller elements mend: adaptive solves go on after them."""
WHOLE_MESH = SMALLER_ELEMENTS - {"overlap between nodes"}
"""Those that say nothing of where elements are too large."""
DECISIVE = ("failed", "not converged")
"""Severities that end a solve."""


def new_finding(
    kind: str,
    text: str,
    where: str = "",
    *,
    advice: str = "",
    measured: float = math.nan,
    limit: float = math.nan,
) -> Finding:
    """A finding of a kind, whose severity the table has."""
    return Finding(kind, KINDS[kind], text, where, advice, measured, limit)


def as_kind(finding: Finding, kind: str, advice: str = "") -> Finding:
    """A finding looked at in another way, and what to change."""
    return replace(finding, kind=kind, severity=KINDS[kind], advice=advice)


def refuse(findings: Iterable[Finding]) -> None:
    """Raise the first finding that refuses the problem.

    Raises
    ------
    InputError
    """
    for finding in findings:
        if finding.severity == "refused":
            raise InputError(str(finding))


def judged(findings: Iterable[Finding], reason: str) -> tuple[str, str]:
    """Status and reason: those of the first decisive finding, else "converged" for the reason
    given and what notes add to it.

    >>> judged([new_finding("far apart", "lies 2 apart", "pair 'a'")], "residuals 1e-9")
    ('converged', "residuals 1e-9; pair 'a': lies 2 apart")
    """
    findings = list(findings)
    for finding in findings:
        if finding.severity in DECISIVE:
            return finding.severity, str(finding)
    return "converged", "; ".join([reason, *(str(f) for f in findings if f.severity == "note")])


def wants_smaller_elements(findings: Iterable[Finding]) -> frozenset[str]:
    """Kinds of the findings that smaller elements mend."""
    return SMALLER_ELEMENTS & {finding.kind for finding in findings}
