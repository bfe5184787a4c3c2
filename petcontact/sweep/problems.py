"""Problems of a sweep: which of them share a preparation, and one of them run on it."""

from __future__ import annotations

import dataclasses
import re
from typing import Any

from ..contact.methods.registry import method_of
from ..model.problem import Problem
from ..pipeline.discrete.discretise import with_laws_of
from ..pipeline.run import run
from ..pipeline.steps.increment import PreparedProblem
from ..results.solution import Solution

LAWS = re.compile(r"(contact|boundary|body\.\d+\.boundary)\.\d+\.(friction_coefficient|friction_bound|wear_coefficient)")
MOTIONS = re.compile(r"(step\.\d+\.)?obstacle\.\d+\.(displacement|rotation|force|moment)(\.\d+)?")


def shares_elimination(key: str, value: Any) -> bool:
    """Whether cases that differ in the value of a dotted key, of this one and others like it, share their elimination.

    Parameters of the method do; coefficients and bounds of friction do, those of wear, and how many cycles there are;
    motions and loads of obstacles do. The elimination depends on meshes, materials, on which components are known, and on
    the data of the bodies (their loads are eliminated with them); a friction that is zero or an expression may change the
    mesh.
    """
    if key.startswith(("method.", "cycle.")):
        return key != "method.formulation"
    if LAWS.fullmatch(key):
        return isinstance(value, (int, float)) and value > 0.0
    return key == "title" or MOTIONS.fullmatch(key) is not None


def run_case(shared: PreparedProblem, case: Problem) -> Solution:
    """One case on the preparation of its group."""
    discrete = with_laws_of(shared.discrete, case)
    return run(dataclasses.replace(shared, discrete=discrete, method=method_of(case.method)))
