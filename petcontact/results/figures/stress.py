"""A figure of the deformed bodies coloured by a stress."""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...fields.peak import PERCENT, peak_of
from ...fields.stress_state import Field
from ...frozen import frozen
from ...mesh.curve_mesh import as_curve
from ...mesh.surface_mesh import SurfaceMesh
from ...model.base import nearest
from ...runtime.figure_style import label, legend_below, plain, save
from ..body_fields import quantities, quantity
from ..data import SolutionData
from ..vtu.inside import Window, field_inside, filled_bodies, grid_inside
from ..vtu.places import Places
from .plane import draw_outlines, place
from .surface import sampled, shade_each
from .view import View, view_of

MAGNIFIED = 0.06
"""Largest displacement drawn, as a fraction of the size of the bodies, where no magnification is
given."""
ALONG = 100
"""Grid cells along the longer side of a body, where no grid is given."""
WIDE = 110
"""Characters of a line under the figure."""
COARSE = 40
"""The same for the figure that `plot` draws."""
SIGNED = 0.01
"""Share of the usual size below zero from which colours have two signs."""


WORDS = {
    "von_mises": "von Mises stress",
    "principal_1": "first principal stress",
    "principal_2": "second principal stress",
    "principal_3": "third principal stress",
    "u": "|u|",
}
"""Of quantities in figures; the others are called by their names."""


def deformed_figure(
    solution: SolutionData,
    path: str | Path,
    *,
    resolution: tuple[int, int] | None = None,
    magnification: float | None = None,
    field: Field | Mapping[str, Field] | None = None,
    quantity: str = "von_mises",
    bodies: Collection[str] | None = None,
    window: Window | None = None,
) -> Path:
    """Draw the deformed bodies at the end, coloured by a stress: in the plane inside, in space on
    the surface.

    Parameters
    ----------
    solution : Solution
    path : str or Path
        Its suffix is the format: .png, .pdf or .svg.
    resolution : (int, int), optional
        In the plane, grid cells along x and y; by default 100 along the longer side of the bounding
        box.
    magnification : float, optional
        Factor of the displacement; by default a round number that makes it visible.
    field : Field, or dict of Field by body, optional
        In the plane, from `field_on_grid`, where it is there already.
    quantity : str
        See `body_fields.quantities`.
    bodies : names, optional
        Those that are coloured.
    window : two (2,) arrays, optional
        In the plane, corners of the box that is shown [length].

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If there is no such format or quantity.
    OutputError
        If the file cannot be written.
    """
    if isinstance(field, Field):
        field = {solution.only_body("field"): field}
    mesh = next(iter(solution.meshes.values()))
    if quantity not in (known := quantities(mesh.dim)):
        raise InputError(
            f"no quantity "
            f"{quantity!r}{nearest(quantity, known) or '; there are ' + ', '.join(known)}"
        )
    coloured = [name for name in filled_bodies(solution) if bodies is None or name in bodies]
    picture = Picture(
        view_of(solution, share=MAGNIFIED, factor=magnification),
        quantity,
        coloured,
        resolution,
        window,
    )
    save(Path(path), DRAWING[mesh.dim], solution, picture, field or {})
    return Path(path)


@frozen
class Picture:
    """What is shown, and how: see `deformed_figure`."""

    view: View
    quantity: str
    bodies: Sequence[str]
    resolution: tuple[int, int] | None = None
    window: Window | None = None

    def label(self, solution: SolutionData) -> str:
        """Of the colours."""
        units = solution.problem.units
        word = WORDS.get(self.quantity, self.quantity)
        return label(word, units.length if self.quantity.startswith("u") else units.stress)


def draw_von_mises(figure: Any, solution: SolutionData) -> None:
    """Von Mises stress in the deformed bodies on a coarse grid."""
    mesh = next(iter(solution.meshes.values()))
    picture = Picture(
        view_of(solution, share=MAGNIFIED), "von_mises", filled_bodies(solution), None
    )
    DRAWING[mesh.dim](figure, solution, picture, {}, COARSE)


