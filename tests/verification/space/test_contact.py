"""Contact in space against fields that are exact on finite blocks, the plane solver, and what must
not change an answer.

Blocks cut out of a half space under sqrt(1 - r²/a²): exact displacement on all sides but the
contact face, exact gap there.
"""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
from marks import slow
from shapes import cuboid, elastic, moved, touching

from petcontact import Problem, adapt, solve
from petcontact.contact import law_protocol
from petcontact.model.base import parse
from petcontact.model.case import parse_problem
from petcontact.pipeline.adapt.surface_errors import TailErrors
from petcontact.pipeline.pose import discretise as assemble
from petcontact.pipeline.run import prepare, run
from petcontact.reference.cattaneo_mindlin import PointPartialSlip
from petcontact.reference.half_space import elliptic_load
from petcontact.reference.hertz import PointContact, elliptic

MU, STICK, HALF = 0.4, 0.6, 1.5
HELD = {
    "lower": ("left", "right", "front", "back", "bottom"),
    "upper": ("left", "right", "front", "back", "top"),
}


def block(name, nu, h, order):
    lower, upper = (
        ([-HALF, -HALF, -HALF], [HALF, HALF, 0.0])
        if name == "lower"
        else ([-HALF, -HALF, 0.0], [HALF] * 3)
    )
    face = "top" if name == "lower" else "bottom"
    return {
        "name": name,
        "material": elastic(1.0, nu),
        "geometry": cuboid(lower, upper),
        "mesh": {
            "element_size": 2.0 * h,
            "element_sizes": {face: h},
            "order": order,
            "exponent": 1.0,
        },
        "boundary": [moved(part, [0.0] * 3) for part in HELD[name]],
    }


def solved(data, states):
    """The problem with displacements states[b](x) (K, n, 3) of body b on all held parts in its load
    states."""
    problem = parse(Problem, data, "exact blocks in space")
    discrete = assemble.discretise(problem)
    for mesh, known, exact in zip(discrete.meshes, discrete.data, states, strict=True):
        held = ~known.traction_known.any(axis=1)
        known.value[1:, held] = exact(mesh.x[held])
    solution = run(prepare(problem, discrete=discrete))
    assert solution.converged, solution.reason
    return solution


def relative(weight, found, exact):
    return float(
        np.sqrt(weight @ np.sum((found - exact) ** 2, axis=1) / (weight @ np.sum(exact**2, axis=1)))
    )


@pytest.mark.parametrize("order", [1, slow(2)])
def test_hertz_on_a_rigid_sphere(order):
    """p_0 = 1, a = 1, ν = 0.3: pressure, and its resultant 2π/3."""
    nu = 0.3
    rise = 0.25 * np.pi * (1.0 - nu**2)
    data = {
        "body": [block("lower", nu, 0.5, order)],
        "obstacle": [{"name": "sphere"}],
        "contact": [touching("top", "lower.top", "sphere", gap=f"{rise}*(x**2 + y**2 - 2)")],
    }
    flip = np.array([1.0, 1.0, -1.0])
    solution = solved(data, [lambda x: elliptic_load(x * flip, 1.0, 1.0, 0.0, nu)[None] * flip])
    pair = solution.last.pairs["top"]
    p = elliptic(np.hypot(pair.x[:, 0], pair.x[:, 1]), 1.0)
    assert relative(pair.weight, pair.pressure[:, None], p[:, None]) < 0.02
    assert pair.force == pytest.approx([0.0, 0.0, -2.0 * np.pi / 3.0], abs=2e-3)
    assert np.abs(pair.moment).max() < 1e-12
    # of the function between the nodes, on points of 50 x 50 squares
    mesh = solution.meshes["lower"]
    line = np.linspace(-HALF, HALF, 50, endpoint=False) + 0.5 * HALF / 25.0
    x = np.stack([*np.meshgrid(line, line), np.zeros((50, 50))], axis=-1).reshape(-1, 3)
    numbers, faces = mesh.faces("top")
    hits = faces.cast(x - [0.0, 0.0, 1.0], np.tile([0.0, 0.0, -1.0], (len(x), 1)))
    found = mesh.basis_at(numbers[hits.face], hits.place)[:, solution.nodes["top"]] @ pair.pressure
    true = relative(
        np.ones(len(x)), found[:, None], elliptic(np.hypot(x[:, 0], x[:, 1]), 1.0)[:, None]
    )
    error, of_force = TailErrors(solution).error()
    assert 1.0 < error / true < 3.0
    assert abs(pair.force[2] + 2.0 * np.pi / 3.0) < of_force * 2.0 * np.pi / 3.0


