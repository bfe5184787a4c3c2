"""Adaptive meshes for pressure and shear: where corners press, where increments leave kinks, what
the estimate says."""

from __future__ import annotations

import numpy as np
import pytest
from problems import posed
from shapes import elastic, moved, problem, rectangle, solid, touching

from petcontact import adapt
from petcontact.model.problem import Problem
from petcontact.pipeline.adapt.difference import fading_places
from petcontact.pipeline.adapt.part_ends import pressed_sides
from petcontact.reference.hertz import LineContact, PointContact, contact_modulus
from petcontact.refinement.contact_edges import edges
from petcontact.refinement.levels import MOST_GAIN, believed, growing


def blocks(low: float, high: float, **changes) -> Problem:
    """A block [-1, 1] x [-1, 0] under one that reaches from `low` to `high`."""
    upper = rectangle([low, 0.0], [high, 1.0]), moved("top", [0.01, -0.02])
    lower = rectangle([-1.0, -1.0], [1.0, 0.0]), moved("bottom", [0.0, 0.0])
    bodies = [solid("upper", *upper, material=elastic(10.0, 0.3)), solid("lower", *lower)]
    contact = touching("pair", "upper.bottom", "lower.top", friction_coefficient=0.3)
    return problem(body=bodies, contact=[contact], **changes)


@pytest.mark.parametrize(
    ("low", "high", "on_upper", "on_lower"),
    [
        (-2.0, 2.0, [1.0, 3.0], []),
        (-0.5, 0.5, [], [0.5, 1.5]),
        (-2.0, 0.5, [1.0], [0.5]),
        (-1.0, 1.0, [], []),
    ],
)
def test_corners_press_where_they_meet_a_side(low, high, on_upper, on_lower):
    posed = blocks(low, high)
    outlines = [body.geometry.outline() for body in posed.body]
    upper, lower = pressed_sides(outlines, posed.interfaces)
    assert [s for found in upper.inner.values() for s in sorted(found)] == pytest.approx(on_upper)
    assert [s for found in lower.inner.values() for s in sorted(found)] == pytest.approx(on_lower)
    assert (len(upper.pressing), len(lower.pressing)) == (len(on_lower), len(on_upper))
    # along the secondary: its own ends, and the corners that press on it
    assert fading_places(posed.posed)["pair"].arc_lengths == pytest.approx(
        np.unique([0.0, *on_upper, high - low])
    )


def half_round(axial: bool, joint: float, size: float) -> dict:
    """The half of a disc or ball of radius |size|, which lies on the side of its sign of y = 0 and
    touches it, its arc cut at x = joint |size|."""
    arcs = [(joint, 1.0 - np.sqrt(1.0 - joint**2)), (1.0, 1.0)][axial:]
    flat, axis = ("flat", (0.0 if axial else -1.0, 1.0)), [("axis", (0.0, 0.0))][not axial :]
    sides = [
        {"part": part, "to": [abs(size) * x, size * y]}
        for part, (x, y) in [*(("arc", end) for end in arcs), flat, *axis]
    ]
    sides[: len(arcs)] = [side | {"radius": size} for side in sides[: len(arcs)]]
    return {"shape": "outline", "loops": [sides]}


@pytest.mark.parametrize(
    ("axial", "joint", "push"),
    [(True, 0.0, 1e-8), (True, 0.0, 7.5e-6), (False, 0.0, 1e-8), (False, 0.3, 1e-8)],
)
def test_a_light_contact_of_unlike_bodies_is_that_of_hertz(axial, joint, push):
    """Its half width is 1e-4 of the radius and less, at the end of a side and inside one. In the
    second one the first mesh overlaps beside the contact."""
    shapes = half_round(axial, joint, 1.0), half_round(axial, joint, -2.0)
    bodies = [
        solid("upper", shapes[0], moved("flat", [0.0, -push])),
        solid("lower", shapes[1], moved("flat", [0.0, 0.0]), material=elastic(3.0, 0.3)),
    ]
    pair = touching("pair", "upper.arc", "lower.arc")
    symmetry = {"symmetry": "axial"} if axial else {}
    solution = adapt(problem(body=bodies, contact=[pair], **symmetry))
    pressure, x = solution.pairs["pair"].pressure, solution.pairs["pair"].x[:, 0]
    weight = solution.meshes["upper"].weight[solution.nodes["pair"]]
    contact = (PointContact if axial else LineContact)(
        float(weight @ pressure), 2.0 / 3.0, contact_modulus(1.0, 0.3, 3.0, 0.3)
    )
    exact = contact.pressure(np.abs(x))
    wrong = np.sqrt(weight @ (pressure - exact) ** 2 / (weight @ exact**2))
    assert solution.converged and wrong < solution.accuracy.error < 1e-2


