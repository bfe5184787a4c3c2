"""Cases of any kind, one body or several, behind one pair of calls: prepare what a group shares, run a case on it."""

from __future__ import annotations

import dataclasses
from typing import Any

from ..model.assembly import Assembly, assembly_of
from ..model.case import Case
from ..pipeline import prepare as preparation
from ..pipeline import run as pipeline
from ..pipeline.increment import SteppedProblem
from ..pipeline.load_steps import prepare_assembly, run_steps
from ..pipeline.prepare import Prepared
from ..results.solution import Solution

AnyCase = Case | Assembly
Shared = Prepared | SteppedProblem
"""What the cases of a group have in common."""


def prepare_group(case: AnyCase, comm: Any, cases: int) -> Shared:
    """Discretise and eliminate for so many cases that differ in their method alone."""
    if isinstance(case, Case) and case.plain:
        return preparation.prepare(case, comm, cases)
    return prepare_assembly(assembly_of(case), comm)


def run_case(shared: Shared, case: AnyCase) -> Solution:
    """One case of the group."""
    if isinstance(shared, Prepared):
        assert isinstance(case, Case)
        return pipeline.run(shared, case)
    discrete = dataclasses.replace(shared.discrete, assembly=assembly_of(case))
    return run_steps(dataclasses.replace(shared, discrete=discrete))


def release(shared: Shared) -> None:
    """Free every PETSc object; a system of several bodies has none."""
    if isinstance(shared, Prepared):
        shared.close()
