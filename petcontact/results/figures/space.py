"""Figures in space: the deformed bodies, and on each interface tractions, motion and states, seen along its normal."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...contact.law_protocol import OPEN
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.surface_mesh import as_surface, corner_values
from ...runtime.figure_style import STATES, label, plain
from ..data import SolutionData
from ..records import PairResult, step_ends
from .curves import CURVES, along, headed
from .view import View, view_of

ARROWS = 500
"""Most arrows of one panel."""


def draw_surface(figure: Any, solution: SolutionData) -> None:
    """The deformed surfaces of all bodies at the end, coloured by |u|, with the initial edges of the panels."""
    surface_on(figure.add_subplot(projection="3d"), solution)


def surface_on(axes: Any, solution: SolutionData, view: View | None = None) -> None:
    """The same on given axes, in a view that others share; else in the one that suits it."""
    sizes = [np.linalg.norm(corner_values(as_surface(mesh), solution.bodies[name].u)[1], axis=2).mean(axis=1)
             for name, mesh in solution.meshes.items()]  # fmt: skip
    what = label("|u|", solution.problem.units.length)
    draw_panels(axes, solution, np.concatenate(sizes), what, view or view_of(solution), view.largest if view else None)


def draw_panels(axes: Any, solution: SolutionData, values: Array, what: str, view: View, top: float | None = None) -> None:
    """The deformed surfaces with the panels of all bodies coloured by a value each, up to `top` or to the largest."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    factor = view.factor
    pieces = [corner_values(as_surface(mesh), solution.bodies[name].u) for name, mesh in solution.meshes.items()]
    moved = np.concatenate([corners + factor * u for corners, u in pieces])
    colour = figure_colours(values, top)
    faces = colour.to_rgba(values)
    axes.add_collection3d(Poly3DCollection(list(moved), facecolors=faces, edgecolors="0.3", linewidths=0.25))
    low, high = np.minimum(moved.min(axis=(0, 1)), view.low), np.maximum(moved.max(axis=(0, 1)), view.high)
    names = (label(axis, solution.problem.units.length) for axis in "xyz")
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]),
             **dict(zip(("xlabel", "ylabel", "zlabel"), names, strict=True)))  # fmt: skip
    axes.set_box_aspect(high - low, zoom=0.85)  # room for the numbers at the axes
    end = solution.last.name if len(solution.tried) > 1 else ""
    axes.set_title("\n".join(filter(None, (headed(solution, end), view.text))), fontsize="medium")
    axes.figure.colorbar(colour, ax=axes, label=what, shrink=0.7, pad=0.1)


