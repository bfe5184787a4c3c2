"""The deformed surfaces of bodies in space, shaded in bands of a quantity, with the edges of the panels."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Array, Index
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...runtime.figure_style import label
from ..data import SolutionData
from ..vtu.inside import filled_bodies
from ..vtu.places import Places, small_triangles
from .bands import UNKNOWN, band_colours, cut
from .curves import headed_end
from .view import View, view_of

TRIANGLES = 8000
"""Of all bodies together, about."""
ELEVATION, AZIMUTH = 24.0, -58.0
"""Of the view [degrees]."""
SHADE = 0.2
"""How much darker surfaces are that are seen from the side."""
TICKS = 5
"""Along the longest edge."""
Sample = Callable[[str, SurfaceMesh, Places], Array]
"""Values (q,) of a body of a name at places."""


@dataclass(frozen=True)
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
        places, triangles, rims = small_triangles(surface, round(TRIANGLES * mesh.n_elements / count))
        at = mesh.variables_at(places.element, places.place)
        x, normal = (np.column_stack([at[f"{n}{axis}"] for axis in "xyz"]) for n in ("", "n"))
        u = mesh.basis_at(places.element, places.place) @ solution.bodies[name].u
        result[name] = Sampled(x, normal, u, sample(name, surface, places), triangles, rims)
    return result


def surface_on(axes: Any, solution: SolutionData, view: View | None = None) -> None:
    """The deformed surfaces of all bodies at the end, shaded by |u|, on given axes; in a view that others share, else in the
    one that suits them."""
    size = lambda name, mesh, places: np.linalg.norm(  # noqa: E731
        mesh.basis_at(places.element, places.place) @ solution.bodies[name].u, axis=1
    )
    what = label("|u|", solution.problem.units.length)
    shade(axes, solution, sampled(solution, size), what, view or view_of(solution), view.largest if view else None)


def shade(
    axes: Any, solution: SolutionData, bodies: Mapping[str, Sampled], what: str, view: View, top: float | None = None
) -> None:
    """Draw surfaces, deformed as the view says, in bands up to `top` or to the largest value, with a colour bar."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    axes.view_init(*best_view(solution))
    axes.set_proj_type("ortho")
    toward = _toward(axes.elev, axes.azim)
    colours = band_colours(np.concatenate([body.values for body in bodies.values()]), top)
    closed, moved = filled_bodies(solution), []
    polygons, fills, rims = list[Array](), list[Array](), list[Array]()
    for name, body in bodies.items():
        x = body.x + view.factor * body.u
        moved.append(x)
        seen = np.ones(len(x), dtype=bool) if name not in closed else body.normal @ toward > -0.1
        triangles = body.triangles[seen[body.triangles].any(axis=1)]
        pieces, band, owner = cut(x[triangles], body.values[triangles], colours.norm.boundaries)
        middles = 0.5 * (colours.norm.boundaries[1:] + colours.norm.boundaries[:-1])
        fill = np.where(band[:, None] < 0, UNKNOWN, colours.to_rgba(middles[band]))
        light = 1.0 - SHADE * (1.0 - np.abs(body.normal[triangles[owner]].mean(axis=1) @ toward))
        fill[:, :3] *= light[:, None]
        polygons += pieces
        fills.append(fill)
        ends = x[body.rims[seen[body.rims].all(axis=1)]]
        # a little nearer to the eye than the panels beside it, which moves nothing in parallel projection
        ends = ends + 0.5 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[:, None, None] * toward
        rims += [*ends[:, [0, 1, 1]]]
    faces = np.concatenate(fills)
    edges = np.concatenate([faces, np.tile((0.55, 0.55, 0.55, 0.7), (len(rims), 1))])
    widths = np.repeat([0.3, 0.35], [len(polygons), len(rims)])
    faces = np.concatenate([faces, np.zeros((len(rims), 4))])
    axes.add_collection3d(Poly3DCollection(polygons + rims, facecolors=faces, edgecolors=edges, linewidths=widths))
    _fit(axes, solution, view, np.concatenate(moved))
    axes.set_title("\n".join(filter(None, (headed_end(solution), view.text))), fontsize="medium")
    axes.figure.colorbar(colours, ax=axes, label=what, shrink=0.75, pad=0.09, aspect=25, spacing="proportional")


def best_view(solution: SolutionData) -> tuple[float, float]:
    """Elevation and azimuth; of one body such that its contact is seen, from below if need be."""
    normal = sum((pair.weight @ pair.normal for pair in solution.pairs.values()), np.zeros(3))
    size = float(np.linalg.norm(normal))
    views = [(up, AZIMUTH + turn) for up in (ELEVATION, -ELEVATION) for turn in (0.0, 90.0, -90.0, 180.0)]
    if len(solution.meshes) > 1 or size == 0.0:
        return views[0]
    facing = [float(_toward(*angles) @ normal) / size for angles in views]
    return views[int(np.argmax(np.array(facing) > max(facing) - 0.5))]


def _toward(elevation: float, azimuth: float) -> Array:
    """The unit vector towards the eye."""
    up, round_ = np.radians([elevation, azimuth])
    return np.array([np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up)])


def _fit(axes: Any, solution: SolutionData, view: View, moved: Array) -> None:
    """Limits, equal scales, and few enough ticks that their numbers do not run into each other."""
    from matplotlib.ticker import MaxNLocator

    low, high = np.minimum(moved.min(axis=0), view.low), np.maximum(moved.max(axis=0), view.high)
    size = np.maximum(high - low, 0.02 * float((high - low).max()))
    for k, axis in enumerate((axes.xaxis, axes.yaxis, axes.zaxis)):
        axis.set_major_locator(MaxNLocator(max(1, round(TICKS * size[k] / size.max())), steps=[1, 2, 5, 10]))
        axis.set_tick_params(labelsize=7.0, pad=0.0)
        axis.pane.set_alpha(0.15)
    axes.grid(visible=False)
    names = [label(axis, solution.problem.units.length) for axis in "xyz"]
    axes.set(xlim=(low[0], low[0] + size[0]), ylim=(low[1], low[1] + size[1]), zlim=(low[2], low[2] + size[2]))
    for setter, name in zip((axes.set_xlabel, axes.set_ylabel, axes.set_zlabel), names, strict=True):
        setter(name, labelpad=-1.0, fontsize=8.0)
    axes.set_box_aspect(size, zoom=0.95)
