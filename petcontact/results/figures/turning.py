"""One HTML page that turns the deformed bodies: all that it needs is in it, no network and no other
program."""

from __future__ import annotations

import base64
import functools
import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ...arrays import Array, Index, scattered
from ...fields.stress_state import StressState
from ...geometry.rotation import lifted
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import CurveMesh
from ...mesh.surface_mesh import SurfaceMesh
from ...runtime.atomic_write import write_text
from ...runtime.figure_style import label, png
from ...runtime.terminal import printable
from ...untyped import Keyed
from ..data import SolutionData
from ..evaluated import NOWHERE
from ..records import PairResult, StepResult, step_ends
from ..vtu.boundary import traction_error
from ..vtu.inner_fields import field_inside, filled_bodies, grid_inside
from ..vtu.spread_points import small_triangles
from .colour_bands import SIGNED, UNIFORM
from .plots import drawings
from .surface_figure import best_view
from .view import view_of

TRIANGLES, CELLS, ALONG = 16_000, 60, 12
"""About: of all surfaces together, along the longer side of a plane body, and on an element of its
rim."""
INCREMENTS = 12
"""At most: ends of steps, and others spread evenly."""
UNKNOWN = 65535
"""What stands for a value that a place does not have."""
FROM_ABOVE = (90.0, -90.0)
"""Elevation and azimuth, x to the right and y up [degrees]."""
COLOURS = 64
"""Number of colours of a colour map."""
Fields = dict[str, Array]


