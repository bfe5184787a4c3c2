"""The lines of a verdict on a load step: resultants, contact, slip and energy by interface."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...contact.friction_law import lengths
from ...geometry.rotation import Axial
from ...runtime.terminal import printable
from ..records import PairResult, StepResult, WearHistory
from .text import vector, wrapped

FEW = 4
"""Closed nodes along each direction of an interface up to which its pressure is not resolved."""
CYCLES = 5
"""Of those that were computed, how many the verdict shows."""
COARSE = 0.01
"""Error of the energy dissipated, over it, that the verdict shows."""


def step_lines(increments: list[StepResult]) -> list[str]:
    """Of a step, by its increments: how far it was reached, and interfaces and obstacles where the
    last solution is.

    Of an increment that failed no numbers are shown: they solve nothing.
    """
    last = increments[-1]
    head = f"  step {last.step} ({printable(last.name)})" + (
        f", cycle {last.cycle}" if last.cycle else ""
    )
    way = "reached" if last.status == "converged" else "failed at"
    reached = (
        "" if (last.load_factor, way) == (1.0, "reached") else f", {way} {last.load_factor:.4g}"
    )
    iterations, count = sum(step.iterations for step in increments), len(increments)
    counts = (
        f"{n} {name}{'s' if n > 1 else ''}"
        for n, name in ((count, "increment"), (iterations, "iteration"))
    )
    lines = [f"{head}{reached}: {', '.join(counts)}"]
    solved = [step for step in increments if step.status == "converged"]
    if not solved:
        return lines
    last = solved[-1]
    if len(solved) < len(increments):
        lines.append(f"    at {last.load_factor:.4g}, the last solution:")
    for name, pair in last.pairs.items():
        every = [step.pairs[name] for step in solved]
        lines += _pair(
            name,
            pair,
            sum(one.dissipated for one in every),
            sum(one.dissipated_error for one in every),
        )
    reach = max(map(_reach, last.pairs.values()), default=0.0)
    for name, obstacle in last.obstacles.items():
        lines += wrapped(
            f"    {printable(name)}: ",
            [
                f"moved {vector(obstacle.displacement)}",
                f"turned {vector(obstacle.rotation)}",
                f"held by {vector(_clean(obstacle.force))}",
                f"moment {vector(_clean(obstacle.moment, reach))}",
            ],
        )
    return lines


def wear_lines(wear: WearHistory, pairs: dict[str, PairResult]) -> list[str]:
    """Worn volume and depth, and the largest pressure, of each interface that wears after some of
    the cycles."""
    lines, last, cycles = list[str](), len(wear.cycle) - 1, int(wear.cycle[-1])
    for name, depth in wear.depth.items():
        over = (
            f"{cycles} cycles, {last} jump{'s' if last != 1 else ''}" if cycles > 1 else "1 cycle"
        )
        lines.append(f"  wear of {printable(name)} over {over}:")
        volume, pressure = depth @ pairs[name].weight, wear.pressure[name]
        for k in np.unique(np.linspace(0, last, CYCLES).round().astype(int)):
            lines.append(
                f"    cycle {wear.cycle[k]}: volume {volume[k]:.6g}, depth "
                f"{depth[k].max(initial=0.0):.4g}, "
                f"max p {pressure[k].max(initial=0.0):.6g}"
            )
    return lines


def _pair(name: str, pair: PairResult, dissipated: float, error: float) -> list[str]:
    """Resultants, what is closed and slips, defects of the inequalities, and energy."""
    closed = pair.state != 2
    p, total = pair.pressure, float(pair.weight.sum())
    # of motions that are round-off of where things are, and the energy of them, nothing is shown
    least = 1e-15 * float(np.abs(pair.x).max(initial=0.0))
    slip = float(lengths(pair.slip[closed]).max(initial=0.0))
    spent = dissipated if dissipated > least * float(pair.weight @ np.abs(p)) else 0.0
    items = [
        f"force {vector(_clean(pair.force))}",
        f"moment {vector(_clean(pair.moment, _reach(pair)))}",
        *_primary(pair),
        f"closed {pair.area:.6g} of {total:.6g}",
        f"slipping {float(pair.weight[pair.state == 1].sum()):.6g}",
        f"max p {float(p.max(initial=0.0)):.6g}",
        f"max |w| {slip if slip > least else 0.0:.4g}",
        f"dissipated {spent:.6g}"
        + (f" (error at most {error:.2g})" if spent > 0.0 and error > COARSE * spent else ""),
    ]
    if pair.wear is not None:
        items.append(f"worn volume {pair.worn_volume.sum():.6g}, depth {pair.worn_depth:.4g}")
    faced, count = np.isfinite(pair.gap), np.count_nonzero(closed)
    if 0 < count < min(len(p), FEW ** pair.tangent.shape[1] + 1):
        items.append(
            f"ONLY {count} of {len(p)} nodes closed: p is not resolved, refine the mesh there"
        )
    if pair.tension_share > 0.0:
        items.append(
            f"IN TENSION on {100.0 * pair.tension_share:.3g} % of it, up to {-float(p.min()):.6g}"
        )
    penetration = 0.0 - float(np.minimum(pair.gap[faced], 0.0).min(initial=0.0))
    excess = float(np.maximum(lengths(pair.sigma_t) - pair.bound, 0.0).max(initial=0.0))
    least += 1e-9 * float(np.abs(pair.slip).max(initial=0.0))
    if penetration > least or excess > 1e-9 * float(np.abs(p).max(initial=0.0)):
        items.append(f"penetration {penetration:.1e}, |q| over its bound by {excess:.1e}")
    return wrapped(f"    {printable(name)}: ", items)


def _primary(pair: PairResult) -> list[str]:
    """What the other body feels, and how far that is from action and reaction."""
    if pair.force_primary is None or pair.moment_primary is None:
        return []
    return [
        f"on the primary {vector(_clean(pair.force_primary))}",
        f"moment {vector(_clean(pair.moment_primary, _reach(pair)))}",
        f"imbalance {pair.imbalance:.1e}",
    ]


def _clean(force: Axial, size: float = 0.0) -> Array:
    """Round-off of a component that vanishes, next to the others or a size, is not shown."""
    return np.asarray(
        np.where(np.abs(force) < 1e-12 * max(size, np.abs(force).max(initial=0.0)), 0.0, force)
        + 0.0
    )


def _reach(pair: PairResult) -> float:
    """The moment that the forces of an interface have where they lie farthest out."""
    return float(pair.weight @ np.abs(pair.pressure)) * float(np.abs(pair.x).max(initial=0.0))
