"""Result files of format 2: an assembly's meshes and every increment; h5py alone can read them."""

from __future__ import annotations

import json
import tomllib
from typing import Any

import h5py
import numpy as np

from ...arrays import Array
from ...contact.laws import OPEN, SLIP
from ...contact.state import COLUMNS, History
from ...errors import ResultError
from ...mesh.storage import read_mesh, write_mesh
from ...model.assembly import Assembly
from ...model.base import parse
from ...refinement.zones import Zone, zones_of
from ..checks import check_fields, check_group, check_pair, read_table
from ..hdf5 import FORMAT, PROVENANCE, describe, describe_all, zone_attributes
from .solution import AssemblySolution, BodyResult, ObstacleResult, PairResult, StepResult

FORMAT_VERSION = 2
RESIDUALS = ("normal", "tangential", "balance", "elastic", "equilibrium", "elimination", "overlap")
FIELDS = {
    "x": ("length", "nodes"),
    "normal": ("1", "outward unit normals; of a pair from the secondary to the primary"),
    "tangent": ("1", "tangents; in the plane the normal turned by +90 degrees"),
    "weight": ("length", "quadrature weights, in space areas: the sum of weight * f(x) is the integral of f"),
    "arc_length": ("length", "arc length along the part, 0 in space"),
    "pressure": ("stress", "-sigma_n"),
    "sigma_t": ("stress", "traction on the secondary along the tangents"),
    "bound": ("stress", "largest |sigma_t| that friction allows"),
    "gap": ("length", "what is left of the gap, infinite where nothing is faced"),
    "slip": ("length", "tangential displacement of the secondary against the primary"),
    "slip_increment": ("length", "what the increment added to slip"),
    "state": ("1", "0 stick, 1 slip, 2 open"),
    "u": ("length", "displacement"),
    "traction": ("stress", "traction on the body"),
    "alpha": ("length", "amplitudes of the rigid motions that only contact holds"),
    "nodes": ("1", "numbers of the nodes among those of the body"),
    "step": ("1", "number of the step, from 1"),
    "load_factor": ("1", "share of the step's change that is reached"),
    "iterations": ("1", "of the method"),
    "balance": ("1", "resultant of tractions and loads on motions that only contact holds, over their work"),
    "tangential": ("1", "residual of the friction law"),
    "increment": ("1", "number of the increment that the iteration belongs to"),
    "vertices": ("length", "corners of elements"),
    "elements": ("1", "numbers of each element's corners"),
    "order": ("1", "order of each element"),
    "part_names": ("1", "names of the parts"),
    "part": ("1", "part of each element or node"),
    "curvature": ("1/length", "of each element, positive where the body is convex"),
    "side_start": ("length", "arc length along the part at the start of each element"),
    "line": ("1", "number of the straight line of each element, -1 on arcs"),
}
"""Unit and meaning of datasets by their last name."""
PAIR_ARRAYS = ("x", "normal", "tangent", "weight", "arc_length", "pressure", "sigma_t", "bound", "gap", "slip",
               "slip_increment", "state")  # fmt: skip


def fill(group: Any, solution: AssemblySolution) -> None:
    """One assembly into an HDF5 file or group."""
    text = h5py.string_dtype()
    for name, mesh in solution.meshes.items():
        place = group.create_group(f"bodies/{name}")
        write_mesh(place.create_group("mesh"), mesh)
    for name, nodes in solution.nodes.items():
        place = group.create_group(f"pairs/{name}")
        place["nodes"] = nodes
        place.attrs.update({"body": solution.sides[name][0], "part": solution.sides[name][1]})
    steps = group.create_group("steps")
    for k, step in enumerate(solution.steps, 1):
        _fill_step(steps.create_group(f"{k}"), solution, step)
    if solution.failed is not None:
        _fill_step(group.create_group("failed"), solution, solution.failed)
    if len(solution.meshes) == 1 and solution.steps:
        _fill_shorthand(group, solution, text)
    _fill_tables(group, solution.tried)
    group.visititems(lambda path, item: describe(item, FIELDS.get(path.rpartition("/")[2]), solution.assembly.units))
    describe_all(group, solution.assembly.units)
    group.attrs.update({
        "format": FORMAT, "format_version": FORMAT_VERSION, "config": solution.assembly.toml(), "status": solution.status,
        "reason": solution.reason, "iterations": solution.iterations, "timings": json.dumps(solution.timings),
        "info": json.dumps(solution.info), **{key: str(solution.info.get(key, "")) for key in PROVENANCE},
    })  # fmt: skip


