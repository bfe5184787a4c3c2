"""Bodies of revolution in space: their half sections turned about the axis, with von Mises stress
on their surfaces and where they are cut open."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...arrays import Array, Index
from ...runtime.figure_style import label
from ...untyped import Figure
from ..data import SolutionData
from ..vtu.boundary import boundary_cells
from ..vtu.inner_fields import field_inside, filled_bodies, grid_inside, inside_cells
from ..vtu.revolve import check_revolved, revolved
from .colour_bands import band_colours, beyond
from .curves import headed_end
from .model_in_space import BELOW
from .stress_figure import COARSE, largest_known
from .surface_figure import AZIMUTH, COLOUR_BAR, ELEVATION, Sampled, draw_bodies, fit_axes
from .view import View

Part = tuple[Array, dict[str, Array], Index]
"""Points of a surface, what is known there, and the triangles between them."""


def draw_turned(figure: Figure, solution: SolutionData, view: View, degrees: float) -> None:
    """Draw the deformed bodies at the end, turned by so many degrees, below 360 with their inside.

    Raises
    ------
    InputError
        If the angle is none, or a body is not of revolution.
    """
    check_revolved([*solution.meshes.values()], degrees)
    bodies = {name: turned(solution, name, degrees) for name in solution.meshes}
    values = np.concatenate([body.values for body in bodies.values()])
    known = largest_known(solution, "von_mises", bodies)
    figure.get_layout_engine().set(rect=(0.0, BELOW, 1.0, 1.0 - BELOW))  # for the names of axes
    axes = figure.add_subplot(projection="3d")
    colours = band_colours(values, max((value for value, *_ in known), default=None))
    eye = view.eye or (ELEVATION, AZIMUTH)
    moved = draw_bodies(axes, solution, bodies, view.factor, colours, eye)
    fit_axes(axes, solution, moved.min(axis=0), moved.max(axis=0))
    what = label("von Mises stress", solution.problem.units.stress)
    figure.colorbar(
        colours,
        ax=axes,
        label=what,
        extend=beyond(values, colours.norm.vmin, colours.norm.vmax),
        **COLOUR_BAR,
    )
    title = "\n".join(filter(None, (headed_end(solution), view.text)))
    figure.suptitle(title, fontsize="medium")


def turned(solution: SolutionData, name: str, degrees: float) -> Sampled:
    """The surface of a body in triangles, the two half sections at which it is open among them."""
    hull = revolved(boundary_cells(solution, name, solution.last), degrees)
    quads = hull.cells_dict["quad"]
    parts = [(hull.points, hull.point_data, np.vstack([quads[:, :3], quads[:, [0, 2, 3]]]))]
    if degrees < 360.0 and name in filled_bodies(solution):
        parts += _half_sections(solution, name, degrees)
    first = np.cumsum([0, *(len(points) for points, _, _ in parts)])
    return Sampled(
        np.vstack([points for points, _, _ in parts]),
        np.vstack([data["normal"] for _, data, _ in parts]),
        np.vstack([data["displacement"] for _, data, _ in parts]),
        np.concatenate([data["von_mises"] for _, data, _ in parts]),
        np.vstack([cells + k for (_, _, cells), k in zip(parts, first, strict=False)]),
        np.zeros((0, 2), dtype=np.int64),
    )


def _half_sections(solution: SolutionData, name: str, degrees: float) -> Iterator[Part]:
    """Yield the half sections at which a body begins and ends."""
    grid = grid_inside(solution.meshes[name], (COARSE, COARSE))
    section = inside_cells(field_inside(solution, grid, name))
    whole, count = revolved(section, degrees), len(section.points)
    angles = len(whole.points) // count
    for face in (slice(None, None, angles), slice(angles - 1, None, angles)):
        data = {key: values[face] for key, values in whole.point_data.items()}
        data["normal"] = np.zeros((count, 3))  # seen from all sides
        yield whole.points[face], data, section.cells_dict["triangle"]
