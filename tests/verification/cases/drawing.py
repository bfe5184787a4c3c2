"""The two pictures of a case: what is posed, and what was found along its contact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from petcontact.mesh.curve_mesh import CurveMesh
from petcontact.results.figures import plane, space
from petcontact.runtime.figure_style import COLOURS, legend_below, save

KINDS = {"held": COLOURS[0], "loaded": COLOURS[4], "contact": COLOURS[1], "free": "0.45"}
ARROWS = 9


def problem_picture(solution, path: Path) -> Path:
    """Bodies as they are posed: what is held, loaded, in contact and free, with the names of parts
    and the loads."""
    return _few_colours(path, _sketch, solution)


def contact_picture(solution, path: Path) -> Path:
    """Pressure and shear along the last interface at the end, in space the pressure on its
    panels."""
    mesh = next(iter(solution.meshes.values()))
    return _few_colours(
        path, _curves if isinstance(mesh, CurveMesh) else space.draw_normal, solution
    )


def _few_colours(path, draw, solution):
    """A PNG of 96 colours, a third of the size."""
    save(path, draw, solution)
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(96, dither=Image.Dither.NONE)
    small.save(path, optimize=True)
    return path


def _kinds(solution, number):
    """Kind of each part of a body, by name."""
    problem = solution.problem
    body = problem.body[number]
    kinds = dict.fromkeys(solution.meshes[body.name].part_names, "free")
    for condition in body.boundary:
        kind = {"displacement": "held", "symmetry": "held", "contact": "contact"}.get(
            condition.condition, "loaded"
        )
        mesh, found = solution.meshes[body.name], solution.bodies[body.name]
        if kind == "loaded" and not found.traction[mesh.nodes_of(condition.part)].any():
            kind = "free"
        kinds[condition.part] = kind
    for pair in problem.contact:
        for side in (pair.secondary, pair.primary):
            name, _, part = side.rpartition(".")
            if (name or body.name) == body.name and part in kinds:
                kinds[part] = "contact"
    return kinds


def _pieces(mesh, part):
    """Corners of the elements of a part: (k, 2, 2) lines in the plane, a list of polygons in
    space."""
    numbers = np.flatnonzero(mesh.part == mesh.part_names.index(part))
    if isinstance(mesh, CurveMesh):
        points = np.stack(
            [mesh.on_elements(numbers, np.array([xi]))[0] for xi in np.linspace(-1.0, 1.0, 5)],
            axis=1,
        )
        return points.reshape(len(numbers), 5, 2)
    return [corners[~np.isnan(corners[:, 0])] for corners in mesh.corners[numbers]]


def _sketch(figure, solution):
    first = next(iter(solution.meshes.values()))
    in_plane = isinstance(first, CurveMesh)
    axes = figure.add_subplot(**({} if in_plane else {"projection": "3d"}))
    size = float(np.ptp(np.vstack([mesh.x for mesh in solution.meshes.values()]), axis=0).max())
    for number, (name, mesh) in enumerate(solution.meshes.items()):
        for part, kind in _kinds(solution, number).items():
            pieces, nodes = _pieces(mesh, part), mesh.nodes_of(part)
            if in_plane:
                _lines(axes, pieces, KINDS[kind], kind)
                middle = (
                    mesh.x[nodes[len(nodes) // 2]]
                    - 0.05 * size * mesh.normal[nodes[len(nodes) // 2]]
                )
                axes.text(*middle, part, fontsize=7.0, color="0.3", ha="center", va="center")
                if kind == "loaded":
                    _arrows(axes, mesh.x[nodes], solution.bodies[name].traction[nodes], size)
            else:
                _panels(axes, pieces, KINDS[kind])
        for force in solution.problem.body[number].point_force if in_plane else ():
            _arrows(axes, np.array([force.at]), np.array([force.force]), size)
    for kind, colour in KINDS.items():
        axes.plot([], [], color=colour, lw=2.0, label=kind)
    unit = f" [{solution.problem.units.length}]" if solution.problem.units.length else ""
    axes.set(xlabel=f"x{unit}", ylabel=f"y{unit}")
    axes.set_aspect("equal")
    legend_below(axes, len(KINDS))


def _lines(axes, pieces, colour, kind):
    from matplotlib.collections import LineCollection

    axes.add_collection(
        LineCollection(list(pieces), colors=colour, linewidths=1.0 if kind == "free" else 2.2)
    )
    axes.autoscale_view()


def _panels(axes, pieces, colour):
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    axes.add_collection3d(
        Poly3DCollection(pieces, facecolors=colour, edgecolors="0.3", linewidths=0.3, alpha=0.35)
    )
    corners = np.vstack(pieces)
    for axis, values in zip("xyz", corners.T, strict=True):
        low, high = getattr(axes, f"get_{axis}lim")()
        getattr(axes, f"set_{axis}lim")(min(low, values.min()), max(high, values.max()))


def _arrows(axes, points, loads, size):
    """The loads, their tips on the boundary, the longest a tenth of the bodies."""
    chosen = np.unique(np.linspace(0, len(points) - 1, ARROWS).astype(int))
    longest = float(np.linalg.norm(loads, axis=1).max()) or 1.0
    arrows = 0.1 * size * loads[chosen] / longest
    axes.quiver(
        *(points[chosen] - arrows).T,
        *arrows.T,
        color=KINDS["loaded"],
        angles="xy",
        scale_units="xy",
        scale=1.0,
        width=0.003,
    )


def _curves(figure, solution):
    name = list(solution.pairs)[-1]
    pair, axes = solution.pairs[name], figure.add_subplot()
    order = np.argsort(pair.arc_length)
    s, units = pair.arc_length[order], solution.problem.units
    plane._shaded(axes, solution, name)
    axes.plot(s, pair.pressure[order], label="pressure p")
    if np.abs(pair.sigma_t).max(initial=0.0) > 1e-9 * np.abs(pair.pressure).max(initial=1.0):
        axes.plot(s, pair.sigma_t[order, 0], label="shear q")
    plane._window(axes, [pair])
    if np.ptp(pair.pressure) < 0.01 * pair.pressure.max():  # a constant, but for round-off
        axes.set_ylim(0.0, 1.2 * pair.pressure.max())
    axes.set(
        xlabel=f"arc length along {'.'.join(solution.sides[name])}"
        + (f" [{units.length}]" if units.length else ""),
        ylabel="traction" + (f" [{units.stress}]" if units.stress else ""),
    )
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
