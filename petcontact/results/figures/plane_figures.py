"""Figures in the plane: the deformed bodies (figures 1 and 4 of the paper), and curves along each
interface (2, 3, 5, 6)."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ...arrays import Array, Index, scattered
from ...contact.law_protocol import OPEN
from ...mesh.curve_mesh import as_curve
from ...runtime.figure_style import (
    COLOURS,
    LINES,
    SHADES,
    draw_states,
    label,
    legend_below,
    legend_beside,
    plain,
    state_style,
)
from ...untyped import Axes, Figure, Keyed
from ..data import SolutionData
from ..records import PairResult
from .curves import (
    CURVES,
    along,
    headed,
    headed_end,
    largest_motion,
    rounded_away,
    shown_ends,
)
from .finite import end_at_corners, without_noise
from .outline_curves import outlines
from .surroundings import (
    draw_loads,
    draw_obstacles,
    draw_supports,
    draw_tractions,
    moved,
    size_of,
)
from .view import View, view_of

ROW = 0.05
"""Height of the zones of a step over that of a panel that shows several."""
LOWEST = 1.2
"""Height of axes with equal scales at least, for names of parts within [inch]."""
WITHIN = 8
"""Points of an element through which a polynomial is drawn."""
BODIES = ("black", COLOURS[2], COLOURS[3], COLOURS[6], COLOURS[5])
"""Colours of the bodies' outlines: not those of the states."""


def draw_deformed(figure: Figure, solution: SolutionData, view: View | None = None) -> None:
    """Draw the outlines before and after, the states of contact nodes, and the forces on them."""
    axes = figure.add_subplot()
    deformed_on(axes, solution, view)
    fit_height(figure, axes, beside=0.8, above=1.6)


def deformed_on(axes: Axes, solution: SolutionData, view: View | None = None) -> None:
    """Draw the same on given axes, in a view that other drawings share or in its own one."""
    shown = view or view_of(solution)
    draw_outlines(axes, solution, shown)
    draw_loads(axes, solution, shown)
    draw_tractions(axes, solution, shown)
    place(axes, solution)
    if view is not None:
        margin = 0.15 * size_of(solution)  # room for forces
        axes.set(
            xlim=(view.low[0] - margin, view.high[0] + margin),
            ylim=(view.low[1] - margin, view.high[1] + margin),
        )
    legend_below(axes, 5)


def fit_height(figure: Figure, axes: Axes, beside: float, above: float) -> None:
    """Make a figure as high as axes of equal scales need that fill its width; flat ones get room.

    `beside` and `above` are the room for what stands beside the axes, and above and below [inch].
    """
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    scale = (figure.get_figwidth() - beside) / (right - left)
    lacks = max(0.5 * (LOWEST / scale - (top - bottom)), 0.0)
    axes.set_ylim(bottom - lacks, top + lacks)
    figure.set_figheight(min(max(scale * (top - bottom), LOWEST), 5.4) + above)


def draw_outlines(axes: Axes, solution: SolutionData, view: View) -> None:
    """Draw the outlines of the bodies, supports, obstacles, and the states of contact nodes."""
    factor = view.factor
    draw_obstacles(axes, solution, view)
    draw_supports(axes, solution, view)
    for number, (name, mesh) in enumerate(solution.meshes.items()):
        colour = BODIES[number % len(BODIES)]
        for initial, deformed in outlines(as_curve(mesh), solution.bodies[name].u, factor):
            axes.plot(*initial.T, color="0.55", lw=0.9, ls="--")
            axes.plot(*deformed.T, color=colour, lw=1.1)
        word = name if len(solution.meshes) > 1 else "deformed"
        axes.plot([], [], color=colour, lw=1.1, label=word)
    axes.plot([], [], color="0.55", lw=0.9, ls="--", label="initial")
    axes.plot([], [], ls="", label=view.text)
    for name, pair in solution.pairs.items():
        shown = np.where(pair.state == OPEN, -1, pair.state)
        draw_states(axes, moved(solution, name, factor), shown, friction=bool(pair.bound.any()))


