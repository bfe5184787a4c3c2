"""Tables of a solution, a row a node, a part, a pair, an increment or an iteration, and CSV files
of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ..contact.state import COLUMNS
from ..errors import InputError
from ..runtime.atomic_write import write_text
from ..runtime.figure_style import STATES
from ..runtime.hints import demand_name
from ..runtime.text_table import as_csv
from ..untyped import Keyed
from .data import SolutionData
from .records import StepResult, along_tangents, below
from .verdict.text import unit_of

Table = Keyed
"""Columns by name, all of one length."""
UNITS = (
    ("length", "[xyz]|u[xyz]?|arc_length|gap|worn_depth|slip.*"),
    ("stress", "pressure|bound|t[xyz]|sigma_.*|von_mises|principal_.*"),
    ("force", "F[xyz]"),
    ("moment", "M[xyz]?|dissipated"),
    ("area", "area|weight"),
    ("volume", "worn_volume"),
)
"""Kinds of units of columns by their names."""


def named(name: str, values: object) -> Table:
    """Components (n, d) along the axes as the columns NAMEx, NAMEy, ...; the points themselves are
    x, y, z; numbers (n,) are the column NAME."""
    columns = np.atleast_2d(np.asarray(values).T)
    axes = "xyz" if len(columns) > 1 else ("",)
    return dict(zip((f"{name}{axis}" for axis in axes), columns, strict=False))


def pairs_table(solution: SolutionData, step: StepResult) -> Table:
    """The contact nodes of all pairs: geometry, pressure, shear and its bound, gap, slip, state,
    displacement."""
    columns = solution.columns(step)
    places = zip(columns["body"].tolist(), columns["nodes"].tolist(), strict=True)
    components = next(iter(step.bodies.values())).u.shape[1]
    u = np.reshape([step.bodies[body].u[node] for body, node in places], (-1, components))
    tangential = {
        key: along_tangents(key, columns[key]) for key in ("sigma_t", "slip", "slip_increment")
    }
    wears = any(pair.wear is not None for pair in step.pairs.values())
    words = np.array([STATES[k][0] for k in sorted(STATES)])
    return {
        **{key: columns[key] for key in ("pair", "body", "part")},
        "node": columns["nodes"],
        **named("", columns["x"]),
        **named("n", columns["normal"]),
        **{key: columns[key] for key in ("arc_length", "weight", "pressure")},
        **tangential["sigma_t"],
        "bound": columns["friction_bound"],
        "gap": columns["gap"],
        **tangential["slip"],
        **tangential["slip_increment"],
        "state": words[columns["state"]],
        **named("u", u),
        **({"worn_depth": columns["worn_depth"]} if wears else {}),
    }


def boundary_table(solution: SolutionData, step: StepResult) -> Table:
    """All nodes of all bodies: place, outward normal, quadrature weight, displacement, traction and
    stress."""
    parts: list[Table] = []
    for name, mesh in solution.meshes.items():
        result, stress = step.bodies[name], solution.stress_on_boundary(name, step)
        parts.append(
            {
                "body": np.full(mesh.n_nodes, name),
                "part": np.array(mesh.part_names)[mesh.node_part],
                "node": np.arange(mesh.n_nodes),
                **named("", mesh.x),
                **named("n", mesh.normal),
                "weight": mesh.weight,
                **named("u", result.u),
                **named("t", result.traction),
                **{f"sigma_{c}": s for c, s in zip(mesh.stresses, stress.T, strict=True)},
            }
        )
    return below(parts)


def reactions_table(solution: SolutionData, step: StepResult) -> Table:
    """Resultant of the tractions on each part of each body; with torsion also the moment about the
    axis."""
    forces = solution.reactions(step)
    by_body = forces if len(solution.meshes) > 1 else {next(iter(solution.meshes)): forces}
    rows = [(body, part, force) for body, parts in by_body.items() for part, force in parts.items()]
    moments = [
        step.bodies[body].moment_on(solution.meshes[body], part)
        for body, part, _ in rows
        if solution.meshes[body].components > solution.meshes[body].dim
    ]
    return {
        "body": np.array([row[0] for row in rows]),
        "part": np.array([row[1] for row in rows]),
        **named("F", [row[2] for row in rows]),
        **({"M": np.array(moments)} if moments else {}),
    }


def resultants_table(solution: SolutionData, step: StepResult) -> Table:
    """Of each pair: force and moment on the secondary, closed area, energy dissipated in the
    increment, worn volume."""
    pairs = step.pairs
    wear = {"worn_volume": np.array([pair.worn_volume.sum() for pair in pairs.values()])}
    return {
        "pair": np.array(list(pairs)),
        **named("F", [pair.force for pair in pairs.values()]),
        **named("M", [pair.moment for pair in pairs.values()]),
        "area": np.array([pair.area for pair in pairs.values()]),
        "dissipated": np.array([pair.dissipated for pair in pairs.values()]),
        **(wear if any(pair.wear is not None for pair in pairs.values()) else {}),
    }


def obstacles_table(solution: SolutionData, step: StepResult) -> Table:
    """Of each obstacle: displacement and rotation, and the force and moment that act on it from
    outside."""
    obstacles = step.obstacles.values()
    return {
        "obstacle": np.array(list(step.obstacles)),
        **named("u", [obstacle.displacement for obstacle in obstacles]),
        **named("rotation", [obstacle.rotation for obstacle in obstacles]),
        **named("F", [obstacle.force for obstacle in obstacles]),
        **named("M", [obstacle.moment for obstacle in obstacles]),
    }


def increments_table(solution: SolutionData, step: StepResult) -> Table:
    """How the increment ended: status, iterations, residuals."""
    return {
        key: np.array([value])
        for key, value in {
            "status": step.status,
            "iterations": step.iterations,
            **step.residuals,
        }.items()
    }


def history_table(solution: SolutionData, step: StepResult) -> Table:
    """A row an iteration of the method."""
    count = len(step.history)
    return {
        "iteration": np.arange(1, count + 1),
        **{key: np.array(getattr(step.history, key)) for key in COLUMNS},
    }


TABLES: dict[str, Callable[[SolutionData, StepResult], Table]] = {
    "pairs": pairs_table,
    "boundary": boundary_table,
    "reactions": reactions_table,
    "resultants": resultants_table,
    "obstacles": obstacles_table,
    "increments": increments_table,
    "history": history_table,
}


def table(solution: SolutionData, name: str, steps: Sequence[int]) -> Table:
    """A table over increments, numbered from 1 on, which the first columns name: increment, step
    and load factor."""
    parts: list[Table] = []
    for number in steps:
        step = solution.tried[number - 1]
        columns = TABLES[name](solution, step)
        rows = len(next(iter(columns.values())))
        of_step = {
            "increment": number,
            "step": step.name or str(step.step),
            "load_factor": step.load_factor,
        }
        parts.append({**{key: np.full(rows, value) for key, value in of_step.items()}, **columns})
    return below(parts)


def csv_text(columns: Mapping[str, object]) -> str:
    """A table as CSV (RFC 4180, with line feeds): names first, numbers with all their digits; texts
    as of `as_csv`."""
    return as_csv(
        list(columns),
        zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True),
    )


def with_units(columns: Mapping[str, object], solution: SolutionData) -> Table:
    """Return the columns with the problem's names of units in their names: "pressure [MPa]"."""
    power = next(iter(solution.meshes.values())).weight_power
    units = solution.problem.units
    named_columns = {}
    for name, values in columns.items():
        kind = next((kind for kind, names in UNITS if re.fullmatch(names, name)), "")
        unit = unit_of(kind, units, power) if kind else ""
        named_columns[f"{name} [{unit}]" if unit else name] = values
    return named_columns