def figure_colours(values: Array, top: float | None = None) -> Any:
    """A colour map from 0, or where values are negative from minus the largest, to the largest or a given one."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    largest = top or float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    signed = bool(np.nanmin(values, initial=0.0) < 0.0)
    return ScalarMappable(Normalize(-largest if signed else 0.0, largest), "coolwarm" if signed else "viridis")


def draw_displacement(figure: Any, solution: SolutionData) -> None:
    """Tangential displacement on each interface at the end, between bodies the slip, as arrows; nodes that stick as dots."""
    for axes, name, pair in _panels(figure, solution):
        slip = np.where(pair.state[:, None] == OPEN, 0.0, pair.slip)
        _shade(axes, solution, name, np.linalg.norm(slip, axis=1), "tangential displacement", "Greys")
        _arrows(axes, pair, slip, "C3")


def draw_traction(figure: Any, solution: SolutionData) -> None:
    """Tangential traction on each interface at the end as arrows, over its share of the bound; nodes that stick as dots."""
    for axes, name, pair in _panels(figure, solution):
        size, limited = np.linalg.norm(pair.sigma_t, axis=1), np.isfinite(pair.bound) & (pair.bound > 0.0)
        share = np.divide(size, pair.bound, out=np.zeros(len(size)), where=limited)
        values, what = (share, "tangential traction / bound") if limited.any() else (size, "tangential traction")
        _shade(axes, solution, name, values, what, "Greys")
        _arrows(axes, pair, pair.sigma_t, "C0")


def draw_normal(figure: Any, solution: SolutionData) -> None:
    """Pressure on each interface at the end; where it is negative a foundation that does not pull would let go."""
    for axes, name, pair in _panels(figure, solution):
        _shade(axes, solution, name, pair.pressure, "pressure", "viridis")


def draw_gap(figure: Any, solution: SolutionData) -> None:
    """What is left of the gap on each interface at the end."""
    for axes, name, pair in _panels(figure, solution):
        gap = np.where(np.isfinite(pair.gap), np.maximum(pair.gap, 0.0), 0.0)
        _shade(axes, solution, name, gap, "gap", "viridis")


def draw_states_by_step(figure: Any, solution: SolutionData) -> None:
    """Which nodes stick, slip and are open at the end of each step: a row an interface."""
    ends = step_ends(solution.steps or solution.tried)
    shown = ends if len(ends) <= CURVES else [*ends[: CURVES - 1], ends[-1]]
    names = list(solution.pairs)
    figure.set_size_inches(7.0 + 1.2 * max(0, len(shown) - 3), 0.8 + 3.0 * len(names))
    every = figure.subplots(len(names), len(shown), squeeze=False)
    for row, name in zip(every, names, strict=True):
        for axes, step in zip(row, shown, strict=True):
            _draw_states(axes, step.pairs[name])
            axes.set_title(": ".join(([name] if len(names) > 1 else []) + [plain(step.title)]), fontsize="small")
    found = {word: handle for axes in every.ravel()
             for handle, word in zip(*axes.get_legend_handles_labels(), strict=True)}  # fmt: skip
    every[0, -1].legend(found.values(), found.keys(), loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="x-small")
    figure.suptitle(headed(solution), fontsize="medium")


def _draw_states(axes: Any, pair: PairResult) -> None:
    directions, names = view(pair)
    x = pair.x @ directions.T
    for number, (word, colour, marker) in STATES.items():
        chosen = pair.state == number
        if chosen.any():
            axes.plot(*x[chosen].T, ls="", marker=marker, color=colour, mec="black", mew=0.2, ms=3.0, label=word)
    axes.set(xlabel=names[0], ylabel=names[1], aspect="equal")


def view(pair: PairResult) -> tuple[Array, tuple[str, str]]:
    """Two directions in the plane that the nodes lie nearest to, coordinate axes where these lie in it, and their names."""
    tangents = pair.tangent.mean(axis=0)
    spread = np.linalg.svd(pair.x - pair.x.mean(axis=0), full_matrices=False)[2]
    flat = np.allclose(pair.tangent, tangents, atol=1e-9)
    directions = tangents if flat else spread[:2]
    names = ["xyz"[int(d.argmax())] if d.max() > 1.0 - 1e-9 else f"direction ({d[0]:.2g}, {d[1]:.2g}, {d[2]:.2g})"
             for d in directions]  # fmt: skip
    return directions, (names[0], names[1])


def shaded_panels(mesh: BoundaryMesh, nodes: Index, values: Array, directions: Array, colours: str = "Greys") -> Any:
    """The panels of some nodes as they are seen along the missing direction, shaded by the mean of nodal values."""
    from matplotlib.collections import PolyCollection

    elements, place = np.unique(mesh.element[nodes], return_inverse=True)
    weight = mesh.weight[nodes]
    mean = np.bincount(place, weight * values) / np.bincount(place, weight)
    seen = [corners[~np.isnan(corners[:, 0])] @ directions.T for corners in as_surface(mesh).corners[elements]]
    shades = PolyCollection(seen, array=mean, cmap=colours, edgecolors="0.7", linewidths=0.3)
    shades.set_clim(min(0.0, float(mean.min())), max(0.0, float(mean.max())) or 1.0)
    return shades


def _panels(figure: Any, solution: SolutionData) -> list[tuple[Any, str, PairResult]]:
    """One panel an interface, and its fields at the end."""
    pairs = solution.pairs
    figure.set_size_inches(7.0, 0.8 + 3.6 * len(pairs))
    end = solution.last.name if len(solution.tried) > 1 else ""
    figure.suptitle(headed(solution, end), fontsize="medium")
    every = figure.subplots(len(pairs), 1, squeeze=False)[:, 0]
    return [(axes, *item) for axes, item in zip(every, pairs.items(), strict=True)]


def _shade(axes: Any, solution: SolutionData, name: str, values: Array, what: str, colours: str) -> None:
    pair, mesh = solution.pairs[name], solution.meshes[solution.sides[name][0]]
    directions, names = view(pair)
    shades = axes.add_collection(shaded_panels(mesh, solution.nodes[name], values, directions, colours))
    axes.autoscale_view()
    axes.set(xlabel=names[0], ylabel=names[1], aspect="equal", title=f"{along(solution, name)}: {what}")
    axes.title.set_fontsize("small")
    axes.figure.colorbar(shades, ax=axes, shrink=0.75)


def _arrows(axes: Any, pair: PairResult, components: Array, colour: str) -> None:
    """Vectors of tangential components, and the nodes that stick."""
    directions = view(pair)[0]
    x, vectors = pair.x @ directions.T, np.einsum("mt,mtc->mc", components, pair.tangent) @ directions.T
    some = np.flatnonzero(np.any(vectors != 0.0, axis=1))
    some = some[:: max(1, len(some) // ARROWS)]
    if len(some):
        # a white edge, so that they are seen on black panels
        shown = {"color": colour, "width": 0.003, "edgecolor": "w", "linewidth": 0.2}
        axes.quiver(*x[some].T, *vectors[some].T, **shown)
    sticks = pair.state == 0
    if sticks.any():
        axes.plot(*x[sticks].T, ".", color="C2", ms=3, label="stick")
        axes.legend(fontsize="small", loc="upper left", bbox_to_anchor=(0.0, -0.12), frameon=False)
