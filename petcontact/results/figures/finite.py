"""What of a stress figures show where stress has no bound, and of curves that are round-off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Mask
from ...round_off import SOLVED
from ...untyped import Axes
from ..data import SolutionData
from ..strength.place import Place
from ..strength.singular_places import singular_places

ABOVE = 0.5
"""Room of a cut axis beyond the values away from corners, over their range. It shows that a curve
grows towards its corner."""


def away_from(places: Sequence[Place], x: Array) -> Mask:
    """Which points (m, d) of a body lie no nearer to places without a bound than where stress
    beside them is told."""
    left_out = [place.leaves_out(x) for place in places]
    return np.asarray(~np.any([np.zeros(len(x), dtype=bool), *left_out], axis=0))


def without_noise(solution: SolutionData, traction: Array) -> Array:
    """A contact traction that is no round-off of the largest traction of all bodies."""
    largest = max(float(np.abs(body.traction).max()) for body in solution.bodies.values())
    return np.where(np.abs(traction) <= SOLVED * largest, 0.0, traction)


def shown_range(
    solution: SolutionData, name: str, curves: Sequence[Array]
) -> tuple[float, float] | None:
    """Between which values tractions (m,) of an interface are shown: near those away from corners
    where they have no bound; None where they are shown whole."""
    body, pair = solution.sides[name][0], solution.pairs[name]
    away = away_from(singular_places(solution, solution.last)[body], pair.x)
    every = np.array([np.append(curve, 0.0) for curve in curves])
    shown = every[:, np.append(away, True)]
    room = ABOVE * float(np.ptp(shown))
    low, high = float(shown.min()) - room, float(shown.max()) + room
    if not away.any() or room == 0.0 or (every.min() >= low and every.max() <= high):
        return None
    return max(low, float(every.min())), min(high, float(every.max()))


def end_at_corners(axes: Axes, solution: SolutionData, name: str, curves: Sequence[Array]) -> None:
    """End the axis of tractions (m,) of an interface as `shown_range` says, and say so."""
    shown = shown_range(solution, name, curves)
    if shown is None:
        return
    room = axes.margins()[1] * (shown[1] - shown[0])
    axes.set_ylim(shown[0] - room, shown[1] + room)
    axes.text(
        0.99,
        0.97,
        "cut at corners, where it has no bound",
        transform=axes.transAxes,
        ha="right",
        va="top",
        fontsize=7.0,
        color="0.35",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
    )