def place(axes: Axes, solution: SolutionData) -> None:
    """Set equal scales, the title and the units of the axes."""
    unit = solution.problem.units.length
    if solution.problem.symmetry == "axial" and axes.get_xlim()[0] < 0.5 * size_of(solution):
        axes.axvline(0.0, color="0.4", lw=0.8, ls="-.", label="axis")
    axes.set(
        xlabel=label("x", unit), ylabel=label("y", unit), aspect="equal", title=headed_end(solution)
    )


def line(number: int) -> Keyed:
    """Return the colour and the style of the curve of a step."""
    return {"color": f"C{number}", "ls": LINES[number % len(LINES)], "lw": 1.2}


def _draw_ends(
    axes: Axes,
    solution: SolutionData,
    name: str,
    values: Callable[[PairResult], Array],
    symbol: str = "",
) -> list[Array]:
    """Draw a field of an interface over the arc length at the end of each step.

    The field is a function of the interface that returns components (m, k) along the tangents.
    The component around the axis is pale. A single curve has the symbol as its label. Returns the
    fields (m, k) at the ends of the steps.
    """
    ends = shown_ends(solution)
    curves = [values(step.pairs[name]) for step in ends]
    for number, (step, curve) in enumerate(zip(ends, curves, strict=True)):
        word = symbol if symbol and len(ends) == 1 else plain(step.title)
        s, drawn = _between(solution, name, step.pairs[name], curve)
        for column, faint in zip(drawn.T, ({}, {"alpha": 0.45}), strict=False):
            axes.plot(
                s, column, label=word + ", round the axis" * bool(faint), **line(number), **faint
            )
    return curves


def _between(
    solution: SolutionData, name: str, pair: PairResult, values: Array
) -> tuple[Array, Array]:
    """Return arc lengths (q,) in order, and values there (q, k) of a field of an interface.

    Between the nodes of an element it is a polynomial, where all of them are in one state. Other
    elements, in which it has a kink, have the values at their nodes.
    """
    mesh, nodes = as_curve(solution.meshes[solution.sides[name][0]]), solution.nodes[name]
    whole = scattered(values, nodes, mesh.n_nodes)
    s, found = [pair.arc_length], [values]
    for element in np.unique(mesh.element[nodes]):
        rows = np.flatnonzero(mesh.element[nodes] == element)
        order = int(mesh.order[element])
        if order > 1 and len(rows) == order + 1 and len({*pair.state[rows].tolist()}) == 1:
            first = 0.5 * (1.0 + np.polynomial.legendre.leggauss(order + 1)[0][0])
            at = np.linspace(first, 1.0 - first, WITHIN)[1:-1]
            chosen = np.full(len(at), element)
            s.append(mesh.arc_lengths(chosen, at))
            found.append(mesh.basis_at(chosen, at) @ whole)
    along = np.concatenate(s)
    order_of = np.argsort(along, kind="stable")
    return along[order_of], np.concatenate(found)[order_of]


def draw_displacement(figure: Figure, solution: SolutionData) -> None:
    """Draw the slip along each interface at the end of each step (figures 2 and 5).

    On fixed ground the slip is the tangential displacement.
    """
    for axes, name, _ in _panels(figure, solution, "tangential displacement", "length"):
        _draw_ends(
            axes,
            solution,
            name,
            lambda pair: np.where(pair.state[:, None] == OPEN, np.nan, pair.slip),
            "$u_t$",
        )
        axes.axhline(0.0, color="0.5", lw=0.6)


def draw_traction(figure: Figure, solution: SolutionData) -> None:
    """Draw the tangential traction along each interface at the end of each step (figures 3 and 6).

    Each step has its own bounds, in its colour.
    """
    for axes, name, order in _panels(figure, solution, "tangential traction", "stress"):
        curves = _draw_ends(
            axes,
            solution,
            name,
            lambda pair: without_noise(solution, pair.sigma_t),
            r"$\sigma_t$",
        )
        _draw_bounds(axes, solution, name, order)
        axes.margins(y=0.08)
        end_at_corners(axes, solution, name, [column for curve in curves for column in curve.T])


