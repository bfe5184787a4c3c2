"""Bodies that only contact or friction holds, alone or one on another, under loads that it can hold,
under loads that it cannot, or under none."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from shapes import cuboid, drawn, elastic, moved, problem, rectangle, solid, touching

from petcontact import load, solve
from petcontact.pipeline.steps import step_loop
from petcontact.pipeline.steps.increment import Increment
from petcontact.pipeline.steps.prepared import HALVINGS

EXAMPLE = Path(__file__).parents[2] / "configs" / "example1.toml"


def block(gap="y", **changes):
    """A block on a floor, held by contact only."""
    usual = {
        "material": {**elastic(1.0, 0.3), "thermal_expansion": 1e-5},
        "mesh": {"element_size": 0.25},
    }
    shape = changes.pop("geometry", rectangle([0.0, 0.0], [2.0, 1.0]))
    body = solid("block", shape, **{**usual, **changes})
    contact = touching("pair", "block.bottom", "floor", gap=gap, friction_coefficient=0.3)
    return {"body": [body], "obstacle": [{"name": "floor"}], "contact": [contact]}


def solved(data, **more):
    return solve(problem(**{**data, **more}))


def test_bodies_of_which_none_is_held_are_not_the_fault_of_the_first():
    small = {"material": elastic(1.0, 0.3), "mesh": {"element_size": 0.5}}
    upper = solid("upper", rectangle([0, 1], [1, 2]), drawn("top", [0.0, -1e-3]), **small)
    lower = solid("lower", rectangle([0, 0], [1, 1]), drawn("bottom", [0.0, 0.0]), **small)
    joined = touching("pair", "upper.bottom", "lower.top")
    assert (
        "nothing has a displacement" in solved({"body": [upper, lower], "contact": [joined]}).reason
    )


def test_a_preload_that_the_load_exceeds_is_named():
    """The pair carries its preload, however it is pulled."""
    small = {"material": elastic(1.0, 0.3), "mesh": {"element_size": 0.5}}
    upper = solid("upper", rectangle([0, 1], [1, 2]), drawn("top", [0.0, 6e-3]), **small)
    lower = solid("lower", rectangle([0, 0], [1, 1]), moved("bottom", [0.0, 0.0]), **small)
    joined = touching("bolt", "upper.bottom", "lower.top", normal="bonded", preload=4e-3)
    reason = solved({"body": [upper, lower], "contact": [joined]}).reason
    assert "upper' cannot be held" in reason and "'bolt' carries its preload of 0.004," in reason


@pytest.mark.parametrize(
    ("load", "way"),
    [([0.0, -0.01, 0.004], "turns it"), ([0.0, 0.01, 0.0], "pushes it along +y")],
)
def test_a_turning_body_of_revolution_is_not_pushed_along_an_axis(load, way):
    data = block(boundary=[drawn("top", load)], geometry=rectangle([1.0, 0.0], [2.0, 1.0]))
    contact = [{**data["contact"][0], "friction_coefficient": 0.1}]
    reason = solved(data, symmetry="axial", contact=contact).reason
    assert f"body 'block' cannot be held: the load {way} beyond" in reason


@pytest.mark.parametrize(
    ("load", "way", "increments"),
    [
        ([0.004, -0.01], "pushes it along +x", 1),
        ([0.004, -0.01], "pushes it along +x", "auto"),
        ([0.0, 0.01], "pushes it along +y", 4),
        ([0.0, "0.1*(x - 1) - 0.01"], "turns it", 1),
    ],
)
def test_a_load_that_nothing_holds_is_found_before_it_is_solved(load, way, increments, monkeypatch):
    """One solve in all, at the least load that is tried, where Coulomb's cone holds none of it; no
    load between that and the whole one is looked at."""
    calls, solver = [], Increment.solved
    looked, look = set(), step_loop.is_unbalanced
    monkeypatch.setattr(step_loop, "is_unbalanced", lambda i: looked.add(i.target) or look(i))
    monkeypatch.setattr(
        Increment, "solved", lambda self, monitor=None: calls.append(1) or solver(self, monitor)
    )
    top = drawn("top", load)
    solution = solved(block(boundary=[top]), step=[{"increments": increments}])
    assert not solution.converged
    assert f"body 'block' cannot be held: the load {way}" in solution.reason
    assert len(calls) == 1
    assert looked == {1.0, 0.5**HALVINGS / (1 if increments == "auto" else increments)}


def test_the_largest_load_is_approached_from_below(monkeypatch):
    """Forces on a tool that is pressed by a given displacement slide it beyond µN. Each load at
    which nothing stops it is tried once, and none beyond it."""
    ends, solver = [], Increment.solved

    def noted(self, monitor=None):
        outcome = solver(self, monitor)
        ends.append((self.target, outcome.converged))
        return outcome

    monkeypatch.setattr(Increment, "solved", noted)
    tool = {"name": "floor", "displacement": [0.0, 0.01]}
    push = {"name": "floor", "displacement": ["free", 0.01], "force": [0.01, 0.0]}
    steps = [{"name": "press"}, {"name": "push", "increments": "auto", "obstacle": [push]}]
    held = {"part": "top", "condition": "displacement", "value": [0.0, 0.0]}
    coarse = block(boundary=[held], mesh={"element_size": 1.0}) | {"obstacle": [tool]}
    solution = solved(coarse, step=steps)
    assert not solution.converged
    last = solution.steps[-1]
    assert last.pairs["pair"].force[0] / last.pairs["pair"].force[1] == pytest.approx(0.3, rel=0.01)
    failed = [end for end, converged in ends if not converged]
    assert failed == sorted(failed, reverse=True)
    assert len(failed) <= HALVINGS


def test_a_slab_that_curls_and_would_rather_tip_than_slide_finds_its_equilibrium(unestimated):
    """All of its narrow contact slides outwards and balances but for a little pull. Where one node
    sticks in place of sliding the pressures tilt, which adds more to the pull than the node holds:
    the bodies come to rest against it."""
    young, deep, pull = 30e9, 0.25, 1e-5
    material = {**elastic(young, 0.15), "density": 2400.0, "thermal_expansion": 1e-5}
    bottom = {"part": "bottom", "condition": "contact", "normal": "unilateral"}
    slab = {
        "material": material,
        "geometry": rectangle([-2.3, 0.0], [2.3, deep]),
        "mesh": {"element_size": 0.05},
        "loads": {"acceleration": [pull, -9.81], "temperature": "15*(0.125 - y)/0.25"},
        "boundary": [
            {**bottom, "friction_coefficient": 0.5},
            *(drawn(part, [0.0, 0.0]) for part in ("left", "right", "top")),
        ],
    }
    solution = solved(slab)
    assert solution.converged and len(solution.steps) == 1
    weight = 2400.0 * 4.6 * deep
    (pair,) = solution.pairs.values()
    assert pair.force == pytest.approx(weight * np.array([-pull, 9.81]), abs=1e-10 * weight)
    assert (pair.state == 0).sum() == 1


@pytest.mark.slow
def test_a_torque_on_an_obstacle_that_friction_cannot_hold_is_named():
    """A plate pressed by a given displacement, so that no linear program sees a limit of the
    torque: what is said is no proof."""
    cube, held = cuboid([0.0, 0.0, 0.0], [1.0, 1.0, 1.0]), moved("bottom", [0.0, 0.0, 0.0])
    body = solid("block", cube, held, mesh={"element_size": 0.5})
    punch = {
        "name": "punch",
        "displacement": [0.0, 0.0, -0.01],
        "rotation": [0.0, 0.0, "free"],
        "moment": [0.0, 0.0, 1.0],
    }
    contact = touching("pair", "block.top", "punch", gap=0.0, friction_coefficient=0.3)
    solution = solved({"body": [body], "obstacle": [punch], "contact": [contact]})
    assert not solution.converged
    assert "obstacle 'punch' is not in equilibrium in the last iterate" in solution.reason
    assert "pushes it to turn about z" in solution.reason and "is not proved" in solution.reason


@pytest.mark.parametrize(("gap", "apart"), [("y", False), ("y + 5", True)])
def test_a_body_that_only_expands(gap, apart):
    """Nothing is carried, the residuals are those of nothing, and what touches nothing stays where
    it is."""
    solution = solved(block(gap, loads={"temperature": 100.0}, boundary=[]))
    pair, u = solution.last.pairs["pair"], solution.last.bodies["block"].u
    assert solution.converged and not pair.pressure.any()
    assert solution.last.residuals["normal"] == 0.0
    assert np.abs(u).max() < 2.0 * 1.3e-3
    assert np.ptp(u, axis=0) == pytest.approx([2.6e-3, 1.3e-3], rel=0.1)
    told = "step 'load': nothing holds 3 motions of body 'block'"
    assert any(text.startswith(told) for text in solution.warnings)
    assert ("no contact anywhere (pair 'pair' lies 5 apart)" in str(solution.warnings)) == apart


@pytest.mark.parametrize(("beside", "held"), [(0.9, True), (1.1, False)])
def test_what_an_element_holds_and_its_nodes_do_not_is_not_said_to_tip(beside, held):
    """One element of order 1 on a floor, nodes at ±.58 of its half length, and a force down at
    `beside` of it."""
    data = block(
        geometry=rectangle([-1.0, 0.0], [1.0, 1.0]),
        mesh={"element_size": 2.0, "order": 1},
        boundary=[drawn("top", [0.0, f"-0.01*(1 + {3 * beside}*x)"])],
    )
    solution = solved(data)
    assert not solution.converged
    assert ("corners of elements can hold" in solution.reason) == held
    assert ("cannot be held" in solution.reason) != held


def pulled(kind, pull, storage):
    """A bar, a box or a ring that only loads act on: they pull at its ends with `pull` and 1."""
    shapes = {
        "bar": (rectangle([0, 0], [2, 1]), "left right"),
        "ring": (rectangle([1, 0], [2, 2]), "bottom top"),
        "box": (cuboid([0, 0, 0], [2, 1, 1]), "left right"),
    }
    shape, ends = shapes[kind]
    along = np.eye(3 if kind == "box" else 2)[1 if kind == "ring" else 0]
    loads = [
        drawn(part, list(size * along))
        for part, size in zip(ends.split(), (-pull, 1.0), strict=True)
    ]
    material = elastic(1e3, 0.3) | ({"plane": "stress"} if kind == "bar" else {})
    body = solid("b", shape, *loads, material=material, mesh={"element_size": 1.0, "order": 2})
    more = {"symmetry": "axial"} if kind == "ring" else {}
    return {"body": [body], "petsc": {"bem_mat_type": storage}, **more}


@pytest.mark.parametrize(
    ("kind", "storage"),
    [("bar", "dense"), ("bar", "hodlr"), ("ring", "dense"), ("box", "dense"), ("box", "hmatrix")],
)
def test_a_body_that_nothing_holds_is_strained_and_does_not_move(kind, storage):
    """Under σ = 1, E = 1e3 it is 2e-3 longer, by half of it at each end."""
    solution = solved(pulled(kind, 1.0, storage))
    body, mesh = solution.last.bodies["b"], solution.meshes["b"]
    axis = 1 if kind == "ring" else 0
    assert solution.converged and "nothing holds" in " ".join(solution.warnings)
    assert np.allclose(body.u[:, axis], 1e-3 * (mesh.x[:, axis] - 1.0), atol=1e-7)


@pytest.mark.parametrize("named", [True, False])
def test_contact_acts_along_the_normals_of_the_secondary_or_a_direction_that_is_named(named):
    """A block whose bottom rises by 1e-3 stands on a flat floor without friction. Forces along its
    normals leave a thousandth of the load over, forces along the floor's leave nothing."""
    corners = [[0.0, 0.0], [2.0, 2e-3], [2.0, 1.0], [0.0, 1.0]]
    parts = ["bottom", "right", "top", "left"]
    shape = {"shape": "polygon", "vertices": corners, "parts": parts}
    data = block(geometry=shape, boundary=[drawn("top", [0.0, -0.01])])
    data["contact"][0] |= {"friction_coefficient": 0.0, "direction": [0.0, -1.0]}
    if not named:
        del data["contact"][0]["direction"]
    solution = solved(data)
    assert solution.converged == named
    assert ("'block' cannot be held: the load pushes it along -x" in solution.reason) != named


