"""What must not change the answer: who is secondary, where the origin is, units, the number of
increments."""

from __future__ import annotations

import numpy as np
import pytest
from problems import block, contact_pair, load_step, posed
from shapes import elastic, moved, problem, rectangle, solid, touching

from petcontact import solve

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

SIDES = "lower.top", "upper.bottom"


def solved(*sides):
    """A block on another one, its face a parabola, pressed and then pushed."""
    mesh = "element_size = 0.25, order = 2"
    text = (
        block("lower", [-2.0, -2.0], [2.0, 0.0], 1.0, 0.3, mesh, bottom=[0.0, 0.0])
        + block("upper", [-2.0, 0.0], [2.0, 1.5], 3.0, 0.2, mesh, top=[0.0, 0.0])
        + contact_pair("pair", *sides, 0.4, "(x - 0.1)**2/2")
        + load_step(upper={"top": [0.0, -0.3]})
        + load_step(upper={"top": [0.1, -0.3]})
    )
    solution = solve(posed(text))
    assert solution.converged, solution.reason
    return solution


def fields(solution, *, flip=False):
    """Pressure and shear by x, as the lower body feels them along +x."""
    pair = solution.last.pairs["pair"]
    order = np.argsort(pair.x[:, 0])
    shear = pair.sigma_t[order, 0] * pair.tangent[order, 0, 0]
    return pair.pressure[order], -shear if flip else shear


def test_either_side_may_be_the_secondary():
    one = fields(solved(*SIDES))
    other = fields(solved(*SIDES[::-1]), flip=True)
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