def _fill_tables(group: Any, steps: list[StepResult]) -> None:
    """/increments, a row an increment, and /history, a row an iteration; one that failed comes last."""
    table = group.create_group("increments")
    for key in ("step", "load_factor", "iterations"):
        table[key] = np.array([getattr(step, key) for step in steps])
    for key in RESIDUALS[:3]:
        table[key] = np.array([step.residuals[key] for step in steps])
    rows = group.create_group("history")
    rows["increment"] = np.repeat(np.arange(1, len(steps) + 1), [len(step.history) for step in steps])
    for key in COLUMNS:
        values = [value for step in steps for value in getattr(step.history, key)]
        rows[key] = np.array(values, dtype=int if key == "ksp_iterations" else float)


def _fill_step(place: Any, solution: AssemblySolution, step: StepResult) -> None:
    place.attrs.update({
        "name": step.name, "step": step.step, "load_factor": step.load_factor, "status": step.status, "reason": step.reason,
        "iterations": step.iterations,
        **{f"residual_{key}": value for key, value in step.residuals.items() if np.isfinite(value)},
    })  # fmt: skip
    place["alpha"] = step.alpha
    for name, pair in step.pairs.items():
        here = place.create_group(f"contact/{name}")
        for key in PAIR_ARRAYS:
            here[key] = getattr(pair, key)
        here.attrs.update({"force": pair.force, "moment": pair.moment, "area": pair.area, "dissipated": pair.dissipated,
                           "dissipated_error": pair.dissipated_error})  # fmt: skip
    for name, body in step.bodies.items():
        here, mesh = place.create_group(f"body/{name}"), solution.meshes[name]
        for key, value in (("x", mesh.x), ("normal", mesh.normal), ("weight", mesh.weight), ("u", body.u),
                           ("traction", body.traction)):  # fmt: skip
            here[key] = value
    for name, obstacle in step.obstacles.items():
        place.create_group(f"obstacle/{name}").attrs.update({
            "displacement": obstacle.displacement, "rotation": obstacle.rotation, "force": obstacle.force,
            "moment": obstacle.moment,
        })  # fmt: skip


def _fill_shorthand(group: Any, solution: AssemblySolution, text: Any) -> None:
    """/boundary, /mesh, /contact and zones of the last increment, as in the one-body format; what is open is no zone."""
    (name, mesh), = solution.meshes.items()
    body, pairs = solution.last.bodies[name], solution.last.pairs
    names = np.array(mesh.part_names, dtype=object)
    boundary = group.create_group("boundary")
    for key, value in (("x", mesh.x), ("normal", mesh.normal), ("weight", mesh.weight), ("u", body.u),
                       ("traction", body.traction)):  # fmt: skip
        boundary[key] = value
    boundary.create_dataset("part", data=names[mesh.node_part], dtype=text)
    group["mesh"] = group[f"bodies/{name}/mesh"]
    contact = group.create_group("contact")
    every = list(pairs.values())
    nodes = np.concatenate([solution.nodes[key] for key in pairs])
    tangent = np.concatenate([pair.tangent for pair in every])
    joined = ("x", "weight", "arc_length", "sigma_t", "pressure", "gap", "state", "slip")
    columns: dict[str, Array] = {key: np.concatenate([getattr(pair, key) for pair in every]) for key in joined}
    columns |= {
        # a single tangent has no axis of its own
        "nodes": nodes, "tangent": tangent[:, 0] if tangent.shape[1] == 1 else tangent,
        "u_t": np.sum(body.u[nodes][:, None] * tangent, axis=2),
        "sigma_n": 0.0 - columns["pressure"], "friction_bound": np.concatenate([pair.bound for pair in every]),
    }  # fmt: skip
    for key, value in columns.items():
        contact[key] = value
    zones: list[Zone] = []
    for key, pair in pairs.items():
        way = np.sign(pair.slip_increment[:, 0] - 1e-300 * pair.sigma_t[:, 0])
        sign = np.where(pair.state == SLIP, way, pair.state)
        zones += [zone for zone in zones_of(mesh, solution.nodes[key], sign) if zone.sign != OPEN]
    group.attrs.update(zone_attributes(zones))
    parts = [solution.sides[key][1] for key, pair in pairs.items() for _ in pair.weight]
    contact.create_dataset("part", data=np.array(parts, dtype=object), dtype=text)


