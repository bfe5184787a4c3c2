"""The lines of a verdict on interfaces: a table of steps, or what the only step does."""

from __future__ import annotations

import functools
import itertools
import operator
from collections.abc import Iterator, Sequence

import numpy as np

from ...contact.friction_law import lengths
from ...contact.law_protocol import OPEN
from ...errors import ONE_BODY
from ...fields.boundary.maxima import maximum
from ...given.interface_data import Law, PosedInterface
from ...model.description import value_text
from ...round_off import WRITTEN
from ...runtime.terminal import printable
from ..numbers.number import ENERGY, Number
from ..records import PairResult, StepResult
from .teller import AXIAL, Teller, label
from .text import table, wrapped
from .zone_words import zones_of

FEW = 4
"""Closed nodes along each direction of an interface up to which its pressure is not resolved."""
HEADINGS = {ENERGY: "energy", "largest slip": "slip"}
"""Headings of columns that differ from the names of their numbers."""
SHOWN = 6
"""Steps that a table shows: the first ones and the last."""


def pair_lines(tell: Teller) -> Iterator[str]:
    """Yield the law of each interface and what it does: in items after the only step, else in a
    table of steps."""
    ends = tell.ends
    there = ends[-1].pairs if ends else {}
    shown = ends if len(ends) <= SHOWN else [*ends[: SHOWN - 1], ends[-1]]
    told = shown if tell.verbose else ends[-1:]
    sides = [each for each in tell.solution.posed.interfaces if each.name in there]
    for _, group in itertools.groupby(sides, lambda each: each.group):
        side, *others = group
        if others:
            yield from _several(tell, [side, *others], told)
            continue
        yield from wrapped(f"  {printable(side.name)}: ", [*_sides(tell, side), *law_words(side)])
        several = len(ends) > 1 and side.law.normal != "bonded"
        yield from _table(tell, side, shown) if several else []
        for step in told:
            yield from _items(tell, step, side, in_table=several and not tell.verbose)
    if left := len(ends) - len(shown):
        yield f"  ... {left} more steps: petcontact show FILE --json"


def _several(
    tell: Teller, sides: Sequence[PosedInterface], steps: Sequence[StepResult]
) -> Iterator[str]:
    """Yield the law of a contact of several parts, and a table of what each pair carries."""
    contact = sides[0].group
    yield from wrapped(f"  {printable(contact)}: ", [f"{len(sides)} pairs", *law_words(sides[0])])
    for step in steps:
        yield from [f"    after {label(step)}"] * (len(tell.ends) > 1)
        shares = step.shares_of(contact, axial=tell.axial)
        names = ("force", "largest p", "contact area", "largest slip")
        of_names = [_column(tell, [tell.get(step, s.name, n) for s in sides], n) for n in names]
        columns = {"primary on secondary": list(map(printable, shares))} | of_names[0]
        columns["share"] = [f"{100.0 * share:.4g} %" for share in shares.values()]
        yield from table(functools.reduce(operator.or_, of_names[1:], columns))
        for side in sides:
            if items := list(_defects(step.pairs[side.name], tell, side.law)):
                yield from wrapped(f"    {printable(side.name)}: ", items)


def _items(tell: Teller, step: StepResult, side: PosedInterface, *, in_table: bool) -> list[str]:
    """Lines of items; only what is wrong with a pair that is told in a table."""
    items = [] if in_table else [*_pair(tell, step, side)]
    items += _defects(step.pairs[side.name], tell, side.law)
    if items and len(tell.ends) > 1 and tell.verbose:
        items[0] = f"{label(step)}: {items[0]}"
    return wrapped("    ", items) if items else []


def _sides(tell: Teller, side: PosedInterface) -> Iterator[str]:
    """What acts on what, where names of bodies say it."""
    problem = tell.solution.problem
    bodies = [printable(each.name) for each in problem.body]
    names = ["" if name == ONE_BODY else f"{name}." for name in bodies]
    other = ""
    if side.primary is not None:
        other = f"{names[side.primary[0]]}{printable(side.primary[1])}"
    elif side.obstacle is not None:
        other = printable(problem.obstacle[side.obstacle].name)
    if other:
        yield f"{other} on {names[side.body]}{printable(side.part)}"


