"""The lines of a verdict on the largest stresses, in the bodies and on their surfaces."""

from __future__ import annotations

import numpy as np

from ...errors import ONE_BODY
from ...round_off import SOLVED
from ...runtime.terminal import printable
from ..numbers.number import Number
from ..numbers.peaks import QUANTITIES
from .teller import Teller
from .text import KEPT, place_of, wrapped

LISTED = 3
"""Places without a bound that are named; of more of them the number is told."""


def peak_lines(tell: Teller) -> list[str]:
    """The largest von Mises and first principal stress, inside, on the surface and beside a place
    without a bound, and where stress has none, with its K."""
    lines, unbounded, stressed = list[str](), dict[tuple[str, str], str](), False
    for name in QUANTITIES:
        stresses = [
            each for each in tell.numbers.values() if each.name.startswith(f"{name} stress ")
        ]
        words = list[str]()
        # beside a place without a bound stress is larger than maxima that have one
        for number in sorted(stresses, key=lambda each: each.beside is None):
            if np.isinf(number.error) and number.place is not None:
                place = place_of(number.place, tell.size)
                named = _named(number.of, printable(number.part))
                text = f"{place} ({', '.join([named, *_strengths(tell, number)])})"
                unbounded.setdefault((number.of, number.name.removeprefix(name)), text)
            else:
                words.append(_words(number, tell))
        if words:
            shown = [each for each in words if each != "0"] or ["0"]
            beside = any(each.beside is not None for each in stresses if np.isfinite(each.error))
            joined = (", and a maximum of " if beside else " and ").join(shown)
            joined = joined.replace(" of below", " below")
            lines += wrapped(f"  largest {name} stress: ", [joined], separator=" ")
            stressed |= joined != "0"
    return [*lines, *(_without_bound([*unbounded.values()]) if stressed or not lines else [])]


def _without_bound(places: list[str]) -> list[str]:
    """Where stress has no bound: the first places, and how many more there are."""
    left = len(places) - LISTED
    more = [f"{left}{KEPT}more{KEPT}place{'s' * (left > 1)}"] * (left > 0)
    listed = ", ".join([*places[:LISTED], *more])
    return wrapped("  stress has no bound at ", [listed], separator=" ") if places else []


def _strengths(tell: Teller, place: Number) -> list[str]:
    """The largest K of each mode at a place without a bound, and its λ."""
    largest = dict[str, Number]()
    for each in sorted(tell.numbers.values(), key=lambda each: each.size):
        own = each.of == place.of and each.name.endswith(f" ({place.part})")
        here = each.beside is None or not np.any(each.beside != place.place)
        if own and here and not np.isnan(each.exponent):
            largest[each.name] = each
    return [
        f"{name.partition(' ')[0]} {tell.number(each, place=False)}, ".replace(" ", KEPT)[:-1]
        + f" λ{KEPT}{each.exponent:.4g}"
        for name, each in largest.items()
    ]


def _words(number: Number, tell: Teller) -> str:
    # strains that a factorisation leaves of a rigid motion are none
    if number.size <= SOLVED * tell.stiffest:
        return "0"
    if number.beside is not None and number.place is not None:
        away = float(np.linalg.norm(number.place - number.beside))
        place, text = place_of(number.beside, tell.size), tell.number(number, place=False)
        sides = _named(number.of, printable(number.name.partition(" beside ")[2]))
        at = f"at {away:.3g} {tell.unit('length')}".strip().replace(" ", KEPT)
        text += f" {at} from {place} ({sides}), where it has no bound"
    else:
        where = "on the surface" if number.part else "inside"
        name = _named(number.of, printable(number.part))
        text = f"{tell.number(number)} {where}" + (f" ({name})" if name else "")
    if len(tell.solution.problem.step) > 1:
        text += f" in step{KEPT}{number.step}"
    return text


def _named(body: str, part: str) -> str:
    """Return the name of a part with its body, or what lies on the body; without the only body."""
    mark = ": " if " " in part else "."
    return part if body == ONE_BODY else mark.join(filter(None, (printable(body), part)))