def cattaneo(x, sign):
    """Displacements of press, +Q, -Q, +Q, (4, n, 3), on the lower (sign -1) or upper body, zero
    slip where they stick."""
    turned = x * [1.0, 1.0, sign]
    press = elliptic_load(turned, 1.0, 1.0, 0.0, 0.0)
    shear = elliptic_load(turned, 1.0, 0.0, MU, 0.0) - STICK * elliptic_load(
        turned, STICK, 0.0, MU, 0.0
    )
    shear[:, 0] -= 0.5 * np.pi * MU * (1.0 - STICK**2)
    return np.array([press, press - sign * shear, press + sign * shear, press - sign * shear]) * [
        1.0,
        1.0,
        sign,
    ]


@pytest.mark.slow
def test_cattaneo_and_mindlin_between_two_blocks():
    """ν = 0: slip is exactly along x, the stick zone a circle. The primary's face takes the panels
    of the secondary."""
    data = {
        "body": [block("lower", 0.0, 0.5, 2), block("upper", 0.0, 0.75, 1)],
        "step": [{"name": name} for name in ("press", "push", "pull", "push again")],
        "contact": [
            touching(
                "pair",
                "lower.top",
                "upper.bottom",
                friction_coefficient=MU,
                gap=f"{0.5 * np.pi}*(x**2 + y**2 - 2)",
            )
        ],
    }
    solution = solved(data, [lambda x: cattaneo(x, -1.0), lambda x: cattaneo(x, 1.0)])
    # p_0 is Young's modulus: strains are as large as they are asked for
    scales = "to be small", "of the body", "small displacements"
    assert all(any(scale in text for scale in scales) for text in solution.warnings)
    pair = solution.last.pairs["pair"]
    r = np.hypot(pair.x[:, 0], pair.x[:, 1])
    bodies = PointContact(2.0 * np.pi / 3.0, 1.0 / np.pi, 0.5)  # p_0 = a = 1
    shear = PointPartialSlip(bodies, MU, MU * bodies.load * (1.0 - STICK**3))
    p, q = bodies.pressure(r), shear.traction(r)
    assert relative(pair.weight, pair.pressure[:, None], p[:, None]) < 0.025
    assert relative(pair.weight, pair.sigma_t, np.column_stack([q, 0.0 * q])) < 0.04
    force = 2.0 * np.pi / 3.0 * np.array([MU * (1.0 - STICK**3), 0.0, -1.0])
    assert pair.force == pytest.approx(force, abs=1e-2)
    # energy of a cycle (Mindlin and Deresiewicz), half of it a branch, a quarter the first one
    spent = [step.pairs["pair"].dissipated for step in solution.steps]
    cycle = shear.dissipated_in_a_cycle(0.5)
    assert spent == pytest.approx(
        [0.0, 0.25 * cycle, 0.5 * cycle, 0.5 * cycle], rel=0.01, abs=1e-15
    )
    assert spent[1:] == pytest.approx([0.5 * spent[3], spent[3], spent[3]], rel=1e-4)
    # action and reaction, force and moment, to round-off
    other, mesh = solution.last.bodies["upper"], solution.meshes["upper"]
    nodes = mesh.nodes_of("bottom")
    loads = mesh.weight[nodes, None] * other.traction[nodes]
    assert np.allclose(loads.sum(axis=0), -pair.force, atol=1e-13)
    assert np.allclose(np.cross(mesh.x[nodes], loads).sum(axis=0), -pair.moment, atol=1e-13)
    # Coulomb's law, and slip against the shear
    slips = pair.state == 1
    size = np.linalg.norm(pair.slip_increment[slips], axis=1)[:, None]
    assert np.allclose(
        pair.sigma_t[slips],
        -MU * pair.pressure[slips, None] * pair.slip_increment[slips] / size,
        atol=1e-6,
    )


@pytest.mark.parametrize("primary", [slow(0.43), 0.75])
def test_hertz_on_faces_that_do_not_match(primary, monkeypatch):
    """Order 2, panels of .5: p is at most 2.3 times as far off as on matching ones, force and
    moment pass exactly."""
    errors = []
    for match in (assemble.matched, lambda boundaries, own, *pairs: own):
        monkeypatch.setattr(assemble, "matched", match)
        data = {
            "body": [block("lower", 0.0, 0.5, 2), block("upper", 0.0, primary, 2)],
            "contact": [
                touching(
                    "pair", "lower.top", "upper.bottom", gap=f"{0.5 * np.pi}*(x**2 + y**2 - 2)"
                )
            ],
        }
        solution = solved(data, [lambda x: cattaneo(x, -1.0)[:1], lambda x: cattaneo(x, 1.0)[:1]])
        pair = solution.last.pairs["pair"]
        p = np.sqrt(np.maximum(1.0 - pair.x[:, 0] ** 2 - pair.x[:, 1] ** 2, 0.0))
        errors.append(relative(pair.weight, pair.pressure[:, None], p[:, None]))
        assert pair.imbalance < 1e-12
        assert pair.force[2] == pytest.approx(-2.0 * np.pi / 3.0, rel=3e-3)
    assert errors[0] < 0.025 and errors[1] < 2.3 * errors[0]


