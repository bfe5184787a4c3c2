"""What must not change the answer: who is secondary, where the origin is, units, the number of
increments."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from problems import block, contact_pair, load_step, posed
from shapes import elastic, moved, problem, rectangle, solid, touching

from petcontact import solve

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")


def two(
    mu=0.4, e2=3.0, down=-0.3, right=0.1, middle=0.1, radius=2.0, press=1, push=1, swapped=False
):
    """A block on another one, its face a parabola, pressed and then pushed."""
    mesh = "element_size = 0.25, order = 2"
    sides = ["lower.top", "upper.bottom"][:: -1 if swapped else 1]
    return (
        block("lower", [-2.0, -2.0], [2.0, 0.0], 1.0, 0.3, mesh, bottom=[0.0, 0.0])
        + block("upper", [-2.0, 0.0], [2.0, 1.5], e2, 0.2, mesh, top=[0.0, 0.0])
        + contact_pair("pair", *sides, mu, f"(x - {middle})**2/{radius}")
        + load_step(increments=press, upper={"top": [0.0, down]})
        + load_step(increments=push, upper={"top": [right, down]})
    )


@functools.cache
def solved(**changes):
    solution = solve(posed(two(**changes)))
    assert solution.converged, solution.reason
    return solution


def fields(solution, *, flip=False):
    """Pressure and shear by x, as the lower body feels them along +x."""
    pair = solution.last.pairs["pair"]
    order = np.argsort(pair.x[:, 0])
    shear = pair.sigma_t[order, 0] * pair.tangent[order, 0, 0]
    return pair.pressure[order], -shear if flip else shear


def test_either_side_may_be_the_secondary():
    one = fields(solved())
    other = fields(solved(swapped=True), flip=True)
    for a, b in zip(one, other, strict=True):
        assert np.allclose(a, b, atol=1e-10 * np.abs(a).max())


@pytest.mark.parametrize("law", [{"normal": "bonded"}, {"friction_coefficient": 0.9}])
def test_a_free_obstacle_may_stick_everywhere(law):
    """v = 0 and u_0 = 0: the problem is linear, and nothing but Sσ says how large a displacement
    is."""
    shape, mesh = rectangle([-1, -1], [1, 0]), {"element_size": 0.2, "order": 1}
    base = solid("base", shape, moved("bottom", [0, 0]), material=elastic(500.0, 0.3), mesh=mesh)
    motion = {"displacement": ["free", "free"], "rotation": "free", "force": [0.1, -2.0]}
    foot = touching("foot", "base.top", "stamp", **law)
    stamp = {"name": "stamp", **motion}
    solution = solve(problem(body=[base], obstacle=[stamp], contact=[foot]))
    assert solution.converged, solution.reason
    assert solution.iterations <= 2
    assert np.allclose(solution.last.pairs["foot"].force, [0.1, -2.0], rtol=1e-12)
    assert solution.last.pairs["foot"].area == pytest.approx(2.0)
    assert -0.01 < solution.last.obstacles["stamp"].displacement[1] < -0.001


def test_a_path_of_constant_pressure_does_not_depend_on_its_increments():
    """Equal bodies: pushing changes no pressure, so that one increment is exact (Cattaneo,
    Mindlin)."""
    once, often = (solved(e2=1.0, push=push).last.pairs["pair"] for push in (1, 5))
    assert np.allclose(once.sigma_t, often.sigma_t, atol=2e-3 * np.abs(once.sigma_t).max())


@pytest.mark.parametrize("seed", range(2))
def test_random_loads_and_coefficients(seed):
    """Laws hold at every node, and both sides feel the same force, whatever the data."""
    rng = np.random.default_rng(seed)
    mu = float(rng.uniform(0.0, 2.0))
    changes = {
        "e2": float(10.0 ** rng.uniform(-1, 1)),
        "middle": float(rng.uniform(-1, 1)),
        "radius": float(rng.uniform(1.0, 6.0)),
        "down": float(rng.uniform(-0.4, -0.1)),
        "right": float(rng.uniform(-0.3, 0.3)),
        "press": int(rng.integers(1, 3)),
        "push": int(rng.integers(1, 4)),
    }
    solution = solve(posed(two(mu, **changes)))
    assert solution.converged, solution.reason
    for step in solution.steps:
        pair = step.pairs["pair"]
        small = 1e-9 * pair.pressure.max()
        assert np.all(pair.pressure >= -small) and np.all(pair.gap >= -1e-9)
        assert np.all(np.abs(pair.sigma_t[:, 0]) <= mu * np.maximum(pair.pressure, 0.0) + small)
        assert np.all(np.abs(pair.pressure * pair.gap) <= 1e-9) and pair.dissipated >= -1e-12
        moved = np.abs(pair.slip_increment[:, 0]) > 1e-9
        slides = moved & (pair.state == 1)
        assert not np.any(moved & (pair.state == 0))
        assert np.all(pair.sigma_t[slides, 0] * pair.slip_increment[slides, 0] <= 1e-12)
    mesh, body = solution.meshes["upper"], solution.last.bodies["upper"]
    assert np.allclose(mesh.weight @ body.traction, 0.0, atol=3e-2 * np.abs(pair.force).max())


@pytest.mark.parametrize(
    ("secondary", "primary", "direction"),
    [("disc.rim", "block.top", [0, -1]), ("block.top", "disc.rim", [0, 1])],
)
def test_action_is_reaction_on_an_arc_and_a_line(secondary, primary, direction):
    """Whichever side is collocated: the far half of the disc, behind the near one along the
    direction, feels nothing.

    It was given the traction too: with the line as the secondary half of the force went there, and
    all was "converged".
    """
    mesh, force = {"element_size": 0.2, "order": 2}, {"at": [0.0, 1.0], "force": [0.0, -0.03]}
    disc = {"shape": "outline", "loops": [{"part": "rim", "center": [0.0, 1.0], "radius": 1.0}]}
    block, held = rectangle([-2.0, -2.0], [2.0, 0.0]), moved("bottom", [0.0, 0.0])
    bodies = [
        solid("disc", disc, mesh=mesh, point_force=[force]),
        solid("block", block, held, mesh=mesh),
    ]
    law = {"direction": direction, "friction_coefficient": 0.3}
    solution = solve(problem(body=bodies, contact=[touching("pair", secondary, primary, **law)]))
    pressed = {}
    for name, part in (secondary.split("."), primary.split(".")):
        body, nodes = solution.meshes[name], solution.meshes[name].nodes_of(part)
        traction = solution.last.bodies[name].traction
        pressed[name] = body.weight[nodes] @ traction[nodes]
        if name == "disc":
            assert not traction[body.x[:, 1] > 1.0].any()
    assert solution.converged and pressed["disc"] == pytest.approx([0.0, 0.03], abs=1e-6)
    assert pressed["block"] == pytest.approx(-pressed["disc"], abs=1e-6)
