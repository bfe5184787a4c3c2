"""The lines of a verdict on pairs, obstacles, supports and wear."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...contact.friction_law import lengths
from ...contact.law_protocol import OPEN
from ...model.problem import ONE_BODY
from ...model.summary import value_text
from ...round_off import WRITTEN
from ...runtime.terminal import printable
from ..data import SolutionData
from ..number import DISPLACEMENT, ENERGY, Number
from ..numbers import maximum
from ..records import PairResult, StepResult, WearHistory
from .text import place_of, table, told, unit_of, wrapped
from .zones import zones_of

FEW = 4
"""Closed nodes along each direction of an interface up to which its pressure is not resolved."""
SHOWN = 6
"""Steps that a table shows: the first ones and the last."""
AXIAL = {"force": "axial force", "moment": "torque"}
"""What a force and a moment of a body of revolution are."""


class Teller:
    """Tells the numbers of a solution.

    Attributes
    ----------
    solution : SolutionData
    numbers : dict of Number by key
    some : bool
        Whether the error of any number is known.
    axial : bool
        Whether the bodies are those of revolution, whose vectors are told along the axis.
    size : float
        Largest coordinate [length].
    verbose : bool
        Whether all numbers are shown.
    ends : list of StepResult
        The last solutions of the steps.
    """

    def __init__(self, solution: SolutionData, verbose: bool) -> None:
        self.solution, self.verbose = solution, verbose
        self.numbers = {number.key: number for number in solution.numbers}
        self.some = any(0.0 < number.error < np.inf for number in self.numbers.values())
        self.axial = solution.problem.symmetry == "axial"
        self.size = max(float(np.abs(mesh.x).max()) for mesh in solution.meshes.values())
        self.power = next(iter(solution.meshes.values())).weight_power
        self.ends = list({(step.step, step.cycle): step for step in solution.steps}.values())

    def unit(self, kind: str) -> str:
        """The user's name of a unit."""
        return unit_of(kind, self.solution.problem.units, self.power)

    def number(self, number: Number, unit: bool = True, place: bool = True) -> str:
        """With its unit, and where it is."""
        if self.axial and number.place is None and len(number.value) > 1 and not self.verbose:
            number = replace(number, value=number.value[1:2])
        text = told(number, self.unit(number.unit) if unit else "", self.some)
        # what is not resolved has no place
        located = number.place is not None and number.size > 0.0 and not number.size <= number.error
        if number.place is None or not place or not (located or np.isinf(number.error)):
            return text
        return f"{text} at {place_of(number.place, self.size)}"

    def get(self, step: StepResult, of: str, name: str) -> Number | None:
        """A number at the end of a step."""
        return self.numbers.get((name, of, step.step, step.cycle))

    def is_told(self, step: StepResult, of: str, names: Mapping[str, str]) -> bool:
        """Whether one of some numbers is not 0."""
        numbers = [self.get(step, of, name) for name in names]
        return any(number is not None and number.size > 0.0 for number in numbers)

    def items(self, step: StepResult, of: str, names: Mapping[str, str]) -> Iterator[str]:
        """Those of some numbers that there are, by their names, each with the words before it."""
        for name, words in names.items():
            number = self.get(step, of, name)
            if number is not None:
                yield f"{words} {self.number(number)}"

    def share(self, number: Number, whole: float) -> str:
        """An area in per cent of another one."""
        parts = 100.0 * number.value / whole, 100.0 * number.error / whole
        share = replace(number, value=parts[0], error=parts[1], scale=0.0)
        if share.error >= max(share.size, 100.0 - share.size):
            return "?"
        exact = share.error < 0.05 and abs(parts[0][0] - round(float(parts[0][0]))) < 0.05
        return f"{parts[0][0]:.0f} %" if exact else told(share, "%", self.some)

    def step_words(self) -> str:
        """Which step the last one is, where there are several."""
        last = self.ends[-1] if self.ends else None
        return f" after {_label(last)}" if last and len(self.ends) > 1 else ""


def _label(step: StepResult) -> str:
    cycle = f", cycle {step.cycle}" if step.cycle else ""
    return f"step {step.step} ({printable(step.name)}){cycle}"