def test_a_body_that_nothing_holds_is_refused_where_its_loads_do_not_balance():
    solution = solved(pulled("bar", 0.99, "dense"))
    assert not solution.converged
    assert "body 'b' cannot be held: the load pushes it along +x" in solution.reason


@pytest.mark.parametrize(("slope", "held"), [(1e-4, True), (0.1, False)])
def test_a_disc_that_rolls_down_a_slope_is_not_held_by_the_arm_of_its_undeformed_contact(
    slope, held
):
    """Its contact would have to lie `slope` radii behind its middle, and is .06 wide."""
    foot = [
        {"part": "foot", "to": [0.2, 0.0202041], "through": [0.0, 0.0]},
        {"part": "rest", "to": [-0.2, 0.0202041], "through": [0.0, 2.0]},
    ]
    disc = solid(
        "disc",
        {"shape": "outline", "loops": [foot]},
        material={**elastic(4e4, 0.3), "density": 1.0},
        loads={"acceleration": [10.0 * slope, -10.0]},
        mesh={"element_size": 0.02, "order": 1},
    )
    law = {"direction": [0.0, -1.0], "gap": "y", "friction_coefficient": 0.5}
    pair = touching("pair", "disc.foot", "floor", **law)
    solution = solve(problem(body=[disc], obstacle=[{"name": "floor"}], contact=[pair]))
    assert solution.converged == held, solution.reason
    assert ("widths of its contact" in solution.reason) != held