def law_words(side: PosedInterface) -> list[str]:
    """The items of a pair's law in words."""
    law = side.law
    if side.periodic:
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
        f"{name} {value_text(value)}"
        for name, value in given.items()
        if value is not None and value.source != 0.0
    ]
    friction = "friction of steps" if side.rubs else "without friction"
    by_steps = not any("friction" in words for words in named)
    return [f"{law.normal} contact", *[friction] * by_steps, *map(printable, named)]


def _force_words(tell: Teller, side: PosedInterface) -> dict[str, str]:
    """Names of the force on the secondary, and of its moment where that says something."""
    body = printable(tell.solution.problem.body[side.body].name)
    on = "the body" if body == ONE_BODY else body
    if tell.axial:
        return {name: f"{word} on {on}" for name, word in AXIAL.items()}
    return {"force": f"force on {on}"} | ({"moment": "moment"} if tell.verbose else {})


def _table(tell: Teller, side: PosedInterface, steps: Sequence[StepResult]) -> list[str]:
    """A line for each step: force, largest p, what is closed and slips, friction used, energy."""
    cycles, rubs = any(step.cycle for step in steps), side.rubs
    areas = [_shares(tell, step, side) for step in steps]
    after = [f" ({step.cycle})" * cycles for step in steps]
    column = functools.partial(_over_steps, tell, side, steps)
    columns = {
        "step": [
            f"{step.step} {printable(step.name)[:12]}{cycle}"
            for step, cycle in zip(steps, after, strict=True)
        ],
        **column("force"),
        **(column("moment") if tell.axial or tell.verbose or not column("force") else {}),
        **column("largest p"),
        "closed": [area[0] for area in areas],
        "slips": [area[1] for area in areas if rubs],
        "used": [area[2] for area in areas if rubs],
        **(column(ENERGY) if rubs else {}),
        **(column("largest slip") if rubs else {}),
    }
    return table({heading: cells for heading, cells in columns.items() if any(cells)})


def _over_steps(
    tell: Teller, side: PosedInterface, steps: Sequence[StepResult], name: str
) -> dict[str, list[str]]:
    """A number after steps, by its heading; nothing where all are 0."""
    return _column(tell, [tell.get(step, side.name, name) for step in steps], name)


def _column(tell: Teller, numbers: Sequence[Number | None], name: str) -> dict[str, list[str]]:
    """Numbers of one name by their heading; nothing where all are 0."""
    known = [number for number in numbers if number is not None]
    heading = AXIAL.get(name, name) if tell.axial else HEADINGS.get(name, name)
    unit = tell.unit(known[0].unit) if known else ""
    cells = [
        "" if number is None else tell.number(number, unit=False, place=False) for number in numbers
    ]
    told = any(number.size > 0.0 for number in known)
    return {f"{heading} [{unit}]" if unit else heading: cells} if told else {}


def _shares(tell: Teller, step: StepResult, side: PosedInterface) -> tuple[str, str, str]:
    """What is closed, what of it slips, and how much of its friction is used."""
    area, slips = (tell.get(step, side.name, key) for key in ("contact area", "slipping"))
    if area is None or slips is None or not area.size:
        return "" if area is None else "0", "", ""
    used = step.pairs[side.name].friction_used
    # of less friction three digits would show noise
    friction = f"{used:.3g}" if used > 0.005 else ""
    whole = float(step.pairs[side.name].weight.sum())
    # all that touches is 100 % of it, however well that is known
    whole_slips = (slips.size, slips.error) == (area.size, area.error)
    slipping = "100 %" if whole_slips else tell.share(slips, area.size)
    return tell.share(area, whole), slipping, friction


def _pair(tell: Teller, step: StepResult, side: PosedInterface) -> Iterator[str]:
    """What a pair does at the end of a step, item by item."""
    pair, name = step.pairs[side.name], side.name
    yield from tell.items(step, name, _force_words(tell, side))
    if tell.verbose and pair.force_primary is not None:
        primary = {"force on the primary": "on the primary", "moment on the primary": "moment"}
        yield from tell.items(step, name, primary)
        yield f"imbalance {pair.imbalance:.1e}"
    most = tell.get(step, name, "largest p")
    if most is not None and most.size > 0.0:
        # nodes nearer to a place without a bound than where stress is told may have more
        larger = float(pair.pressure.max()) > most.size + float(np.nan_to_num(most.error))
        yield f"largest p {'away from corners ' * larger}{tell.number(most)}"
    if side.law.normal == "bonded" or side.periodic:
        yield from tell.items(step, name, {"largest q": "largest q"} if tell.verbose else {})
    elif tell.solution.kind == "bilateral":
        yield from _slides(tell, step, side)
    else:
        yield from _touches(tell, step, side)


