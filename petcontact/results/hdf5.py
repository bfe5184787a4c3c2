"""Result files: HDF5 that h5py alone can read, one layout for every problem, written whole or not
at all."""

from __future__ import annotations

import functools
import json
import tomllib
from collections.abc import Callable, Container, Iterable, Mapping, MutableMapping
from pathlib import Path

import h5py
import numpy as np

from ..contact.state import COLUMNS, History
from ..errors import ResultError
from ..given.tables.base import parse
from ..given.tables.units import Units
from ..mesh.storage import read_mesh, write_mesh
from ..model.interfaces import posed_interfaces
from ..model.problem import Problem
from ..runtime.file_kinds import demand_result_name
from ..untyped import Group, Keyed
from .data import SolutionData
from .format.accuracy import read_report, write_findings
from .format.checks import (
    check_fields,
    check_group,
    check_history,
    check_pair,
    check_steps,
    read_table,
)
from .format.container import opened, write_atomically
from .format.descriptions import FIELDS
from .format.number_tables import read_numbers, write_numbers
from .format.wear_table import read_wear, write_wear
from .records import BodyResult, ObstacleResult, PairResult, StepResult
from .report import as_json

FORMAT = "petcontact result"
FORMAT_VERSION = 3
RESIDUALS = ("normal", "tangential", "balance", "elastic")
"""Columns of the table of increments."""
MEASURES = ("equilibrium", "elimination", "overlap", "between", "displaced")
"""What else an increment is judged by, attributes only."""
STILL = ("x", "normal", "tangent", "weight", "arc_length")
"""Fields of an interface that no increment changes; they are stored once, under several names."""
OF_BODIES = ("x", "normal", "weight", "part")
"""Such fields of a body."""
MOVING = ("pressure", "sigma_t", "bound", "gap", "slip", "slip_increment", "state")
ERRORS = ("pressure_error", "sigma_t_error")
MAY_BE = ("wear", "primary")
RESULTANTS = (
    "force",
    "moment",
    "dissipated",
    "dissipated_error",
    "force_primary",
    "moment_primary",
    "overlap",
)
JOINED = "parts"
"""Attribute of a contact of several parts: its pairs, which stand beside it."""
PLACES = ("displacement", "rotation", "force", "moment")
TEXT = h5py.h5t.py_create(h5py.string_dtype(), logical=True)
"""Text of any length in UTF-8."""
ONE_BODY = (
    "nodes",
    "x",
    "tangent",
    "weight",
    "arc_length",
    "u_t",
    "sigma_t",
    "sigma_n",
    "friction_bound",
    "state",
    "pressure",
    "gap",
    "slip",
    "part",
)
"""Datasets of /contact."""


def write_solution(path: str | Path, solution: SolutionData, *, replace: bool = True) -> None:
    """Write a result file: to a temporary name, flushed to the disk, then renamed.

    Parameters
    ----------
    path : str or Path
    solution : Solution
    replace : bool
        Whether a file of that name may be replaced; if not, and there is one, the result is kept
        beside it.

    Raises
    ------
    InputError
        If the name ends as that of another kind of file.
    OutputError
        If the file cannot be written (folder missing or read-only, disk full), then nothing is left
        behind; or if it is kept under another name.
    """
    demand_result_name(path)
    write_atomically(path, lambda file: write_group(file, solution), replace=replace)


