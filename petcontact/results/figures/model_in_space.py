"""A problem in space as it is posed: its bodies with parts in colours, their names, loads, and
obstacles as nets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ...arrays import Array
from ...mesh.surface_mesh import SurfaceMesh
from ...runtime.figure_style import wrapped
from ...untyped import Axes, Figure, ScalarMappable
from ..data import SolutionData
from ..vtu.spread_points import Places
from .posed_parts import KINDS, SMALL, LabelledPart, has_room, parts_of, point_forces, titled
from .surface_figure import (
    Sampled,
    best_view,
    draw_bodies,
    draw_nets,
    fit_axes,
    sampled,
    toward_eye,
)
from .surroundings import LONG, size_of

BELOW = 0.1
"""Share of the height of a figure of bodies in space that its legend and names of axes take."""
IN_SPACE = 16
"""Arrows of a part in space at most, since more hide the part; points of a part at which its name
may stand, too."""


def draw_space(figure: Figure, solution: SolutionData) -> None:
    """The problem of a solution in space."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.patches import Patch

    parts, kinds = parts_of(solution), list(KINDS)
    numbers = {(part.body, part.name): float(kinds.index(part.kind)) for part in parts}

    def sample(name: str, mesh: SurfaceMesh, places: Places) -> Array:
        each = np.array([numbers[name, part] for part in mesh.part_names])
        return np.asarray(each[mesh.part[places.element]])

    bodies = sampled(solution, sample)
    levels = np.arange(len(kinds) + 1) - 0.5
    colours = ScalarMappable(
        BoundaryNorm(levels, len(kinds)), ListedColormap([*map(_soft, KINDS.values())])
    )
    figure.set_figwidth(1.6 * figure.get_figwidth())
    figure.get_layout_engine().set(rect=(0.0, BELOW, 1.0, 1.0 - BELOW))
    views = _both_sides(figure, solution, bodies, colours)
    shown = [kind for kind in kinds if any(part.kind == kind for part in parts)]
    patches = [Patch(facecolor=_soft(KINDS[kind])) for kind in shown]
    nets, _ = (draw_nets(axes, solution, 0.0) for axes in views)
    shown += ["obstacle"] * len(nets)
    figure.legend([*patches, *nets], shown, loc="lower center", ncols=len(shown))
    _titles(figure, solution, views, bodies, parts)


def _both_sides(
    figure: Figure, solution: SolutionData, bodies: Mapping[str, Sampled], colours: ScalarMappable
) -> list[Axes]:
    """Bodies and loads from opposite sides: what one picture hides the other one shows."""
    up, round_ = best_view(solution)
    views = []
    for k, angles in enumerate(((up, round_), (-up, round_ + 180.0))):
        axes = figure.add_subplot(1, 2, k + 1, projection="3d", computed_zorder=False)
        x = draw_bodies(axes, solution, bodies, 0.0, colours, angles)
        fit_axes(axes, solution, x.min(axis=0), x.max(axis=0))
        _loads(axes, solution)
        word = "above" if angles[0] > 0.0 else "below"
        axes.set_title(f"from {word}", fontsize="small", loc="left")  # away from names of axes
        views.append(axes)
    return views


def _titles(
    figure: Figure,
    solution: SolutionData,
    views: list[Axes],
    bodies: Mapping[str, Sampled],
    parts: list[LabelledPart],
) -> None:
    """The title, with the laws of contact that is hidden from both sides, and names of parts."""
    seen = [_places(axes, solution, bodies, parts) for axes in views]
    hidden = [part for part in parts if all(each[part] is None for each in seen)]
    laws = [wrapped(part.known) for part in hidden if part.kind == "contact" and part.text]
    figure.suptitle("\n".join([titled(solution), *laws]), fontsize="medium")
    for axes, places in zip(views, seen, strict=True):
        _names(axes, places)


def _soft(colour: str) -> tuple[float, ...]:
    """A colour on which black letters can be read."""
    from matplotlib.colors import to_rgb

    return tuple(1.0 - 0.55 * (1.0 - np.array(to_rgb(colour))))


def _view(axes: Axes) -> Array:
    """The rows (3, 3) point along the screen, up, and to the eye."""
    eye = toward_eye(axes.elev, axes.azim)
    return np.vstack([SurfaceMesh.tangents_to(eye[None])[0], eye])


def _places(
    axes: Axes, solution: SolutionData, bodies: Mapping[str, Sampled], parts: list[LabelledPart]
) -> dict[LabelledPart, Array | None]:
    """Where the name of each part may stand; None of parts that are hidden."""
    return {part: _seen(solution, part, bodies, _view(axes)) for part in parts}


def _names(axes: Axes, places: Mapping[LabelledPart, Array | None]) -> None:
    """The names of parts that are seen, where no other name stands."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    figure, taken, view = axes.figure, list[object](), _view(axes)
    figure.draw_without_rendering()  # sizes are known only then
    ends = proj_transform(*np.vstack([0.0 * view[1], view[1]]).T, axes.get_proj())[:2]
    unit = np.ptp(axes.transData.transform(np.transpose(ends)), axis=0).max()
    letter = SMALL / 72.0 * figure.dpi / float(unit)
    seen = [(part, place) for part, place in places.items() if place is not None]
    for part, place in sorted(seen, key=lambda each: each[0].kind == "free"):
        for text in (part.words, part.name):
            if has_room(taken, view[:2] @ place, text, letter, 0.0, -0.5):
                axes.text(*place, text, fontsize=SMALL, ha="center", va="center", zorder=1e3)
                break


def _seen(
    solution: SolutionData, part: LabelledPart, bodies: Mapping[str, Sampled], view: Array
) -> Array | None:
    """The place on a part next to its middle that no body hides, None if there is none; the rows of
    a view (3, 3) point along the screen, up, and to the eye."""
    mesh = solution.meshes[part.body]
    nodes = mesh.nodes_of(part.name)
    x = mesh.x[nodes[mesh.normal[nodes] @ view[2] > 0.0]] + 1e-3 * size_of(solution) * view[2]
    x = x[np.linalg.norm(x - x.sum(axis=0) / max(1, len(x)), axis=1).argsort()]
    corners = np.concatenate([body.x[body.triangles] for body in bodies.values()])
    for place in x[:: max(1, len(x) // IN_SPACE)]:
        across, up, depth = np.moveaxis((corners - place) @ view.T, 2, 0)
        turn = across * np.roll(up, -1, axis=1) - up * np.roll(across, -1, axis=1)
        around = np.abs(np.sign(turn).sum(axis=1)) == 3.0
        # of the triangle's plane where it is seen before the place
        nearer = np.sum(np.roll(turn, -1, axis=1) * depth, axis=1) * turn.sum(axis=1) > 0.0
        if not np.any(around & nearer):
            return np.asarray(place)
    return None


def _given(solution: SolutionData) -> Iterator[tuple[Array, Array, Array]]:
    """Some points of each loaded part in space, with normals and tractions (m, 3)."""
    for part in parts_of(solution):
        if part.kind == "loaded":
            mesh = solution.meshes[part.body]
            nodes = mesh.nodes_of(part.name)
            some = nodes[np.linspace(0, len(nodes) - 1, IN_SPACE).astype(int)]
            yield mesh.x[some], mesh.normal[some], solution.bodies[part.body].traction[some]


def _loads(axes: Axes, solution: SolutionData) -> None:
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
