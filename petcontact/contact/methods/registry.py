"""The methods behind one call: `run_method` takes the name, its parameters and a contact system."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...arrays import Array, Index
from ...compliance.base import ContactSystem
from ...errors import InputError
from ...mesh.curve_mesh import CurveMesh, as_curve
from ...model.solver_options import Method
from ...results.solution import ContactFields
from ..rho_rules import Rule, make_rule
from ..state import ContactState
from .newton import semismooth_newton
from .operator_robin import operator_robin
from .projection import Criterion, project
from .tao import tao


def run_method(
    system: ContactSystem,
    method: Method,
    rule: Rule | None = None,
    monitor: Callable[[ContactState], None] | None = None,
    start: tuple[Array, Array] | None = None,
) -> ContactState:
    """Solve u_t = u_0 + S σ_t with the friction condition by the method's name.

    Parameters
    ----------
    system : ContactSystem
        Dense or compressed, condensed or full.
    method : Method
    rule : Rule, optional
        Over `method.rule`, for the projection method.
    monitor : callable, optional
        Called with the state so far after each iteration.
    start : pair of (m, 1) arrays, optional
        Initial u_t [length] and σ_t [stress], over `method.start`.

    Raises
    ------
    InputError
        If `method.start` names no usable result file.
    SolverError
        If a solve or an iterate fails.
    """
    criterion = Criterion(method.tolerance, method.stop)
    limit = method.max_iterations
    start = start if start is not None else initial_functions(system, method.start)
    name = "projection" if rule is not None else method.resolved_name
    if name == "semismooth-newton":
        return semismooth_newton(system, criterion=criterion, max_iterations=limit, start=start, monitor=monitor)
    if name == "operator-robin":
        return operator_robin(
            system, omega=method.omega, criterion=criterion, max_iterations=limit, start=start, monitor=monitor
        )
    if name == "tao":
        return tao(system, criterion=criterion, max_iterations=limit, start=start, monitor=monitor)
    return project(
        system, rule or make_rule(method), rho=method.rho, omega=method.omega, criterion=criterion,
        max_iterations=limit, start=start, monitor=monitor,
    )  # fmt: skip


def initial_functions(system: ContactSystem, name: str) -> tuple[Array, Array] | None:
    """Initial functions by name; those of a result file are carried over by arc length, part by part."""
    if name == "zero":
        return None
    if name == "frictionless":
        return system.u_0, np.zeros_like(system.u_0)
    if not Path(name).exists():
        raise InputError(f'method.start: {name!r} is neither "zero", "frictionless" nor a result file')
    from ...results.hdf5 import read_solution

    operators = system.operators
    return carried_over(read_solution(name).contact, as_curve(operators.mesh), operators.data.contact_nodes)


def carried_over(old: ContactFields, mesh: CurveMesh, nodes: Index) -> tuple[Array, Array]:
    """u_t and σ_t (m, 1) of a solution at the contact nodes of another mesh, by arc length along each part."""
    names = np.array(mesh.part_names)[mesh.node_part[nodes]]
    u, sigma = np.zeros((len(nodes), 1)), np.zeros((len(nodes), 1))
    for part in np.unique(names):
        here, there = names == part, old.part == part
        if there.any():
            s = mesh.arc_length[nodes[here]]
            u[here, 0] = np.interp(s, old.arc_length[there], old.u_t[there, 0])
            sigma[here, 0] = np.interp(s, old.arc_length[there], old.sigma_t[there, 0])
    return u, sigma
