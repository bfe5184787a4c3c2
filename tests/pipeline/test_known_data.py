"""Known data that vary within elements, with kinks, jumps and narrow features: values are right
wherever the body lies, and what a mesh misses is named."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from shapes import (
    closing,
    cuboid,
    drawn,
    elastic,
    moved,
    problem,
    rectangle,
    solid,
    touching,
)

from petcontact import adapt, solve

YOUNG = 1000.0
STEEL = elastic(YOUNG, 0.3)
NARROW = "10*exp(-(y - 0.52)**2/2e-4)"
SMOOTH = "10*sin(pi*y)"
ROUND = ("left", "right", "front", "back")
ROLLERS = [{"part": part, "condition": "symmetry"} for part in ROUND]


def bilateral(bound):
    return {"part": "bottom", "condition": "contact", "friction_bound": bound}


def warned(side=0.0, bound=0.3, step=()):
    """Warnings of a block that misses its data."""
    block = problem(
        material=STEEL,
        geometry=rectangle([0.0, 0.0], [1.0, 1.0]),
        mesh={"element_size": 0.125, "order": 1},
        boundary=[
            drawn("left", [side, 0.0]),
            moved("top", [0.0, -0.01]),
            bilateral(bound),
            drawn("right", [0.0, 0.0]),
        ],
        step=list(step),
    )
    return [text for text in solve(block).warnings if "misses" in text]


def test_narrow_loads_poles_functions_bounds_and_steps_are_looked_at():
    assert warned(SMOOTH) == []
    later = {"name": "load", "boundary": [{"part": "left", "value": [NARROW, 0.0]}]}
    for told, given in (
        ("the traction on left", {"side": NARROW}),
        ("the traction on left", {"side": "1/(y - 0.5)"}),  # which no node meets
        ("the traction on left", {"step": [later]}),
        (
            "the friction bound on bottom",
            {"side": lambda y: 0.0 * y, "bound": "1 + 1e3*(abs(x - 0.53) < 0.005)"},
        ),
    ):
        (text,) = warned(**given)
        assert f"of {told}" in text


TURNED = {
    "hole": ["0.01*(y - 1)", "-0.01*x"],
    "top": ["0.01*(z - 1)", "0.02*z", "-0.01*x - 0.02*y"],
}
CIRCLES = [
    {"part": part, "center": [0, 0], "radius": radius}
    for part, radius in (("rim", 1), ("hole", 0.5))
]
RING = {"shape": "outline", "loops": CIRCLES}
BALL = {"shape": "sphere", "centre": [0, 0, 0], "radius": 1}


@pytest.mark.parametrize(
    ("shape", "part", "storage", "order"),
    [
        (RING, "hole", "hodlr", 2),
        (BALL, "top", "dense", 1),
    ],
)
def test_rotations_that_are_given_strain_no_curved_body(shape, part, storage, order):
    """Elements do not hold them: a ball of order 1 had stresses of .1 E times the angle."""
    turned, mesh = TURNED[part], {"element_size": 0.5, "order": order}
    body = solid("ball", shape, moved(part, turned), material=STEEL, mesh=mesh)
    steps = [
        {"boundary": [{"body": "ball", "part": part, "value": value}]}
        for value in ([0.0] * len(turned), turned)
    ]
    found = solve(problem(body=[body], bem={"mat_type": storage}, step=steps))
    stresses = [np.abs(found.boundary_state(step=k)[1].von_mises).max() for k in (1, 2)]
    assert found.status == "converged" and max(stresses) < 1e-10 * YOUNG * 0.02


def test_held_faces_of_constant_elements_that_a_rotation_meets_at_their_nodes_are_held():
    """One row of nodes on each end of a plate: a rigid rotation through them is not what is given,
    which bends the plate."""
    ends = moved("left", [0.0, 0.0, 0.0]), moved("right", [0.0, 0.0, 0.5])
    mesh = {"element_size": 0.8, "order": 0}
    found = solve(problem(body=[solid("plate", cuboid([0, 0, 0], [8, 2, 0.4]), *ends, mesh=mesh)]))
    assert found.bodies["plate"].traction.any() and not found.converged


def cube(size):
    """A block 2 x 2 x 2 between rollers on panels of a size."""
    mesh = {"element_size": size, "order": 1, "exponent": 1.0}
    return {"material": elastic(1.0, 0.3), "geometry": cuboid([0.0] * 3, [2.0] * 3), "mesh": mesh}


def test_the_integral_of_a_load_is_right_on_any_panels():
    load, exact = "-0.01*where(abs(x-.31) < .04, 1, 0)", -0.01 * 0.08 * 2.0
    floor = {"obstacle": [{"name": "floor"}], "contact": [touching("c", "bottom", "floor")]}
    boundary = [*ROLLERS, drawn("top", [0.0, 0.0, load])]
    found = solve(problem(**cube(1.0), boundary=boundary, **floor))
    (mesh,), (body,) = found.meshes.values(), found.bodies.values()
    top = mesh.nodes_of("top")
    assert mesh.weight[top] @ body.traction[top, 2] == pytest.approx(exact, rel=1e-3)
    assert found.pairs["c"].force[2] == pytest.approx(-exact, rel=2e-2)


def test_a_bump_between_open_nodes_is_not_overlooked():
    gap = "0.02 - 0.025*exp(-((x-.83)**2+(y-.83)**2)/0.002)"
    punch = {"name": "punch", "displacement": [0.0, 0.0, -0.01]}
    held, pair = moved("bottom", [0.0] * 3), touching("c", "top", "punch", gap=gap)
    found = solve(problem(**cube(0.5), boundary=[*ROLLERS, held], obstacle=[punch], contact=[pair]))
    assert not found.converged and "overlap between nodes" in found.reason
    place = [float(each) for each in re.findall(r"[\d.e+-]+", found.reason.split(" at (")[1])[:3]]
    assert place == pytest.approx([0.83, 0.83, 2.0], abs=5e-3)


STILL = [drawn("left", [0.0, 0.0]), drawn("right", [0.0, 0.0])]


def pressed(lower, upper, modulus, gap, **motion):
    """A block whose bottom is held under a rigid die of some shape."""
    return adapt(
        problem(
            material=elastic(modulus, 0.3),
            geometry=rectangle(lower, upper),
            boundary=[moved("bottom", [0.0, 0.0]), *STILL],
            obstacle=[{"name": "die", **motion}],
            contact=[touching("surface", "top", "die", gap=gap)],
        )
    )


def test_a_guarded_circle_is_a_circle_at_any_place():
    """A disc of radius 3 pressed .1 deep: the pressure of Hertz for the force that it carries, but for the depth of the block; elements
    between false kinks had 400 times as much."""
    at, x = 1000.0, "(x - 1004)"
    gap = f"where(abs({x}) < 3, 3 - sqrt(max(9 - {x}**2, 0)), 3)"
    found = pressed([at, -4.0], [at + 12.0, 0.0], 10.0, gap, displacement=[0.0, -0.1])
    pair = found.pairs["surface"]
    closed = float(pair.weight[pair.state != 2].sum())
    assert found.status == "converged"
    assert pair.force[1] == pytest.approx(-0.6020434, rel=1e-5)
    assert pair.pressure.max() == pytest.approx(
        2.0 * abs(pair.force[1]) / (math.pi * 0.5 * closed), rel=5e-3
    )
    assert found.boundary_state()[1].von_mises.max() == pytest.approx(0.3287, rel=1e-2)


def test_a_joint_that_a_tangential_ray_carries_over_is_one_with_that_of_the_other_body():
    """A circle under a flat as wide: the ray at its end is off by the root of the round-off."""
    circles = [
        {"part": part, "center": [0.0, 1.0], "radius": radius}
        for part, radius in (("rim", 1.0), ("bore", 0.3))
    ]
    disc = solid("disc", {"shape": "outline", "loops": circles}, moved("bore", [0.0, 0.0]))
    block = solid("block", rectangle([-1.0, 2.0], [1.0, 3.0]), moved("top", [0.0, -0.02]))
    pair = touching("c", "block.bottom", "disc.rim")
    found = adapt(problem(body=[disc, block], contact=[pair]))
    assert found.status == "converged"
    for name in found.meshes:
        state = found.boundary_state(body=name)[1]
        near = state.von_mises[state.x[:, 1] < 2.5]  # the block's clamped corners have no bound
        assert near.max() == pytest.approx(0.0131, rel=2e-2)


def test_where_a_gap_jumps_a_part_ends():
    """A block that hangs over the edge of a rigid table: all its weight rests on what is left."""
    table = closing("bottom", normal="unilateral", gap="where(x <= 0, 0, 1)")
    found = adapt(
        problem(
            material={**elastic(1e8, 0.2), "density": 1000.0},
            geometry=rectangle([-2.0, 0.0], [1.0, 1.0]),
            loads={"acceleration": [0.0, -10.0]},
            boundary=[table, *STILL, drawn("top", [0.0, 0.0])],
        )
    )
    (pair,) = found.pairs.values()
    assert found.status == "converged"
    assert pair.force[1] == pytest.approx(3e4, rel=1e-6)
    assert float(pair.weight[pair.state != 2].sum()) == pytest.approx(2.0, rel=1e-6)
