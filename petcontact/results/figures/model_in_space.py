"""A problem in space as it is posed: its bodies with parts in colours, their names, loads, and
obstacles as nets."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...arrays import Array
from ...mesh.surface_mesh import SurfaceMesh
from ..data import SolutionData
from .posed_parts import KINDS, SMALL, LabelledPart, has_room, parts_of, point_forces, titled
from .surface import best_view, draw_bodies, draw_nets, fit_axes, sampled, toward_eye
from .surroundings import LONG, size_of

HIGH = 3.4
"""Height of bodies in space as they are drawn [inch]."""
BELOW = 0.08
"""Share of the height of a figure of bodies in space that its legend and names of axes take."""
IN_SPACE = 16
"""Arrows of a part in space at most: more hide the part."""


def draw_space(figure: Any, solution: SolutionData) -> None:
    """The problem of a solution in space."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.patches import Patch

    parts, kinds = parts_of(solution), list(KINDS)
    numbers = {(part.body, part.name): float(kinds.index(part.kind)) for part in parts}

    def sample(name: str, mesh: SurfaceMesh, places: Any) -> Array:
        each = np.array([numbers[name, part] for part in mesh.part_names])
        return np.asarray(each[mesh.part[places.element]])

    bodies = sampled(solution, sample)
    levels = np.arange(len(kinds) + 1) - 0.5
    colours = ScalarMappable(
        BoundaryNorm(levels, len(kinds)), ListedColormap([*map(_soft, KINDS.values())])
    )
    figure.get_layout_engine().set(rect=(0.0, BELOW, 1.0, 1.0 - BELOW))
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    x = draw_bodies(axes, solution, bodies, 0.0, colours, best_view(solution))
    fit_axes(axes, solution, x.min(axis=0), x.max(axis=0))
    _names(axes, solution, parts)
    _loads(axes, solution)
    shown = [kind for kind in kinds if any(part.kind == kind for part in parts)]
    patches = [Patch(facecolor=_soft(KINDS[kind])) for kind in shown]
    nets = draw_nets(axes, solution, 0.0)
    words = [*shown, *["obstacle"] * len(nets)]
    figure.legend([*patches, *nets], words, loc="lower center", ncols=len(words))
    figure.suptitle(titled(solution), fontsize="medium")


def _soft(colour: str) -> tuple[float, ...]:
    """A colour on which black letters can be read."""
    from matplotlib.colors import to_rgb

    return tuple(1.0 - 0.55 * (1.0 - np.array(to_rgb(colour))))


def _names(axes: Any, solution: SolutionData, parts: list[LabelledPart]) -> None:
    """The names of parts that are seen, in the middle of each, where no other stands."""
    eye, taken = toward_eye(axes.elev, axes.azim), list[Any]()
    screen = SurfaceMesh.tangents_to(eye[None])[0]
    letter = SMALL / 72.0 * size_of(solution) / HIGH
    for part in sorted(parts, key=lambda part: part.kind == "free"):
        mesh = solution.meshes[part.body]
        nodes = mesh.nodes_of(part.name)
        if not len(nodes) or mesh.normal[nodes].mean(axis=0) @ eye <= 0.0:
            continue
        middle = mesh.x[nodes].mean(axis=0) + 0.02 * size_of(solution) * eye
        for text in (part.words, part.name):
            if has_room(taken, screen @ middle, text, letter, 0.0, -0.5):
                axes.text(*middle, text, fontsize=SMALL, ha="center", va="center", zorder=1e3)
                break


def _given(solution: SolutionData) -> Iterator[tuple[Array, Array, Array]]:
    """Some points of each loaded part in space, with normals and tractions (m, 3)."""
    for part in parts_of(solution):
        if part.kind == "loaded":
            mesh = solution.meshes[part.body]
            nodes = mesh.nodes_of(part.name)
            some = nodes[np.linspace(0, len(nodes) - 1, IN_SPACE).astype(int)]
            yield mesh.x[some], mesh.normal[some], solution.bodies[part.body].traction[some]


def _loads(axes: Any, solution: SolutionData) -> None:
    """Tractions that are given, and forces at points, as arrows."""
    size, drawn = size_of(solution), list[tuple[Array, Array]]()
    for at, force in point_forces(solution):
        drawn.append((at[None], force[None] / np.linalg.norm(force)))
    given = list(_given(solution))
    largest = max((float(np.abs(traction).max()) for *_, traction in given), default=1.0)
    for x, normal, traction in given:
        arrows = traction / largest
        pulls = np.sum(arrows * normal, axis=1) > 0.0
        drawn.append((x - LONG * size * np.where(pulls[:, None], 0.0, arrows), arrows))
    style = {"color": "black", "lw": 0.8, "arrow_length_ratio": 0.35, "zorder": 1e3}
    for feet, arrows in drawn:
        axes.quiver(*feet.T, *(LONG * size * arrows).T, **style)
