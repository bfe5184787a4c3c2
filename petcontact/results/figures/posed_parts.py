"""The parts of a problem with what is known on them in words, for its pictures in any
dimension."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

import numpy as np

from ...arrays import Array
from ...errors import in_body
from ...given.conditions import Traction
from ...model.description import condition_text, law_text
from ...record import record
from ...runtime.figure_style import COLOURS, plain, wrapped
from ..data import SolutionData

KINDS = {"free": "0.8", "held": COLOURS[0], "loaded": COLOURS[4], "contact": COLOURS[1]}
"""Colours of parts, by what is known on them."""
WORDS = 30
"""Characters of a line of what stands beside a part: a third of a figure's width."""
SMALL = 6.5
"""Size of the names of parts [points]."""


@record
class LabelledPart:
    """A part of a body, what is known on it, and that in words; the law of a contact
    stands at its first secondary."""

    body: str
    name: str
    kind: str
    text: str
    pair: str = ""

    @property
    def known(self) -> str:
        """The text, after the name of the pair if there is one."""
        return ": ".join(filter(None, [self.pair, self.text]))

    @property
    def words(self) -> str:
        """What stands beside it in a picture."""
        return "\n".join(map(plain, [self.name, *textwrap.wrap(self.known, WORDS)]))


def parts_of(solution: SolutionData) -> list[LabelledPart]:
    """All parts in the last step, with their conditions and interfaces."""
    problem, labelled = solution.problem, dict[tuple[str, str], LabelledPart]()
    names = [body.name for body in problem.body]
    for number, (name, mesh) in enumerate(solution.meshes.items()):
        conditions = problem.bodies[number].conditions[solution.last.step - 1]
        for part in mesh.part_names:
            condition = conditions.get(part)
            kind = _kind(condition, solution.bodies[name].traction[mesh.nodes_of(part)])
            text = "" if kind == "free" or condition is None else condition_text(condition)
            labelled[name, part] = LabelledPart(name, part, kind, text)
    first = {side.group: side.ends[0] for side in reversed(problem.interfaces)}
    for side in problem.interfaces:
        for number, part in () if side.periodic else side.ends:
            pair = "" if side.is_condition else f"pair {side.group}"
            text = law_text(side.law) if (number, part) == first[side.group] else ""
            labelled[names[number], part] = LabelledPart(names[number], part, "contact", text, pair)
    return list(labelled.values())


def _kind(condition: object, traction: Array) -> str:
    if condition is None or (isinstance(condition, Traction) and not traction.any()):
        return "free"
    return "loaded" if isinstance(condition, Traction) else "held"


def titled(solution: SolutionData) -> str:
    """The title, the step whose supports and loads are shown, and loads that no arrow shows."""
    step, count = solution.last, len(solution.problem.step)
    lines = [wrapped(solution.problem.title)]
    lines += [plain(f"supports and loads at the end of step {step.name!r}")] * (count > 1)
    volume = [
        f"{in_body(body.name)}{name.replace('_', ' ')}"
        for body in solution.problem.body
        if body.loads is not None
        for name in sorted(body.loads.model_fields_set - {"centre", "axis"})
    ]
    return "\n".join(filter(None, [*lines, plain(", ".join(volume))]))


def has_room(
    taken: list[object], x: Array, text: str, letter: float, angle: float, down: float
) -> bool:
    """Whether a text has room beside a point; then it is taken. A letter is half as wide as
    high."""
    import shapely.affinity

    lines = text.split("\n")
    wide, high = 0.55 * letter * max(map(len, lines)), 1.3 * letter * len(lines)
    low = x[1] + down * high
    flat = shapely.box(x[0] - 0.5 * wide, low, x[0] + 0.5 * wide, low + high)
    box = shapely.affinity.rotate(flat, angle, origin=tuple(x))
    free = not any(box.intersects(other) for other in taken)
    taken += [box] * free
    return free


def point_forces(solution: SolutionData) -> Iterator[tuple[Array, Array]]:
    """Points at which forces act, and the forces (d,) other than zero."""
    for body in solution.problem.body:
        for point in body.point_force:
            if any(point.force):
                yield np.array(point.at, dtype=float), np.array(point.force, dtype=float)
