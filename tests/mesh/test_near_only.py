"""Parts match where they are near, so that many rollers do not hand joints to one another."""

from __future__ import annotations

import math

import numpy as np

from petcontact import Body, Displacement, Material, Pair, Problem
from petcontact.model.shapes.plane import SideBySide
from petcontact.pipeline.pose.discretise import meshed

STEEL = Material(1000.0, 0.3)


def disc(name: str, x: float, y: float, radius: float, hole: float = 0.0) -> Body:
    loops = [[{"part": "rim", "center": [x, y], "radius": radius}]]
    loops += [[{"part": "race", "center": [x, y], "radius": hole}]] if hole else []
    return Body(name, STEEL, SideBySide(shape="outline", loops=[loop[0] for loop in loops]))


def bearing(count: int) -> Problem:
    angles = 2.0 * math.pi * (np.arange(count) + 0.3) / count
    rollers = [
        disc(f"r{k}", 4.0 * math.cos(a), 4.0 * math.sin(a), 1.0) for k, a in enumerate(angles)
    ]
    outer = disc("outer", 0.0, 0.0, 6.0, 5.0)
    held = outer.model_copy(update={"boundary": (Displacement("rim", (0.0, 0.0)),)})
    pairs = [
        pair
        for k in range(count)
        for pair in (
            Pair(f"i{k}", f"r{k}.rim", "inner.rim"),
            Pair(f"o{k}", f"r{k}.rim", "outer.race"),
        )
    ]
    return Problem(body=[disc("inner", 0.0, 0.0, 3.0), held, *rollers], contact=pairs)


def test_a_roller_has_as_many_elements_in_a_bearing_of_many() -> None:
    few, many = (meshed(bearing(count), None)[1] for count in (2, 6))
    assert max(mesh.n_nodes for mesh in many[2:]) <= 1.2 * max(mesh.n_nodes for mesh in few[2:])
