"""Problems of a sweep: which of them share a preparation, and one of them run on it."""

from __future__ import annotations

import contextlib
import re
from dataclasses import replace

from ..contact.methods.registry import method_of
from ..model.problem import Problem
from ..pipeline.pose.discretise import discretise
from ..pipeline.run import prepare, run
from ..pipeline.solve import adapts_itself, solve
from ..pipeline.steps.prepared import PreparedProblem
from ..results.solution import Solution
from ..untyped import Comm

FRICTION = re.compile(
    r"(step\.\d+\.)?(contact|boundary|body\.\d+\.boundary)\.\d+\."
    r"(friction_coefficient|friction_bound|wear_coefficient)"
)
GAPS = re.compile(
    r"(step\.\d+\.)?(contact|boundary|body\.\d+\.boundary)\.\d+\.(gap|interference|clearance)"
)
PRELOADS = re.compile(r"(step\.\d+\.)?(contact|boundary|body\.\d+\.boundary)\.\d+\.preload")
MOTIONS = re.compile(
    r"(step\.\d+\.)?obstacle\.\d+\.(displacement|rotation|force|moment|by)(\.\d+)?"
    r"|step\.\d+\.(increments|name)"
)
LOADS = re.compile(
    r"(step\.\d+\.|body\.\d+\.)?"
    r"(boundary\.\d+\.(value|pressure|jump|by)|point_force\.\d+\.(force|at))(\.\d+)?"
    r"|(step\.\d+\.loads\.\d+|(body\.\d+\.)?loads)\."
    r"(acceleration|force|angular_velocity|centre|axis|temperature)(\.\d+)?"
    r"|(body\.\d+\.)?material\.(density|thermal_expansion)"
)


def elimination_needs(key: str, value: object, *, meshes_fixed: bool) -> object:
    """What of the value of a dotted key the elimination depends on: None if nothing, else what must
    be the same.

    Parameters of the method are nothing to it, coefficients and bounds of friction, those of wear,
    how many cycles and increments there are, motions and loads of obstacles. Where meshes follow
    from sizes that are given, gaps and loads are not either, but for which components are free, and
    friction may be an expression; where meshes resolve their data, or friction is zero, they may
    differ.
    """
    if key.startswith(("method.", "cycle.")):
        return value if key == "method.formulation" else None
    if key == "title" or MOTIONS.fullmatch(key):
        return None
    if FRICTION.fullmatch(key):
        positive = value > 0.0 if isinstance(value, (int, float)) else meshes_fixed
        return None if positive else value
    if PRELOADS.fullmatch(key):
        return _word(value)
    if meshes_fixed and GAPS.fullmatch(key):
        return value == "geometry" or None
    if meshes_fixed and LOADS.fullmatch(key):
        return list(map(_word, value)) if isinstance(value, list) else _word(value)
    return value


def _word(component: object) -> str | None:
    """What of a component the elimination depends on: whether it is free, or goes on."""
    return component if component in ("free", "hold", "locked") else None


def prepared_for(case: Problem, comm: Comm, cases: int) -> PreparedProblem | None:
    """What the cases of a group share; nothing where meshes follow the solution of each."""
    return None if adapts_itself(case) else prepare(case, comm, cases=cases)


def run_case(shared: PreparedProblem | None, case: Problem, comm: Comm = None) -> Solution:
    """One case on the preparation of its group; eliminated on its own where other loads take
    that, and solved as by itself where nothing is shared."""
    if shared is None:
        return solve(case, comm=comm)
    discrete = discretise(case, like=shared.discrete)
    system = shared.system.loaded(discrete.data, discrete.interfaces)
    if system is not None:
        return run(replace(shared, discrete=discrete, system=system, method=method_of(case.method)))
    with contextlib.closing(prepare(case, comm, discrete)) as own:
        return run(own)
