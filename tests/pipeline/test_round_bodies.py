"""Round bodies: what faces what, loads in the volume that balance, motions that contact hardly
resists."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import cuboid, elastic, moved, problem, solid, touching

from petcontact import solve
from petcontact.pipeline.adapt.fixed_mesh import carries_something
from petcontact.pipeline.judge.first_panels import missed_volume
from petcontact.pipeline.pose.discretise import discretise

STEEL = elastic(1.0, 0.3)


def test_sides_that_go_round_do_not_meet_through_the_bodies():
    """Cylinders of radius 10, one above the other, that touch in a point. A line along a generator
    touches the other one where one of its panels turns away: that was an overlap of 30."""
    mesh = {"element_size": 5.0, "order": 1}
    lower = {"shape": "cylinder", "from": [-10, 0, -10], "to": [10, 0, -10], "radius": 10}
    upper = {"shape": "cylinder", "from": [0, -10, 10], "to": [0, 10, 10], "radius": 10}
    bodies = [
        solid("lower", lower, moved("bottom", [0, 0, 0]), mesh=mesh),
        solid("upper", upper, *(moved(part, [0, 0, 0.5]) for part in ("bottom", "top")), mesh=mesh),
    ]
    pair = touching("cross", "upper.side", "lower.side")
    solution = solve(problem(body=bodies, contact=[pair]))
    assert solution.converged and not solution.last.pairs["cross"].pressure.any()


def ball(**body):
    """A ball pressed onto a plane by its weight, with gaps along its own rough normals."""
    skin = [{"part": "skin", "to": [0, 1], "radius": 1.0}, {"part": "axis", "to": [0, -1]}]
    body = solid(
        "ball",
        {"shape": "revolved", "loops": [skin]},
        **{"loads": {"force": [0, 0, -1e-4]}, "mesh": {"element_size": 0.7, "order": 1}, **body},
    )
    pair = touching("c", "ball.skin", "g", gap="(1+z)/max(-nz, .1)")
    return {"body": [body], "obstacle": [{"name": "g"}], "contact": [pair]}


def test_a_ball_under_its_weight_does_not_roll():
    """Its rotations are resisted by errors of normals of 1e-3, which made it turn by radians."""
    solution = solve(problem(**ball()))
    assert solution.converged and np.abs(solution.last.alpha[3:]).max() < 1e-12
    force = solution.last.pairs["c"].force
    assert np.abs(force[:2]).max() < 1e-10 * force[2] and np.isclose(
        force[2], 4e-4 / 3 * np.pi, rtol=0.02
    )


def test_what_panels_of_a_ball_miss_of_its_weight_is_in_the_error_of_forces():
    posed = problem(**ball(mesh={"element_size": 1.3, "order": 1}))
    (mesh,) = discretise(posed).meshes
    volume = float(mesh.weight @ np.sum(mesh.x * mesh.normal, axis=1)) / 3.0
    missed = 1.0 - volume / (4.0 / 3.0 * np.pi)
    assert 1e-4 < missed < 0.1
    assert missed_volume(posed, [mesh]) == pytest.approx(missed, rel=0.15)


def test_what_panels_of_bars_miss_of_their_section_is_in_the_error_of_stress():
    """Two bars that are held at their ends and pulled to a stress of 5 where they meet."""
    held, bodies = [0, 0, 0], list[dict]()
    for name, end, low in (("lower", "bottom", 0), ("upper", "top", 2)):
        ends = {"from": [0, 0, low], "to": [0, 0, low + 2], "radius": 0.5}
        bar = {"shape": "cylinder", **ends}
        bodies.append(solid(name, bar, moved(end, held), material=elastic(1000.0, 0.0)))
    bond = {"normal": "bonded", "preload": 1.25 * np.pi}
    cut = touching("cut", "upper.bottom", "lower.top", **bond)
    stresses = [n for n in solve(problem(body=bodies, contact=[cut])).numbers if "Mises" in n.name]
    assert stresses
    for stress in stresses:
        assert 1e-5 < abs(stress.value[0] - 5.0) < stress.error < 1e-2


def test_what_turns_a_ball_without_friction_is_held_by_nothing():
    """Whatever resists it is the roughness of its panels."""
    couple = [{"at": [0, y, 0], "force": [2e-5 * y, 0, 0]} for y in (-0.5, 0.5)]
    solution = solve(problem(**ball(point_force=couple)))
    assert not solution.converged and "'ball' cannot be held: the load turns it" in solution.reason


def test_a_roller_that_touches_without_load_is_neither_apart_nor_overlaps():
    """No node lies where it touches: the nearest are .04 and more away, and the polynomials between
    them, which overlap, are no overlap."""
    plate = solid("plate", cuboid([-10, -10, -5], [10, 10, 0]), moved("bottom", [0, 0, 0]))
    shape = {"shape": "cylinder", "from": [-8, 0, 5], "to": [8, 0, 5], "radius": 5.0}
    roller = solid("roller", shape, mesh={"element_size": 4.0, "order": 1})
    plate["mesh"] = {"element_size": 5.0, "order": 1}
    contact = touching("c", "roller.side", "plate.top")
    solution = solve(problem(body=[plate, roller], contact=[contact]))
    assert solution.last.pairs["c"].gap.min() > 0.01
    assert solution.provenance.distance["c"] == 0.0
    assert any("'c' touches without pressure" in text for text in solution.warnings)
    assert "overlap" not in solution.verdict()


def test_blocks_that_just_touch_carry_nothing():
    """A gap of .01, closed by .01: what round-off leaves is neither contact nor overlap."""
    box, other = cuboid([-1, -1, -1], [1, 1, 0]), cuboid([-0.7, -0.7, 0.01], [0.7, 0.7, 1])
    still, pressed = moved("bottom", [0, 0, 0]), moved("top", [0, 0, -0.01])
    bodies = [
        solid("a", box, still, mesh={"element_size": 0.7, "order": 1}),
        solid("b", other, pressed, mesh={"element_size": 0.5, "order": 1}),
    ]
    pair = touching("c", "b.bottom", "a.top", friction_coefficient=0.2)
    solution = solve(problem(body=bodies, contact=[pair]))
    assert solution.converged and not carries_something(solution)
    assert any("touches without pressure" in text for text in solution.warnings)
