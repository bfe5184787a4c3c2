"""A figure of the deformed bodies coloured by a stress."""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np
import shapely
from scipy.spatial.distance import cdist

from ...arrays import Array
from ...errors import InputError
from ...fields.stress_state import Field
from ...mesh.curve_mesh import as_curve
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...record import record, replace
from ...runtime.figure_style import label, legend_below, name_what_is_seen, plain, save
from ...runtime.hints import demand_name
from ...untyped import Axes, Figure
from ..body_fields import quantities, quantity
from ..data import SolutionData
from ..numbers.number import Number
from ..numbers.peaks import QUANTITIES, stress_peaks, unbounded_places
from ..strength.place import Place
from ..verdict.text import KEPT, place_of
from ..vtu.inner_fields import (
    Window,
    check_window,
    field_inside,
    filled_bodies,
    grid_inside,
    within,
)
from ..vtu.spread_points import Places
from .colour_bands import beyond
from .curves import headed_end
from .cuts import grid_of, outline_of, plane_of
from .finite import away_from
from .plane_figures import draw_outlines, fit_height, place
from .surface_figure import sampled, shade_each
from .view import View, view_of

MAGNIFIED = 0.06
"""Largest displacement drawn, as a fraction of the size of the bodies, where no magnification is
given."""
ALONG = 100
"""Grid cells along the longer side of a body, where no grid is given."""
WIDE = 110
"""Characters of a line under the figure."""
PLACES = 3
"""Most places without a bound that a figure names; the verdict names more."""
COARSE = 40
"""Grid cells along the longer side in the figure that `plot` draws."""
SIGNED = 0.01
"""Share of the usual size below zero from which colours have two signs."""


WORDS = {
    "von_mises": "von Mises stress",
    "principal_1": "first principal stress",
    "principal_2": "second principal stress",
    "principal_3": "third principal stress",
    "u": "|u|",
}
"""Words for quantities in figures; other quantities are called by their names."""


def deformed_figure(
    solution: SolutionData,
    path: str | Path,
    *,
    resolution: tuple[int, int] | None = None,
    magnification: float | None = None,
    field: Field | Mapping[str, Field] | None = None,
    quantity: str = "von_mises",
    bodies: Collection[str] | None = None,
    window: Window | None = None,
    section: str | None = None,
) -> Path:
    """Draw the deformed bodies at the end, coloured by a stress: in the plane inside, in space on
    the surface.

    Parameters
    ----------
    solution : Solution
    path : str or Path
        Its suffix is the format: .png, .pdf or .svg.
    resolution : (int, int), optional
        In the plane, grid cells along x and y; by default 100 along the longer side of the bounding
        box.
    magnification : float, optional
        Factor of the displacement; by default a round number that makes it visible.
    field : Field, or dict of Field by body, optional
        In the plane, from `field_on_grid`, where it is there already.
    quantity : str
        von_mises, principal_1, ..., sigma_xx, ..., u, ux, ...
    bodies : names, optional
        Those that are coloured.
    window : two (d,) arrays, optional
        In the plane and in a cut, corners of the box that is shown [length].
    section : str, optional
        In space, the plane of a cut through the bodies as they were: "y=0".

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If there is no such format or quantity.
    OutputError
        If the file cannot be written.
    """
    if isinstance(field, Field):
        field = {solution.only_body("field"): field}
    mesh = next(iter(solution.meshes.values()))
    demand_name("no quantity", quantity, quantities(mesh.components))
    coloured = [name for name in filled_bodies(solution) if bodies is None or name in bodies]
    picture = Picture(
        view_of(solution, share=MAGNIFIED, factor=magnification),
        quantity,
        coloured,
        resolution,
        window,
    )
    if section is not None:
        if mesh.dim < 3:
            raise InputError(f"--section {section}: cuts bodies in space; these are plane")
        check_window(mesh, window)
        picture = replace(picture, view=replace(picture.view, factor=0.0), across=plane_of(section))
        save(Path(path), _draw_section, solution, picture)
        return Path(path)
    save(Path(path), DRAWING[mesh.dim], solution, picture, field or {})
    return Path(path)


@record
class Picture:
    """What is shown, and how: see `deformed_figure`."""

    view: View
    quantity: str
    bodies: Sequence[str]
    resolution: tuple[int, int] | None = None
    window: Window | None = None
    across: tuple[int, float] | None = None

    def label(self, solution: SolutionData) -> str:
        """Label of the colour bar."""
        return label(WORDS.get(self.quantity, self.quantity), self.unit(solution))

    def unit(self, solution: SolutionData) -> str:
        """The user's name of the unit of the quantity."""
        units = solution.problem.units
        return (units.length if self.quantity.startswith("u") else units.stress) or ""