STRAIN = """
[material]
young_modulus = 1.0
poisson_ratio = 0.3
[geometry]
{geometry}
[mesh]
element_size = {h}
order = {order}
{grading}
[[boundary]]
part = "bottom"
condition = "displacement"
value = {zero}
[[boundary]]
part = "left"
condition = "traction"
value = {zero}
[[boundary]]
part = "right"
condition = "traction"
value = {zero}
{rollers}
[[obstacle]]
name = "parabola"
displacement = {down}
[[contact]]
name = "top"
secondary = "top"
primary = "parabola"
gap = "x**2/4"
friction_coefficient = 0.4
[[step]]
increments = 1
[[step]]
increments = 1
[[step.obstacle]]
name = "parabola"
displacement = {right}
"""


@pytest.mark.slow
def test_plane_strain_between_rollers_is_that_of_the_plane():
    """A slice of a long block with rollers on its ends: unilateral contact with Coulomb friction,
    two load steps."""
    roller = (
        '[[boundary]]\npart = "{}"\ncondition = "displacement"\nvalue = ["free", 0.0, "free"]\n'
    )
    flat = STRAIN.format(
        geometry='shape = "rectangle"\nlower_left = [-2.0, -2.0]\nupper_right = [2.0, 0.0]',
        h=0.125,
        order=2,
        grading="",
        zero=[0.0, 0.0],
        rollers="",
        down=[0.0, -0.15],
        right=[0.06, -0.15],
    )
    deep = STRAIN.format(
        geometry='shape = "box"\nlower = [-2.0, 0.0, -2.0]\nupper = [2.0, 0.5, 0.0]',
        h=0.5,
        order=2,
        grading="exponent = 1.0",
        zero=[0.0, 0.0, 0.0],
        rollers=roller.format("front") + roller.format("back"),
        down=[0.0, 0.0, -0.15],
        right=[0.06, 0.0, -0.15],
    )
    plane, space = (
        solve(parse_problem(tomllib.loads(text), "test", {}, ".")) for text in (flat, deep)
    )
    assert plane.converged and space.converged
    for one, other in zip(plane.steps, space.steps, strict=True):
        pushed, wanted = other.pairs["top"].force / 0.5, one.pairs["top"].force
        assert pushed[[0, 2]] == pytest.approx(wanted, rel=0.01, abs=0.01 * np.abs(wanted).max())
        assert abs(pushed[1]) < 1e-10
        assert other.obstacles["parabola"].moment[1] / 0.5 == pytest.approx(
            -one.obstacles["parabola"].moment, abs=2e-3
        )


@pytest.mark.slow
def test_spence_by_increments_and_panels_of_its_own():
    """CONTACT's spence35: a rigid sphere on a half space, ν = 0, µ = .2986; c/a = .4943, p_max =
    .02392.

    The far faces have a point force's displacements: 6 mm off the middle in the place of 18 that
    costs .08 of c/a.
    """
    r, share = "sqrt(x**2 + y**2 + z**2)", 0.4705 / (2.0 * np.pi)
    value = [f"{share}*{c}*(-z/({r})**3 - 1/(({r})*(({r}) - z)))" for c in "xy"] + [
        f"-{share}*(2/({r}) + z**2/({r})**3)"
    ]
    far = [moved(part, value) for part in ("left", "right", "front", "back", "bottom")]
    data = {
        "body": [
            {
                "name": "half",
                "material": elastic(1.0, 0.0),
                "boundary": far,
                "geometry": cuboid([-18.0] * 3, [18.0, 18.0, 0.0]),
            }
        ],
        "obstacle": [
            {"name": "sphere", "displacement": [0.0, 0.0, "free"], "force": [0.0, 0.0, -0.4705]}
        ],
        "contact": [
            touching(
                "top", "half.top", "sphere", gap="(x**2 + y**2)/243", friction_coefficient=0.2986
            )
        ],
        "step": [{"increments": "auto"}],
    }
    solution = adapt(parse(Problem, data, "spence"), 0.05)
    pair = solution.pairs["top"]
    closed, stuck = (
        pair.weight[where].sum()
        for where in (pair.pressure > 0.0, pair.state == law_protocol.STICK)
    )
    assert solution.converged and 30 <= len(solution.steps) <= 60
    assert np.sqrt(stuck / closed) == pytest.approx(0.4943, abs=0.02)
    assert pair.pressure.max() == pytest.approx(0.02392, rel=0.025)
