"""A figure of a fatigue parameter: along the surface, and below it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..given.tables.units import Units
from ..results.data import SolutionData
from ..results.figures.curves import headed
from ..runtime.figure_style import LINES, label, plain, save
from ..untyped import Figure, Keyed
from .evaluate import Fatigue

UNITS = {"ruiz-1": "{0}·{1}", "ruiz-2": "({0})²·{1}"}
"""Units of parameters, from those of stress {0} and length {1}; other parameters are stresses."""


def fatigue_figure(solution: SolutionData, result: Fatigue, path: str | Path) -> Path:
    """Draw values over the arc length of each part (in space over the places), and the largest at
    each depth.

    Raises
    ------
    InputError
        If there is no such format.
    OutputError
        If the file cannot be written.
    """
    save(Path(path), _draw, solution, result)
    return Path(path)


def _unit(parameter: str, units: Units) -> str | None:
    """Return the unit of a parameter, None where units have no names."""
    if parameter not in UNITS:
        return units.stress
    if units.stress and units.length:
        return UNITS[parameter].format(units.stress, units.length)
    return None


def _draw(figure: Figure, solution: SolutionData, result: Fatigue) -> None:
    deep = any(np.any(curve.sites.depth > 0.0) for curve in result.found)
    axes = np.atleast_1d(figure.subplots(1, 1 + deep))
    units, plane = solution.problem.units, next(iter(solution.meshes.values())).dim == 2
    curves = [
        (found, part) for found in result.found for part in dict.fromkeys(found.sites.part.tolist())
    ]
    for number, (curve, part) in enumerate(curves):
        on_surface = (curve.sites.part == part) & (curve.sites.depth == 0.0)
        name = plain(f"{curve.sites.body}.{part}" if len(solution.meshes) > 1 else part)
        across = curve.sites.along if plane else curve.sites.x[:, 0]
        order = np.flatnonzero(on_surface)[np.argsort(across[on_surface], kind="stable")]
        style: Keyed = (
            {"lw": 1.2, "ls": LINES[number % len(LINES)]}
            if plane
            else {"ls": "", "marker": ".", "ms": 2.5}
        )
        axes[0].plot(across[order], curve.value[order], color=f"C{number}", label=name, **style)
        if deep:
            levels = np.unique(curve.sites.depth)
            on_part = curve.sites.part == part
            most = [
                curve.value[on_part & (curve.sites.depth == level)].max(initial=-np.inf)
                for level in levels
            ]
            shown = np.isfinite(most)
            axes[1].plot(levels[shown], np.array(most)[shown], ".-", color=f"C{number}")
    axes[0].set(
        xlabel=label("arc length along the part" if plane else "x", units.length),
        ylabel=label(plain(result.parameter), _unit(result.parameter, units)),
        title="on the surface",
    )
    figure.suptitle(headed(solution), fontsize="large")
    axes[0].legend()
    if deep:
        axes[1].set(xlabel=label("depth", units.length), title="largest at a depth")
    for axis in axes:
        axis.set_ylim(bottom=min(0.0, axis.get_ylim()[0]))
        axis.grid(alpha=0.3, lw=0.5)
