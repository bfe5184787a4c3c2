"""The largest stresses of a solution, in its bodies and on their surfaces.

Stress is sampled on the boundary, below every contact and all over the body. The largest that has a
bound is the largest of those samples that are tops: no sample within half its distance from the
next place without a bound is larger. It is climbed to its top. Beside a place without a bound
stress is told at the place's stated distance.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array, shown
from ...round_off import first_largest, largest_first, to_single
from ..evaluated import Evaluated
from ..records import StepResult, step_ends
from ..strength.place import Place
from ..strength.singular_places import singular_places
from .number import Number
from .stress_samples import FINEST, TRIED, Samples

QUANTITIES = {"von Mises": "von_mises", "first principal": "first_principal"}
"""Of `StressState`, by their names in the verdict."""
Told = tuple[float, Place, Samples]
"""A stress, a place beside which it is told, and the samples of its body."""
MORE = 1e-3
"""Share by which a stress inside is more than all on the surface, to be named besides."""


def stress_peaks(solution: Evaluated, ends: Sequence[StepResult] | None = None) -> list[Number]:
    """Return the largest stresses of `QUANTITIES` after some increments, by default the ends of
    steps: inside, on the surface, beside a place without a bound, and where there is none.

    There is none with a bound where all stress only falls from such places, and none inside unless
    it is larger there than on the surface.
    """
    # numbers of an altered file, or of a solve that failed, may overflow
    with np.errstate(all="ignore"):
        ends = step_ends(solution.steps or solution.tried) if ends is None else ends
        samples = [Samples(solution, body, step) for step in ends for body in solution.meshes]
        return [number for name in QUANTITIES for number in _largest(samples, name)]


def unbounded_places(solution: Evaluated, numbers: Sequence[Number]) -> dict[str, list[Place]]:
    """Return the places of each body at which numbers say that stress has no bound."""
    endless = [each for each in numbers if stress_name(each) and np.isinf(each.error)]

    def is_one(place: Place, number: Number) -> bool:
        at = number.place is not None and place.away(number.place[None])[0] == 0.0
        return (number.of, number.part) == (place.body, place.sides) and (place.is_edge or at)

    return {
        body: [place for place in places if any(is_one(place, each) for each in endless)]
        for body, places in singular_places(solution, solution.last).items()
    }


def stress_name(number: Number) -> str:
    """Return the attribute of a `StressState` of which a number is the maximum, or ""."""
    return next((key for name, key in QUANTITIES.items() if number.name.startswith(f"{name} ")), "")


def _largest(samples: Sequence[Samples], name: str) -> list[Number]:
    """Return the largest of one stress over bodies and steps."""
    key = QUANTITIES[name]
    endless = [(*each, some) for some in samples for each in some.endless(key)]
    tops = _tops(samples, key)
    named = [
        replace(top, name=f"{name} stress {where}", alone=max(top.alone, FINEST**2 * top.size))
        for top, where in zip(reversed(tops), ("inside", "on the surface"), strict=True)
        if top is not None
    ]
    endless = [endless[k] for k in largest_first(np.array([each[0] for each in endless]))]
    beside = _beside(endless, name)
    largest = max([*named, *beside], key=lambda each: float(each.value[0]), default=None)
    named += [each for each in beside if each is largest]
    return [*named, *_without_bound(name, endless)]


def _beside(at: Sequence[Told], name: str) -> list[Number]:
    """The largest stress beside the first places, where stress inside the bodies is known: on their
    arcs, or at tops up to twice as far away."""
    key, known = QUANTITIES[name], (each for each in at if each[2].fields_known)
    tried, found = list(itertools.islice(known, TRIED)), list[Number]()
    _look_around((some, place, 0.0, place.angle) for _, place, some in tried)
    arcs = [some.largest_on_arc(key, place) for _, place, some in tried]
    most = [max(each[0], arc[0]) for each, arc in zip(tried, arcs, strict=True)]
    least = max((arc[0] for arc in arcs), default=0.0)
    _look_around(
        (some, place, *arc[2:])
        for (_, place, some), arc, value in zip(tried, arcs, most, strict=True)
        if value >= least
    )
    for k in largest_first(np.array(most)).tolist():
        if not found or most[k] > found[0].size:
            own = tried[k][2].beside(f"{name} stress", key, tried[k][1])
            found = [max(*found, own, key=lambda each: to_single(each.size))] if found else [own]
    return found


def _look_around(arcs: Iterable[tuple[Samples, Place, float, float]]) -> None:
    """Find the stress on arcs about places of some samples, those of one body all at once."""
    arcs = list(arcs)
    for some in dict.fromkeys(arc[0] for arc in arcs):
        some.look_around([arc[1:] for arc in arcs if arc[0] is some])


def _without_bound(name: str, endless: Sequence[Told]) -> list[Number]:
    """The numbers that say where a stress has no bound, one of edges with equal sides."""
    unbounded = dict[object, Number]()
    for _, place, some in endless:
        where = None if place.is_edge else tuple(place.x)
        unbounded.setdefault((some.body, place.sides, where), some.without_bound(name, place))
    return list(unbounded.values())


def _tops(samples: Sequence[Samples], key: str) -> list[Number | None]:
    """The largest stress that has a bound on the surface, and inside where it is larger there."""
    tops, above = list[Number | None](), -np.inf
    for inside in (False, True):
        # of each body and step the largest come first, and no more are looked for than needed
        found = (zip(some.peaks(key, inside), itertools.repeat(some)) for some in samples)
        largest = heapq.merge(*found, key=lambda each: -float(to_single(each[0].value[0])))
        top = None
        for peak, some in itertools.islice(largest, TRIED):
            if (top := some.top(key, peak, above)) is not None:
                break
        tops.append(top)
        above = float(top.value[0]) + MORE * top.size if top else above
    return tops


def largest_at(solution: Evaluated, body: str, points: Array, stress: Array) -> str:
    """Return in words the largest of stresses (n,) at points (n, d) after the last increment.

    Next to a place without a bound the number only says how near the points lie.
    """
    k = first_largest(stress)
    near = [
        each.sides
        for each in singular_places(solution, solution.last)[body]
        if each.leaves_out(points[k : k + 1])[0]
    ]
    where = f", next to {near[0]}, where stress has no bound" if near else ""
    return f"{stress[k]:.4g} at {shown(points[k], 4)}{where}"
