"""A figure of a fatigue parameter: along the surface, and below it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..model.bodies import Units
from ..results.data import SolutionData
from ..results.figures.curves import headed
from ..runtime.figure_style import LINES, label, plain, save
from .evaluate import Fatigue

UNITS = {"ruiz-1": "{0}·{1}", "ruiz-2": "({0})²·{1}"}
"""Of stress and length; other parameters are stresses."""


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
    """Of a parameter; None without names of units."""
    if parameter not in UNITS:
        return units.stress
    if units.stress and units.length:
        return UNITS[parameter].format(units.stress, units.length)
    return None


def _draw(figure: Any, solution: SolutionData, result: Fatigue) -> None:
    deep = any(np.any(one.sites.depth > 0.0) for one in result.found)
    axes = np.atleast_1d(figure.subplots(1, 1 + deep))
    units, plane = solution.problem.units, next(iter(solution.meshes.values())).dim == 2
    curves = [
        (found, part) for found in result.found for part in dict.fromkeys(found.sites.part.tolist())
    ]
    for number, (one, part) in enumerate(curves):
        mine = (one.sites.part == part) & (one.sites.depth == 0.0)
        name = plain(f"{one.sites.body}.{part}" if len(solution.meshes) > 1 else part)
        across = one.sites.along if plane else one.sites.x[:, 0]
        order = np.flatnonzero(mine)[np.argsort(across[mine], kind="stable")]
        style: dict[str, Any] = (
            {"lw": 1.2, "ls": LINES[number % len(LINES)]}
            if plane
            else {"ls": "", "marker": ".", "ms": 2.5}
        )
        axes[0].plot(across[order], one.value[order], color=f"C{number}", label=name, **style)
        if deep:
            levels = np.unique(one.sites.depth)
            here = one.sites.part == part
            most = [
                one.value[here & (one.sites.depth == level)].max(initial=-np.inf)
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
    for each in axes:
        each.set_ylim(bottom=min(0.0, each.get_ylim()[0]))
        each.grid(alpha=0.3, lw=0.5)
