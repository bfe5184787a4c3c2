"""The lines of a verdict on pairs and obstacles at the end of a load step, and on wear."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...contact.friction_law import lengths
from ...contact.law_protocol import OPEN
from ...model.summary import value_text
from ...round_off import WRITTEN
from ...runtime.terminal import printable
from ..data import SolutionData
from ..number import Number
from ..numbers import maximum
from ..records import PairResult, StepResult, WearHistory
from .text import WIDTH, place_of, told, unit_of, wrapped

FEW = 4
"""Closed nodes along each direction of an interface up to which its pressure is not resolved."""
NARROW = WIDTH - 2
"""Of lines that are indented by two more where there are several steps."""


class Teller:
    """Tells the numbers of a solution.

    Attributes
    ----------
    solution : SolutionData
    numbers : dict of Number by key
    some : bool
        Whether the error of any number is known.
    size : float
        Largest coordinate [length].
    verbose : bool
        Whether all numbers are shown.
    """

    def __init__(self, solution: SolutionData, verbose: bool) -> None:
        self.solution, self.verbose = solution, verbose
        self.numbers = {number.key: number for number in solution.numbers}
        self.some = any(np.isfinite(number.error) for number in self.numbers.values())
        self.size = max(float(np.abs(mesh.x).max()) for mesh in solution.meshes.values())

    def number(self, number: Number) -> str:
        """With its unit, and where it is."""
        units, meshes = self.solution.problem.units, self.solution.meshes
        unit = unit_of(number.unit, units, next(iter(meshes.values())).weight_power)
        text = told(number, unit, self.some)
        # what is not resolved has no place
        located = number.place is not None and number.size > 0.0 and not number.size <= number.error
        if number.place is None or not (located or np.isinf(number.error)):
            return text
        return f"{text} at {place_of(number.place, self.size)}"

    def get(self, step: StepResult, of: str, name: str) -> Number | None:
        """A number at the end of a step."""
        return self.numbers.get((name, of, step.step, step.cycle))

    def is_told(self, step: StepResult, of: str, names: dict[str, str]) -> bool:
        """Whether one of some numbers is not 0."""
        numbers = [self.get(step, of, name) for name in names]
        return any(number is not None and number.size > 0.0 for number in numbers)

    def items(self, step: StepResult, of: str, names: dict[str, str]) -> Iterator[str]:
        """Those of some numbers that there are, by their names, each with the words before it."""
        for name, words in names.items():
            number = self.get(step, of, name)
            if number is not None:
                yield f"{words} {self.number(number)}"


def step_lines(tell: Teller, increments: list[StepResult], laws: bool) -> list[str]:
    """Of a step, by its increments: how far it was reached, and pairs, with their `laws`, and
    obstacles where the last solution is.

    Of an increment that failed no numbers are shown: they solve nothing.
    """
    last = increments[-1]
    head = f"  step {last.step} ({printable(last.name)})" + (
        f", cycle {last.cycle}" if last.cycle else ""
    )
    way = "reached" if last.status == "converged" else "failed at"
    whole = (last.load_factor, way) == (1.0, "reached")
    reached = "" if whole else f", {way} {last.load_factor:.4g}"
    iterations, count = sum(step.iterations for step in increments), len(increments)
    counts = ", ".join(
        f"{n} {name}{'s' if n > 1 else ''}"
        for n, name in ((count, "increment"), (iterations, "iteration"))
    )
    single = len(tell.solution.problem.step) < 2 and whole and count == 1 and not tell.verbose
    lines = [] if single else [f"{head}{reached}: {counts}"]
    solved = [step for step in increments if step.status == "converged"]
    if not solved:
        return lines
    if len(solved) < len(increments):
        lines.append(f"    at {solved[-1].load_factor:.4g}, the last solution:")
    texts = [*_pairs(tell, solved[-1], laws), *_obstacles(tell, solved[-1])]
    return [*lines, *(line if single else f"  {line}" for line in texts)]


def _pairs(tell: Teller, step: StepResult, laws: bool) -> Iterator[str]:
    for posed in tell.solution.problem.interfaces:
        if posed.name not in step.pairs:
            continue
        pair = step.pairs[posed.name]
        head = f"  {printable(posed.name)}: "
        yield from wrapped(head, law_words(posed) if laws else [], width=NARROW)
        for items in (*_pair(tell, step, posed.name, posed.law), _defects(pair, tell.verbose)):
            if items:
                yield from wrapped("    ", items, width=NARROW)


def law_words(posed: Any) -> list[str]:
    """The items of a pair's law in words."""
    law = posed.law
    if posed.periodic:
        return ["periodic"]
    if law.normal == "bonded":
        return ["bonded"]
    given = {
        "friction coefficient": law.friction_coefficient,
        "friction bound": law.friction_bound,
        "wear coefficient": law.wear_coefficient,
    }
    named = [
        f"{name} {value_text(datum) if datum.varies else datum}"
        for name, datum in given.items()
        if datum is not None
    ]
    friction = [] if law.has_friction else ["without friction"]
    return [f"{law.normal} contact", *friction, *map(printable, named)]