def read_assembly(group: Any, source: str) -> AssemblySolution:
    """An assembly's solution from an HDF5 group of format 2.

    Raises
    ------
    ResultError
        If the group is damaged.
    """
    attributes = dict(group.attrs)
    try:
        check_group(group, source)
        meshes = {name: read_mesh(group[f"bodies/{name}/mesh"], source) for name in group["bodies"]}
        nodes = {name: place["nodes"][()] for name, place in group["pairs"].items()}
        sides = {name: (str(p.attrs["body"]), str(p.attrs["part"])) for name, p in group["pairs"].items()}
        count = len(group["steps"]) if "steps" in group else 0
        rows = group["history"]
        steps = [_read_step(group[f"steps/{k}"], _read_history(rows, k)) for k in range(1, count + 1)]
        failed = _read_step(group["failed"], _read_history(rows, count + 1)) if "failed" in group else None
        for step in steps if failed is None else [*steps, failed]:
            for name, body in step.bodies.items():
                check_fields(meshes[name], {f"{name}/u": body.u, f"{name}/traction": body.traction}, source)
            for name, pair in step.pairs.items():
                check_pair(meshes[sides[name][0]], nodes[name], vars(pair), f"{source}: contact/{name}")
        assembly: Assembly = parse(Assembly, tomllib.loads(attributes["config"]), source)
        return AssemblySolution(
            assembly, {b.name: meshes[b.name] for b in assembly.body}, nodes, sides, steps, str(attributes["status"]),
            str(attributes["reason"]), read_table(attributes["timings"], f"{source}: timings", numbers=True),
            read_table(attributes["info"], f"{source}: info"), failed,
        )  # fmt: skip
    except ResultError:
        raise
    except Exception as error:  # whatever damaged bytes make of h5py and numpy
        raise ResultError(f"{source}: damaged ({type(error).__name__}: {' '.join(str(error).split())})") from error


def _read_history(rows: Any, increment: int) -> History:
    """The iterations of one increment; files of 0.2.0 have none."""
    if "increment" not in rows:
        return History()
    mine = rows["increment"][()] == increment
    return History(**{key: rows[key][()][mine].tolist() for key in COLUMNS})


def _read_step(place: Any, history: History) -> StepResult:
    facts = place.attrs
    pairs = {name: _read_pair(here) for name, here in place.get("contact", {}).items()}
    bodies = {name: BodyResult(here["u"][()], here["traction"][()]) for name, here in place.get("body", {}).items()}
    obstacles = {
        name: ObstacleResult(*(here.attrs[key] for key in ("displacement", "rotation", "force", "moment")))
        for name, here in place.get("obstacle", {}).items()
    }  # fmt: skip
    residuals = {key: float(facts.get(f"residual_{key}", np.nan)) for key in RESIDUALS}
    return StepResult(
        str(facts["name"]), int(facts["step"]), float(facts["load_factor"]), str(facts["status"]), str(facts["reason"]),
        int(facts["iterations"]), residuals, pairs, bodies, obstacles, place["alpha"][()],
        history,
    )  # fmt: skip


def _read_pair(here: Any) -> PairResult:
    fields = {key: here[key][()] for key in PAIR_ARRAYS}
    return PairResult(**fields, force=here.attrs["force"], moment=here.attrs["moment"],
                      dissipated=float(here.attrs["dissipated"]),
                      dissipated_error=float(here.attrs.get("dissipated_error", np.nan)))  # fmt: skip
