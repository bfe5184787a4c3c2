"""All figures of a solution: one set in the plane, one in space, and the curves that both have."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Sequence
from pathlib import Path

import numpy as np

from ...contact.law_protocol import OPEN
from ...errors import InputError
from ...runtime.figure_style import SIZE, save_all, style
from ...runtime.hints import among, demand_name
from ...untyped import Axes, Figure
from ..data import SolutionData
from ..records import PairResult, step_ends
from ..vtu.inner_fields import filled_bodies
from . import plane_figures, space, surface_figure
from .curves import draw_history, draw_hysteresis, draw_motion, draw_wear, moves, returns
from .hoop import draw_hoop
from .stress_figure import draw_von_mises
from .view import View

FIRST = ("deformed", "surface", "normal", "traction")
"""A solve draws the bodies and what contact carries; `petcontact plot` draws all."""
OF_BODIES = ("deformed", "surface", "stress", "hoop")
"""Figures of what is not in contact, too."""
WITH_VIEW = ("deformed", "surface", "stress")
"""Figures of the deformed bodies."""
Drawings = dict[str, Callable[..., None]]
"""What draws a solution into a figure, by the name of the figure."""


def plot_all(
    solution: SolutionData,
    folder: str | Path,
    stem: str = "result",
    formats: Sequence[str] = ("png",),
    names: Collection[str] | None = None,
    view: View | None = None,
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
    view : View, optional
        Magnification and direction in which bodies are drawn; by default what suits each figure.

    Returns
    -------
    list of Path
        STEM-deformed.png (in space STEM-surface.png), STEM-displacement.png, STEM-normal.png with a
        panel for each interface, STEM-traction.png where any is tangential, STEM-gap.png where one
        opens, in space STEM-states.png and STEM-error.png; STEM-history.png;
        STEM-hysteresis.png where slip returns; STEM-motion.png where obstacles move in several
        increments; where anything wears STEM-wear.png, with cycles in the plane STEM-profiles.png;
        STEM-stress.png, von Mises stress in the deformed bodies (in space on their surfaces), and
        in the plane STEM-hoop.png, the stress along their boundaries.

    Raises
    ------
    InputError
        If there is no such format or figure.
    OutputError
        If a file cannot be written.
    """
    all_names = {**OF_ALL, **OF_DIMENSION[2], **OF_DIMENSION[3]}
    for name in names or ():
        demand_name("names: no figure", name, all_names)
    wanted = {
        name: functools.partial(draw, view=view) if view and name in WITH_VIEW else draw
        for name, draw in drawings(solution).items()
        if names is None or name in names
    }
    return save_all(wanted, folder, stem, solution, formats=formats)


def drawings(solution: SolutionData) -> Drawings:
    """The figures that a solution has."""
    drawers = {**OF_DIMENSION[next(iter(solution.meshes.values())).dim], **OF_ALL}
    return {
        name: draw
        for name, draw in drawers.items()
        if (solution.nodes or name in OF_BODIES) and (name not in NEEDS or NEEDS[name](solution))
    }


def _pairs(solution: SolutionData) -> list[PairResult]:
    """All interfaces at the ends of the steps."""
    ends = step_ends(solution.steps or solution.tried)
    return [pair for step in ends for pair in step.pairs.values()]


NEEDS: dict[str, Callable[[SolutionData], bool]] = {
    "gap": lambda solution: any(np.any(pair.state == OPEN) for pair in _pairs(solution)),
    "stress": lambda solution: bool(filled_bodies(solution)),
    "hoop": lambda solution: bool(filled_bodies(solution)),
    "traction": lambda solution: any(pair.sigma_t.any() for pair in _pairs(solution)),
    "error": lambda solution: all(pair.errors for pair in solution.pairs.values()),
    "profiles": lambda solution: solution.wear is not None,
    "hysteresis": lambda solution: len(solution.steps) > 1 and returns(solution),
    "motion": lambda solution: (
        len(solution.steps) > 1
        and bool(moves(solution, "displacement") or moves(solution, "rotation"))
    ),
    "wear": lambda solution: any(pair.wear is not None for pair in solution.pairs.values()),
}
"""What a solution must have for a figure."""
OF_ALL: Drawings = {
    "history": draw_history,
    "hysteresis": draw_hysteresis,
    "motion": draw_motion,
    "wear": draw_wear,
}
OF_DIMENSION: dict[int, Drawings] = {
    2: {
        "deformed": plane_figures.draw_deformed,
        "displacement": plane_figures.draw_displacement,
        "traction": plane_figures.draw_traction,
        "normal": plane_figures.draw_normal,
        "gap": plane_figures.draw_gap,
        "profiles": plane_figures.draw_profiles,
        "stress": draw_von_mises,
        "hoop": draw_hoop,
    },
    3: {
        "surface": surface_figure.draw_surface,
        "displacement": space.draw_displacement,
        "traction": space.draw_traction,
        "normal": space.draw_normal,
        "states": space.draw_states_by_step,
        "gap": space.draw_gap,
        "error": space.draw_error,
        "stress": draw_von_mises,
    },
}


def plot_on(
    solution: SolutionData, place: Axes | Figure | None = None, view: View | None = None
) -> Axes:
    """Draw the bodies as they were and as they are on given axes, or on those of a figure, a new
    one by default; returns the axes. In a view that other drawings share, where one is given."""
    dim = next(iter(solution.meshes.values())).dim
    if isinstance(place, str):
        raise InputError(
            f"{place!r} is no figure and no axes; plot_all(solution, '.', names=['normal']) draws "
            f"what has a name{among(place, [*drawings(solution)])}"
        )
    if place is None:
        from matplotlib import pyplot, rc_context

        with rc_context(style()):
            figure = pyplot.figure(figsize=SIZE, layout="constrained")
            place = plot_on(solution, figure, view)
            if dim == 2:
                plane_figures.fit_height(figure, place, beside=0.8, above=1.6)
            return place
    if hasattr(place, "add_subplot"):
        place = place.add_subplot(projection={2: None, 3: "3d"}[dim])
    {2: plane_figures.deformed_on, 3: surface_figure.surface_on}[dim](place, solution, view)
    return place
