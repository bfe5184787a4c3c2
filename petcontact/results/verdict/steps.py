"""The lines of a verdict on steps that ended early, on obstacles and supports, and on wear."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...errors import ONE_BODY
from ...round_off import SOLVED
from ...runtime.terminal import printable
from ..numbers.number import DISPLACEMENT, Number
from ..records import StepResult, WearHistory
from .teller import AXIAL, Teller, label
from .text import table, wrapped


def progress_lines(tell: Teller) -> list[str]:
    """How far each step that ended early was reached; all steps, with what they took, in full."""
    steps = dict[tuple[int, int], list[StepResult]]()
    for step in tell.solution.tried:
        steps.setdefault((step.step, step.cycle), []).append(step)
    return [line for increments in steps.values() for line in _progress(tell, increments)]


def _progress(tell: Teller, increments: list[StepResult]) -> list[str]:
    last, solved = increments[-1], [s for s in increments if s.status == "converged"]
    way = "reached" if last.status == "converged" else "failed at"
    whole = (last.load_factor, way) == (1.0, "reached")
    items = [f"{way} {last.load_factor:.4g}"]
    given = tell.solution.posed.steps
    if last.sliding:
        items += [f"there contact {printable(last.sliding)} slips as a whole"]
    elif whole and given and given[last.step - 1].until:
        return wrapped(f"  {label(last)}: ", ["all loads act, no contact slips as a whole"])
    if tell.verbose:
        count = sum(step.iterations for step in increments)
        items += [f"{len(increments)} increments", f"{count} iterations"]
    elif whole:
        return []
    if not whole and solved and not last.sliding:
        items.append(f"numbers are of {solved[-1].load_factor:.4g}, the last solution")
    return wrapped(f"  {label(last)}: ", items)


def reaction_lines(tell: Teller) -> list[str]:
    """How obstacles moved that are free to, what supports and obstacles are held by, what all
    forces leave over, and the largest displacement; after the last step, in full after each."""
    lines = list[str]()
    for step in tell.ends if tell.verbose else tell.ends[-1:]:
        after = f" after {label(step)}" if len(tell.ends) > 1 else ""
        for name in step.obstacles:
            items = [*_moved(tell, step, name)]
            lines += wrapped(f"  {printable(name)}{after}: ", items) if items else []
        at = [each for each in tell.numbers.values() if each.key[2:] == (step.step, step.cycle)]
        held = [item for each in at for item in _reaction(tell, each)]
        held += _left_over(tell, step)
        lines += wrapped(f"  reactions{after}: ", held) if held else []
    return [*lines, *_displaced(tell)]


def _left_over(tell: Teller, step: StepResult) -> list[str]:
    """What all forces add up to, and of what they are."""
    left = float(step.residuals.get("equilibrium", np.nan))
    if not np.isfinite(left):
        return []
    within = f" within {left:.0e}" if left > SOLVED else ""
    return [f"sum of all forces 0{within}", *tell.notes]


def _moved(tell: Teller, step: StepResult, name: str) -> Iterator[str]:
    """How an obstacle has moved; where that is given it is told in full only."""
    for word in ("moved", "turned"):
        number = tell.get(step, name, word)
        if number is not None and (tell.verbose or number.error != 0.0):
            yield f"{word} {tell.number(number)}"


def _displaced(tell: Teller) -> list[str]:
    """The largest displacement of all bodies and steps."""
    sizes = [each for each in tell.numbers.values() if each.name == DISPLACEMENT]
    if not sizes:
        return []
    most = max(sizes, key=lambda each: each.size)
    body = "" if most.of == ONE_BODY else f" ({printable(most.of)})"
    body += f" in step {most.step}" * (len(tell.ends) > 1)
    return wrapped("  largest displacement: ", [tell.number(most) + body], separator=" ")


def _reaction(tell: Teller, number: Number) -> Iterator[str]:
    """A force or a moment by which a part or an obstacle is held, in words."""
    what, on, part = number.name.partition(" on ")
    turns = what == "moment" or number.name == "held by moment"
    if turns and not tell.turns(number):
        return
    head = AXIAL["moment"] if tell.axial else "moment"
    if what in AXIAL and on and part != "the primary":
        body = "" if number.of == ONE_BODY else f"{printable(number.of)}."
        yield f"{body}{printable(part)} {f'{head} ' * turns}{tell.number(number)}"
    elif number.name in ("held by", "held by moment"):
        yield f"{printable(number.of)} {f'{head} ' * turns}{tell.number(number)}"


def wear_lines(tell: Teller, wear: WearHistory) -> Iterator[str]:
    """Worn volume and depth, and the largest pressure, of each interface that wears after some of
    the cycles."""
    last, cycles = len(wear.cycle) - 1, int(wear.cycle[-1])
    shown = np.unique(np.linspace(0, last, 5 if tell.verbose else 3).round().astype(int))
    over = f"{cycles} cycles, {last} jump{'s' if last != 1 else ''}" if cycles > 1 else "1 cycle"
    for name, depth in wear.depth.items():
        yield f"  wear of {printable(name)} over {over}:"
        columns = (
            ("cycle", "", wear.cycle),
            ("volume", tell.unit("volume"), depth @ tell.solution.pairs[name].weight),
            ("depth", tell.unit("length"), depth.max(axis=1, initial=0.0)),
            ("largest p", tell.unit("stress"), wear.pressure[name].max(axis=1, initial=0.0)),
        )
        yield from table(
            {
                f"{word} [{unit}]" if unit else word: [f"{each:.6g}" for each in values[shown]]
                for word, unit, values in columns
            }
        )
