"""A problem as it is posed: bodies with the names of their parts, supports, loads, obstacles, and
the parts that may touch."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Array
from ...fields.boundary.places import points_at
from ...mesh.curve_mesh import CurveMesh, as_curve
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...model.bodies import Contact, Traction
from ...model.expressions import evaluate
from ...model.summary import condition_text, law_text
from ...runtime.figure_style import COLOURS, legend_below, plain, wrapped
from ..data import SolutionData
from ..vtu.inside import filled_bodies
from ..vtu.places import small_triangles
from .plane import BODIES, fit_height, outlines, place
from .surface import TRIANGLES, best_view, draw_bodies, fit_axes, sampled, toward_eye
from .surroundings import (
    EDGE,
    LOAD,
    LONG,
    REACH,
    THICK,
    draw_arrows,
    draw_loads,
    draw_obstacles,
    draw_supports,
    size_of,
    stretches,
)
from .view import view_of

KINDS = {"free": "0.8", "held": COLOURS[0], "loaded": COLOURS[4], "contact": COLOURS[1]}
"""Colours of parts, by what is known on them."""
WORDS = 30
"""Characters of a line of what stands beside a part: a third of a figure's width."""
TINT = 0.12
"""Opacity of the inside of bodies."""
SMALL = 6.5
"""Size of the names of parts [points]."""
BESIDE = 0.8
"""Width of what stands beside the axes of the plane [inch]."""
HIGH = 3.4
"""Height of bodies in space as they are drawn [inch]."""
BELOW = 0.08
"""Share of the height of a figure of bodies in space that its legend takes."""
IN_SPACE = 16
"""Arrows of a part in space at most: more hide the part."""


@dataclass(frozen=True)
class LabelledPart:
    """A part of a body, what is known on it, and that in words."""

    body: str
    name: str
    kind: str
    text: str

    @property
    def words(self) -> str:
        """What stands beside it in a picture."""
        return "\n".join(map(plain, [self.name, *textwrap.wrap(self.text, WORDS)]))


def parts_of(solution: SolutionData) -> list[LabelledPart]:
    """All parts in the last step, with their conditions and interfaces."""
    problem, labelled = solution.problem, dict[tuple[str, str], LabelledPart]()
    names = [body.name for body in problem.body]
    for number, (name, mesh) in enumerate(solution.meshes.items()):
        conditions = problem.conditions(number)[solution.last.step - 1]
        for part in mesh.part_names:
            condition = conditions.get(part)
            kind = _kind(condition, solution.bodies[name].traction[mesh.nodes_of(part)])
            text = "" if kind == "free" else condition_text(condition)
            labelled[name, part] = LabelledPart(name, part, kind, text)
    for side in problem.interfaces:
        for number, part in () if side.periodic else side.ends:
            against = "" if isinstance(side.law, Contact) else f"pair {side.name}: "
            is_secondary = (number, part) == side.ends[0]
            text = f"{against}{law_text(side.law)}" if is_secondary else f"pair {side.name}"
            labelled[names[number], part] = LabelledPart(names[number], part, "contact", text)
    return list(labelled.values())


def _kind(condition: Any, traction: Array) -> str:
    if condition is None or (isinstance(condition, Traction) and not traction.any()):
        return "free"
    return "loaded" if isinstance(condition, Traction) else "held"


def draw_model(figure: Any, solution: SolutionData) -> None:
    """The problem of a solution, as `petcontact draw` shows it."""
    DRAWING[next(iter(solution.meshes.values())).dim](figure, solution)


def _titled(solution: SolutionData) -> str:
    """The title, the step whose supports and loads are shown, and loads that no arrow shows."""
    step, count = solution.last, len(solution.problem.step)
    lines = [wrapped(solution.problem.title)]
    lines += [plain(f"supports and loads at the end of step {step.name!r}")] * (count > 1)
    volume = [
        f"{body.name}: {name.replace('_', ' ')}"
        for body in solution.problem.body
        if body.loads is not None
        for name in sorted(body.loads.model_fields_set - {"centre", "axis"})
    ]
    return "\n".join(filter(None, [*lines, plain(", ".join(volume))]))


def _draw_plane(figure: Any, solution: SolutionData) -> None:
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
    for at, force in _point_forces(solution):
        arrow = LONG * size * force / np.linalg.norm(force)
        draw_arrows(axes, at[None], arrow[None], np.array([False]), np.arange(1), "force", LOAD)
    place(axes, solution)
    axes.set_title(_titled(solution))
    legend_below(axes, 5)
    fit_height(figure, axes, beside=BESIDE, above=1.6)
    taken = list[Any]()
    for part, mesh in sorted(parts, key=lambda each: each[0].kind == "free"):
        _named(axes, mesh, part, taken, 0.5 * THICK * size)


def _bodies(axes: Any, solution: SolutionData) -> None:
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


def _edge(axes: Any, mesh: CurveMesh, part: LabelledPart) -> None:
    """A part that may touch, as a thick line."""
    for elements in stretches(mesh, part.name):
        x = mesh.on_elements(elements, np.linspace(-1.0, 1.0, 5))[0].reshape(-1, 2)
        word = "contact" if "contact" not in axes.get_legend_handles_labels()[1] else None
        axes.plot(*x.T, color=KINDS["contact"], lw=2.4, label=word)


