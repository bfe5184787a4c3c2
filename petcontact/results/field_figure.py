"""A figure of the deformed body coloured by von Mises stress."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array
from ..fields.interior import Field, field_on_grid
from ..mesh.basis import lagrange
from .figures import plain, round_number, save
from .solution import Solution

MAGNIFIED = 0.06
"""Largest displacement drawn, as a fraction of the body's diameter, where no magnification is given."""
BRIGHTEST = 99.0
"""Percentile of the von Mises stress at which the colours end: it is infinite at some corners."""


def deformed_figure(
    solution: Solution, path: str | Path, *, resolution: tuple[int, int] | None = None,
    magnification: float | None = None, field: Field | None = None,
) -> Path:  # fmt: skip
    """Draw the deformed body, coloured by von Mises stress, with its initial outline, as PNG.

    Parameters
    ----------
    solution : Solution
    path : str or Path
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
    OutputError
        If the file cannot be written.
    """
    mesh = solution.mesh
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
    axes = figure.add_subplot()
    moved, stress = field.points + factor * field.u, field.von_mises
    top = float(np.percentile(stress, BRIGHTEST))
    colours = axes.tripcolor(*moved.T, stress, triangles=field.cells, shading="gouraud", cmap="viridis",
                             vmin=0.0, vmax=top if top > 0.0 else 1.0)  # fmt: skip
    for initial, deformed in _outlines(solution, factor):
        axes.plot(*initial.T, color="0.55", lw=0.8, ls="--")
        axes.plot(*deformed.T, color="black", lw=0.9)
    contact = solution.contact
    shown = contact.x + factor * solution.u[contact.nodes]
    for state, colour, label in ((1, "C3", "slip"), (0, "white", "stick")):
        chosen = contact.state == state
        if chosen.any():
            axes.plot(*shown[chosen].T, ".", color=colour, mec="black", mew=0.2, ms=4, label=label)
    axes.set(xlabel="x", ylabel="y", aspect="equal", title=plain(solution.case.title))
    axes.title.set_fontsize("medium")
    figure.colorbar(colours, ax=axes, label="von Mises stress", extend="max" if stress.max() > top else "neither",
                    shrink=0.8)  # fmt: skip
    axes.plot([], [], color="0.55", lw=0.8, ls="--", label="initial")
    axes.plot([], [], color="black", lw=0.9, label=f"deformed, u × {factor:g}")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=4, fontsize="small", frameon=False)


def _outlines(solution: Solution, factor: float) -> list[tuple[Array, Array]]:
    """Closed curves (k, 2), initial and deformed, one pair a loop."""
    mesh = solution.mesh
    pairs = []
    for loop in mesh.loops():
        initial, deformed = [], []
        for k in loop.tolist():
            order = int(mesh.order[k])
            # constant elements by their middle, which is where their displacement is accurate
            xi = np.linspace(-1.0, 1.0, 7) if order else np.zeros(1)
            place = mesh.on_element(k, xi)[0]
            values = lagrange(order, xi).T @ solution.u[mesh.first_node[k] : mesh.first_node[k + 1]]
            initial.append(mesh.on_element(k, np.linspace(-1.0, 1.0, 7))[0])
            deformed.append(place + factor * values)
        curves = [np.vstack(points) for points in (initial, deformed)]
        pairs.append((np.vstack([curves[0], curves[0][:1]]), np.vstack([curves[1], curves[1][:1]])))
    return pairs