def test_what_carries_nothing_is_not_meshed_finer():
    """A plate on two discs, the second of which is 1e-3 lower: the first carries what Hertz says, on the edges that its force
    has given to the second mesh already."""
    push, discs = 1e-6, []
    for name, x, y in (("high", -1.5, 0.0), ("low", 1.5, -1e-3)):
        sides = [
            {"part": "top", "to": [x - 1.0, y - 1.0], "through": [x, y]},
            {"part": "flat", "to": [x + 1.0, y - 1.0]},
        ]
        discs.append(solid(name, {"shape": "outline", "loops": [sides]}, moved("flat", [0.0, 0.0])))
    plate = solid("plate", rectangle([-3.0, 0.0], [3.0, 1.0]), moved("top", [0.0, -push]))
    pairs = [touching(name, f"{name}.top", "plate.bottom") for name in ("high", "low")]
    solution = adapt(problem(body=[plate, *discs], contact=pairs))
    pair, nodes = (
        solution.pairs["high"],
        {name: mesh.n_nodes for name, mesh in solution.meshes.items()},
    )
    assert not solution.pairs["low"].pressure.any() and nodes["low"] < 0.5 * nodes["high"]
    exact = LineContact(
        float(pair.weight @ pair.pressure), 1.0, contact_modulus(1.0, 0.3, 1.0, 0.3)
    ).pressure(pair.x[:, 0] + 1.5)
    wrong = np.sqrt(pair.weight @ (pair.pressure - exact) ** 2 / (pair.weight @ exact**2))
    assert solution.converged and wrong < solution.accuracy.error < 1e-2
    assert len(solution.accuracy.differences) == 2


def test_wear_that_jumps_leaves_an_edge_that_presses():
    posed = blocks(-1.0, 1.0)
    worn = posed.contact[0].model_copy(update={"wear_coefficient": "where(x > 0.25, 0.1, 0)"})
    posed = posed.model_copy(update={"contact": (worn,)})
    assert fading_places(posed.posed)["pair"].arc_lengths == pytest.approx([0.0, 1.25, 2.0])


def test_where_slip_turns_there_is_an_edge():
    s = np.linspace(0.0, 1.0, 1001)
    moved, ones = s - 0.3004, np.ones(1001)

    def places(state, smallest=1.0):
        return [
            edge.s
            for edge in edges(s, ones, -np.sign(moved), ones, 0.0 * s, moved, state, smallest)
        ]

    none = np.zeros(0)
    assert edges(none, none, none, none, none, none, none.astype(np.int64)) == []
    slip, turning, speck = (np.ones(1001, dtype=np.int64) for _ in range(3))
    turning[300], speck[600] = 0, 0
    assert places(slip) == pytest.approx([0.3004])
    # a node that sticks where slip turns is a zone, elsewhere a speck on coarse meshes
    assert len(places(turning)) == 2
    assert places(speck) == pytest.approx([0.3004])
    assert len(places(speck, 1e-5)) == 3


def test_differences_that_grow_are_not_believed_to_fall():
    assert believed([1e-2, 5e-3]) == 5e-3
    assert believed([1e-2, 1e-5]) == pytest.approx(1e-2 / MOST_GAIN)
    assert believed([5e-3, 1e-2]) == pytest.approx(2e-2)
    assert growing([1e-2, 5e-3, 6e-3]) and growing([1e-3, 5e-3, 1e-3])
    assert not growing([1e-2, 5e-3, 1e-3]) and not growing([1.0, 2.0, 1.0, 0.5])


LIFTED = """
material = { young_modulus = 1.0, poisson_ratio = 0.3 }
geometry = { shape = "rectangle", lower_left = [-20.0, -20.0], upper_right = [20.0, 0.0] }
contact = [{ name = "c", secondary = "top", primary = "punch", gap = "where(abs(x) <= 1, 0, 1)" }]
boundary = [{ part = "bottom", condition = "displacement", value = [0.0, 0.0] },
    { part = "left", condition = "traction", value = [0.0, 0.0] },
    { part = "right", condition = "traction", value = [0.0, 0.0] }]
[[obstacle]]
name = "punch"
displacement = [0.0, "free"]
force = [0.0, -0.01]
rotation = "free"
moment = -0.007
"""
RING = """
[[body]]
name = "ring"
material = { young_modulus = 210000.0, poisson_ratio = 0.0 }
geometry = { shape = "outline", loops = [[{ part = "out", to = [10.4, 0], through = [0, -10.4] },
    { part = "e1", to = [9.6, 0] }, { part = "in", to = [-9.6, 0], through = [0, -9.6] },
    { part = "e0", to = [-10.4, 0] }]] }
boundary = [{ part = "e0", condition = "symmetry" }, { part = "e1", condition = "symmetry" }]
[[obstacle]]
name = "plate"
displacement = [0.0, 0.05]
[[contact]]
name = "t"
secondary = "ring.out"
primary = "plate"
gap = "y + 10.4"
direction = [0.0, -1.0]
"""


def test_a_punch_that_lifts_off_is_solved_though_its_zones_close_nodes_beside_it():
    """A punch of half width 1 whose load is 0.7 off its middle carries on 1.2, and
    p = F/(0.6 π) √((x + 0.2)/(1 - x)) on a half-plane; this block is somewhat stiffer."""
    solution = adapt(posed(LIFTED))
    assert solution.converged, solution.reason
    assert solution.pairs["c"].area == pytest.approx(1.2, rel=0.01)
    assert solution.last.obstacles["punch"].rotation == pytest.approx(-0.009655, rel=5e-3)


def test_a_thin_ring_is_as_exact_as_its_elements():
    """It moves by 0.05 where elements of 1e-7 are pressed: what a move of rounded nodes seems to
    strain would be p."""
    solution = adapt(posed(RING), 1e-3)
    assert solution.converged, solution.reason
    pair, modulus, inertia = solution.pairs["t"], 210000.0, 0.8**3 / 12.0
    # the moment F R/π takes curvature from the place of a line contact
    curvature = 1.0 / 10.4 - 10.0 * pair.force[1] / np.pi / (modulus * inertia)
    width = np.sqrt(4.0 * pair.force[1] / (np.pi * modulus * curvature))
    assert pair.area == pytest.approx(2.0 * width, rel=1e-3)
