"""Figures of load steps in space: deformed bodies, and on each interface pressure, shear, gap, slip and states."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arrays import Array
from ...runtime.figure_style import STATES, plain
from ...runtime.figure_style import title as cut
from ..surface_figures import ARROWS, draw_surfaces, shaded_panels, view
from .figures import CURVES, step_ends
from .solution import AssemblySolution, PairResult


def draw_bodies(figure: Any, solution: AssemblySolution) -> None:
    """The deformed surfaces of all bodies at the end."""
    bodies = [(mesh, solution.last.bodies[name].u) for name, mesh in solution.meshes.items()]
    draw_surfaces(figure, bodies, f"{solution.assembly.title}: {solution.last.name}")


def draw_surface_traction(figure: Any, solution: AssemblySolution, name: str) -> None:
    """Pressure, and the shear as arrows over its share of the bound, at the end."""
    pair, bound = solution.last.pairs[name], solution.last.pairs[name].bound
    size = np.linalg.norm(pair.sigma_t, axis=1)
    limited = np.isfinite(bound) & (bound > 0.0)
    share = np.divide(size, bound, out=np.zeros(len(size)), where=limited)
    upper, lower = _panels(figure, solution, name)
    _shade(figure, upper, solution, name, np.maximum(pair.pressure, 0.0), "pressure p", "viridis")
    values, label = (share, "|q| / bound") if limited.any() else (size, "|q|")
    _shade(figure, lower, solution, name, values, label, "Greys")
    _arrows(lower, pair, pair.sigma_t, "C0")


def draw_surface_motion(figure: Any, solution: AssemblySolution, name: str) -> None:
    """What is left of the gap, and the slip as arrows, at the end."""
    pair = solution.last.pairs[name]
    upper, lower = _panels(figure, solution, name)
    gap = np.where(np.isfinite(pair.gap), np.maximum(pair.gap, 0.0), 0.0)
    _shade(figure, upper, solution, name, gap, "gap", "viridis")
    slip = np.where(pair.state[:, None] == 2, 0.0, pair.slip)
    _shade(figure, lower, solution, name, np.linalg.norm(slip, axis=1), "slip |w|", "Greys")
    _arrows(lower, pair, slip, "C3")


def draw_states_by_step(figure: Any, solution: AssemblySolution, name: str) -> None:
    """Which nodes stick, slip and are open at the end of each step."""
    ends = step_ends(solution)
    shown = ends if len(ends) <= CURVES else [*ends[: CURVES - 1], ends[-1]]
    wide, tall = np.ptp(ends[-1].pairs[name].x @ view(ends[-1].pairs[name], slice(None))[0].T, axis=0)
    rows = len(shown) if wide > 1.5 * tall else 1
    figure.set_size_inches(7.0, 1.2 + rows * (0.6 + 6.0 * rows / len(shown) * tall / wide))
    every = figure.subplots(rows, len(shown) // rows, squeeze=False).ravel()
    for axes, step in zip(every, shown, strict=True):
        pair = step.pairs[name]
        directions, names = view(pair, slice(None))
        x = pair.x @ directions.T
        for number, (word, colour, marker) in STATES.items():
            chosen = pair.state == number
            if chosen.any():
                axes.plot(*x[chosen].T, ls="", marker=marker, color=colour, mec="black", mew=0.2, ms=3.0, label=word)
        axes.set(xlabel=names[0], ylabel=names[1], aspect="equal", title=plain(step.name))
        axes.title.set_fontsize("small")
    found = {word: handle for axes in every for handle, word in zip(*axes.get_legend_handles_labels(), strict=True)}
    every[-1].legend(found.values(), found.keys(), loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize="x-small")
    figure.suptitle(_title(solution, name), fontsize="medium")


def _panels(figure: Any, solution: AssemblySolution, name: str) -> Any:
    """Two axes, beside or above one another as the interface is tall or wide."""
    pair = solution.last.pairs[name]
    wide, tall = np.ptp(pair.x @ view(pair, slice(None))[0].T, axis=0)
    end = f", {solution.last.name}" if len(solution.steps) > 1 else ""
    figure.suptitle(_title(solution, name + end), fontsize="medium")
    if wide > 1.5 * tall:
        figure.set_size_inches(7.0, 2.0 + 11.0 * max(tall / wide, 0.1))
        return figure.subplots(2, 1)
    return figure.subplots(1, 2)


def _shade(figure: Any, axes: Any, solution: AssemblySolution, name: str, values: Array, label: str, colours: str) -> None:
    pair, mesh = solution.last.pairs[name], solution.meshes[solution.sides[name][0]]
    directions, names = view(pair, slice(None))
    shades = axes.add_collection(shaded_panels(mesh, solution.nodes[name], values, directions, colours))
    axes.autoscale_view()
    axes.set(xlabel=names[0], ylabel=names[1], aspect="equal", title=label)
    axes.title.set_fontsize("small")
    figure.colorbar(shades, ax=axes, shrink=0.75)


def _arrows(axes: Any, pair: PairResult, components: Array, colour: str) -> None:
    directions = view(pair, slice(None))[0]
    vectors = np.einsum("mt,mtc->mc", components, pair.tangent) @ directions.T
    some = np.flatnonzero(np.any(vectors != 0.0, axis=1))
    some = some[:: max(1, len(some) // ARROWS)]
    if len(some):
        # a white edge, so that they are seen on black panels
        shown = {"color": colour, "width": 0.003, "edgecolor": "w", "linewidth": 0.2}
        axes.quiver(*(pair.x[some] @ directions.T).T, *vectors[some].T, **shown)


def _title(solution: AssemblySolution, what: str) -> str:
    return ": ".join(filter(None, (cut(solution.assembly.title), plain(what))))