def _slides(tell: Teller, step: StepResult, side: PosedInterface) -> Iterator[str]:
    """Shear, zones and slip of bilateral contact."""
    if not (side.rubs or tell.verbose):
        return
    yield from tell.items(step, side.name, {"largest q": "largest q"})
    if tell.power > 1:
        yield f"slips on {_shares(tell, step, side)[1]} of it"
    else:
        yield from zones_of(tell.solution, side.part)
    yield from tell.items(step, side.name, {"largest slip": "largest |u_t|", ENERGY: ENERGY})


def _touches(tell: Teller, step: StepResult, side: PosedInterface) -> Iterator[str]:
    """What is closed and slips, gaps, and wear."""
    name, law = side.name, side.law
    moved = {"largest slip": "largest slip", ENERGY: ENERGY}
    yield from tell.items(step, name, {"largest q": "largest q"} if tell.verbose else {})
    yield from _area(tell, step, side)
    yield from _gaps(tell, step, name, law)
    sizes = [each.size for key in moved if (each := tell.get(step, name, key)) is not None]
    if tell.verbose or (side.rubs and any(sizes)):
        yield from tell.items(step, name, moved)
    worn = {"worn volume": "worn volume", "worn depth": "largest depth"}
    yield from tell.items(step, name, worn)


def _area(tell: Teller, step: StepResult, side: PosedInterface) -> Iterator[str]:
    """What is closed, and where there is friction the share of it that slips."""
    area = tell.get(step, side.name, "contact area")
    if area is None:
        return
    what = "contact width" if tell.power == 1 else "contact area"
    whole = float(step.pairs[side.name].weight.sum())
    full = area.size >= whole * (1.0 - WRITTEN)
    yield f"{what} {tell.number(area)}" + (", all of it" if full else f" of {whole:.5g}")
    _, slips, used = _shares(tell, step, side)
    if side.rubs and slips:
        yield f"what of it slips is {slips}" if slips == "not known" else f"{slips} of it slips"
        yield from [f"friction used {used}"] * bool(used)


def _gaps(tell: Teller, step: StepResult, name: str, law: Law) -> Iterator[str]:
    """The overlap before any load; in full the first gap, too, and the largest that is left."""
    solution, pair = tell.solution, step.pairs[name]
    mesh, faced = solution.meshes[solution.sides[name][0]], np.isfinite(pair.gap)
    left = maximum(mesh, solution.nodes[name], np.where(faced, pair.gap, 0.0))[0]
    first = solution.provenance.distance.get(name, 0.0) if step.step == 1 else 0.0
    gaps = {"first overlap": -first}
    gaps |= {"first gap": first, "largest gap left": left} if tell.verbose else {}
    for words, value in gaps.items():
        if law.normal == "unilateral" and WRITTEN * tell.size < value < np.inf:
            yield f"{words} {value:.3g} {tell.unit('length')}".rstrip()


def _defects(pair: PairResult, tell: Teller, law: Law) -> Iterator[str]:
    """What a mesh leaves of the conditions of contact, and what an iteration leaves, which the
    residuals tell, too."""
    closed, p = pair.state != OPEN, pair.pressure
    count, faced = np.count_nonzero(closed), np.isfinite(pair.gap)
    if 0 < count < min(np.count_nonzero(faced), FEW ** pair.tangent.shape[1] + 1):
        yield f"ONLY {count} of {len(p)} nodes closed: p is not resolved, refine the mesh there"
    if pair.tension_share > 0.0:
        most = f"{float(f'{-float(p.min()):.2g}'):g} {tell.unit('stress')}".strip()
        share = f"about {float(f'{100.0 * pair.tension_share:.2g}'):g} % of it"
        pulls = f"pulls on {share}: bilateral contact cannot open"
        yield f"tension up to about {most}" if law.normal == "bonded" else pulls
    if tell.verbose:
        penetration = 0.0 - float(np.minimum(pair.gap[faced], 0.0).min(initial=0.0))
        excess = float(np.maximum(lengths(pair.sigma_t) - pair.bound, 0.0).max(initial=0.0))
        yield f"penetration {penetration:.1e}"
        yield f"|q| over its bound by {excess:.1e}"