def progress_lines(tell: Teller) -> list[str]:
    """How far each step that ended early was reached; all steps, with what they took, in full."""
    lines, steps = list[str](), dict[tuple[int, int], list[StepResult]]()
    for step in tell.solution.tried:
        steps.setdefault((step.step, step.cycle), []).append(step)
    for increments in steps.values():
        last, solved = increments[-1], [s for s in increments if s.status == "converged"]
        way = "reached" if last.status == "converged" else "failed at"
        whole = (last.load_factor, way) == (1.0, "reached")
        if whole and not tell.verbose:
            continue
        items = [f"{way} {last.load_factor:.4g}"]
        if tell.verbose:
            count = sum(step.iterations for step in increments)
            items += [f"{len(increments)} increments", f"{count} iterations"]
        if not whole and solved:
            items.append(f"numbers are of {solved[-1].load_factor:.4g}, the last solution")
        lines += wrapped(f"  {_label(last)}: ", items)
    return lines


def pair_lines(tell: Teller) -> list[str]:
    """Of each interface its law, and what it does: in items after the only step, else in a table
    of steps."""
    lines, ends = list[str](), tell.ends
    shown = ends if len(ends) <= SHOWN else [*ends[: SHOWN - 1], ends[-1]]
    for posed in tell.solution.problem.interfaces:
        if not ends or posed.name not in ends[-1].pairs:
            continue
        lines += wrapped(f"  {printable(posed.name)}: ", [*_sides(tell, posed), *law_words(posed)])
        several = len(ends) > 1 and posed.law.normal != "bonded"
        if several:
            lines += _table(tell, posed, shown)
        for step in shown if tell.verbose else ends[-1:]:
            items = [] if several and not tell.verbose else [*_pair(tell, step, posed)]
            items += _defects(step.pairs[posed.name], tell, posed.law)
            head = f"{_label(step)}: " if len(ends) > 1 and tell.verbose else ""
            lines += wrapped("    ", [head + items[0], *items[1:]]) if items else []
    left = len(ends) - len(shown)
    return [*lines, *[f"  ... {left} more steps: petcontact show FILE --json"] * bool(left)]


def _sides(tell: Teller, posed: Any) -> Iterator[str]:
    """What acts on what, where names of bodies say it."""
    problem = tell.solution.problem
    bodies = [printable(each.name) for each in problem.body]
    names = ["" if name == ONE_BODY else f"{name}." for name in bodies]
    if posed.primary is not None or posed.obstacle is not None:
        other = (
            f"{names[posed.primary[0]]}{printable(posed.primary[1])}"
            if posed.primary is not None
            else printable(problem.obstacle[posed.obstacle].name)
        )
        yield f"{other} on {names[posed.body]}{printable(posed.part)}"


def law_words(posed: Any) -> list[str]:
    """The items of a pair's law in words."""
    law = posed.law
    if posed.periodic:
        return ["periodic"]
    if law.normal == "bonded":
        return ["bonded"]
    coefficient, bound = law.friction_coefficient, law.friction_bound
    given = {
        "friction coefficient": coefficient,
        "friction bound": bound,
        "wear coefficient": law.wear_coefficient,
    }
    named = [
        f"{name} {value if isinstance(value, float) else value_text(value)}"
        for name, value in given.items()
        if value not in (None, 0.0)
    ]
    friction = [] if _rubs(law) else ["without friction"]
    return [f"{law.normal} contact", *friction, *map(printable, named)]


def _rubs(law: Any) -> bool:
    return {law.friction_coefficient, law.friction_bound} - {None, 0.0} != set()


def _force_words(tell: Teller, posed: Any) -> dict[str, str]:
    """Names of the force on the secondary, and of its moment where that says something."""
    body = printable(tell.solution.problem.body[posed.body].name)
    on = "the body" if body == ONE_BODY else body
    if tell.axial:
        return {name: f"{word} on {on}" for name, word in AXIAL.items()}
    return {"force": f"force on {on}"} | ({"moment": "moment"} if tell.verbose else {})


