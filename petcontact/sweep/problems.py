"""Cases of any kind, one body or several: what a group shares is prepared once, and each of its cases is run on it."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

from ..model.assembly import Assembly, assembly_of
from ..model.case import Case
from ..pipeline import prepare as preparation
from ..pipeline import run as pipeline
from ..pipeline.assemble import with_laws_of
from ..pipeline.increment import SteppedProblem
from ..pipeline.load_steps import prepare_assembly, run_steps
from ..pipeline.prepare import Prepared, is_stepped
from ..results.solution import Solution
from ..results.steps.solution import AssemblySolution

AnyCase = Case | Assembly
AnySolution = Solution | AssemblySolution
Shared = Prepared | SteppedProblem
"""What the cases of a group have in common."""
LAWS = re.compile(r"contact\.\d+\.friction_(coefficient|bound)")
MOTIONS = re.compile(r"(step\.\d+\.)?obstacle\.\d+\.(displacement|rotation|force|moment)(\.\d+)?")


def shares_elimination(key: str, value: Any) -> bool:
    """Whether cases that differ in the value of a dotted key, of this one and others like it, share their elimination.

    Parameters of the method do; coefficients and bounds of friction between bodies, and motions and loads of obstacles do.
    The elimination depends on meshes, materials, on which components are known, and on the data of the bodies (their loads
    are eliminated with them); a friction that is zero or an expression may change the mesh.
    """
    if key.startswith("method."):
        return key != "method.formulation"
    if LAWS.fullmatch(key):
        return isinstance(value, (int, float)) and value > 0.0
    return key == "title" or MOTIONS.fullmatch(key) is not None


def bodies_of(case: AnyCase) -> list[tuple[Any, set[str]]]:
    """The bodies of a case, and the names of their parts in contact."""
    pairs = case.contact if isinstance(case, Assembly) else ()
    sides = {side.split(".")[-1] for pair in pairs for side in (pair.secondary, pair.primary)}
    return [(body, sides | {condition.part for condition in body.boundary if condition.condition == "contact"})
            for body in (case.body if isinstance(case, Assembly) else [case])]  # fmt: skip


def prepare_group(case: AnyCase, comm: Any, cases: int) -> Shared:
    """Discretise and eliminate for so many cases that share it."""
    if isinstance(case, Case) and not is_stepped(case):
        return preparation.prepare(case, comm, cases)
    return prepare_assembly(assembly_of(case), comm)


def run_case(shared: Shared, case: AnyCase) -> AnySolution:
    """One case of the group."""
    if isinstance(shared, Prepared):
        assert isinstance(case, Case)
        return pipeline.run(shared, case)
    return run_steps(dataclasses.replace(shared, discrete=with_laws_of(shared.discrete, assembly_of(case))))


def release(shared: Shared) -> None:
    """Free every PETSc object; a system of several bodies has none."""
    if isinstance(shared, Prepared):
        shared.close()