def write_page(path: str | Path, solution: SolutionData) -> Path:
    """Write the page of a solution: bodies to turn, deformed as much as wanted, shaded by a field
    of an increment.

    Parameters
    ----------
    path : str or Path
        Of the .html file; WebGL, which every browser of today has, draws it.
    solution : Solution
        In space its surfaces are shown, in the plane the inside of its bodies.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(__package__, ""),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    title = printable(solution.problem.title) or "petcontact"
    # in a script an escaped < ends no element
    data = json.dumps(scene(solution), separators=(",", ":")).replace("<", "\\u003c")
    text = environment.get_template("turning.html").render(
        title=title, data=data, curves=_curves(solution)
    )
    write_text(path, text)
    return Path(path)


def _curves(solution: SolutionData) -> list[str]:
    """Return the figures of p and q along the contacts of plane bodies, PNG as base64."""
    if next(iter(solution.meshes.values())).dim == 3:
        return []  # their surfaces are shaded by both
    wanted = drawings(solution)
    return [png(wanted[name], solution) for name in ("normal", "traction") if name in wanted]


def scene(solution: SolutionData) -> Keyed:
    """What the page shows, as JSON has it; arrays are base64, little-endian."""
    from matplotlib import colormaps

    units, steps = solution.problem.units, _shown(solution.steps or solution.tried)
    names = {
        "u": label("|u|", units.length),
        "von_mises": label("von Mises stress", units.stress),
        "pressure": label("pressure", units.stress),
        "shear": label("shear traction", units.stress),
        "slip": label("slip", units.length),
        "error": label("estimated error of the traction", units.stress),
    }
    plane = next(iter(solution.meshes.values())).dim == 2
    drawn = {name: _piece(mesh, solution, name, steps) for name, mesh in solution.meshes.items()}
    found = [
        key
        for key in names  # of superelements no stress is known
        if any(
            key in fields[0] and np.isfinite(fields[0][key]).any() for _, fields in drawn.values()
        )
    ]
    ranges = {
        key: _range([each[key] for _, fields in drawn.values() for each in fields if key in each])
        for key in found
    }
    away = _apart(solution)
    return {
        "bodies": [
            body
            | {
                "name": printable(name),
                "away": away[name],
                "steps": [_packed_fields(fields, ranges) for fields in each],
            }
            for name, (body, each) in drawn.items()
        ],
        "fields": [
            {"key": key, "name": names[key], "low": low, "high": high}
            for key, (low, high) in ranges.items()
        ],
        "steps": [printable(f"{step.title}, load factor {step.load_factor:.4g}") for step in steps],
        "factor": view_of(solution, steps).factor,
        "plane": plane,
        "view": list(FROM_ABOVE if plane else best_view(solution)),
        "maps": {
            name: _packed(255.0 * colormaps[word](np.linspace(0.0, 1.0, COLOURS)), "u1")
            for name, word in (("uniform", UNIFORM), ("signed", SIGNED))
        },
    }


def _packed_fields(fields: Fields, ranges: dict[str, tuple[float, float]]) -> dict[str, str]:
    """The displacement and those fields of a body that have a range."""
    return {"move": _packed(fields["move"], "<f4")} | {
        key: _quantised(fields[key], *bounds) for key, bounds in ranges.items() if key in fields
    }


def _apart(solution: SolutionData) -> dict[str, list[float]]:
    """Where bodies are moved so that contact between them is seen, (3,) each, of pairs of two
    against each other by 1.

    Secondaries go against the mean of their normals in contact; no way where these point all
    around, as those of a pin do.
    """
    names = list(solution.meshes)
    rows, motions = [np.ones(len(names))], [np.zeros(3)]
    for name, pair in solution.pairs.items():
        mean = pair.weight @ pair.normal / pair.weight.sum()
        owner = solution.primaries.get(name, NOWHERE)[0]
        if owner in names:
            body = names.index(solution.sides[name][0]), names.index(owner)
            rows.append(np.eye(len(names))[body[0]] - np.eye(len(names))[body[1]])
            motions.append(-np.pad(mean, (0, 3 - len(mean))))
    found = np.linalg.lstsq(np.array(rows), np.array(motions), rcond=None)[0]
    return {name: np.round(each, 6).tolist() for name, each in zip(names, found, strict=True)}


def _range(values: Sequence[Array]) -> tuple[float, float]:
    """From 0, or the least value below, to the largest; of nothing but zeros to 1."""
    known = np.concatenate([each[np.isfinite(each)] for each in values])
    low, high = float(known.min(initial=0.0)), float(known.max(initial=0.0))
    return low, high if high > low else 1.0


def _shown(steps: Sequence[StepResult]) -> list[StepResult]:
    """The ends of steps, and others spread evenly."""
    ends = [steps.index(step) for step in step_ends(list(steps))][-INCREMENTS:]
    spread = (
        np.linspace(0, len(steps) - 1, max(INCREMENTS - len(ends), 1)).round().astype(int).tolist()
    )
    return [steps[k] for k in sorted({*ends, *(spread if len(ends) < INCREMENTS else [])})]


def _packed(values: Array | Index, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


def _quantised(values: Array, low: float, high: float) -> str:
    """Values in 65534 steps between two bounds."""
    known = np.isfinite(values)
    share = np.divide(values - low, high - low, out=np.zeros(len(values)), where=known)
    return _packed(
        np.where(known, np.rint(np.clip(share, 0.0, 1.0) * (UNKNOWN - 1)), UNKNOWN), "<u2"
    )


@functools.singledispatch
def _piece(
    mesh: BoundaryMesh, solution: SolutionData, name: str, steps: Sequence[StepResult]
) -> tuple[Keyed, list[Fields]]:
    """Points, normals, triangles and rims of a body, and its fields after each increment,
    displacements as `move`."""
    raise TypeError(f"no page of {type(mesh).__name__}")


@_piece.register
def _(
    mesh: SurfaceMesh, solution: SolutionData, name: str, steps: Sequence[StepResult]
) -> tuple[Keyed, list[Fields]]:
    share = mesh.n_elements / sum(other.n_elements for other in solution.meshes.values())
    places, triangles, rims = small_triangles(mesh, round(TRIANGLES * share))
    x, normal = mesh.at(places.element, places.place)
    basis, fields = mesh.basis_at(places.element, places.place), []
    contact = {
        pair: np.isin(places.element, mesh.element[nodes])
        for pair, nodes in solution.nodes.items()
        if solution.sides[pair][0] == name
    }
    for step in steps:
        traction = basis @ step.bodies[name].traction
        error = traction_error(mesh, step.bodies[name])[places.element]
        across = np.sum(traction * normal, axis=1)
        slip = np.full(len(x), np.nan)
        for pair, touching in contact.items():
            slips = basis @ _slip_at_nodes(mesh, solution.nodes[pair], step.pairs[pair])
            slip[touching] = np.linalg.norm(slips, axis=1)[touching]
        state = solution.body_fields(name, step).on_boundary(places.element, places.place)
        fields.append(
            _of_state(state)
            | {
                "pressure": -across,
                "shear": np.linalg.norm(traction - across[:, None] * normal, axis=1),
                "slip": slip,
                "error": error,
            }
        )
    return _geometry(x, normal, triangles, rims), fields


def _slip_at_nodes(mesh: SurfaceMesh, nodes: Index, pair: PairResult) -> Array:
    """Return the slip of an interface at all nodes of a mesh (n, 2), 0 where nothing is closed."""
    slip = np.where(pair.state[:, None] < 2, pair.slip, 0.0)
    return scattered(slip, nodes, mesh.n_nodes)


@_piece.register
def _(
    mesh: CurveMesh, solution: SolutionData, name: str, steps: Sequence[StepResult]
) -> tuple[Keyed, list[Fields]]:
    element = np.repeat(np.arange(mesh.n_elements), ALONG + 1)
    place = np.tile(np.linspace(0.0, 1.0, ALONG + 1), mesh.n_elements)
    number = np.arange(len(element)).reshape(-1, ALONG + 1)
    rims = np.stack([number[:, :-1], number[:, 1:]], axis=-1).reshape(-1, 2)
    basis, x = mesh.basis_at(element, place), mesh.at(element, place)[0]
    cells = np.empty((0, 3), dtype=np.int64)
    inside: Callable[[StepResult], StressState | None] = lambda step: None  # noqa: E731
    if name in filled_bodies(solution):
        size = np.ptp(x, axis=0)
        along = np.maximum(2, np.rint(CELLS * size / size.max()).astype(int))
        grid = grid_inside(mesh, (int(along[0]), int(along[1])))
        cells, x = np.asarray(grid[1]) + len(x), np.concatenate([x, grid[0]])
        inside = lambda step: field_inside(solution, grid, name, step)  # noqa: E731
    fields = []
    for step in steps:
        u, state = basis @ step.bodies[name].u, inside(step)
        both = {"move": u, "u": np.linalg.norm(u, axis=1), "von_mises": np.full(len(u), np.nan)}
        if state is not None:
            both = {
                key: np.concatenate([both[key], values]) for key, values in _of_state(state).items()
            }
        both["move"] = lifted(both["move"][:, :2], 3)
        fields.append(both)
    flat = np.pad(x, ((0, 0), (0, 1)))
    return _geometry(flat, np.tile([0.0, 0.0, 1.0], (len(flat), 1)), cells, rims), fields


def _of_state(state: StressState) -> Fields:
    return {"move": state.u, "u": np.linalg.norm(state.u, axis=1), "von_mises": state.von_mises}


def _geometry(x: Array, normal: Array, triangles: Index, rims: Index) -> Keyed:
    return {
        "x": _packed(x, "<f4"),
        "normal": _packed(normal, "<f4"),
        "triangles": _packed(triangles, "<u4"),
        "rims": _packed(rims, "<u4"),
    }