def _table(tell: Teller, posed: Any, steps: Sequence[StepResult]) -> list[str]:
    """A line for each step: force, largest p, what is closed and slips, friction used, energy."""
    columns = dict[str, list[str]]()
    words = (
        AXIAL if tell.axial else {name: name for name in AXIAL if name == "force" or tell.verbose}
    )

    def column(name: str, heading: str) -> None:
        numbers = [tell.get(step, posed.name, name) for step in steps]
        unit = next((tell.unit(number.unit) for number in numbers if number is not None), "")
        if any(number is not None and number.size > 0.0 for number in numbers):
            columns[f"{heading} [{unit}]" if unit else heading] = [
                "" if number is None else tell.number(number, unit=False, place=False)
                for number in numbers
            ]

    cycles = any(step.cycle for step in steps)
    columns["step"] = [
        f"{step.step} {printable(step.name)[:12]}" + f" ({step.cycle})" * cycles for step in steps
    ]
    column("force", words["force"])
    if "moment" in words:
        column("moment", words["moment"])
    column("largest p", "largest p")
    areas = [_shares(tell, step, posed) for step in steps]
    columns["closed"] = [area[0] for area in areas]
    if _rubs(posed.law):
        columns["slips"] = [area[1] for area in areas]
        columns["used"] = [area[2] for area in areas]
        column(ENERGY, "energy")
        column("largest slip", "slip")
    return table(columns)


def _shares(tell: Teller, step: StepResult, posed: Any) -> tuple[str, str, str]:
    """What is closed, what of it slips, and how much of its friction is used."""
    area, slips = (tell.get(step, posed.name, key) for key in ("contact area", "slipping"))
    if area is None or slips is None or not area.size:
        return "0", "", ""
    used = step.pairs[posed.name].friction_used
    # of less friction three digits would show noise
    friction = f"{used:.3g}" if used > 0.005 else ""
    whole = float(step.pairs[posed.name].weight.sum())
    return tell.share(area, whole), tell.share(slips, area.size), friction


def _pair(tell: Teller, step: StepResult, posed: Any) -> Iterator[str]:
    """What a pair does at the end of a step, item by item."""
    pair, name, law = step.pairs[posed.name], posed.name, posed.law
    bilateral = tell.solution.kind == "bilateral"
    yield from tell.items(step, name, _force_words(tell, posed))
    if tell.verbose and pair.force_primary is not None:
        primary = {"force on the primary": "on the primary", "moment on the primary": "moment"}
        yield from tell.items(step, name, primary)
        yield f"imbalance {pair.imbalance:.1e}"
    if tell.is_told(step, name, pressure := {"largest p": "largest p"}):
        yield from tell.items(step, name, pressure)
    if tell.verbose or (bilateral and _rubs(law)):
        yield from tell.items(step, name, {"largest q": "largest q"})
    if law.normal == "bonded" or posed.periodic:
        return
    moved = {"largest slip": "largest |u_t|" if bilateral else "largest slip", ENERGY: ENERGY}
    if bilateral and _rubs(law) and step is tell.solution.last:
        yield from zones_of(tell.solution, posed.part)
    if not bilateral:
        yield from _area(tell, step, posed)
        yield from _gaps(tell, step, name, law)
    elif tell.power > 1 and _rubs(law):
        yield f"slips on {_shares(tell, step, posed)[1]} of it"
    if tell.verbose or (_rubs(law) and tell.is_told(step, name, moved)):
        yield from tell.items(step, name, moved)
    worn = {"worn volume": "worn volume", "worn depth": "largest depth"}
    yield from tell.items(step, name, worn)


def _area(tell: Teller, step: StepResult, posed: Any) -> Iterator[str]:
    """What is closed, and where there is friction the share of it that slips."""
    area = tell.get(step, posed.name, "contact area")
    if area is None:
        return
    what = "contact width" if tell.power == 1 else "contact area"
    whole = float(step.pairs[posed.name].weight.sum())
    yield f"{what} {tell.number(area)} of {whole:.5g}"
    _, slips, used = _shares(tell, step, posed)
    if _rubs(posed.law) and slips:
        yield f"{slips} of it slips"
        yield from [f"|Q|/(mu N) {used}"] * bool(used)


