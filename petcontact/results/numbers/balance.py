"""Errors of forces and moments, which balance one another."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from .number import Number


def balanced(numbers: Sequence[Number], *, supports: bool) -> Iterator[Number]:
    """Yield numbers whose forces, and moments, share their errors at the end of a step.

    They balance one another: where one is off another one is, though two meshes may agree on it by
    chance. It is off by as much, or by the same share of all that acts. What supports are held by
    counts for others only if `supports` is true: where contact finds the pressure, forces of pairs
    balance given ones to round-off on any mesh.
    """
    acting = dict[tuple[str, int, int], list[Number]]()
    for number in numbers:
        counts = supports or " on " not in number.name or number.name.endswith("on the primary")
        if number.is_resultant and counts and not np.isnan(number.error):
            acting.setdefault((number.unit, *number.key[2:]), []).append(number)
    for number in numbers:
        others = acting.get((number.unit, *number.key[2:]), []) if number.is_resultant else []
        errors = [each.error * min(1.0, number.scale / each.scale) for each in others]
        own = [number.error] if errors and not np.isnan(number.error) else []
        yield number.known_to(max(errors + own)) if errors else number
