"""Curves of a solution of any dimension: how the method converged, and the way of forces and energy
over the increments."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, shown
from ...contact.law_protocol import OPEN
from ...round_off import ROUNDED, SOLVED
from ...runtime.figure_style import label, legend_below, plain, wrapped
from ...untyped import Axes, Figure
from ..data import SolutionData
from ..records import PairResult, StepResult, step_ends

CURVES = 5
"""Step ends drawn into one panel at most."""


def headed(solution: SolutionData, what: str = "") -> str:
    """The title of the problem, and what is shown of it; below it what is no result, or how far
    the load went."""
    text = wrapped(": ".join(filter(None, (solution.problem.title, what))))
    return "\n".join(filter(None, (text, plain(_shortfall(solution)))))


def _shortfall(solution: SolutionData) -> str:
    """What a solution lacks. Increments before one that failed are solutions under their loads."""
    if solution.converged:
        return ""
    last = solution.last
    if solution.failed is None or last.status != "converged":
        return f"{solution.status}: no result"
    return f"solved up to load factor {last.load_factor:.3g} of step {last.title!r}, not beyond"


def headed_end(solution: SolutionData) -> str:
    """Return the title of a picture of the end, with the last step where there are several
    increments."""
    return headed(solution, solution.last.name if len(solution.tried) > 1 else "")


def shown_ends(solution: SolutionData) -> list[StepResult]:
    """The ends of the steps, the first ones and the last where there are many."""
    ends = step_ends(solution.steps or solution.tried)
    return ends if len(ends) <= CURVES else [*ends[: CURVES - 1], ends[-1]]


def along(solution: SolutionData, name: str) -> str:
    """The part on which an interface lies, with its body where there are several, and its name
    where these share a part."""
    side = solution.sides[name]
    part = plain(".".join(side) if len(solution.meshes) > 1 else side[1])
    return part if [*solution.sides.values()].count(side) == 1 else f"{plain(name)}, {part}"


def draw_history(figure: Figure, solution: SolutionData) -> None:
    """How the method converged in the last increment: residuals, and what it adapts, ρ_k or the
    active sets."""
    history = solution.last.history
    k = np.arange(1, len(history) + 1)
    left, right = figure.subplots(1, 2)
    # a row holds the residual of the iterate that its step starts from: the last iterate's comes
    # after
    residual = np.array([*history.residual, solution.last.residual])
    largest = float(np.nanmax(residual, initial=0.0)) or 1.0
    # a logarithmic axis has no place for round-off, nor for a zero
    scaled = np.where(residual > ROUNDED * largest, residual / largest, np.nan)
    left.semilogy(np.arange(len(residual)), scaled, marker=".", label=r"$\|R_\rho\|$ / largest")
    if np.isnan(scaled[-1:]).any():
        left.plot([], [], ls="", label=f"round-off from iteration {_first_nan(scaled)} on")
    newton = np.array(history.exchanged, dtype=float)
    if len(newton):
        k = k[-len(newton) :]
        right.plot(k, newton, marker="o", label="nodes on the wrong side")
        right.set(title="active sets", ylim=(0.0, 1.05 * max(newton.max(), 1.0)))
    else:
        left.semilogy(k, _positive(history.change), label="relative change")
        left.axhline(
            solution.problem.method.tolerance, color="0.5", lw=0.8, ls=":", label="tolerance"
        )
        right.semilogy(k, _positive(history.rho), label=r"$\rho_k$")
        if np.isfinite(_positive(history.w)).any():
            right.semilogy(k, _positive(history.w), ".", ms=4, label=r"$w_k$")
        right.set_title(label("Robin parameter", solution.problem.units.stiffness))
    left.set_title(
        "convergence" if len(solution.tried) == 1 else "convergence of the last increment"
    )
    for axes in (left, right):
        axes.set_xlabel("iteration")
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.minorticks_off()
        axes.grid(alpha=0.3, lw=0.5)
        legend_below(axes, 3)


def _first_nan(values: Array) -> int:
    """The first of the last run of NaN."""
    finite = np.flatnonzero(~np.isnan(values))
    return int(finite[-1]) + 1 if len(finite) else 0


def draw_wear(figure: Figure, solution: SolutionData) -> None:
    """Worn volume and depth, and the largest pressure, over the cycles; over the increments where
    there are none."""
    left, right = figure.subplots(
        1, 2, gridspec_kw={"wspace": 0.1}
    )  # the label of the depth is the left one's
    units, table = solution.problem.units, solution.wear
    deep, pressed = left.twinx(), []
    for number, (name, last) in enumerate(
        (name, pair) for name, pair in solution.pairs.items() if pair.wear is not None
    ):
        if table is not None and len(table.cycle) > 1:
            abscissa, depth, pressure = table.cycle, table.depth[name], table.pressure[name]
        else:
            pairs = [step.pairs[name] for step in solution.steps]
            abscissa = np.arange(1, len(pairs) + 1)
            depth = np.array(
                [
                    np.zeros(len(last.x)) if pair.wear is None else pair.wear.sum(axis=1)
                    for pair in pairs
                ]
            )
            pressure = np.array([pair.pressure for pair in pairs])
        colour = f"C{number}"
        left.plot(
            abscissa,
            depth @ last.weight,
            ".-",
            color=colour,
            lw=1.2,
            ms=4,
            label=f"{plain(name)}: volume",
        )
        deep.plot(abscissa, depth.max(axis=1, initial=0.0), "--", color=colour, lw=1.0)
        left.plot([], [], "--", color=colour, lw=1.0, label=f"{plain(name)}: depth")
        right.plot(abscissa, pressure.max(axis=1, initial=0.0), ".-", color=colour, lw=1.2, ms=4)
        pressed.append(pressure.max(initial=0.0))
    what = "increment" if table is None or len(table.cycle) < 2 else "cycle"
    unit = (
        units.length
        and f"{units.length}{'²' if solution.last.pairs[name].x.shape[1] == 2 else '³'}"
    )
    left.set(xlabel=what, ylabel=label("worn volume", unit), title="volume")
    figure.suptitle(headed(solution, "wear"), fontsize="large")
    deep.set_ylabel(label("largest depth (dashed)", units.length))
    right.set(
        xlabel=what,
        title=label("largest pressure", units.stress),
        ylim=(0.0, 1.05 * max(pressed) or None),
    )
    legend_below(left, 2)


def _positive(values: object) -> Array:
    array = np.array(values, dtype=float)
    return np.where(array > 0.0, array, np.nan)


def returns(solution: SolutionData) -> bool:
    """Whether some interface slips forth and back, so that force over slip is a loop."""
    moved = largest_motion(solution)
    for name in solution.nodes:
        slip = mean_motion([step.pairs[name] for step in solution.steps])[0]
        ways = np.diff(rounded_away(slip, moved), prepend=0.0)
        if ways.max() > SOLVED * moved and ways.min() < -SOLVED * moved:
            return True
    return False


def largest_motion(solution: SolutionData) -> float:
    """|u| of all nodes and increments, component by component."""
    return max(
        (float(np.abs(body.u).max()) for step in solution.steps for body in step.bodies.values()),
        default=0.0,
    )


def draw_hysteresis(figure: Figure, solution: SolutionData) -> None:
    """Tangential force over mean slip of each interface (a loop where loads are cyclic), and the
    energy dissipated."""
    left, right = figure.subplots(1, 2)
    moved = largest_motion(solution)
    for number, name in enumerate(solution.nodes):
        pairs = [step.pairs[name] for step in solution.steps]
        slip, force = mean_motion(pairs)
        slip = rounded_away(slip, moved)
        left.plot([0.0, *slip], [0.0, *force], ".-", color=f"C{number}", lw=1.2, ms=4, label=name)
        carried = max(float(pair.weight @ np.abs(pair.pressure)) for pair in pairs)
        energy = rounded_away(np.cumsum([pair.dissipated for pair in pairs]), carried * moved)
        right.plot(np.arange(1, len(pairs) + 1), energy, ".-", color=f"C{number}", lw=1.2, ms=4)
    units, power = solution.problem.units, next(iter(solution.meshes.values())).weight_power
    way = (
        ""
        if all(pair.slip.shape[1] == 1 for pair in solution.last.pairs.values())
        else " along the largest slip"
    )
    up = label("tangential force on the primary", units.stress_times(power))
    left.set(xlabel=label(f"mean slip w{way}", units.length), ylabel=up, title="force over slip")
    figure.suptitle(headed(solution, "hysteresis"), fontsize="large")
    right.set(xlabel="increment", title=label("energy dissipated", units.stress_times(power + 1)))
    right.xaxis.get_major_locator().set_params(integer=True)
    left.locator_params(axis="x", nbins=5)
    legend_below(left, 2)


def rounded_away(values: Array, size: float) -> Array:
    """Zeros where values are round-off of what they are differences of."""
    return np.where(np.abs(values) <= SOLVED * size, 0.0, values)


def mean_motion(pairs: list[PairResult]) -> tuple[Array, Array]:
    """Mean slip and tangential force on the primary after each increment, along the way of the
    largest mean slip."""
    weight = pairs[0].weight
    touched = np.any([pair.state != OPEN for pair in pairs], axis=0)
    area = float(weight[touched].sum()) or 1.0
    slip = np.array([weight[touched] @ pair.slip[touched] / area for pair in pairs])
    way = _largest_way(slip)
    return slip @ way, np.array([-weight @ pair.sigma_t for pair in pairs]) @ way


def _largest_way(moved: Array) -> Array:
    """The unit vector (k,) along the largest of some motions (n, k), its largest part positive."""
    way: Array = np.eye(1, moved.shape[1])[0]
    largest = moved[np.argmax(np.linalg.norm(moved, axis=1))]
    if np.any(largest):
        way = largest / np.linalg.norm(largest) * np.sign(largest[np.argmax(np.abs(largest))])
    return way


def moves(solution: SolutionData, key: str) -> list[str]:
    """Names of the obstacles that have a "displacement" or "rotation" after any increment."""
    return [name for name in solution.last.obstacles if _after_all(solution, name, key).any()]


def _after_all(solution: SolutionData, name: str, key: str) -> Array:
    """What an obstacle has after each increment, (n, k)."""
    found = [getattr(step.obstacles[name], key) for step in solution.steps]
    return np.array([np.atleast_1d(values) for values in found])


def _draw_path(axes: Axes, name: str, moved: Array, held: Array) -> None:
    """What holds an obstacle over how it moved, (n, k), both along its largest motion."""
    way = _largest_way(moved)
    path = np.vstack([[0.0, 0.0], np.column_stack([moved @ way, held @ way])])
    word = plain(name) + f" along {shown(way, 2)}" * (len(way) > 1)
    axes.plot(*path.T, ".-", lw=1.2, ms=4, label=word)


def draw_motion(figure: Figure, solution: SolutionData) -> None:
    """What holds each obstacle over how it moved after each increment: the force along its largest
    displacement, and the moment over its rotation."""
    units, power = solution.problem.units, next(iter(solution.meshes.values())).weight_power
    kinds = {
        "displacement": ("force", units.length, units.stress_times(power)),
        "rotation": ("moment", "rad", units.stress_times(power + 1)),
    }
    moving = {key: names for key in kinds if (names := moves(solution, key))}
    every = figure.subplots(1, len(moving), squeeze=False)[0]
    for axes, (key, names) in zip(every, moving.items(), strict=True):
        held, unit, unit_held = kinds[key]
        for name in names:
            _draw_path(axes, name, *(_after_all(solution, name, word) for word in (key, held)))
        axes.set(xlabel=label(key, unit), ylabel=label(held, unit_held))
        axes.locator_params(axis="x", nbins=5)
    figure.suptitle(headed(solution, "obstacles"), fontsize="large")
    legend_below(every[0], 2)