def _draw_bounds(axes: Axes, solution: SolutionData, name: str, order: Index) -> None:
    """Draw the bounds of the shear at the ends of the steps, once where they are one."""
    ends = shown_ends(solution)
    bounds = [step.pairs[name].bound[order] for step in ends]
    single = all(np.array_equal(bound, bounds[-1]) for bound in bounds)
    shown = [(len(ends) - 1, bounds[-1])] if single else [*enumerate(bounds)]
    for number, bound in shown:
        word = r"$\pm$ bound" + ("" if single else f", {plain(ends[number].title)}")
        style = {"color": "black" if single else f"C{number}", "lw": 0.7, "ls": (0, (1, 1))}
        s = ends[number].pairs[name].arc_length[order]
        if np.isfinite(bound).all():
            axes.plot(s, bound, label=word, **style)
            axes.plot(s, -bound, **style)


def draw_normal(figure: Figure, solution: SolutionData) -> None:
    """Draw the pressure along each interface at the end of each step.

    Where it is negative at the last one, a foundation that does not pull would let go.
    """
    for axes, name, order in _panels(figure, solution, "pressure", "stress"):
        curves = _draw_ends(
            axes,
            solution,
            name,
            lambda pair: without_noise(solution, pair.pressure)[:, None],
            "$p$",
        )
        s, pull = solution.pairs[name].arc_length[order], np.minimum(curves[-1][order, 0], 0.0)
        if pull.any():
            axes.fill_between(s, 0.0, pull, color=COLOURS[3], alpha=0.4, lw=0, label="tension")
        axes.axhline(0.0, color="0.5", lw=0.6)
        end_at_corners(axes, solution, name, [curve[:, 0] for curve in curves])


def draw_gap(figure: Figure, solution: SolutionData) -> None:
    """Draw the gap that is left along each interface at the end of each step."""
    moved = largest_motion(solution)
    for axes, name, _ in _panels(figure, solution, "gap", "length"):
        curves = _draw_ends(
            axes,
            solution,
            name,
            lambda pair: rounded_away(
                np.where(np.isfinite(pair.gap), pair.gap, np.nan)[:, None], moved
            ),
        )
        (low, high), s = axes.get_xlim(), solution.pairs[name].arc_length
        shown = np.concatenate([curve[(s >= low) & (s <= high), 0] for curve in curves])
        top = float(np.nan_to_num(shown).max(initial=0.0))
        if top > 0.0:
            axes.set_ylim(-0.05 * top, 1.05 * top)


def draw_profiles(figure: Figure, solution: SolutionData) -> None:
    """Draw the pressure and, downwards, the worn depth of both sides after some of the cycles."""
    table = solution.wear
    assert table is not None
    shown = np.unique(np.linspace(0, len(table.cycle) - 1, CURVES).round().astype(int))
    depth = label("worn depth (dashed)", solution.problem.units.length)
    for axes, name, order in _panels(figure, solution, "pressure", "stress", list(table.depth)):
        s, deep = solution.pairs[name].arc_length[order], axes.twinx()
        for number, k in enumerate(shown):
            axes.plot(
                s,
                table.pressure[name][k][order],
                color=f"C{number}",
                label=f"cycle {table.cycle[k]}",
            )
            deep.plot(s, table.depth[name][k][order], color=f"C{number}", lw=1.0, ls="--")
        lowest = 2.5 * float(table.depth[name].max(initial=0.0)) or 1.0
        deep.set(ylim=(lowest, 0.0), ylabel=depth)


