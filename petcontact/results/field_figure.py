"""A figure of the deformed body coloured by von Mises stress."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..fields.interior import Field, field_on_grid
from ..fields.peak import largest
from ..mesh.curve_mesh import as_curve
from ..runtime.figure_style import draw_states, label, legend_below, plain, round_number, save
from .figures import outlines, place
from .solution import Solution

MAGNIFIED = 0.06
"""Largest displacement drawn, as a fraction of the body's diameter, where no magnification is given."""


def deformed_figure(
    solution: Solution, path: str | Path, *, resolution: tuple[int, int] | None = None,
    magnification: float | None = None, field: Field | None = None,
) -> Path:  # fmt: skip
    """Draw the deformed body, coloured by von Mises stress, with its initial outline.

    Parameters
    ----------
    solution : Solution
    path : str or Path
        Its suffix is the format: .png, .pdf or .svg.
    resolution : (int, int), optional
        Grid cells along x and y; by default 100 along the longer side of the bounding box.
    magnification : float, optional
        Factor of the displacement; by default a round number that makes it visible.
    field : Field, optional
        From `field_on_grid`, where it is there already.

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
    mesh = as_curve(solution.mesh)
    if field is None:
        size = np.ptp(mesh.start, axis=0)
        along = np.maximum(2, np.rint(100.0 * size / size.max()).astype(int))
        grid = resolution or (int(along[0]), int(along[1]))
        field = field_on_grid(mesh, solution.u, solution.traction, solution.case.material, grid)
    diameter = float(np.hypot(*np.ptp(mesh.start, axis=0)))
    peak = float(np.hypot(*field.u.T).max())
    factor = magnification if magnification is not None else round_number(MAGNIFIED * diameter, peak)
    save(Path(path), _draw, solution, field, factor)
    return Path(path)


def _draw(figure: Any, solution: Solution, field: Field, factor: float) -> None:
    axes, units = figure.add_subplot(), solution.case.units
    moved, peak = field.points + factor * field.u, largest(field, as_curve(solution.mesh))
    colours = axes.tripcolor(*moved.T, field.von_mises, triangles=field.cells, shading="gouraud", cmap="viridis",
                             vmin=0.0, vmax=peak.usual if peak.usual > 0.0 else 1.0, rasterized=True)  # fmt: skip
    for initial, deformed in outlines(as_curve(solution.mesh), solution.u, factor):
        axes.plot(*initial.T, color="0.55", lw=0.8, ls="--")
        axes.plot(*deformed.T, color="black", lw=0.9)
    contact = solution.contact
    draw_states(axes, contact.x + factor * solution.u[contact.nodes], contact.state)
    axes.plot(*moved[int(np.argmax(field.von_mises))], "x", color="black", ms=5.0, mew=1.0, label="largest")
    figure.colorbar(colours, ax=axes, label=label("von Mises stress", units.stress), shrink=0.8,
                    extend="max" if peak.stress > peak.usual else "neither")  # fmt: skip
    axes.plot([], [], color="0.55", lw=0.8, ls="--", label="initial")
    axes.plot([], [], color="black", lw=0.9, label=f"deformed, u × {factor:g}")
    place(axes, solution)
    figure.supxlabel(plain(f"largest {peak}"), fontsize=8.0)
    legend_below(axes, 5)
