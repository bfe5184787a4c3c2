"""All figures of a solution: one set in the plane, one in space, and the curves that both have."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...contact.law_protocol import OPEN
from ...runtime.figure_style import save_all
from ..data import SolutionData
from ..records import step_ends
from ..vtu.inside import filled_bodies
from . import plane, space, surface
from .curves import draw_history, draw_hysteresis, draw_wear
from .hoop import draw_hoop
from .stress import draw_von_mises
from .view import View

FIRST = ("deformed", "surface", "normal", "traction")
"""A solve draws the bodies and what contact carries; `petcontact plot` draws all."""
OF_BODIES = ("deformed", "surface", "stress", "hoop")
"""Figures of what is not in contact, too."""
Drawings = dict[str, Callable[[Any, SolutionData], None]]
"""What draws a solution into a figure, by the name of the figure."""


def plot_all(
    solution: SolutionData,
    folder: str | Path,
    stem: str = "result",
    formats: Sequence[str] = ("png",),
    names: Collection[str] | None = None,
) -> list[Path]:
    """Draw every figure of a solution, or some of them.

    Parameters
    ----------
    solution : Solution
    folder : str or Path
        Made if it does not exist.
    stem : str
        Start of the file names.
    formats : sequence of str
        Of "png", "pdf", "svg".
    names : collection of str, optional
        Those that are wanted, of "deformed", "normal", ...

    Returns
    -------
    list of Path
        STEM-deformed.png (in space STEM-surface.png), STEM-displacement.png, STEM-normal.png with a
        panel for each interface, STEM-traction.png where any is tangential, STEM-gap.png where one
        opens, in space STEM-states.png and STEM-error.png; STEM-history.png, and of several
        increments STEM-hysteresis.png; where anything wears STEM-wear.png, with cycles in the plane
        STEM-profiles.png; STEM-stress.png, von Mises stress in the deformed bodies (in space on
        their surfaces), and in the plane STEM-hoop.png, the stress along their boundaries.

    Raises
    ------
    InputError
        If there is no such format.
    OutputError
        If a file cannot be written.
    """
    found = drawings(solution)
    wanted = found if names is None else {name: found[name] for name in found if name in names}
    return save_all(wanted, folder, stem, solution, formats=formats)


def drawings(solution: SolutionData) -> Drawings:
    """The figures that a solution has."""
    found = dict(OF_DIMENSION[next(iter(solution.meshes.values())).dim])
    ends = step_ends(solution.steps or solution.tried)
    if not any(np.any(pair.state == OPEN) for step in ends for pair in step.pairs.values()):
        del found["gap"]
    if not filled_bodies(solution):
        del found["stress"]
        found.pop("hoop", None)
    if not any(pair.sigma_t.any() for step in ends for pair in step.pairs.values()):
        del found["traction"]
    if any(
        pair.pressure_error is None or pair.sigma_t_error is None
        for pair in solution.pairs.values()
    ):
        found.pop("error", None)
    if solution.wear is None:
        found.pop("profiles", None)
    if not solution.nodes:
        return {name: draw for name, draw in found.items() if name in OF_BODIES}
    found["history"] = draw_history
    if len(solution.steps) > 1:
        found["hysteresis"] = draw_hysteresis
    if any(pair.wear is not None for pair in solution.last.pairs.values()):
        found["wear"] = draw_wear
    return found


OF_DIMENSION: dict[int, Drawings] = {
    2: {
        "deformed": plane.draw_deformed,
        "displacement": plane.draw_displacement,
        "traction": plane.draw_traction,
        "normal": plane.draw_normal,
        "gap": plane.draw_gap,
        "profiles": plane.draw_profiles,
        "stress": draw_von_mises,
        "hoop": draw_hoop,
    },
    3: {
        "surface": surface.draw_surface,
        "displacement": space.draw_displacement,
        "traction": space.draw_traction,
        "normal": space.draw_normal,
        "states": space.draw_states_by_step,
        "gap": space.draw_gap,
        "error": space.draw_error,
        "stress": draw_von_mises,
    },
}


def plot_on(solution: SolutionData, place: Any = None, view: View | None = None) -> Any:
    """Draw the bodies as they were and as they are on given axes, or on those of a figure, a new
    one by default; returns the axes. In a view that other drawings share, where one is given."""
    dim = next(iter(solution.meshes.values())).dim
    if place is None:
        from matplotlib import pyplot

        place = pyplot.figure(layout="constrained")
    if hasattr(place, "add_subplot"):
        place = place.add_subplot(projection="3d") if dim == 3 else place.add_subplot()
    {2: plane.deformed_on, 3: surface.surface_on}[dim](place, solution, view)
    return place