def write_group(group: Group, solution: SolutionData, *, numbers: bool = True) -> None:
    """Write a solution into an HDF5 file or group.

    The numbers of the verdict may be left out, or not be known. A reader computes them then.
    """
    for name, mesh in solution.meshes.items():
        place = _ordered(group, f"bodies/{name}")
        write_mesh(place.create_group("mesh"), mesh)
        _put(place, _values(mesh, ("x", "normal", "weight")))
        _write_names(place, "part", np.array(mesh.part_names, dtype=object)[mesh.node_part])
    for name, nodes in solution.nodes.items():
        place = _ordered(group, f"pairs/{name}")
        place.attrs.update(zip(("body", "part"), solution.sides[name], strict=True))
        _put(place, {"nodes": nodes, **_values(solution.last.pairs[name], STILL)})
    steps, still = group.create_group("steps"), functools.cache(functools.partial(_still, group))
    for k, step in enumerate(solution.steps, 1):
        _write_step(steps.create_group(f"{k}"), solution, step, still)
    if solution.failed is not None:
        _write_step(group.create_group("failed"), solution, solution.failed, still)
    _write_tables(group, solution.tried)
    write_findings(group, solution.findings)
    if numbers and solution.numbers:
        write_numbers(group, solution.numbers)
    if solution.wear is not None:
        write_wear(group, solution.wear)
    group.attrs.update(
        {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "config": solution.problem.toml(),
            "status": solution.status,
            "reason": solution.reason,
            "iterations": solution.iterations,
            "rho": solution.last.rho,
            "residual": solution.last.residual,
            "elastic_residual": solution.last.residuals["elastic"],
            "timings": json.dumps(solution.timings),
            "accuracy": as_json(solution.accuracy),
            "provenance": as_json(solution.provenance),
            **_values(solution.provenance, ("argv", "petsc_options", "versions")),
        }
    )
    if len(solution.meshes) == 1:
        _write_one_body(group, solution)
    # without h5py's own objects, which take longer than what is written
    h5py.h5o.visit(group.id, functools.partial(_describe, group.id, solution.problem.units))


def _ordered(group: Group, path: str) -> Group:
    """Return a group that is made if it is missing, and so are its parents.

    Groups are listed in the order in which they are made, which is that of the config.
    """
    for name in path.split("/"):
        group = group[name] if name in group else group.create_group(name, track_order=True)
    return group


def _values(record: object, keys: Iterable[str]) -> Keyed:
    """Return some fields of a record by their names."""
    return {key: getattr(record, key) for key in keys}


def _put(place: MutableMapping[str, object], values: Mapping[str, object]) -> None:
    """Store values in a group by their names, without those that are None."""
    for key, value in values.items():
        if value is not None:
            place[key] = value


def _write_names(group: Group, key: str, names: object) -> None:
    group.create_dataset(key, data=np.asarray(names, dtype=object), dtype=h5py.string_dtype())


def _write_tables(group: Group, steps: list[StepResult]) -> None:
    """Write /increments with a row for each increment, and /history with a row for each iteration.

    An increment that failed comes last.
    """
    table = group.create_group("increments")
    for key in ("step", "load_factor", "iterations", "rho", "residual"):
        table[key] = np.array([getattr(step, key) for step in steps])
    for key in RESIDUALS:
        table[key] = np.array([step.residuals[key] for step in steps])
    rows = group.create_group("history")
    rows["increment"] = np.repeat(
        np.arange(1, len(steps) + 1), [len(step.history) for step in steps]
    )
    for key in COLUMNS:
        values = [value for step in steps for value in getattr(step.history, key)]
        rows[key] = np.array(values, dtype=int if key == "ksp_iterations" else float)
    # Newton's are the last rows of an increment
    exchanged = [
        [-1] * (len(step.history) - len(step.history.exchanged)) + step.history.exchanged
        for step in steps
    ]
    rows["exchanged"] = np.array([count for row in exchanged for count in row], dtype=int)


def _still(group: Group, place: str, keys: tuple[str, ...]) -> Keyed:
    """Return datasets of a folder, each of which gets a second name by being stored again."""
    return {key: group[f"{place}/{key}"] for key in keys}


def _write_step(
    place: Group,
    solution: SolutionData,
    step: StepResult,
    still: Callable[[str, tuple[str, ...]], Keyed],
) -> None:
    facts = {
        "name": step.name,
        "step": step.step,
        "cycle": step.cycle or None,
        "origin": step.origin,
        "sliding": step.sliding or None,
        "load_factor": step.load_factor,
        "status": step.status,
        "reason": step.reason,
        "iterations": step.iterations,
        "rho": step.rho,
        "residual": step.residual,
        **{f"residual_{key}": value for key, value in step.residuals.items()},
    }
    # what was not computed is not there
    place.attrs.update(
        {key: value for key, value in facts.items() if value is not None and value == value}
    )
    place["alpha"] = step.alpha
    for name, pair in step.pairs.items():
        folder = _ordered(place, f"contact/{name}")
        _put(folder, still(f"pairs/{name}", STILL) | _values(pair, (*MOVING, *ERRORS, *MAY_BE)))
        worn = ("worn_volume", "worn_depth") if pair.wear is not None else ()
        _put(folder.attrs, _values(pair, (*RESULTANTS, "area", "imbalance", *worn)))
    _write_joined(place, solution, step)
    for name, body in step.bodies.items():
        known = solution.body_fields(name, step).known
        stress = solution.stress_on_boundary(name, step) if known else None
        fields = {"u": body.u, "traction": body.traction, "stress": stress}
        _put(_ordered(place, f"body/{name}"), still(f"bodies/{name}", OF_BODIES) | fields)
    for name, obstacle in step.obstacles.items():
        _put(_ordered(place, f"obstacle/{name}").attrs, _values(obstacle, PLACES))


