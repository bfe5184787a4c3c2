"""The deformed surfaces of bodies in space, shaded in bands of a quantity, with the edges of the
panels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...arrays import Array, Index, Mask, scattered
from ...contact.law_protocol import OPEN
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...record import record
from ...runtime.figure_style import label, plain
from ...untyped import Axes, Figure, ScalarMappable
from ..data import SolutionData
from ..evaluated import NOWHERE
from ..vtu.inner_fields import filled_bodies
from ..vtu.spread_points import Places, small_triangles
from .colour_bands import UNKNOWN, band_colours, beyond, cut
from .curves import headed_end
from .surroundings import EDGE, obstacles
from .view import View, view_of

TRIANGLES = 8000
"""About how many triangles all bodies have together."""
ELEVATION, STEEP, AZIMUTH = 24.0, 50.0, -58.0
"""Angles of views [degrees]."""
SHADE = 0.2
"""How much darker surfaces are that are seen from the side."""
SEEN = 0.8
"""Share of the most that any view shows of a contact, with which the first view that has it is
taken."""
COLUMNS, TOGETHER, ALONE, TITLE, BAR = 3, 4.8, 2.9, 0.5, 1.2
"""Columns of bodies drawn alone; heights of all together, of a row of those and of titles, width of
the bar [inches]."""
ZOOM, ALONE_ZOOM = 0.95, 0.8
"""How far the boxes about bodies fill their axes, of several panels and of one [-]."""
COLOUR_BAR = {"shrink": 0.75, "pad": 0.09, "aspect": 25}
"""Room for the labels of an axis in space that stand between."""
TICKS = 5
"""Along the longest edge."""
Sample = Callable[[str, SurfaceMesh, Places], Array]
"""Values (q,) of a body of a name at places."""


@record
class Sampled:
    """A body's surface in small triangles."""

    x: Array
    normal: Array
    u: Array
    values: Array
    triangles: Index
    rims: Index


def sampled(solution: SolutionData, sample: Sample) -> dict[str, Sampled]:
    """The surfaces of all bodies at the end, with values."""
    count = sum(mesh.n_elements for mesh in solution.meshes.values())
    result = {}
    for name, mesh in solution.meshes.items():
        surface = as_surface(mesh)
        places, triangles, rims = small_triangles(
            surface, round(TRIANGLES * mesh.n_elements / count)
        )
        x, normal = mesh.at(places.element, places.place)
        u = mesh.basis_at(places.element, places.place) @ solution.bodies[name].u
        result[name] = Sampled(x, normal, u, sample(name, surface, places), triangles, rims)
    return result


def surface_on(axes: Axes, solution: SolutionData, view: View | None = None) -> None:
    """The deformed surfaces of all bodies at the end, shaded by |u|, on given axes; in a view that
    others share, else in the one that suits them."""
    text = shade(
        [axes],
        solution,
        *_displacements(solution),
        view or view_of(solution),
        view.largest if view else None,
    )
    axes.set_title(text, fontsize="medium")


def draw_surface(figure: Figure, solution: SolutionData, view: View | None = None) -> None:
    """The deformed surfaces at the end, shaded by |u|, with the edges of the panels."""
    shade_each(figure, solution, *_displacements(solution), view or view_of(solution))


def _displacements(solution: SolutionData) -> tuple[dict[str, Sampled], str]:
    """|u| on all surfaces, and what it is called."""
    size = lambda name, mesh, places: np.linalg.norm(  # noqa: E731
        mesh.basis_at(places.element, places.place) @ solution.bodies[name].u, axis=1
    )
    return sampled(solution, size), label("|u|", solution.problem.units.length)


