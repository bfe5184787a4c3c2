"""A problem as it is posed: bodies with the names of their parts, supports, loads, obstacles, and
the parts that may touch."""

from __future__ import annotations

import itertools

import numpy as np

from ...arrays import Array
from ...mesh.curve_mesh import CurveMesh, as_curve
from ...runtime.figure_style import legend_below, new_label, plain
from ...untyped import Axes, Figure
from ..data import SolutionData
from ..vtu.inner_fields import filled_bodies
from .model_in_space import draw_space
from .outline_curves import outlines, round_places
from .plane_figures import BODIES, fit_height, place
from .posed_parts import KINDS, SMALL, LabelledPart, has_room, parts_of, point_forces, titled
from .surroundings import (
    LOAD,
    LONG,
    THICK,
    along,
    draw_arrows,
    draw_loads,
    draw_obstacles,
    draw_supports,
    size_of,
    stretches,
)
from .view import view_of

TINT = 0.12
"""Opacity of the inside of bodies."""
BESIDE = 0.8
"""Width of what stands beside the axes of the plane [inch]."""


def draw_model(figure: Figure, solution: SolutionData) -> None:
    """The problem of a solution, as `petcontact draw` shows it."""
    DRAWING[next(iter(solution.meshes.values())).dim](figure, solution)


def _draw_plane(figure: Figure, solution: SolutionData) -> None:
    axes, size = figure.add_subplot(), size_of(solution)
    view = view_of(solution, factor=0.0)  # where bodies are before anything moves
    draw_obstacles(axes, solution, view)
    draw_supports(axes, solution, view)
    _bodies(axes, solution)
    parts = [(part, as_curve(solution.meshes[part.body])) for part in parts_of(solution)]
    for part, mesh in parts:
        if part.kind == "contact":
            _edge(axes, mesh, part)
    draw_loads(axes, solution, view)
    for at, force in point_forces(solution):
        arrow = LONG * size * force / np.linalg.norm(force)
        draw_arrows(axes, at[None], arrow[None], np.array([False]), "force", LOAD)
    place(axes, solution)
    axes.set_title(titled(solution))
    legend_below(axes, 5)
    fit_height(figure, axes, beside=BESIDE, above=1.6)
    figure.draw_without_rendering()  # sizes are known only then
    _names(axes, parts, 0.5 * THICK * size)


def _names(axes: Axes, parts: list[tuple[LabelledPart, CurveMesh]], away: float) -> None:
    """The names of parts, within the axes and where no other name stands."""
    import shapely

    pixels = np.ptp(axes.transData.transform(np.eye(2))[:, 0])
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    taken: list[object] = [shapely.box(left, low, right, high).exterior]
    for part, mesh in sorted(parts, key=lambda each: each[0].kind == "free"):
        _named(axes, mesh, part, taken, SMALL / 72.0 * axes.figure.dpi / pixels, away)


def _bodies(axes: Axes, solution: SolutionData) -> None:
    """The bodies, tinted between their outlines, of which holes run the other way round."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    for number, (name, mesh) in enumerate(solution.meshes.items()):
        colour, word = BODIES[number % len(BODIES)], plain(name) if len(solution.meshes) > 1 else ""
        loops = [still for still, _ in outlines(as_curve(mesh), solution.bodies[name].u, 1.0)]
        path = Path.make_compound_path(*(Path(np.vstack([x, x[:1]]), closed=True) for x in loops))
        tint = TINT if name in filled_bodies(solution) else 0.0
        axes.add_patch(PathPatch(path, facecolor=colour, alpha=tint, lw=0.0))
        axes.plot([], [], color=colour, lw=1.0, label=word or None)
        for loop in loops:
            axes.plot(*loop.T, color=colour, lw=1.0)


def _edge(axes: Axes, mesh: CurveMesh, part: LabelledPart) -> None:
    """A part that may touch, as a thick line."""
    for elements in stretches(mesh, part.name):
        x = mesh.on_elements(elements, round_places(mesh))[0].reshape(-1, 2)
        axes.plot(*x.T, color=KINDS["contact"], lw=2.4, label=new_label(axes, "contact"))


def _named(
    axes: Axes,
    mesh: CurveMesh,
    part: LabelledPart,
    taken: list[object],
    letter: float,
    away: float,
) -> None:
    """The name of a part along its longest stretch, and what holds on it: on the inner side, or
    where others stand there on the outer one."""
    middle = _middle(mesh, part.name)
    if middle is None:
        return
    x, normal = middle
    angle = float(np.degrees(np.arctan2(normal[0], -normal[1])))
    angle = angle - 180.0 * np.floor((angle + 89.0) / 180.0)  # no text stands on its head
    upwards = normal @ [-np.sin(np.radians(angle)), np.cos(np.radians(angle))]
    outside = 3.0 if part.kind == "held" else 1.0  # symbols of supports are 2 * away thick
    for text, side in itertools.product((part.words, part.name), (-1.0, outside)):
        start = x + side * away * normal
        if has_room(taken, start, text, letter, angle, 0.0 if side * upwards > 0.0 else -1.0):
            axes.text(
                *start,
                text,
                va="bottom" if side * upwards > 0.0 else "top",
                ha="center",
                rotation=angle,
                rotation_mode="anchor",
                fontsize=SMALL,
                color="0.45" if part.kind == "free" else "black",
            )
            return


def _middle(mesh: CurveMesh, part: str) -> tuple[Array, Array] | None:
    """Middle of the longest stretch of a part, and the outward normal there."""
    longest = max(stretches(mesh, part), key=lambda one: mesh.length[one].sum(), default=None)
    if longest is None:
        return None
    x, normal = mesh.at(*along(mesh, longest, np.array([0.5 * mesh.length[longest].sum()])))
    return x[0], normal[0]


DRAWING = {2: _draw_plane, 3: draw_space}
"""What draws problems in so many dimensions."""
