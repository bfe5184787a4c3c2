"""What presses two bodies together, known before a solve."""

from __future__ import annotations

import pytest
from shapes import drawn, moved, problem, solid, touching

from petcontact.pipeline.adapt.first_mesh import FirstMeshes
from petcontact.pipeline.adapt.known_forces import known_force


def block(low: float) -> dict:
    return {"shape": "box", "lower": [0.0, 0.0, low], "upper": [2.0, 3.0, low + 1.0]}


LOWER = solid("lower", block(0.0), moved("bottom", [0.0] * 3))
RAM = {"name": "ram", "displacement": ["free"] * 3, "force": [0.0, 0.0, -4.0]}
FIT = touching("fit", "upper.top", "ram", normal="bonded")


@pytest.mark.parametrize(
    ("conditions", "more", "force"),
    [
        ([drawn("top", [0.0, 0.0, -0.5])], {}, 3.0),
        ([], {"loads": {"force": [0.0, 0.0, "-0.5"]}}, 3.0),
        ([], {"obstacle": [RAM]}, 4.0),
        ([drawn("left", [0.0, 0.0, -0.5])], {"obstacle": [RAM]}, 5.5),
        ([moved("top", [0.0, 0.0, "free"])], {}, 0.0),
        ([moved("top", [0.0, 0.0, -0.1])], {}, None),
        ([], {"obstacle": [RAM | {"displacement": [0.0, 0.0, -0.1], "force": [0.0] * 3}]}, None),
    ],
)
@pytest.mark.parametrize("turned", [False, True])
def test_what_a_body_hands_on(conditions, more, force, turned):
    """By tractions, volume loads and a ram, from the secondary or from the primary."""
    loads = {name: more[name] for name in {*more} & {"loads"}}
    rams = {name: more[name] for name in {*more} & {"obstacle"}}
    bodies = [solid("upper", block(1.0), *conditions, **loads), LOWER]
    sides = ("lower.top", "upper.bottom") if turned else ("upper.bottom", "lower.top")
    posed = problem(
        body=bodies, contact=[touching("pair", *sides), *([FIT] if rams else [])], **rams
    ).posed
    found = known_force(posed, posed.interfaces[0], FirstMeshes(posed, 4000).meshes)
    assert found is None if force is None else found == pytest.approx(force)


def test_a_floor_carries_what_presses_a_body_on_it():
    """Of two obstacles one is pushed; the other one is held, and feels the same force."""
    lid = {"name": "lid", "displacement": ["free"] * 3, "force": [0.0, 0.0, -4.0]}
    pairs = [touching("low", "ring.bottom", "floor"), touching("high", "ring.top", "lid")]
    posed = problem(
        body=[solid("ring", block(1.0))], obstacle=[{"name": "floor"}, lid], contact=pairs
    ).posed
    meshes = FirstMeshes(posed, 4000).meshes
    assert [known_force(posed, side, meshes) for side in posed.interfaces] == pytest.approx(
        [4.0, 4.0]
    )
