"""A figure of the stress along the boundary of each body in the plane."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...fields.boundary.places import best_places
from ...fields.stress_state import StressState
from ...mesh.curve_mesh import CurveMesh, as_curve
from ...runtime.figure_style import label, legend_beside, plain
from ...untyped import Axes, Figure, Keyed
from ..data import SolutionData
from ..vtu.inner_fields import filled_bodies
from .curves import headed, shown_ends
from .plane_figures import line

LETTER = 0.0095
"""Width of a letter over that of the axes [-]: names of parts that are shorter are turned."""


def draw_hoop(figure: Figure, solution: SolutionData) -> None:
    """Draw the normal stress along the boundary, loop after loop, at the end of each step.

    Bodies of revolution have the stress around the axis as well. Parts begin at the thin lines.
    """
    bodies = [name for name in solution.meshes if name in filled_bodies(solution)]
    figure.set_figheight(1.2 + 2.6 * len(bodies))
    units = solution.problem.units
    for axes, name in zip(np.atleast_1d(figure.subplots(len(bodies), 1)), bodies, strict=True):
        mesh = as_curve(solution.meshes[name])
        start = np.append(0.0, np.cumsum(mesh.length))
        _draw_stresses(axes, solution, name, start)
        first = np.flatnonzero(np.append(True, mesh.part[1:] != mesh.part[:-1]))
        room = np.diff(start[np.append(first, -1)]) / start[-1]
        for k, share in zip(first, room, strict=True):
            axes.axvline(start[k], color="0.7", lw=0.6)
            word = plain(mesh.part_names[mesh.part[k]])
            axes.annotate(
                word,
                (start[k], 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(2.0, -2.0),
                textcoords="offset points",
                va="top",
                rotation=90.0 if share < LETTER * len(word) else 0.0,
                fontsize="x-small",
                color="0.35",
            )
        axes.axhline(0.0, color="0.5", lw=0.6)
        axes.set(
            xlim=(0.0, float(mesh.length.sum())),
            xlabel=label("arc length round the boundary", units.length),
            ylabel=label("stress along the boundary", units.stress),
            title=headed(solution, name if len(solution.meshes) > 1 else ""),
        )
        if len(axes.get_legend_handles_labels()[0]) > 1:
            legend_beside(axes)


def _draw_stresses(axes: Axes, solution: SolutionData, name: str, start: Array) -> None:
    """Draw the curves of a body whose elements have the arc lengths `start` at their starts."""
    mesh, ends, largest = as_curve(solution.meshes[name]), shown_ends(solution), 0.0
    element, place = best_places(mesh)
    along = start[element] + place * mesh.length[element]
    order = np.argsort(along, kind="stable")
    for number, step in enumerate(ends):
        state = solution.body_fields(name, step).on_boundary(element, place)
        title = plain(step.title) if len(ends) > 1 else ""
        for word, stress, faint in _curves(mesh, element, place, state):
            largest = max(largest, float(np.percentile(np.abs(stress), 99.0)))
            text = ", ".join(filter(None, (title, word)))
            axes.plot(along[order], stress[order], label=text, **line(number), **faint)
    # stress may be infinite at corners
    if largest > 0.0:
        axes.set_ylim(*np.clip(axes.get_ylim(), -1.5 * largest, 1.5 * largest))


def _curves(
    mesh: CurveMesh, element: Index, place: Array, state: StressState
) -> list[tuple[str, Array, Keyed]]:
    """Return the name, the stress and the style of each curve."""
    along = hoop_stress(mesh, element, place, state)
    if "zz" not in mesh.stresses:
        return [("", along, {})]
    return [("along the curve", along, {}), ("around the axis", state.sigma_zz, {"alpha": 0.45})]


def hoop_stress(mesh: CurveMesh, element: Index, place: Array, state: StressState) -> Array:
    """Return τ·στ (q,) at places of a boundary in the plane, with τ along it [stress].

    `state` is the stress at these places.
    """
    x, y = mesh.tangents_to(mesh.at(element, place)[1])[:, 0].T
    xx, yy, xy = state.in_plane.T
    return np.asarray(xx * x * x + yy * y * y + 2.0 * xy * x * y)
