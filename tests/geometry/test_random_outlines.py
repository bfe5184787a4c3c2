"""Outlines drawn at random, most of them impossible: each is refused in one line or meshed as it
should be."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact import InputError, SideBySide


def number(rng):
    drawn = 10.0 ** rng.integers(-20, 20), rng.normal(), rng.integers(-5, 6)
    special = (0.0, 1.0, -1.0, 1e-9, 1e60, *map(float, drawn))
    return special[rng.integers(len(special))]


def loop(rng):
    part = lambda: str(rng.choice(["a", "b", "c"]))  # noqa: E731
    if rng.random() < 0.3:
        return {
            "part": part(),
            "center": (number(rng), number(rng)),
            "radius": abs(number(rng)) or 1.0,
        }
    radius, sides = rng.uniform(0.5, 3.0), []
    for angle in np.sort(rng.uniform(0.0, 2.0 * np.pi, rng.integers(1, 7))):
        on_circle = (float(radius * np.cos(angle)), float(radius * np.sin(angle)))
        side = {
            "part": part(),
            "to": on_circle if rng.random() < 0.85 else (number(rng), number(rng)),
        }
        kind = rng.random()
        if kind < 0.2:
            side["radius"] = (
                number(rng)
                if rng.random() < 0.5
                else float(rng.uniform(0.5, 20.0) * rng.choice([-1, 1]))
            )
        elif kind < 0.4:
            near = tuple(map(float, radius * rng.normal(size=2)))
            side["through"] = (number(rng), number(rng)) if rng.random() < 0.4 else near
        sides.append(side)
    return sides


@pytest.mark.parametrize("to", [(1.0, 0.0), (0.0, 2.0)])
def test_a_loop_of_two_straight_sides_encloses_nothing(to):
    with pytest.raises(InputError, match=r"a loop of two straight sides at .* encloses nothing"):
        SideBySide(loops=[[{"part": "a", "to": to}, {"part": "b", "to": (0.0, 0.0)}]]).outline()
