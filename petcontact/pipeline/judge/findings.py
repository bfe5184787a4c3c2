"""The judge: one table says what a finding of each kind means for a solution.

A check measures one quantity and returns findings. Only the table `KINDS` decides what a finding
does: it refuses the problem, ends the solve, is shown as a warning, or is added to the reason. A
new check is a function that returns findings, and a line in the table.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

from ...errors import InputError
from ...results.report import Finding


class Kind(NamedTuple):
    """What a finding of one kind does, and the limit beyond which the check reports it."""

    severity: str
    limit: float = math.nan


KINDS = {
    # before the bodies are eliminated
    "thickness": Kind("refused"),
    # ratio of Young's moduli: the displacements of two bodies are added with 16 digits
    "stiffness": Kind("refused", 1e12),
    "bending": Kind("warning"),
    # largest over smallest area factor within one curved element
    "distortion": Kind("warning", 2.0),
    "matching": Kind("warning"),
    "facing": Kind("warning"),
    "fitting gap": Kind("warning"),
    # noise of measured points over their second differences, of which pressures are made
    "noise": Kind("warning", 0.1),
    # deviation of the largest pressure by noise that is left; two of them are the wanted accuracy
    "spread": Kind("warning", 5e-3),
    "volume loads": Kind("warning"),
    # for one increment
    "stopped": Kind("failed"),
    # defect of the boundary integral equations over the largest displacement; compressed bodies may
    # have `BLOCKS` times their tolerance
    "elastic residual": Kind("failed", 1e-7),
    "not solved": Kind("not converged"),
    # displacement over the size of the body; more means that loads and moduli differ in units
    "displacement": Kind("not converged", 1e9),
    "friction bound": Kind("not converged"),
    # difference of force or moment between the two sides of an interface, over all that acts
    "reaction": Kind("not converged", 1e-2),
    # error of a solution that is known exactly; bodies that are not thin have 1e-14 to 1e-12
    "elimination": Kind("not converged", 1e-4),
    # resultant on a body over the sum of the forces' sizes; fine meshes have 1e-7 to 7e-3
    "equilibrium": Kind("not converged", 0.1),
    # overlaps are divided by the displacement that contact causes
    "overlap": Kind("not converged", 1e-3),
    "overlap between nodes": Kind("not converged", 0.1),
    # natural residual over the tractions of an interface; 0 or 1 if there are no tractions
    "contact law": Kind("not converged", 1e-2),
    "overlap on the way": Kind("note", 0.1),
    # rollers had 0.85 and 0.91, and a fifth of their force, on 2 rows of nodes; 0.58 and 0.39 on
    # 3 rows; 0.04 on 8 rows
    "overlap under pressure": Kind("warning", 0.3),
    "iterations": Kind("warning"),
    "loose motion": Kind("warning"),
    "second solution": Kind("warning"),
    # for the whole solution
    "no contact": Kind("warning"),
    "unpaired": Kind("warning"),
    # initial gap or overlap over the size of the body
    "far apart": Kind("warning", 0.05),
    "through": Kind("refused", 1.0),
    # pressure along the surface over the pressure, as the estimated error of "accuracy"
    "oblique": Kind("warning", 0.1),
    "mixed planes": Kind("warning"),
    "ignored load": Kind("warning"),
    # pressure after all loads are taken away, over the largest pressure of the path
    "jam": Kind("warning", 1e-3),
    # as "reaction"; friction across a gap makes a couple
    "moments": Kind("warning", 1e-3),
    # height of curved faces above their facets, over the gap that contact closes
    "sag": Kind("warning", 0.1),
    # as "equilibrium"
    "uneven tractions": Kind("warning", 0.02),
    "rough increments": Kind("warning"),
    # limits of small displacements: rotation [rad], travel over the size of the body, and below
    # slip over the size of an element
    "turn": Kind("warning", 0.1),
    "travel": Kind("warning", 0.1),
    # deflection over the thickness: a plate whose edges cannot draw in is a tenth stiffer there
    # (S. Timoshenko and S. Woinowsky-Krieger, Theory of plates and shells, 1959, section 97)
    "bend": Kind("warning", 0.5),
    # arc by which a turning round body carries its contact along, over the contact's width: the arm
    # of its force is wrong by this arc
    "roll": Kind("warning", 0.1),
    "rolled off": Kind("not converged", 1.0),
    "slip": Kind("warning", 1.0),
    # estimated L2 error of q over the norm of p, where the user wants no accuracy
    "path": Kind("warning", 0.03),
    # unusual data: linear elasticity neglects squares of the strain; 5e-9 is 1 kPa on steel; dry
    # pairs have friction coefficients of 0.05 to 1.5; overlap is over the size of the body
    "strain": Kind("warning", 0.05),
    "tiny strain": Kind("warning", 5e-9),
    "friction coefficient": Kind("warning", 2.0),
    "closed gap": Kind("warning"),
    "cut off": Kind("warning"),
    "empty step": Kind("warning"),
    # share of given data between the nodes; constant elements miss 16 % of a sine at ten elements
    # a period
    "known data": Kind("warning", 0.25),
    # estimated error
    "accuracy": Kind("warning", 0.1),
    "meshes": Kind("warning"),
    "interrupted": Kind("warning"),
    "accuracy wanted": Kind("not converged"),
    "method error": Kind("not converged"),
    "missed data": Kind("not converged"),
}
"""Severity and limit of each kind of finding. The comment above an entry defines its limit."""
SMALLER_ELEMENTS = frozenset({"elimination", "equilibrium", "overlap between nodes"})
"""Kinds of findings that smaller elements mend: an adaptive solve refines and goes on."""
WHOLE_MESH = SMALLER_ELEMENTS - {"overlap between nodes"}
"""Kinds that do not show which elements are too large: all elements are refined."""
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
    """Return a finding with the severity of its kind, and its limit unless one is given."""
    severity, usual = KINDS[kind]
    return Finding(kind, severity, text, where, advice, measured, usual if limit is None else limit)


def limit_of(kind: str) -> float:
    """Return the limit of a kind, nan where the limit is not one number."""
    return KINDS[kind].limit


def as_kind(finding: Finding, kind: str, advice: str = "") -> Finding:
    """Return the finding as one of another kind, with that kind's severity and new advice."""
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
    """Return the status and the reason that follow from findings.

    They are those of the first decisive finding. Without one, the status is "converged" and the
    reason is the given one, followed by the notes.

    >>> judged([new_finding("overlap on the way", "it is 2", "pair 'a'")], "residuals 1e-9")
    ('converged', "residuals 1e-9; pair 'a': it is 2")
    """
    findings = list(findings)
    for finding in findings:
        if finding.severity in DECISIVE:
            return finding.severity, str(finding)
    return "converged", "; ".join([reason, *(str(f) for f in findings if f.severity == "note")])


def wants_smaller_elements(findings: Iterable[Finding]) -> frozenset[str]:
    """Return the kinds of the given findings that smaller elements mend."""
    return SMALLER_ELEMENTS & {finding.kind for finding in findings}
