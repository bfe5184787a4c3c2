"""Problems of a sweep: what a group shares is prepared once, and a case runs on it."""

from __future__ import annotations

import dataclasses
from typing import Any

from ..contact.methods.registry import method_of
from ..model.problem import Problem
from ..pipeline.increment import PreparedProblem
from ..pipeline.run import prepare, run
from ..results.solution import Solution


def prepare_group(case: Problem, comm: Any, cases: int) -> PreparedProblem:
    """Discretise and eliminate for so many cases that differ in their method alone."""
    return prepare(case, comm, cases=cases)


def run_case(shared: PreparedProblem, case: Problem) -> Solution:
    """One case of the group."""
    discrete = dataclasses.replace(shared.discrete, problem=case, warnings=list(shared.discrete.warnings))
    return run(dataclasses.replace(shared, discrete=discrete, method=method_of(case.method)))


def release(shared: PreparedProblem) -> None:
    """Free every PETSc object."""
    shared.close()