def _write_joined(place: object, solution: SolutionData, step: StepResult) -> None:
    """Write each contact of several parts as a whole, beside its pairs."""
    groups = dict.fromkeys(side.contact for side in solution.posed.interfaces if side.contact)
    for name in groups if step.pairs else ():
        pair, folder = step.pairs[name], _ordered(place, f"contact/{name}")
        shares = step.shares_of(name, axial=solution.posed.axial)
        _put(folder, _values(pair, (*STILL, *MOVING, *MAY_BE)))
        _put(folder.attrs, _values(pair, (*RESULTANTS, "area")))
        folder.attrs.update({JOINED: list(shares), "shares": list(shares.values())})


def _write_one_body(group: Group, solution: SolutionData) -> None:
    """Write /mesh, /boundary, /contact and the zones of the last increment.

    /mesh and /boundary are second names of groups.
    """
    (name,) = solution.meshes
    last = f"steps/{len(solution.steps)}" if solution.steps else "failed"
    group["mesh"], group["boundary"] = group[f"bodies/{name}/mesh"], group[f"{last}/body/{name}"]
    if solution.nodes:
        contact, columns = group.create_group("contact"), _contact(solution)
        _put(contact, {key: values for key, values in columns.items() if key != "part"})
        _write_names(contact, "part", columns["part"])
    zones = solution.zones
    group.attrs.update(
        {
            "zones": np.array([[z.start, z.end, z.sign] for z in zones]).reshape(-1, 3),
            "zone_parts": json.dumps([z.part for z in zones]),
        }
    )


def _contact(solution: SolutionData) -> Keyed:
    """Return the columns of /contact in the order of the nodes."""
    columns = solution.columns()
    order = np.argsort(columns["nodes"], kind="stable")
    fields = {key: columns[key][order] for key in ONE_BODY}
    if fields["tangent"].shape[1] == 1:  # a single tangent has no axis of its own
        fields["tangent"] = fields["tangent"][:, 0]
    return fields


def _describe(group: h5py.h5g.GroupID, units: Units, path: bytes) -> None:
    """Write the attributes `unit` and `description` of a dataset.

    The unit has the user's name if the problem gives one.
    """
    *_, folder, name = f"/{path.decode()}".split("/")
    entry = FIELDS.get(f"{folder}/{name}") or FIELDS.get(name)
    item = h5py.h5o.open(group, path) if entry else None
    if entry and isinstance(item, h5py.h5d.DatasetID):
        unit, meaning = entry
        names = {"length": units.length, "stress": units.stress, "stress/length": units.stiffness}
        for key, text in (("unit", names.get(unit) or unit), ("description", meaning)):
            made = h5py.h5a.create(item, key.encode(), TEXT, h5py.h5s.create(h5py.h5s.SCALAR))
            made.write(np.array(text, dtype=h5py.string_dtype()))


def read_data(path: str | Path) -> SolutionData:
    """Return what a result file of any format holds.

    Raises
    ------
    ResultError
        If the file is missing, truncated, not HDF5, not ours, or of a later format version.
    """
    with opened(path) as file:
        return _read_group(file, f"{path}")


def _read_group(group: Group, source: str) -> SolutionData:
    try:
        attributes = dict(group.attrs)
        version = attributes.get("format_version")
        if attributes.get("format") != FORMAT:
            raise ResultError(f"{source}: not a result of petcontact")
        if version != FORMAT_VERSION:
            raise ResultError(f"{source}: format version {version}, this is {FORMAT_VERSION}")
        check_group(group, source)
        return _read(group, attributes, source)
    except ResultError:
        raise
    except Exception as error:  # whatever damaged bytes make of h5py and numpy
        raise ResultError(
            f"{source}: damaged ({type(error).__name__}: {' '.join(str(error).split())})"
        ) from error


