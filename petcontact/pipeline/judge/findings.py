"""The judge: what a finding of each kind means for a solution.

A check looks at one thing and returns findings. This table alone says whether a finding refuses
the problem, ends the solve, is shown as a warning, or is told beside the reason. A new check is a
function that returns findings, and a line here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

from ...errors import InputError
from ...results.report import Finding


class Kind(NamedTuple):
    """What follows from findings of a kind, and the number beyond which there is one."""

    severity: str
    limit: float = math.nan


KINDS = {
    # before the bodies are eliminated
    "thickness": Kind("refused"),
    # ratio of Young's moduli: displacements of two bodies add up in 16 digits
    "stiffness": Kind("refused", 1e12),
    "bending": Kind("warning"),
    # largest over smallest area factor within a curved element
    "distortion": Kind("warning", 2.0),
    "matching": Kind("warning"),
    "facing": Kind("warning"),
    "fitting gap": Kind("warning"),
    "volume loads": Kind("warning"),
    # of an increment
    "stopped": Kind("failed"),
    "elastic residual": Kind("failed"),
    "not solved": Kind("not converged"),
    # displacement over the size of the body: loads and moduli are in different units
    "displacement": Kind("not converged", 1e9),
    "friction bound": Kind("not converged"),
    # force or moment that the two sides of an interface do not have alike, over all that acts
    "reaction": Kind("not converged", 1e-2),
    # error of a known solution; bodies that are not thin leave 1e-14 to 1e-12
    "elimination": Kind("not converged", 1e-4),
    # resultant on a body over the sum of sizes; meshes that resolve tractions leave 1e-7 to 7e-3
    "equilibrium": Kind("not converged", 0.1),
    # overlaps are over what contact displaces
    "overlap": Kind("not converged", 1e-3),
    "overlap between nodes": Kind("not converged", 0.1),
    # natural residual over the tractions of an interface; without any it is 0 or 1
    "contact law": Kind("not converged", 1e-2),
    "overlap on the way": Kind("note", 0.1),
    # rollers on 2 rows of nodes had .85 and .91 and a fifth of their force; on 3 rows .58 and .39;
    # on 8 rows .04
    "overlap under pressure": Kind("warning", 0.3),
    "iterations": Kind("warning"),
    "loose motion": Kind("warning"),
    "rough motion": Kind("warning"),
    "second solution": Kind("warning"),
    # of a solution
    "no contact": Kind("warning"),
    "unpaired": Kind("warning"),
    # initial gap or overlap over the size of the body
    "far apart": Kind("warning", 0.05),
    "ignored load": Kind("warning"),
    # pressure over the largest that there was, after all loads are taken away
    "jam": Kind("warning", 1e-3),
    # as "reaction", with the couple of friction across a gap
    "moments": Kind("warning", 1e-3),
    # height of curved faces over facets, over what contact closes
    "sag": Kind("warning", 0.1),
    # as "equilibrium"
    "uneven tractions": Kind("warning", 0.02),
    "rough increments": Kind("warning"),
    # displacements are small up to these: a rotation [rad], over the size of the body, and over
    # that of the elements
    "turn": Kind("warning", 0.1),
    "travel": Kind("warning", 0.1),
    # by the arc that a contact moves along a round body that turns, over its width: its arm is off
    # by that, and what holds the body is of that order
    "roll": Kind("warning", 0.1),
    "rolled off": Kind("not converged", 1.0),
    "slip": Kind("warning", 1.0),
    # error of q over p in L2, where no accuracy is wanted
    "path": Kind("warning", 0.03),
    # what is out of scale: linear elasticity leaves out squares of the strain; 5e-9 is 1 kPa on
    # steel; dry pairs have coefficients of 0.05 to 1.5; overlap over the size of the body
    "strain": Kind("warning", 0.05),
    "tiny strain": Kind("warning", 5e-9),
    "friction coefficient": Kind("warning", 2.0),
    "closed gap": Kind("warning"),
    "large overlap": Kind("warning", 0.1),
    "empty step": Kind("warning"),
    "known data": Kind("warning"),
    # estimated error
    "accuracy": Kind("warning", 0.1),
    "meshes": Kind("warning"),
    "accuracy wanted": Kind("not converged"),
    "method error": Kind("not converged"),
    "missed data": Kind("not converged"),
}
"""Severity and limit of findings by their kind."""
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
    limit: float | None = None,
) -> Finding:
    """A finding of a kind, whose severity and limit, if no other one is given, the table has."""
    severity, usual = KINDS[kind]
    return Finding(kind, severity, text, where, advice, measured, usual if limit is None else limit)


def limit_of(kind: str) -> float:
    """The number beyond which there is a finding of a kind, nan where that is not one number."""
    return KINDS[kind].limit


def as_kind(finding: Finding, kind: str, advice: str = "") -> Finding:
    """A finding looked at in another way, and what to change."""
    return replace(finding, kind=kind, severity=KINDS[kind].severity, advice=advice)


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

    >>> judged([new_finding("overlap on the way", "it is 2", "pair 'a'")], "residuals 1e-9")
    ('converged', "residuals 1e-9; pair 'a': it is 2")
    """
    findings = list(findings)
    for finding in findings:
        if finding.severity in DECISIVE:
            return finding.severity, str(finding)
    return "converged", "; ".join([reason, *(str(f) for f in findings if f.severity == "note")])


def wants_smaller_elements(findings: Iterable[Finding]) -> frozenset[str]:
    """Kinds of the findings that smaller elements mend."""
    return SMALLER_ELEMENTS & {finding.kind for finding in findings}