def pushed(pressure, method="semismooth-newton"):
    """A block of 8 x 4 on a sole with g = 50, pushed by a pressure on its left side."""
    changes = {
        "boundary.0.friction_bound": 50.0,
        "boundary.1": drawn("top", [0.0, 0.0]),
        "boundary.2": {"part": "left", "condition": "traction", "pressure": pressure},
        "mesh": {"element_size": 0.4},
        "method": {"name": method},
    }
    return solve(load(EXAMPLE, changes))


@pytest.mark.usefixtures("unestimated")
@pytest.mark.parametrize("method", ["semismooth-newton", "operator-robin", "projection"])
def test_friction_that_can_carry_the_load_does(method):
    """Capacity 8·50 = 400, load 4·97. Each step of the projection moved the block as if all stuck."""
    solution = pushed(97.0, method)
    assert solution.converged and "3 motions held by contact only" in solution.verdict(verbose=True)
    force = solution.pairs["bottom"].force
    assert force == pytest.approx([-388.0, 0.0], rel=1e-9, abs=1e-9)


@pytest.mark.usefixtures("unestimated")
def test_friction_that_cannot_is_told_with_the_load_that_it_could():
    solution = pushed(110.0)
    reached = float(re.search(r"no equilibrium at load factor (\d\.\d+)", solution.reason)[1])
    assert not solution.converged and reached == pytest.approx(400.0 / 440.0, abs=0.01)