def _read(group: Group, attributes: Keyed, source: str) -> SolutionData:
    """Return the solution that a checked group holds."""
    nodes = {name: pair["nodes"][()] for name, pair in group.get("pairs", {}).items()}
    sides = {
        name: (str(pair.attrs["body"]), str(pair.attrs["part"]))
        for name, pair in group.get("pairs", {}).items()
    }
    problem = _read_problem(attributes["config"], sides, source)
    meshes = {
        body.name: read_mesh(group[f"bodies/{body.name}/mesh"], source) for body in problem.body
    }
    check_steps(group.get("steps", {}), max(1, len(problem.step)), source)
    count = len(group.get("steps", ()))
    rows = {key: values[()] for key, values in group["history"].items()}
    check_history(rows, source)
    steps = [_read_step(group[f"steps/{k}"], _read_history(rows, k)) for k in range(1, count + 1)]
    failed = (
        _read_step(group["failed"], _read_history(rows, count + 1)) if "failed" in group else None
    )
    if not steps and failed is None:
        raise ResultError(f"{source}: damaged (it holds no increment)")
    for step in steps if failed is None else [*steps, failed]:
        for name, body in step.bodies.items():
            check_fields(
                meshes[name], {f"{name}/u": body.u, f"{name}/traction": body.traction}, source
            )
        for name, pair in step.pairs.items():
            check_pair(meshes[sides[name][0]], nodes[name], vars(pair), f"{source}: contact/{name}")
    return SolutionData(
        problem,
        meshes,
        nodes,
        sides,
        steps,
        str(attributes["status"]),
        str(attributes["reason"]),
        read_table(attributes["timings"], f"{source}: timings", numbers=True),
        *read_report(group, attributes, source),
        failed,
        read_wear(group, nodes, source),
        written=read_numbers(group, source),
    )


def _read_problem(config: str, sides: Container[str], source: str) -> Problem:
    """Return the problem, whose parts that may touch are those of the file.

    They were found on outlines, whose own files need not be where a result is read.
    """
    problem: Problem = parse(Problem, tomllib.loads(config), source)
    vars(problem)["interfaces"] = tuple(
        side for side in posed_interfaces(problem) if side.name in sides or not side.contact
    )
    return problem


def _read_history(rows: Keyed, increment: int) -> History:
    """Return the iterations of one increment."""
    rows_of = rows["increment"] == increment
    exchanged = rows["exchanged"][rows_of]
    return History(
        **{key: rows[key][rows_of].tolist() for key in COLUMNS},
        exchanged=exchanged[exchanged >= 0].tolist(),
    )


def _read_step(place: Group, history: History) -> StepResult:
    facts = place.attrs
    pairs = {
        name: PairResult(
            **{key: folder[key][()] for key in (*STILL, *MOVING)},
            **{key: folder.attrs[key] for key in RESULTANTS if key in folder.attrs},
            **{key: folder[key][()] for key in MAY_BE if key in folder},
            errors=functools.partial(tuple, [folder[key][()] for key in ERRORS])
            if ERRORS[0] in folder
            else None,
        )
        for name, folder in place.get("contact", {}).items()
        if JOINED not in folder.attrs
    }
    bodies = {
        name: BodyResult(folder["u"][()], folder["traction"][()])
        for name, folder in place.get("body", {}).items()
    }
    obstacles = {
        name: ObstacleResult(*(folder.attrs[key] for key in PLACES))
        for name, folder in place.get("obstacle", {}).items()
    }
    residuals = {
        key: float(facts.get(f"residual_{key}", np.nan)) for key in (*RESIDUALS, *MEASURES)
    }
    return StepResult(
        str(facts["name"]),
        int(facts["step"]),
        float(facts["load_factor"]),
        str(facts["status"]),
        str(facts["reason"]),
        int(facts["iterations"]),
        residuals,
        pairs,
        bodies,
        obstacles,
        place["alpha"][()],
        float(facts["rho"]),
        float(facts["residual"]),
        history,
        int(facts.get("cycle", 0)),
        float(facts["origin"]) if "origin" in facts else None,
        str(facts.get("sliding", "")),
    )
