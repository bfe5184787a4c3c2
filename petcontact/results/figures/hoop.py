"""A figure of the stress along the boundary of each body in the plane."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...fields.boundary.places import best_places
from ...mesh.curve_mesh import CurveMesh, as_curve
from ...runtime.figure_style import label, legend_beside, plain
from ..data import SolutionData
from ..vtu.inside import filled_bodies
from .curves import headed, shown_ends
from .plane import line


def draw_hoop(figure: Any, solution: SolutionData) -> None:
    """Normal stress along the boundary, loop after loop, at the end of each step, and around the
    axis of bodies of revolution; parts begin at the lines."""
    bodies = [name for name in solution.meshes if name in filled_bodies(solution)]
    figure.set_figheight(1.2 + 2.6 * len(bodies))
    units = solution.problem.units
    for axes, name in zip(np.atleast_1d(figure.subplots(len(bodies), 1)), bodies, strict=True):
        mesh = as_curve(solution.meshes[name])
        _draw_stresses(axes, solution, name, mesh)
        _mark_parts(axes, mesh)
        axes.axhline(0.0, color="0.5", lw=0.6)
        axes.set(
            xlim=(0.0, float(mesh.length.sum())),
            xlabel=label("arc length round the boundary", units.length),
            ylabel=label("stress along the boundary", units.stress),
            title=headed(solution, name if len(solution.meshes) > 1 else ""),
        )
        if len(axes.get_legend_handles_labels()[0]) > 1:
            legend_beside(axes)


def _draw_stresses(axes: Any, solution: SolutionData, name: str, mesh: CurveMesh) -> None:
    """The curves of a body."""
    element, place = best_places(mesh)
    along, ends, usual = _way(mesh, element, place), shown_ends(solution), 0.0
    order = np.argsort(along, kind="stable")
    for number, step in enumerate(ends):
        for what, (stress, style) in _stresses(solution, name, element, place, step).items():
            usual = max(usual, float(np.percentile(np.abs(stress), 99.0)))
            words = [plain(step.title) if len(ends) > 1 else "", what]
            style |= {"label": ", ".join(filter(None, words))}
            axes.plot(along[order], stress[order], **line(number), **style)
    # stress may be infinite at corners
    if usual > 0.0:
        low, high = axes.get_ylim()
        axes.set_ylim(max(low, -1.5 * usual), min(high, 1.5 * usual))


def _mark_parts(axes: Any, mesh: CurveMesh) -> None:
    for start, part in _starts(mesh):
        axes.axvline(start, color="0.7", lw=0.6)
        axes.annotate(
            plain(part),
            (start, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(2.0, -2.0),
            textcoords="offset points",
            va="top",
            fontsize="x-small",
            color="0.35",
        )


def hoop_stress(
    solution: SolutionData, body: str, element: Index, place: Array, step: Any = None
) -> Array:
    """τ·στ (q,) at places of a plane body's boundary, τ along it [stress]."""
    at = solution.meshes[body].variables_at(element, place)
    state = solution.body_fields(body, step).on_boundary(element, place)
    x, y = -at["ny"], at["nx"]
    xx, yy, xy = state.in_plane.T
    return np.asarray(xx * x * x + yy * y * y + 2.0 * xy * x * y)


def _stresses(
    solution: SolutionData, body: str, element: Index, place: Array, step: Any
) -> dict[str, tuple[Array, dict[str, Any]]]:
    """What is drawn, by its name, with the style of its line."""
    along = hoop_stress(solution, body, element, place, step)
    if "zz" not in solution.meshes[body].stresses:
        return {"": (along, {})}
    around = solution.body_fields(body, step).on_boundary(element, place).sigma_zz
    return {"along the curve": (along, {}), "around the axis": (around, {"alpha": 0.45})}


def _way(mesh: CurveMesh, element: Index, place: Array) -> Array:
    """Arc length round all loops at places [length]."""
    first = np.concatenate([[0.0], np.cumsum(mesh.length)])
    return np.asarray(first[element] + place * mesh.length[element])


def _starts(mesh: CurveMesh) -> list[tuple[float, str]]:
    """Where parts begin, and their names."""
    first = np.concatenate([[0.0], np.cumsum(mesh.length)])
    found = np.flatnonzero(np.append(True, mesh.part[1:] != mesh.part[:-1]))
    return [(float(first[k]), mesh.part_names[mesh.part[k]]) for k in found]
