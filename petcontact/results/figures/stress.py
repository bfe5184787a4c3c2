"""A figure of the deformed bodies coloured by von Mises stress."""

from __future__ import annotations

import functools
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...fields.interior import Field
from ...fields.peak import largest
from ...mesh.curve_mesh import CurveMesh, as_curve
from ...mesh.surface_mesh import SurfaceMesh
from ...runtime.figure_style import label, legend_below, plain, save
from ..data import SolutionData
from ..vtu.inside import field_inside, filled_bodies, grid_inside
from .plane import draw_outlines, place
from .space import draw_panels
from .view import View, view_of

MAGNIFIED = 0.06
"""Largest displacement drawn, as a fraction of the size of the bodies, where no magnification is given."""
ALONG = 100
"""Grid cells along the longer side of a body, where no grid is given."""
WIDE = 110
"""Characters of a line under the figure."""
DEPTH = 0.25
"""Depth under a panel, in its half-widths, at which the stress of the figure in space is."""


def deformed_figure(
    solution: SolutionData, path: str | Path, *, resolution: tuple[int, int] | None = None,
    magnification: float | None = None, field: Field | Mapping[str, Field] | None = None,
) -> Path:  # fmt: skip
    """Draw the deformed bodies at the end, coloured by von Mises stress; in space that close under the surface.

    Parameters
    ----------
    solution : Solution
    path : str or Path
        Its suffix is the format: .png, .pdf or .svg.
    resolution : (int, int), optional
        In the plane, grid cells along x and y; by default 100 along the longer side of the bounding box.
    magnification : float, optional
        Factor of the displacement; by default a round number that makes it visible.
    field : Field, or dict of Field by body, optional
        In the plane, from `field_on_grid`, where it is there already.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If there is no such format.
    OutputError
        If the file cannot be written.
    """
    if isinstance(field, Field):
        field = {solution.only_body("field"): field}
    view = view_of(solution, share=MAGNIFIED, factor=magnification)
    save(Path(path), _drawing(next(iter(solution.meshes.values()))), solution, view, resolution, field or {})
    return Path(path)


@functools.singledispatch
def _drawing(mesh: Any) -> Any:
    """What draws bodies with meshes of a kind."""
    raise TypeError(f"no figure of {type(mesh).__name__}")


@_drawing.register
def _(mesh: CurveMesh) -> Any:
    return _draw_plane


@_drawing.register
def _(mesh: SurfaceMesh) -> Any:
    return _draw_space


def _draw_plane(
    figure: Any, solution: SolutionData, view: View, resolution: tuple[int, int] | None, given: Mapping[str, Field]
) -> None:
    axes, units, factor = figure.add_subplot(), solution.problem.units, view.factor
    fields = {name: given.get(name) or _field(solution, name, resolution) for name in filled_bodies(solution)}
    peaks = {name: largest(field, as_curve(solution.meshes[name])) for name, field in fields.items()}
    usual = max((peak.usual for peak in peaks.values()), default=0.0) or 1.0
    for field in fields.values():
        shown = {"shading": "gouraud", "cmap": "viridis", "vmin": 0.0, "vmax": usual, "rasterized": True}
        colours = axes.tripcolor(*(field.points + factor * field.u).T, field.von_mises, triangles=field.cells, **shown)
    draw_outlines(axes, solution, view)
    if peaks:
        name, peak = max(peaks.items(), key=lambda item: item[1].stress)
        field = fields[name]
        at = int(np.argmax(field.von_mises))
        axes.plot(*(field.points[at] + factor * field.u[at]), "x", color="black", ms=5.0, mew=1.0, label="largest")
        figure.colorbar(colours, ax=axes, label=label("von Mises stress", units.stress), shrink=0.8,
                        extend="max" if peak.stress > usual else "neither")  # fmt: skip
        figure.supxlabel(textwrap.fill(plain(f"largest {peak}"), WIDE), fontsize=8.0)
    place(axes, solution)
    legend_below(axes, 5)


def _field(solution: SolutionData, name: str, resolution: tuple[int, int] | None) -> Field:
    mesh = as_curve(solution.meshes[name])
    size = np.ptp(mesh.start, axis=0)
    along = np.maximum(2, np.rint(ALONG * size / size.max()).astype(int))
    return field_inside(solution, grid_inside(mesh, resolution or (int(along[0]), int(along[1]))), name)


def _draw_space(
    figure: Any, solution: SolutionData, view: View, resolution: tuple[int, int] | None, given: Mapping[str, Field]
) -> None:
    values = []
    for name, mesh in solution.meshes.items():
        weight = np.bincount(mesh.element, mesh.weight)
        centre, normal = (np.stack([np.bincount(mesh.element, mesh.weight * column) / weight for column in field.T], axis=1)
                          for field in (mesh.x, mesh.normal))  # fmt: skip
        inside = centre - 0.5 * DEPTH * np.sqrt(weight)[:, None] * normal
        known = name in filled_bodies(solution)
        values.append(solution.von_mises_at(inside, name) if known else np.full(len(inside), np.nan))
    axes = figure.add_subplot(projection="3d")
    stress = label("von Mises stress", solution.problem.units.stress)
    draw_panels(axes, solution, np.concatenate(values), stress, view)