def _pair(tell: Teller, step: StepResult, name: str, law: Any) -> Iterator[list[str]]:
    """Line by line."""
    pair = step.pairs[name]
    twisted = len(pair.force) > pair.x.shape[1]
    words = ("force", "moment") if tell.verbose or twisted else ("force",)
    yield list(tell.items(step, name, {word: word for word in words}))
    if tell.verbose and pair.force_primary is not None:
        primary = {"force on the primary": "on the primary", "moment on the primary": "moment"}
        yield [*tell.items(step, name, primary), f"imbalance {pair.imbalance:.1e}"]
    bonded, pressure = law.normal == "bonded", {"largest p": "largest p"}
    pulls = bonded and not tell.is_told(step, name, pressure)  # all over
    shear = {"largest q": "largest q"} if tell.verbose or bonded else {}
    yield list(tell.items(step, name, shear if pulls else pressure | shear))
    slides = law.has_friction
    yield [*_area(tell, step, name, slides), *_gaps(tell, step, name, law)]
    if tell.verbose or (slides and tell.is_told(step, name, MOVED)):
        yield list(tell.items(step, name, MOVED))
    yield list(
        tell.items(step, name, {"worn volume": "worn volume", "worn depth": "largest depth"})
    )


def _area(tell: Teller, step: StepResult, name: str, slides: bool) -> Iterator[str]:
    """What is closed, and where there is friction the share of it that slips."""
    area, slips = (tell.get(step, name, key) for key in ("contact area", "slipping"))
    if area is None or slips is None:
        return
    power = tell.solution.meshes[tell.solution.sides[name][0]].weight_power
    what = "contact width" if power == 1 else "contact area"
    yield f"{what} {tell.number(area)} of {float(step.pairs[name].weight.sum()):.5g}"
    if slides and area.size > 0.0:
        share = 100.0 * slips.size / area.size
        part = {0.0: "nothing", 100.0: "all"}.get(share, f"{share:.3g} %")
        resolved = slips.size == 0.0 or not slips.error >= slips.size
        yield f"{part} of it slips" if resolved else "what slips is not resolved"
        # of less friction three digits would show noise
        if (used := step.pairs[name].friction_used) > 0.005:
            yield f"|Q|/(mu N) {used:.3g}"


def _gaps(tell: Teller, step: StepResult, name: str, law: Any) -> Iterator[str]:
    """The smallest gap or overlap before any load, and the largest gap that is left."""
    solution, pair = tell.solution, step.pairs[name]
    mesh, faced = solution.meshes[solution.sides[name][0]], np.isfinite(pair.gap)
    left = maximum(mesh, solution.nodes[name], np.where(faced, pair.gap, 0.0))[0]
    first = solution.provenance.distance.get(name, 0.0) if step.step == 1 else 0.0
    unit = unit_of("length", solution.problem.units, 1)
    gaps = {"first gap": first, "first overlap": -first, "largest gap left": left}
    for words, value in gaps.items() if law.normal == "unilateral" else ():
        if WRITTEN * tell.size < value < np.inf:
            yield f"{words} {value:.3g} {unit}".rstrip()


MOVED = {"largest slip": "largest slip", "dissipated energy": "dissipated energy"}
OBSTACLE = {"moved": "moved", "turned": "turned", "held by": "held by", "held by moment": "moment"}
"""Numbers of an obstacle, and the words before them."""


def _defects(pair: PairResult, verbose: bool) -> list[str]:
    """What a mesh leaves of the conditions of contact, and what an iteration leaves, which the
    residuals tell, too."""
    closed, p, items = pair.state != OPEN, pair.pressure, list[str]()
    count, faced = np.count_nonzero(closed), np.isfinite(pair.gap)
    if 0 < count < min(len(p), FEW ** pair.tangent.shape[1] + 1):
        items.append(
            f"ONLY {count} of {len(p)} nodes closed: p is not resolved, refine the mesh there"
        )
    if pair.tension_share > 0.0:
        items.append(
            f"PULLS on {100.0 * pair.tension_share:.3g} % of it, by up to {-float(p.min()):.3g}"
        )
    if verbose:
        penetration = 0.0 - float(np.minimum(pair.gap[faced], 0.0).min(initial=0.0))
        excess = float(np.maximum(lengths(pair.sigma_t) - pair.bound, 0.0).max(initial=0.0))
        items.append(f"penetration {penetration:.1e}, |q| over its bound by {excess:.1e}")
    return items


def _obstacles(tell: Teller, step: StepResult) -> Iterator[str]:
    for name in step.obstacles:
        # without numbers, as a signal leaves them, there is nothing to tell
        if items := list(tell.items(step, name, OBSTACLE)):
            yield from wrapped(f"  {printable(name)}: ", items, width=NARROW)


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
        # five of the cycles that were computed
        for k in np.unique(np.linspace(0, last, 5).round().astype(int)):
            lines.append(
                f"    cycle {wear.cycle[k]}: volume {volume[k]:.6g}, depth "
                f"{depth[k].max(initial=0.0):.4g}, "
                f"max p {pressure[k].max(initial=0.0):.6g}"
            )
    return lines