def _gaps(tell: Teller, step: StepResult, name: str, law: Any) -> Iterator[str]:
    """The overlap before any load; in full the first gap, too, and the largest that is left."""
    solution, pair = tell.solution, step.pairs[name]
    mesh, faced = solution.meshes[solution.sides[name][0]], np.isfinite(pair.gap)
    left = maximum(mesh, solution.nodes[name], np.where(faced, pair.gap, 0.0))[0]
    first = solution.provenance.distance.get(name, 0.0) if step.step == 1 else 0.0
    gaps = {"first overlap": -first}
    gaps |= {"first gap": first, "largest gap left": left} if tell.verbose else {}
    for words, value in gaps.items() if law.normal == "unilateral" else ():
        if WRITTEN * tell.size < value < np.inf:
            yield f"{words} {value:.3g} {tell.unit('length')}".rstrip()


def _defects(pair: PairResult, tell: Teller, law: Any) -> Iterator[str]:
    """What a mesh leaves of the conditions of contact, and what an iteration leaves, which the
    residuals tell, too."""
    closed, p = pair.state != OPEN, pair.pressure
    count, faced = np.count_nonzero(closed), np.isfinite(pair.gap)
    if 0 < count < min(len(p), FEW ** pair.tangent.shape[1] + 1):
        yield f"ONLY {count} of {len(p)} nodes closed: p is not resolved, refine the mesh there"
    if pair.tension_share > 0.0:
        most = f"{float(f'{-float(p.min()):.3g}'):g} {tell.unit('stress')}".strip()
        share = f"pulls on {100.0 * pair.tension_share:.3g} % of it: bilateral contact cannot open"
        yield f"tension up to {most}" if law.normal == "bonded" else share
    if tell.verbose:
        penetration = 0.0 - float(np.minimum(pair.gap[faced], 0.0).min(initial=0.0))
        excess = float(np.maximum(lengths(pair.sigma_t) - pair.bound, 0.0).max(initial=0.0))
        yield f"penetration {penetration:.1e}"
        yield f"|q| over its bound by {excess:.1e}"


def reaction_lines(tell: Teller) -> list[str]:
    """How obstacles moved that are free to, what supports and obstacles are held by, what all
    forces leave over, and the largest displacement; after the last step, in full after each."""
    lines, numbers = list[str](), tell.numbers.values()
    for step in tell.ends if tell.verbose else tell.ends[-1:]:
        after = f" after {_label(step)}" if len(tell.ends) > 1 else ""
        for name in step.obstacles:
            moved = [tell.get(step, name, word) for word in ("moved", "turned")]
            items = [
                f"{each.name} {tell.number(each)}"
                for each in moved
                if each is not None and (tell.verbose or each.error != 0.0)
            ]
            lines += wrapped(f"  {printable(name)}{after}: ", items) if items else []
        at = [each for each in numbers if each.key[2:] == (step.step, step.cycle)]
        held = [item for each in at for item in _reaction(tell, each)]
        left = float(step.residuals.get("equilibrium", np.nan))
        if held and np.isfinite(left):
            held.append(f"sum of all forces 0 to {left:.0e} of their sizes")
        lines += wrapped(f"  reactions{after}: ", held) if held else []
    moved = [each for each in numbers if each.name == DISPLACEMENT]
    if moved:
        most = max(moved, key=lambda each: each.size)
        body = "" if most.of == ONE_BODY else f" ({printable(most.of)})"
        body += f" in step {most.step}" * (len(tell.ends) > 1)
        lines += wrapped("  largest displacement: ", [tell.number(most) + body], separator=" ")
    return lines


def _reaction(tell: Teller, number: Number) -> Iterator[str]:
    """A force or a moment by which a part or an obstacle is held, in words."""
    what, on, part = number.name.partition(" on ")
    turns = what == "moment" or number.name == "held by moment"
    if turns and not (tell.verbose or (tell.axial and number.size > 0.0)):
        return
    head = AXIAL["moment"] if tell.axial else "moment"
    if what in AXIAL and on and part != "the primary":
        body = "" if number.of == ONE_BODY else f"{printable(number.of)}."
        yield f"{body}{printable(part)} {f'{head} ' * turns}{tell.number(number)}"
    elif number.name in ("held by", "held by moment"):
        yield f"{printable(number.of)} {f'{head} ' * turns}{tell.number(number)}"


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
