"""Result files of format 1, one body in the paper's contact: read, never written."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...contact.state import COLUMNS, History
from ...errors import ResultError
from ...geometry.rotation import moment
from ...given.tables.base import parse
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.storage import demand, read_mesh
from ...model.problem import ONE_BODY, Problem
from ..data import SolutionData
from ..records import BodyResult, ContactFields, PairResult, StepResult
from .checks import check_fields, check_history, check_pair, read_table
from .report import read_report


def read_format1(group: Any, attributes: dict[str, Any], source: str) -> SolutionData:
    """The solution of a checked group of format 1.

    Raises
    ------
    ResultError
        If it holds no fields, or they do not fit each other.
    """
    if "boundary" not in group:
        raise ResultError(
            f"{source}: holds no fields, the case failed ({attributes.get('reason')})"
        )
    mesh, stored = read_mesh(group["mesh"], source), group["contact"]
    contact = {key: stored[key][()] for key in ContactFields.__dataclass_fields__}
    contact["tangent"] = contact["tangent"].reshape(len(contact["x"]), -1, mesh.components)
    contact["part"] = np.array([name.decode() for name in contact["part"]])
    check_pair(mesh, contact["nodes"], contact, f"{source}: contact")
    demand(bool(np.all(np.diff(contact["nodes"]) > 0)), f"{source}: contact/nodes is not in order")
    demand(
        set(contact["part"].tolist()) <= set(mesh.part_names),
        f"{source}: contact/part names parts that the mesh has not",
    )
    fields = {key: group[f"boundary/{key}"][()] for key in ("u", "traction")}
    check_fields(mesh, fields, source)
    rows = group["history"]
    history = History(
        **{
            key: rows[key][()].tolist()
            for key in (*COLUMNS, *["exchanged"] * ("exchanged" in rows))
        }
    )
    check_history(vars(history), source)
    problem: Problem = parse(Problem, tomllib.loads(attributes["config"]), source)
    pairs = {
        name: _ground_pair(mesh, name, contact, fields["traction"])
        for name in dict.fromkeys(contact["part"].tolist())
    }
    status, reason = str(attributes["status"]), str(attributes["reason"])
    step = StepResult(
        "load",
        1,
        1.0,
        "converged" if status == "converged" else "not converged",
        reason,
        len(history),
        {
            "normal": 0.0,
            "tangential": np.nan,
            "balance": 0.0,
            "elastic": float(attributes["elastic_residual"]),
        },
        {name: pair for name, (_, pair) in pairs.items()},
        {ONE_BODY: BodyResult(**fields)},
        {},
        np.zeros(0),
        float(attributes["rho"]),
        float(attributes["residual"]),
        history,
    )
    report = read_report(group, attributes, source)
    return SolutionData(
        problem,
        {ONE_BODY: mesh},
        {name: pairs[name][0] for name in pairs},
        {name: (ONE_BODY, name) for name in pairs},
        [step] if status == "converged" else [],
        status,
        reason,
        read_table(attributes["timings"], f"{source}: timings", numbers=True),
        replace(
            report[0],
            zones=[
                (part, float(a), float(b), int(s))
                for part, (a, b, s) in zip(
                    json.loads(attributes["zone_parts"]), attributes["zones"], strict=True
                )
            ],
        ),
        *report[1:],
        failed=None if status == "converged" else step,
    )


def _ground_pair(
    mesh: BoundaryMesh, part: str, contact: dict[str, Any], traction: Array
) -> tuple[Index, PairResult]:
    """Nodes, and nodal fields after the only increment, of a contact part, as an interface with
    fixed ground."""
    rows = np.flatnonzero(mesh.node_part[contact["nodes"]] == mesh.part_names.index(part))
    nodes, tangent, u_t, sigma_t, bound, state = (
        contact[key][rows]
        for key in ("nodes", "tangent", "u_t", "sigma_t", "friction_bound", "state")
    )
    x, normal, weight, zero = (
        mesh.x[nodes],
        mesh.normal[nodes],
        mesh.weight[nodes],
        np.zeros(len(nodes)),
    )
    force, pressure = (
        weight[:, None] * traction[nodes],
        0.0 - np.einsum("ij,ij->i", traction[nodes], normal),
    )
    return nodes, PairResult(
        x,
        normal,
        tangent,
        weight,
        mesh.sites(nodes).along,
        pressure,
        sigma_t,
        bound,
        zero,
        u_t,
        u_t,
        state,
        force.sum(axis=0),
        moment(x, force),
        float(-weight @ np.sum(sigma_t * u_t, axis=1)),
    )