def _draw_plane(
    figure: Any,
    solution: SolutionData,
    picture: Picture,
    given: Mapping[str, Field],
    cells: int = ALONG,
) -> None:
    axes, factor, fields, values = figure.add_subplot(), picture.view.factor, {}, {}
    for name in picture.bodies:
        fields[name] = field = given.get(name) or _field(solution, name, picture, cells)
        values[name] = quantity(field, picture.quantity)
    peaks = {
        name: peak_of(as_curve(solution.meshes[name]), field.x, np.abs(values[name]))
        for name, field in fields.items()
    }
    usual = max((peak.usual for peak in peaks.values()), default=0.0) or 1.0
    signed = (
        min((float(v.min(initial=0.0)) for v in values.values()), default=0.0) < -SIGNED * usual
    )
    shown = {
        "shading": "gouraud",
        "cmap": "coolwarm" if signed else "viridis",
        "vmin": -usual if signed else 0.0,
        "vmax": usual,
        "rasterized": True,
    }
    for name, field in fields.items():
        colours = axes.tripcolor(
            *(field.x + factor * field.u).T, values[name], triangles=field.cells, **shown
        )
    draw_outlines(axes, solution, picture.view)
    if peaks:
        name, peak = max(peaks.items(), key=lambda item: item[1].stress)
        field, at = fields[name], int(np.argmax(np.abs(values[name])))
        axes.plot(
            *(field.x[at] + factor * field.u[at]),
            "x",
            color="black",
            ms=5.0,
            mew=1.0,
            label="largest",
        )
        ends = "both" if signed else "max"
        figure.colorbar(
            colours,
            ax=axes,
            label=picture.label(solution),
            shrink=0.8,
            extend=ends if peak.stress > usual else "neither",
        )
        figure.supxlabel(textwrap.fill(plain(f"largest {peak}"), WIDE), fontsize=8.0)
    place(axes, solution)
    if picture.window is not None and fields:
        # where the points of the window are drawn
        drawn = np.vstack([field.x + factor * field.u for field in fields.values()])
        (left, bottom), (right, top) = drawn.min(axis=0), drawn.max(axis=0)
        axes.set(xlim=(left, right), ylim=(bottom, top))
    legend_below(axes, 5)


def _field(solution: SolutionData, name: str, picture: Picture, cells: int) -> Field:
    mesh = as_curve(solution.meshes[name])
    size = (
        np.ptp(mesh.start, axis=0)
        if picture.window is None
        else picture.window[1] - picture.window[0]
    )
    along = np.maximum(2, np.rint(cells * size / size.max()).astype(int))
    resolution = picture.resolution or (int(along[0]), int(along[1]))
    return field_inside(solution, grid_inside(mesh, resolution, picture.window), name)


def _draw_space(
    figure: Any,
    solution: SolutionData,
    picture: Picture,
    given: Mapping[str, Field],
    cells: int = ALONG,
) -> None:
    """The surfaces, shaded."""

    def sample(name: str, mesh: SurfaceMesh, places: Places) -> Array:
        if name not in picture.bodies:
            return np.full(len(places.element), np.nan)
        return quantity(
            solution.body_fields(name).on_boundary(places.element, places.place), picture.quantity
        )

    bodies = sampled(solution, sample)
    sizes = np.abs(np.concatenate([body.values for body in bodies.values()]))
    # a few places with singular stress leave no colours for the others
    usual = (
        float(np.percentile(sizes[np.isfinite(sizes)], PERCENT))
        if np.isfinite(sizes).any()
        else 0.0
    )
    shade_each(figure, solution, bodies, picture.label(solution), picture.view, usual or None)


DRAWING = {2: _draw_plane, 3: _draw_space}
"""What draws bodies in so many dimensions."""
