"""Figures in space: the deformed bodies, and on each interface tractions, motion and states, seen
along its normal."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Mask, scattered
from ...contact.law_protocol import OPEN, SLIP, STICK
from ...mesh.surface_mesh import as_surface
from ...runtime.figure_style import STATES, draw_states, label, legend_below, plain
from ...untyped import Axes, Figure
from ..data import SolutionData
from ..records import PairResult
from ..vtu.spread_points import small_triangles
from .colour_bands import band_colours, beyond
from .curves import along, headed, headed_end, shown_ends
from .finite import shown_range
from .surface_figure import TRIANGLES
from .view import Chart

ARROWS = 500
"""Most arrows of one panel."""
ROUND = 0.3
"""Length of the mean normal of what is in contact below which that goes round the body."""
SMALL, MARGIN, NEXT, LONG = 0.5, 0.2, 1.1, 5.0
"""Share of the extent of a face up to which contact is shown alone, how much of its own is shown
beside it, and up to which multiple of the distance to the next node that is open; length over width
from which on scales differ."""


def draw_displacement(figure: Figure, solution: SolutionData) -> None:
    """Tangential displacement on each interface at the end, between bodies the slip, as arrows;
    nodes that stick and slip as dots."""
    for axes, name, pair in _panels(figure, solution):
        slip = np.where(pair.state[:, None] == OPEN, 0.0, pair.slip)
        unit = solution.problem.units.length
        _shade(
            axes,
            solution,
            name,
            np.linalg.norm(slip, axis=1),
            label("tangential displacement", unit),
        )
        _arrows(axes, solution, name, slip, unit)


def draw_traction(figure: Figure, solution: SolutionData) -> None:
    """Tangential traction on each interface at the end as arrows, over its share of the bound;
    nodes that stick and slip as dots."""
    for axes, name, pair in _panels(figure, solution):
        size = np.linalg.norm(pair.sigma_t, axis=1)
        limited = np.isfinite(pair.bound) & (pair.bound > 0.0)
        share = np.divide(size, pair.bound, out=np.zeros(len(size)), where=limited)
        unit = solution.problem.units.stress
        if limited.any():
            _shade(axes, solution, name, share, "tangential traction / bound", 1.0)
        else:
            _shade_traction(axes, solution, name, size, label("tangential traction", unit))
        _arrows(axes, solution, name, pair.sigma_t, unit)


def draw_normal(figure: Figure, solution: SolutionData) -> None:
    """Pressure on each interface at the end; where it is negative a foundation that does not pull
    would let go."""
    for axes, name, pair in _panels(figure, solution):
        what = label("pressure", solution.problem.units.stress)
        _shade_traction(axes, solution, name, pair.pressure, what)


def draw_error(figure: Figure, solution: SolutionData) -> None:
    """Estimated error of pressure and shear together on each interface at the end, rms over each
    panel."""
    for axes, name, pair in _panels(figure, solution):
        assert pair.pressure_error is not None and pair.sigma_t_error is not None
        error = np.hypot(pair.pressure_error, pair.sigma_t_error)
        _shade(
            axes,
            solution,
            name,
            error,
            label("estimated error of p and q", solution.problem.units.stress),
        )


def draw_gap(figure: Figure, solution: SolutionData) -> None:
    """What is left of the gap on each interface at the end; panels that face nothing somewhere are
    left out."""
    for axes, name, pair in _panels(figure, solution):
        _shade(
            axes,
            solution,
            name,
            np.maximum(pair.gap, 0.0),
            label("gap", solution.problem.units.length),
        )


def draw_states_by_step(figure: Figure, solution: SolutionData) -> None:
    """Which nodes stick, slip and are open at the end of each step: a row an interface."""
    ends, names = shown_ends(solution), list(solution.pairs)
    figure.set_size_inches(7.0 + 1.2 * max(0, len(ends) - 3), 0.8 + 3.0 * len(names))
    every = figure.subplots(len(names), len(ends), squeeze=False)
    for row, name in zip(every, names, strict=True):
        for axes, step in zip(row, ends, strict=True):
            pair = step.pairs[name]
            chart = Chart.of(solution, name)
            x = chart.at(pair.x)
            closed = np.any([end.pairs[name].state != OPEN for end in ends], axis=0)
            shown = _window(axes, x, closed, _front(solution, name, closed, chart), chart)
            draw_states(axes, x[shown], pair.state[shown], friction=bool(pair.bound.any()))
            axes.set_title(
                ": ".join(([name] if len(names) > 1 else []) + [plain(step.title)]),
                fontsize="small",
            )
    found = {
        word: handle
        for axes in every.ravel()
        for handle, word in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    every[0, -1].legend(
        found.values(),
        found.keys(),
        loc="upper left",
        bbox_to_anchor=(1.0, 1.0),
        fontsize="x-small",
    )
    figure.suptitle(headed(solution), fontsize="medium")


def _front(solution: SolutionData, name: str, closed: Mask, chart: Chart) -> Mask:
    """Which nodes lie on the side of a round body that is in contact; all where contact goes round,
    or is unrolled."""
    if chart.centre is not None:
        return np.ones(len(closed), dtype=bool)
    normal = solution.meshes[solution.sides[name][0]].normal[solution.nodes[name]]
    mean = normal[closed if closed.any() else slice(None)].mean(axis=0)
    return np.asarray((np.linalg.norm(mean) < ROUND) | (normal @ mean >= 0.0))


def _panels(figure: Figure, solution: SolutionData) -> list[tuple[object, str, PairResult]]:
    """One panel an interface, and its fields at the end."""
    pairs = solution.pairs
    figure.set_layout_engine("compressed")  # axes of equal scales leave no room beside them
    figure.set_size_inches(7.0, 0.8 + 3.6 * len(pairs))
    figure.suptitle(headed_end(solution), fontsize="medium")
    every = figure.subplots(len(pairs), 1, squeeze=False)[:, 0]
    return [(axes, *item) for axes, item in zip(every, pairs.items(), strict=True)]


def _shade_traction(
    axes: Axes, solution: SolutionData, name: str, values: Array, what: str
) -> None:
    """Shade a traction up to what it is away from corners where it has no bound."""
    shown = shown_range(solution, name, [values])
    _shade(axes, solution, name, values, what, None if shown is None else max(map(abs, shown)))


def _shade(
    axes: Axes,
    solution: SolutionData,
    name: str,
    values: Array,
    what: str,
    top: float | None = None,
) -> None:
    """Panels of an interface, see `Chart`, in bands up to `top` of what nodal values (m,)
    interpolate."""
    from matplotlib.collections import LineCollection
    from matplotlib.tri import Triangulation

    pair = solution.pairs[name]
    mesh = as_surface(solution.meshes[solution.sides[name][0]])
    nodes = solution.nodes[name]
    chart, closed, known = Chart.of(solution, name), pair.state != OPEN, np.isfinite(values)
    front = _front(solution, name, closed, chart)
    whole = np.setdiff1d(mesh.element[nodes[front & known]], mesh.element[nodes[~known]])
    places, triangles, rims = small_triangles(
        mesh, TRIANGLES, whole if len(whole) else np.unique(mesh.element[nodes])
    )
    nodal = scattered(np.where(known, values, 0.0), nodes, mesh.n_nodes)
    shown = nodal[nodes][
        _window(axes, chart.at(pair.x), closed, front, chart) & (known | (len(whole) == 0))
    ]
    colours = band_colours(shown, top)
    # between the nodes a polynomial passes what it has at them
    between = np.clip(mesh.basis_at(places.element, places.place) @ nodal, shown.min(), shown.max())
    x = chart.at(mesh.at(places.element, places.place)[0], places.element)
    axes.tricontourf(
        Triangulation(*x.T, triangles),
        between,
        levels=colours.norm.boundaries,
        norm=colours.norm,
        cmap=colours.cmap,
        extend="both",
    )
    axes.add_collection(
        LineCollection(x[rims], colors="w", linewidths=0.3, alpha=0.5),
        autolim=axes.get_autoscale_on(),
    )
    axes.autoscale_view()
    axes.set_title(f"{along(solution, name)}: {what}", fontsize="small")
    axes.figure.colorbar(
        colours,
        ax=axes,
        shrink=0.75,
        spacing="proportional",
        extend=beyond(between, colours.norm.vmin, colours.norm.vmax),
    )


def _window(axes: Axes, x: Array, closed: Mask, front: Mask, chart: Chart) -> Mask:
    """Name the axes and choose what they show of nodes at places (m, 2), and which these are: all
    in front, or along an axis on which the face is much larger those in contact and some beside
    them."""
    low, high = x.min(axis=0), x.max(axis=0)
    least, most = x[closed].min(axis=0, initial=np.inf), x[closed].max(axis=0, initial=-np.inf)
    small, shown = most - least < SMALL * (high - low), front.copy()
    # from the contact's box: one beside another side of it is not in the picture
    away = np.maximum(least - x, x - most)[:, small].max(axis=1, initial=0.0)
    nearest = away[front & ~closed & (away > 0.0)].min(initial=np.inf)
    for k in np.flatnonzero(small & closed.any()):
        margin = max(MARGIN * (most - least)[k], NEXT * nearest)
        low[k], high[k] = max(low[k], least[k] - margin), min(high[k], most[k] + margin)
        shown &= (x[:, k] >= low[k]) & (x[:, k] <= high[k])
        axes.set(**{"xy"[k] + "lim": (low[k], high[k])})
    size = high - low
    alike = chart.centre is None and size.max() < LONG * size.min()
    axes.set(xlabel=chart.names[0], ylabel=chart.names[1], aspect="equal" if alike else "auto")
    axes.locator_params(nbins=5)
    return shown


def _arrows(
    axes: Axes, solution: SolutionData, name: str, components: Array, unit: str | None
) -> None:
    """Vectors of tangential components with the length of one of them, and the nodes that stick and
    slip."""
    chart = Chart.of(solution, name)
    pair = solution.pairs[name]
    x = chart.at(pair.x)
    vectors = chart.vectors(pair.x, np.einsum("mt,mtc->mc", components, pair.tangent))
    some = np.flatnonzero(np.any(vectors != 0.0, axis=1))
    some = some[:: max(1, len(some) // ARROWS)]
    if len(some):
        # a dark edge, so that they are seen on every shade
        axes.quiver(
            *x[some].T, *vectors[some].T, color="w", width=0.0035, edgecolor="0.1", linewidth=0.4
        )
        longest = f"longest {np.linalg.norm(vectors[some], axis=1).max():.3g} {plain(unit or '')}"
        axes.plot([], [], ls="", marker=r"$\rightarrow$", color="0.1", ms=10.0, label=longest)
    closed = {STICK: pair.state == STICK, SLIP: (pair.state == SLIP) & (pair.bound > 0.0)}
    marked = {state: rows for state, rows in closed.items() if rows.any()}
    for state, rows in marked.items():
        name, colour, marker = STATES[state]
        axes.plot(*x[rows].T, marker, color=colour, mec="w", mew=0.4, ms=3.0, label=name)
    if len(some) or marked:
        legend_below(axes, 3)