def shade_each(
    figure: Figure,
    solution: SolutionData,
    bodies: Mapping[str, Sampled],
    what: str,
    view: View,
    top: float | None = None,
) -> None:
    """Draw all surfaces together and, of several bodies, each that is in contact alone, turned so
    that its contact is seen: together they hide it. Colours are as of `shade`."""
    alone = [name for name in bodies if contact_normals(solution, name)] if len(bodies) > 1 else []
    if not alone:
        every = [figure.add_subplot(projection="3d")]
        figure.suptitle(shade(every, solution, bodies, what, view, top), fontsize="medium")
        return
    columns = min(len(alone), COLUMNS)
    rows = -(-len(alone) // columns)
    wide, high = 3.2 * columns + BAR, TOGETHER + ALONE * rows
    figure.set_layout_engine("none")
    figure.set_size_inches(wide, high)
    share = 1.0 - BAR / wide
    places = [(0.0, ALONE * rows / high, share, (TOGETHER - TITLE) / high)]
    places += [
        (
            share * (k % columns) / columns,
            ALONE * (rows - 1 - k // columns) / high,
            share / columns,
            (ALONE - TITLE) / high,
        )
        for k in range(len(alone))
    ]
    every = [figure.add_axes(place, projection="3d") for place in places]
    bar = figure.add_axes((1.0 - 0.8 * BAR / wide, 0.25, 0.15 / wide, 0.5))
    text = shade(every, solution, bodies, what, view, top, names=alone, bar=bar)
    figure.suptitle(text, fontsize="medium")


def shade(
    every: Sequence[Axes],
    solution: SolutionData,
    bodies: Mapping[str, Sampled],
    what: str,
    view: View,
    top: float | None = None,
    names: Sequence[str] = (),
    bar: object = None,
) -> str:
    """Draw surfaces, deformed as the view says, in bands up to `top` or to the largest value, with
    a colour bar: on the first of some axes all of them, on the others those of the names alone.
    Returns the title: the layout of figures keeps room for theirs, and not for that of axes in
    space, whose labels stand there."""
    values = np.concatenate([body.values for body in bodies.values()])
    colours = band_colours(values, top)
    eye = view.eye or best_view(solution)
    moved = draw_bodies(every[0], solution, bodies, view.factor, colours, eye)
    fit_axes(
        every[0],
        solution,
        np.minimum(moved.min(axis=0), view.low),
        np.maximum(moved.max(axis=0), view.high),
    )
    text = f"{view.text}, seen from below" if every[0].elev < 0.0 else view.text
    if draw_nets(every[0], solution, view.factor):
        text = f"{text}; obstacles are nets"
    for axes, name in zip(every[1:], names, strict=True):
        moved = draw_bodies(
            axes, solution, {name: bodies[name]}, view.factor, colours, best_view(solution, name)
        )
        draw_nets(axes, solution, view.factor, name)
        fit_axes(axes, solution, moved.min(axis=0), moved.max(axis=0), ALONE_ZOOM)
        axes.set(xticks=[], yticks=[], zticks=[])
        for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
            axis.labelpad = -12.0
        below = ", from below" if axes.elev < 0.0 else ""
        axes.set_title(f"{plain(name)}, its contact in view{below}", fontsize="small")
    place = {"ax": every[0], **COLOUR_BAR} if bar is None else {"cax": bar}
    every[0].figure.colorbar(
        colours,
        label=what,
        spacing="proportional",
        extend=beyond(values, colours.norm.vmin, colours.norm.vmax),
        **place,
    )
    return "\n".join(filter(None, (headed_end(solution), text)))


def draw_bodies(
    axes: Axes,
    solution: SolutionData,
    bodies: Mapping[str, Sampled],
    factor: float,
    colours: ScalarMappable,
    angles: tuple[float, float],
) -> Array:
    """Surfaces on axes, seen from elevation and azimuth; their points, displaced."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    axes.view_init(*angles)
    axes.set_proj_type("ortho")
    toward = toward_eye(axes.elev, axes.azim)
    closed, moved = filled_bodies(solution), []
    polygons, fills, rims = list[Array](), list[Array](), list[Array]()
    for name, body in bodies.items():
        moved.append(x := body.x + factor * body.u)
        seen = np.ones(len(x), dtype=bool) if name not in closed else body.normal @ toward > -0.1
        pieces, fill = _shaded_bands(body, x, seen, colours, toward)
        polygons += pieces
        fills.append(fill)
        ends = x[body.rims[seen[body.rims].all(axis=1)]]
        # a little nearer to the eye than the panels beside it, which moves nothing in parallel
        # projection
        ends = ends + 0.5 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[:, None, None] * toward
        rims += [*ends[:, [0, 1, 1]]]
    grey, clear = (np.tile(each, (len(rims), 1)) for each in ((0.55, 0.55, 0.55, 0.7), (0.0,) * 4))
    axes.add_collection3d(
        Poly3DCollection(
            equal_corners(polygons + rims),
            facecolors=np.concatenate([*fills, clear]),
            edgecolors=np.concatenate([*fills, grey]),
            linewidths=np.repeat([0.3, 0.35], [len(polygons), len(rims)]),
        )
    )
    return np.concatenate(moved)


def _shaded_bands(
    body: Sampled, x: Array, seen: Mask, colours: ScalarMappable, toward: Array
) -> tuple[list[Array], Array]:
    """Polygons of one colour that cover the triangles with points that are seen, displaced to x;
    and their colours, darker where they turn away from the eye."""
    limits = colours.norm.boundaries
    triangles = body.triangles[seen[body.triangles].any(axis=1)]
    pieces, band, owner = cut(x[triangles], body.values[triangles], limits)
    fill = np.where(
        band[:, None] < 0, UNKNOWN, colours.to_rgba(0.5 * (limits[1:] + limits[:-1])[band])
    )
    turned = np.abs(body.normal[triangles[owner]].mean(axis=1) @ toward)
    fill[:, :3] *= 1.0 - SHADE * (1.0 - turned[:, None])
    return [*pieces], fill


def draw_nets(
    axes: Axes, solution: SolutionData, factor: float, body: str | None = None
) -> list[object]:
    """Draw rigid obstacles, all or those of one body, as a net, which hides nothing; the net, or
    nothing.

    It is made of the edges of the panels that may touch them and face the eye.
    """
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    eye, lines = toward_eye(axes.elev, axes.azim), list[Array]()
    for name, offset in obstacles(solution, factor):
        if body not in (None, solution.sides[name][0]):
            continue
        mesh, nodes = solution.meshes[solution.sides[name][0]], solution.nodes[name]
        faces = np.unique(mesh.element[nodes])
        places, _, rims = small_triangles(as_surface(mesh), TRIANGLES, faces)
        nodal = scattered(offset, nodes, mesh.n_nodes)
        x, normal = mesh.at(places.element, places.place)
        x = x + mesh.basis_at(places.element, places.place) @ nodal
        seen = np.isfinite(x[:, 0]) & (normal @ eye > 0.0)
        lines += [*x[rims[seen[rims].all(axis=1)]]]
    if not lines:
        return []
    net = Line3DCollection(lines, colors=EDGE, lw=0.7, zorder=1e2)
    axes.computed_zorder = False  # what is nearer to the eye in the mean need not cover it
    axes.add_collection3d(net)
    return [net]


def equal_corners(polygons: Sequence[Array]) -> Array:
    """Polygons with equal numbers of corners: the last corner is repeated where there are fewer.

    Where the numbers differ, matplotlib 3.10 and later find the limits of axes from memory that
    they have not written.

    Parameters
    ----------
    polygons : sequence of (k, 3) arrays
        The number of corners k may differ from polygon to polygon.

    Returns
    -------
    (p, K, 3) array
        K is the largest k.
    """
    corners = np.arange(max(map(len, polygons)))
    return np.stack([one[np.minimum(corners, len(one) - 1)] for one in polygons])


def contact_normals(solution: SolutionData, body: str) -> list[Array]:
    """Outward normals of a body times areas on its interfaces, (m, 3) each, where they are in
    contact, or anywhere."""
    result = []
    for name, pair in solution.pairs.items():
        closed = (
            pair.state != OPEN
            if np.any(pair.state != OPEN)
            else np.ones(len(pair.weight), dtype=bool)
        )
        area = (pair.weight[:, None] * pair.normal)[closed]
        owner = solution.primaries.get(name, NOWHERE)[0]
        sides = (1.0, solution.sides[name][0]), (-1.0, owner)
        result += [sign * area for sign, one in sides if one == body]
    return result


def best_view(solution: SolutionData, body: str | None = None) -> tuple[float, float]:
    """Elevation and azimuth; of one body such that as much as can be of its contact is seen, from
    below if need be."""
    views = [
        (up, AZIMUTH + turn)
        for up in (ELEVATION, -ELEVATION, STEEP, -STEEP)
        for turn in (0.0, 90.0, -90.0, 180.0)
    ]
    names = list(solution.meshes) if body is None else [body]
    normals = contact_normals(solution, names[0]) if len(names) == 1 else []
    if not normals:
        return views[0]
    seen = [
        float(np.maximum(np.concatenate(normals) @ toward_eye(*angles), 0.0).sum())
        for angles in views
    ]
    return views[int(np.argmax(np.array(seen) > SEEN * max(seen)))]


def toward_eye(elevation: float, azimuth: float) -> Array:
    """The unit vector towards the eye."""
    up, round_ = np.radians([elevation, azimuth])
    return np.array([np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up)])


def fit_axes(
    axes: Axes, solution: SolutionData, low: Array, high: Array, zoom: float = ZOOM
) -> None:
    """Limits, equal scales, and few enough ticks that their numbers do not run into each other."""
    from matplotlib.ticker import MaxNLocator

    size = np.maximum(high - low, 0.02 * float((high - low).max()))
    for k, axis in enumerate((axes.xaxis, axes.yaxis, axes.zaxis)):
        axis.set_major_locator(
            MaxNLocator(max(1, round(TICKS * size[k] / size.max())), steps=[1, 2, 5, 10])
        )
        axis.set_tick_params(labelsize=7.0, pad=0.0)
        axis.pane.set_alpha(0.15)
    axes.grid(visible=False)
    names = [label(axis, solution.problem.units.length) for axis in "xyz"]
    axes.set(
        xlim=(low[0], low[0] + size[0]),
        ylim=(low[1], low[1] + size[1]),
        zlim=(low[2], low[2] + size[2]),
    )
    for setter, name in zip(
        (axes.set_xlabel, axes.set_ylabel, axes.set_zlabel), names, strict=True
    ):
        setter(name, labelpad=-1.0, fontsize=8.0)
    axes.set_box_aspect(size, zoom=zoom)