def plate(name, lower, upper, *conditions, size=0.12):
    mesh = {"element_size": size, "order": 1}
    return solid(name, rectangle(lower, upper), *conditions, mesh=mesh)


def disc(name, centre, radius):
    """A disc in four parts: `far` and `near` above and below its middle, two sides."""

    def at(angle):
        way = math.radians(90.0 + angle)
        return [centre[0] + radius * math.cos(way), centre[1] + radius * math.sin(way)]

    parts = ("far", 0.0), ("side", 90.0), ("near", 180.0), ("side", 270.0)
    sides = [
        {"part": part, "to": at(middle + 45.0), "through": at(middle)} for part, middle in parts
    ]
    mesh = {"element_size": 0.06, "order": 1}
    return solid(name, {"shape": "outline", "loops": [sides]}, mesh=mesh)


@pytest.mark.usefixtures("unestimated")
def test_discs_in_a_column_with_little_friction_are_solved_in_few_iterations():
    """Where sets are exchanged without damping the discs roll to and fro for hundreds of
    iterations."""
    bodies = [
        plate("floor", [-2, -1], [2, 0], moved("bottom", [0.0, 0.0])),
        plate("plate", [-0.912593, 0.0], [0.912593, 0.481023], size=0.06),
        disc("lower", [-0.0077105, 1.1113619], 0.6303393),
        disc("upper", [-0.0250493, 2.4559552], 0.7142539),
        plate("lid", [-2, 3.1702091], [2, 4.1702091], moved("top", ["free", -0.06])),
    ]
    pairs = [
        ("plate.bottom", "floor.top", -1),
        ("lower.near", "plate.top", -1),
        ("upper.near", "lower.far", -1),
        ("upper.far", "lid.bottom", 1),
    ]
    contact = [
        touching(f"{k}", *parts, friction_coefficient=0.05, direction=[0, way])
        for k, (*parts, way) in enumerate(pairs)
    ]
    solution = solve(problem(body=bodies, contact=contact))
    assert solution.converged and [step.iterations < 40 for step in solution.steps] == [True]
    forces = np.array([each.force[1] for each in solution.pairs.values()])
    assert forces * [1, 1, 1, -1] == pytest.approx(forces[0] * np.ones(4), rel=1e-9)
    assert forces[0] > 0.0