def _named(axes: Any, mesh: CurveMesh, part: LabelledPart, taken: list[Any], away: float) -> None:
    """The name of a part along its longest stretch, and what holds on it: on the inner side, or
    where others stand there on the outer one."""
    middle = _middle(mesh, part.name)
    if middle is None:
        return
    x, normal = middle
    angle = float(np.degrees(np.arctan2(normal[0], -normal[1])))
    angle = angle - 180.0 * np.floor((angle + 89.0) / 180.0)  # no text stands on its head
    upwards = normal @ [-np.sin(np.radians(angle)), np.cos(np.radians(angle))]
    letter = SMALL / 72.0 * np.ptp(axes.get_xlim()) / (axes.figure.get_figwidth() - BESIDE)
    for text, side in itertools.product((part.words, part.name), (-1.0, 1.0)):
        start = x + side * away * normal
        if _has_room(taken, start, text, letter, angle, 0.0 if side * upwards > 0.0 else -1.0):
            style = {"fontsize": SMALL, "color": "0.45" if part.kind == "free" else "black"}
            how = {"ha": "center", "rotation": angle, "rotation_mode": "anchor"}
            axes.text(*start, text, va="bottom" if side * upwards > 0.0 else "top", **how, **style)
            return


def _middle(mesh: CurveMesh, part: str) -> tuple[Array, Array] | None:
    """Middle of the longest stretch of a part, and the outward normal there."""
    longest = max(stretches(mesh, part), key=lambda one: mesh.length[one].sum(), default=None)
    if longest is None:
        return None
    way = np.cumsum(mesh.length[longest])
    k = int(np.searchsorted(way, 0.5 * way[-1]))
    within = 1.0 - (way[k] - 0.5 * way[-1]) / mesh.length[longest[k]]
    x, normal = points_at(mesh, longest[k : k + 1], np.array([within]))
    return x[0], normal[0]


def _has_room(
    taken: list[Any], x: Array, text: str, letter: float, angle: float, down: float
) -> bool:
    """Whether a text has room beside a point; then it is taken. A letter is half as wide as
    high."""
    import shapely.affinity

    lines = text.split("\n")
    wide, high = 0.55 * letter * max(map(len, lines)), 1.3 * letter * len(lines)
    low = x[1] + down * high
    flat = shapely.box(x[0] - 0.5 * wide, low, x[0] + 0.5 * wide, low + high)
    box = shapely.affinity.rotate(flat, angle, origin=tuple(x))
    free = not any(box.intersects(other) for other in taken)
    taken += [box] * free
    return free


def _point_forces(solution: SolutionData) -> Iterator[tuple[Array, Array]]:
    """Points at which forces act, and the forces (d,) other than zero."""
    for body in solution.problem.body:
        for point in body.point_force:
            if any(point.force):
                yield np.array(point.at, dtype=float), np.array(point.force, dtype=float)


def _draw_space(figure: Any, solution: SolutionData) -> None:
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
    x = draw_bodies(axes, solution, bodies, 1.0, colours, best_view(solution))
    fit_axes(axes, solution, x.min(axis=0), x.max(axis=0))
    _names_in_space(axes, solution, parts)
    _loads_in_space(axes, solution)
    shown = [kind for kind in kinds if any(part.kind == kind for part in parts)]
    patches = [Patch(facecolor=_soft(KINDS[kind])) for kind in shown]
    nets = _obstacles_in_space(axes, solution)
    words = [*shown, *["obstacle"] * len(nets)]
    figure.legend([*patches, *nets], words, loc="lower center", ncols=len(words))
    figure.suptitle(_titled(solution), fontsize="medium")


def _obstacles_in_space(axes: Any, solution: SolutionData) -> list[Any]:
    """Draw rigid obstacles as a net, which hides nothing; the net, or nothing.

    It is made of the panels that may touch them, moved by the gap along the normal, where they face
    the eye.
    """
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    eye, lines = toward_eye(axes.elev, axes.azim), list[Array]()
    for side in solution.problem.interfaces:
        if side.primary is None and side.law.normal != "bonded":
            lines += [*_net(solution, side, eye)]
    if not lines:
        return []
    net = Line3DCollection(lines, colors=EDGE, lw=0.7, zorder=1e2)
    axes.add_collection3d(net)
    return [net]


def _net(solution: SolutionData, side: Any, eye: Array) -> Array:
    """Lines (k, 2, 3) of one obstacle."""
    mesh, nodes = solution.meshes[solution.sides[side.name][0]], solution.nodes[side.name]
    places, _, rims = small_triangles(as_surface(mesh), TRIANGLES, np.unique(mesh.element[nodes]))
    nodal = np.zeros(mesh.n_nodes)
    nodal[nodes] = evaluate(side.law.gap, mesh.variables(nodes), len(nodes), side.name)
    gap = mesh.basis_at(places.element, places.place) @ nodal
    x, normal = points_at(mesh, places.element, places.place)
    seen = (np.abs(gap) <= REACH * size_of(solution)) & (normal @ eye > 0.0)
    return np.asarray((x + gap[:, None] * normal)[rims[seen[rims].all(axis=1)]])


def _soft(colour: str) -> tuple[float, ...]:
    """A colour on which black letters can be read."""
    from matplotlib.colors import to_rgb

    return tuple(1.0 - 0.55 * (1.0 - np.array(to_rgb(colour))))


def _names_in_space(axes: Any, solution: SolutionData, parts: list[LabelledPart]) -> None:
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
            if _has_room(taken, screen @ middle, text, letter, 0.0, -0.5):
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


def _loads_in_space(axes: Any, solution: SolutionData) -> None:
    """Tractions that are given, and forces at points, as arrows."""
    size, drawn = size_of(solution), list[tuple[Array, Array]]()
    for at, force in _point_forces(solution):
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


DRAWING = {2: _draw_plane, 3: _draw_space}
"""What draws problems in so many dimensions."""