def draw_von_mises(figure: Figure, solution: SolutionData, view: View | None = None) -> None:
    """Von Mises stress in the deformed bodies on a coarse grid."""
    view = view or view_of(solution, share=MAGNIFIED)
    picture = Picture(view, "von_mises", filled_bodies(solution))
    DRAWING[next(iter(solution.meshes.values())).dim](figure, solution, picture, {}, COARSE)


def _draw_plane(
    figure: Figure,
    solution: SolutionData,
    picture: Picture,
    given: Mapping[str, Field],
    cells: int = ALONG,
) -> None:
    axes, caption = figure.add_subplot(), ""
    fields = within(
        picture.window,
        picture.bodies,
        lambda name: given.get(name) or _field(solution, name, picture, cells),
    )
    if fields:
        caption = _colour(figure, axes, solution, picture, fields)
    draw_outlines(axes, solution, picture.view)
    place(axes, solution)
    if picture.window is not None and fields:
        # where the points of the window are drawn
        drawn = np.vstack([_drawn(picture, field) for field in fields.values()])
        (left, bottom), (right, top) = drawn.min(axis=0), drawn.max(axis=0)
        axes.set(xlim=(left, right), ylim=(bottom, top))
        name_what_is_seen(axes)
    legend_below(axes, 5, caption)
    fit_height(figure, axes, beside=1.6, above=2.1)


def _draw_section(figure: Figure, solution: SolutionData, picture: Picture) -> None:
    """What a plane cuts out of the bodies, as they were."""
    axes, (axis, value) = figure.add_subplot(), picture.across or (0, 0.0)
    cells = max(picture.resolution or (ALONG,))
    every = {
        name: outline_of(as_surface(solution.meshes[name]), axis, value) for name in picture.bodies
    }
    if picture.window is not None:
        box = shapely.box(*np.delete(picture.window, axis, axis=1).ravel())
        every = {name: cut.intersection(box) for name, cut in every.items()}
    if not (cuts := {name: cut for name, cut in every.items() if not cut.is_empty}):
        raise InputError(f"--section: no body lies at {'xyz'[axis]} = {value:g}")
    fields = {
        name: field_inside(solution, grid_of(cut, axis, value, cells), name)
        for name, cut in cuts.items()
    }
    caption = _colour(figure, axes, solution, picture, fields)
    for cut in cuts.values():
        for line in shapely.get_parts(shapely.boundary(cut)):
            axes.plot(*shapely.get_coordinates(line).T, color="black", lw=1.0)
    first, second = (
        label(name, solution.problem.units.length) for name in "xyz" if name != "xyz"[axis]
    )
    title = f"{headed_end(solution)}, cut at {'xyz'[axis]} = {value:g}"
    axes.set(xlabel=first, ylabel=second, aspect="equal", title=title)
    legend_below(axes, 5, caption)
    fit_height(figure, axes, beside=1.6, above=2.1)


def _colour(
    figure: Figure,
    axes: Axes,
    solution: SolutionData,
    picture: Picture,
    fields: Mapping[str, Field],
) -> str:
    """Bodies in colours of the quantity, a colour bar, and its largest value; returns that in
    words."""
    values = {name: quantity(field, picture.quantity) for name, field in fields.items()}
    field, row, largest, text = _largest(solution, picture, fields, values)
    every, end = np.concatenate([*values.values()]), abs(largest) or 1.0
    signed = float(every.min(initial=0.0)) < -SIGNED * end
    how = {
        "shading": "gouraud",
        "cmap": "coolwarm" if signed else "viridis",
        "vmin": -end if signed else 0.0,
        "vmax": end,
        "rasterized": True,
    }
    for each, one in fields.items():
        colours = axes.tripcolor(*_drawn(picture, one).T, values[each], triangles=one.cells, **how)
    axes.plot(
        *_drawn(picture, field)[row],
        "x",
        color="black",
        ms=5.0,
        mew=1.0,
        label="largest",
        clip_on=False,
    )
    extend = beyond(every, -end if signed else -np.inf, end)
    figure.colorbar(colours, ax=axes, label=picture.label(solution), shrink=0.8, extend=extend)
    return textwrap.fill(plain(text + _without(solution, picture)), WIDE)