def write_tables(
    solution: SolutionData, target: str | Path, names: Sequence[str] = (), steps: Sequence[int] = ()
) -> list[Path]:
    """Write tables as CSV: one to a file of suffix .csv, or NAME.csv of each into a folder.

    Heads name units where the problem does: "pressure [MPa]".

    Parameters
    ----------
    solution : Solution
    target : str or Path
        A file of suffix .csv, or a folder, which is made if it does not exist.
    names : sequence of str, optional
        Of TABLES; all that have rows by default, of a file the first of them, "pairs" where there
        are any.
    steps : sequence of int, optional
        Increments from 1 on, all by default.

    Raises
    ------
    InputError
        If there is no such table or increment, or a file cannot hold several tables.
    OutputError
        If a file cannot be written.
    """
    target, one = Path(target), Path(target).suffix.lower() == ".csv"
    without = {
        "pairs": solution.nodes,
        "resultants": solution.nodes,
        "obstacles": solution.last.obstacles,
    }
    every = [name for name in TABLES if without.get(name, True)]
    names = list(names) or (every[:1] if one else every)
    for name in names:
        demand_name("no table", name, TABLES, "tables are")
        if name not in every:
            raise InputError(
                f"no table {name!r} of this result, which has no {name}; "
                f"tables are {', '.join(every)}"
            )
    if one and len(names) > 1:
        raise InputError(
            f"{target}: a .csv file holds one table, {', '.join(names)} are {len(names)}; name a "
            "folder"
        )
    count = len(solution.tried)
    for step in steps:
        if not 1 <= step <= count:
            raise InputError(f"step: there are increments 1 to {count}, got {step}")
    if not one:
        target.mkdir(parents=True, exist_ok=True)
    paths = [target if one else target / f"{name}.csv" for name in names]
    for path, name in zip(paths, names, strict=True):
        columns = table(solution, name, steps or range(1, count + 1))
        write_text(path, csv_text(with_units(columns, solution)))
    return paths