@pytest.mark.usefixtures("unestimated")
def test_a_free_cylinder_between_two_plates_that_meet_it_between_nodes_only_is_not_overlooked():
    """It could yield to one plate, and no node meets the other: that was taken for no contact."""
    shape = {"shape": "cylinder", "from": [0.0, -4.0, 5.0], "to": [0.0, 4.0, 5.0], "radius": 5.0}
    roller = solid("roller", shape, mesh={"element_size": 8.0, "order": 1})
    plates = [{"name": "floor"}, {"name": "plate", "displacement": [0.0, 0.0, -0.01]}]
    contact = [
        touching("lower", "roller.side", "floor", gap="z", direction=[0.0, 0.0, -1.0]),
        touching("upper", "roller.side", "plate", gap="10 - z", direction=[0.0, 0.0, 1.0]),
    ]
    solution = solve(problem(body=[roller], obstacle=plates, contact=contact))
    assert solution.status == "not converged" and "overlap between nodes" in solution.reason


def test_a_disc_that_carries_nothing_stays_where_it_lies():
    """A lid is pressed on two discs and does not reach the second one: first guesses closed it."""
    discs = [
        solid(
            name,
            {"shape": "outline", "loops": [{"part": "s", "center": [x, 1.0], "radius": 1.0}]},
            material=elastic(1000.0, 0.3),
            mesh={"element_size": 0.05},
        )
        for name, x in (("loaded", 0.0), ("idle", 3.0))
    ]
    pairs = [
        touching(name, side, tool, direction=[0.0, way], gap=gap, friction_coefficient=0.1)
        for name, side, tool, way, gap in (
            ("1", "loaded.s", "floor", -1.0, "y"),
            ("2", "loaded.s", "lid", 1.0, "2 - y"),
            ("3", "idle.s", "floor", -1.0, "y"),
            ("4", "idle.s", "lid", 1.0, "2.01 - y"),
        )
    ]
    lid = {"name": "lid", "displacement": [0.0, "free"], "force": [0.0, -1.0]}
    solution = solved({"body": discs, "obstacle": [{"name": "floor"}, lid], "contact": pairs})
    assert solution.converged, solution.reason
    u = solution.steps[-1].bodies
    assert np.abs(u["idle"].u).max() < 1e-9 * np.abs(u["loaded"].u).max()