def _panels(
    figure: Figure,
    solution: SolutionData,
    what: str,
    unit: str,
    names: list[str] | None = None,
) -> Iterator[tuple[Axes, str, Index]]:
    """Yield axes for each interface, its name, and its nodes in order along it; up are values with
    the problem's unit of length or stress.

    The states at the end are shaded behind the curves. The label of the axis and the legend follow
    when the curves are drawn.
    """
    shown = names or list(solution.pairs)
    if len(shown) > 1:
        figure.set_figheight(1.2 + 2.6 * len(shown))
    for axes, name in zip(np.atleast_1d(figure.subplots(len(shown), 1)), shown, strict=True):
        axes.set_xlim(*_extent(solution, name))
        _window(axes, [step.pairs[name] for step in shown_ends(solution)])
        _shaded(axes, solution, name)
        way = label(f"arc length along {along(solution, name)}", solution.problem.units.length)
        axes.set(xlabel=way, title=headed(solution) if name == shown[0] else "")
        yield axes, name, np.argsort(solution.pairs[name].arc_length)
        axes.set_ylabel(label(what, getattr(solution.problem.units, unit)))
        _room_for_rows(axes, len(shown_ends(solution)))
        if names is None:
            legend_beside(axes)
        else:  # a second axis stands on the right
            legend_below(axes, 3)


def _shaded(axes: Axes, solution: SolutionData, name: str) -> None:
    """Shade the stretches of arc length that stick, slip and are open: after one step all of the
    height, after several a row at the bottom for each of them, the first one on top."""
    ends = shown_ends(solution)
    words, high = dict[str, None](), ROW if len(ends) > 1 else 1.0
    left, right = axes.get_xlim()
    for number, step in enumerate(reversed(ends)):
        rows = number * high, (number + 1) * high
        for start, end, word in _zones(solution, name, step.pairs[name]):
            axes.axvspan(start, end, *rows, color=SHADES[word], lw=0)
            if start < right and end > left:
                words[word] = None
        if len(ends) > 1:
            axes.text(
                0.005,
                (number + 0.5) * high,
                plain(step.title),
                color="0.25",
                fontsize=6.5,
                va="center",
                transform=axes.transAxes,
            )
    for word in words:
        axes.fill_between([], [], [], color=SHADES[word], label=word)


def _room_for_rows(axes: Axes, count: int) -> None:
    """Lower the bottom of axes so that rows of zones hide no curve."""
    if count > 1:
        low, high = axes.get_ylim()
        axes.set_ylim(low - (high - low) * ROW * count / (1.0 - ROW * count), high)


def _zones(
    solution: SolutionData, name: str, pair: PairResult
) -> Iterator[tuple[float, float, str]]:
    """Yield the ends of the zones of an interface, and their names."""
    mesh = as_curve(solution.meshes[solution.sides[name][0]])
    order, friction = np.argsort(pair.arc_length), bool(pair.bound.any())
    s, state = pair.arc_length[order], pair.state[order]
    element = mesh.element[solution.nodes[name][order]]
    cuts = np.flatnonzero(np.diff(state)) + 1
    last = mesh.side_start[element[-1]] + mesh.length[element[-1]]
    ends = np.concatenate([[mesh.side_start[element[0]]], 0.5 * (s[cuts - 1] + s[cuts]), [last]])
    for first, low, high in zip([0, *cuts.tolist()], ends[:-1], ends[1:], strict=True):
        yield low, high, state_style(int(state[first]), friction=friction)[0]


def _extent(solution: SolutionData, name: str) -> tuple[float, float]:
    """Return the arc lengths at which an interface begins and ends."""
    zones = [*_zones(solution, name, solution.pairs[name])]
    return zones[0][0], zones[-1][1]


def _window(axes: Axes, pairs: list[PairResult]) -> None:
    """Show the stretch that was closed, with a margin that reaches beyond the nearest open node."""
    closed = np.any([pair.state != OPEN for pair in pairs], axis=0)
    s = pairs[-1].arc_length
    if closed.any() and not closed.all():
        low, high = s[closed].min(), s[closed].max()
        beyond = np.abs(s[~closed, None] - [low, high]).min()
        margin = max(0.15 * (high - low), 2.0 * float(beyond))
        axes.set_xlim(max(low - margin, s.min()), min(high + margin, s.max()))
