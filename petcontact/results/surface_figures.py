"""Figures of a body in space: its deformed surface, and slip and traction on the contact parts as arrows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Array, Index
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.surface_mesh import SurfaceMesh
from .solution import ContactFields, Solution
from .steps.solution import PairResult

MAGNIFIED = 0.08
"""Largest displacement drawn, as a fraction of the body's diameter."""
ARROWS = 500
"""Most arrows of one panel."""


def draw_surface(figure: Any, solution: Solution) -> None:
    """The deformed surface, coloured by |u|, with the initial edges of the panels."""
    draw_surfaces(figure, [(solution.mesh, solution.u)], solution.case.title)


def draw_surfaces(figure: Any, bodies: Sequence[tuple[BoundaryMesh, Array]], heading: str) -> None:
    """Deformed surfaces of bodies, meshes with their nodal displacements, coloured by |u|."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    from ..runtime.figure_style import round_number, title

    every = np.vstack([mesh.x for mesh, _ in bodies])
    peak = max(float(np.linalg.norm(u, axis=1).max()) for _, u in bodies)
    factor = round_number(MAGNIFIED * float(np.linalg.norm(np.ptp(every, axis=0))), peak)
    axes = figure.add_subplot(projection="3d")
    pieces = [corner_values(as_surface(mesh), u) for mesh, u in bodies]
    corners, moves = (np.concatenate(values) for values in zip(*pieces, strict=True))
    size, moved = np.linalg.norm(moves, axis=2).mean(axis=1), corners + factor * moves
    colour = figure_colours(size)
    axes.add_collection3d(Poly3DCollection(list(moved), facecolors=colour.to_rgba(size), edgecolors="0.3", linewidths=0.25))
    low, high = moved.min(axis=(0, 1)), moved.max(axis=(0, 1))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]), xlabel="x", ylabel="y", zlabel="z")
    axes.set_box_aspect(high - low, zoom=0.85)  # room for the numbers at the axes
    axes.set_title(": ".join(filter(None, (title(heading), f"u × {factor:g}"))), fontsize="medium")
    figure.colorbar(colour, ax=axes, label="|u|", shrink=0.7, pad=0.1)


def figure_colours(values: Array) -> Any:
    """A colour map from 0 to the largest value."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(0.0, float(values.max()) or 1.0), "viridis")


def draw_slip(figure: Any, solution: Solution) -> None:
    """Tangential displacement on the contact parts as arrows, nodes that stick as dots."""
    _draw_vectors(figure, solution, solution.contact.u_t, "tangential displacement $u_t$", "C3")


def draw_tangential_traction(figure: Any, solution: Solution) -> None:
    """Tangential traction on the contact parts as arrows, nodes that stick as dots."""
    _draw_vectors(figure, solution, solution.contact.sigma_t, r"tangential traction $\sigma_t$", "C0")


def _draw_vectors(figure: Any, solution: Solution, components: Array, label: str, colour: str) -> None:
    """One panel a contact part, seen along its mean normal; panels shaded by its mean size under the arrows."""
    from ..runtime.figure_style import plain, title

    contact = solution.contact
    parts = list(dict.fromkeys(contact.part.tolist()))
    figure.set_size_inches(7.0, 0.8 + 3.6 * len(parts))
    for axes, part in zip(figure.subplots(len(parts), 1, squeeze=False)[:, 0], parts, strict=True):
        chosen = np.flatnonzero(contact.part == part)
        directions, names = view(contact, chosen)
        x, sticks = contact.x[chosen] @ directions.T, contact.state[chosen] == 0
        vectors = np.einsum("nk,nkd->nd", components[chosen], contact.tangent[chosen])
        size = np.linalg.norm(vectors, axis=1)
        shades = axes.add_collection(shaded_panels(solution.mesh, contact.nodes[chosen], size, directions))
        some = np.arange(0, len(x), max(1, len(x) // ARROWS))
        axes.quiver(*x[some].T, *(vectors[some] @ directions.T).T, color=colour, width=0.0025)
        axes.plot(*x[sticks].T, ".", color="C2", ms=3, label="stick" if sticks.any() else None)
        axes.autoscale_view()
        axes.set(xlabel=names[0], ylabel=names[1], aspect="equal", title=f"{plain(part)}: {label}")
        axes.title.set_fontsize("small")
        figure.colorbar(shades, ax=axes, shrink=0.75)
        if sticks.any():
            axes.legend(fontsize="small", loc="upper left", bbox_to_anchor=(0.0, -0.12), frameon=False)
    figure.suptitle(title(solution.case.title), fontsize="medium")


def view(contact: ContactFields | PairResult, chosen: Index | slice) -> tuple[Array, tuple[str, str]]:
    """Two directions in the plane that the nodes lie nearest to, coordinate axes where these lie in it, and their names."""
    tangents = contact.tangent[chosen].mean(axis=0)
    spread = np.linalg.svd(contact.x[chosen] - contact.x[chosen].mean(axis=0), full_matrices=False)[2]
    flat = np.allclose(contact.tangent[chosen], tangents, atol=1e-9)
    directions = tangents if flat else spread[:2]
    names = ["xyz"[int(d.argmax())] if d.max() > 1.0 - 1e-9 else f"direction ({d[0]:.2g}, {d[1]:.2g}, {d[2]:.2g})"
             for d in directions]  # fmt: skip
    return directions, (names[0], names[1])


def shaded_panels(mesh: BoundaryMesh, nodes: Index, values: Array, directions: Array, colours: str = "Greys") -> Any:
    """The panels of some nodes as they are seen along the missing direction, shaded by the mean of nodal values >= 0."""
    from matplotlib.collections import PolyCollection

    elements, place = np.unique(mesh.element[nodes], return_inverse=True)
    weight = mesh.weight[nodes]
    mean = np.bincount(place, weight * values) / np.bincount(place, weight)
    seen = [corners[~np.isnan(corners[:, 0])] @ directions.T for corners in as_surface(mesh).corners[elements]]
    shades = PolyCollection(seen, array=mean, cmap=colours, edgecolors="0.7", linewidths=0.3)
    shades.set_clim(0.0, float(mean.max()) or 1.0)
    return shades


def as_surface(mesh: BoundaryMesh) -> SurfaceMesh:
    """The mesh of a body in space."""
    assert isinstance(mesh, SurfaceMesh)
    return mesh


def corner_values(mesh: SurfaceMesh, values: Array) -> tuple[Array, Array]:
    """Corners (k, 4, 3) of the panels, triangles with their third twice, and nodal values (n, d) extrapolated to them."""
    corners = np.where(np.isnan(mesh.corners), mesh.corners[:, 2:3], mesh.corners)
    result = np.empty((mesh.n_elements, 4, values.shape[1]))
    for batch in mesh.batches():
        panels = batch.elements
        count = panels.polygon.shape[1]
        basis = panels.basis(panels.polygon)
        nodal = values[batch.nodes].reshape(len(panels.index), -1, values.shape[1])
        at = np.einsum("nqb,nbd->nqd", basis, nodal)
        result[panels.index] = at[:, np.minimum(np.arange(4), count - 1)]
    return corners, result