def _largest(
    solution: SolutionData,
    picture: Picture,
    fields: Mapping[str, Field],
    values: Mapping[str, Array],
) -> tuple[Field, int, float, str]:
    """The field with the largest value, the row of its point that is nearest to it, the value, and
    the words for value and place: those of the verdict where it has them, else of the points."""
    whole = picture.window is None and picture.across is None
    told = largest_known(solution, picture.quantity, fields) if whole else []
    if told:
        largest, name, place = max(told, key=lambda each: each[0])
        row = int(np.argmin(cdist(fields[name].x, place[None])))
    else:
        tops = {
            name: _top(solution, picture, name, field.x, values[name])
            for name, field in fields.items()
        }
        name = max(tops, key=lambda one: abs(float(values[one][tops[one]])))
        row = tops[name]
        largest, place = float(values[name][row]), fields[name].x[row]
    at = place_of(place, float(np.abs(fields[name].x).max())).replace(KEPT, " ")
    text = f"largest {largest:.4g} {picture.unit(solution)}".rstrip()
    return fields[name], row, largest, f"{text} at {at} of the initial shape"


def largest_known(
    solution: SolutionData, quantity: str, bodies: Collection[str]
) -> list[tuple[float, str, Array]]:
    """The largest values of the verdict, with their bodies and places: of a place without a bound
    that at its stated distance."""
    name = WORDS.get(quantity, "").removesuffix(" stress")
    return [
        (float(number.value[0]), number.of, number.place)
        for number in (_peaks(solution) if name in QUANTITIES else ())
        if number.name.startswith(f"{name} stress ")
        and number.of in bodies
        and number.place is not None
        and np.isfinite(number.value[0])
    ]


def _peaks(solution: SolutionData) -> Sequence[Number]:
    """The largest stresses at the end: the verdict's are those of all steps."""
    last = solution.last
    return (
        solution.at_end("peaks", last, lambda: stress_peaks(solution, [last]))
        if solution.posed.steps
        else solution.numbers
    )


def _drawn(picture: Picture, field: Field) -> Array:
    """Where the points of a field are drawn (m, 2)."""
    x = field.x + picture.view.factor * field.u[:, : field.x.shape[1]]
    return np.asarray(x if picture.across is None else np.delete(x, picture.across[0], axis=1))


def _places(solution: SolutionData, picture: Picture, body: str) -> list[Place]:
    """Where the quantity has no bound."""
    stress = not picture.quantity.startswith("u")
    return unbounded_places(solution, _peaks(solution))[body] if stress else []


def _without(solution: SolutionData, picture: Picture) -> str:
    """Where colours and the largest leave values out, in words."""
    size = max(float(np.abs(mesh.x).max()) for mesh in solution.meshes.values())
    left = {
        f"{place_of(place.x, size).replace(KEPT, ' ')} ({place.sides})"
        for name in picture.bodies
        for place in _places(solution, picture, name)
        if picture.window is None or _near(place, picture.window)
    }
    listed, more = sorted(left)[:PLACES], max(0, len(left) - PLACES)
    rest = f" and {more} more place{'s' * (more > 1)}" if more else ""
    return f", away from {', '.join(listed)}{rest} where stress has no bound" if left else ""


def _near(place: Place, window: Window) -> bool:
    """Whether values in a window are left out for a place."""
    inside = np.clip(place.x, *window)
    return float(np.linalg.norm(place.x - inside)) < place.distance


def _top(solution: SolutionData, picture: Picture, body: str, x: Array, values: Array) -> int:
    """Number of the largest of values (n,) in size, at points (n, d) of a body, away from where
    they have no bound."""
    places = _places(solution, picture, body)
    sizes = np.where(np.isfinite(values), np.abs(values), -1.0)
    if places:
        away = away_from(places, x)
        sizes = np.where(away, sizes, -1.0) if away.any() else sizes
    return int(np.argmax(sizes))


def _field(solution: SolutionData, name: str, picture: Picture, cells: int) -> Field:
    mesh = as_curve(solution.meshes[name])
    size = (
        np.ptp(mesh.start, axis=0)
        if picture.window is None
        else picture.window[1] - picture.window[0]
    )
    along = np.maximum(2, np.rint(cells * size / size.max()).astype(int))
    resolution = picture.resolution or (int(along[0]), int(along[1]))
    return field_inside(solution, grid_inside(mesh, resolution, picture.window), name)


def _draw_space(
    figure: Figure,
    solution: SolutionData,
    picture: Picture,
    given: Mapping[str, Field],
    cells: int = ALONG,
) -> None:
    """The surfaces, shaded."""

    def sample(name: str, mesh: SurfaceMesh, places: Places) -> Array:
        if name not in picture.bodies:
            return np.full(len(places.element), np.nan)
        return quantity(
            solution.body_fields(name).on_boundary(places.element, places.place), picture.quantity
        )

    bodies = sampled(solution, sample)
    top = max(
        abs(float(body.values[_top(solution, picture, name, body.x, body.values)]))
        for name, body in bodies.items()
        if name in picture.bodies
    )
    shade_each(figure, solution, bodies, picture.label(solution), picture.view, top or None)


DRAWING = {2: _draw_plane, 3: _draw_space}
"""What draws bodies in so many dimensions."""
