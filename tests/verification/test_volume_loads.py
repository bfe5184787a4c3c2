"""Weight, rotation and heat against closed forms, plane and space, one body and two; symmetry
against the whole."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import (
    closing,
    drawn,
    elastic,
    moved,
    outline,
    problem,
    rectangle,
    rollers,
    solid,
    touching,
)

from petcontact import InputError, read_result, solve

pytestmark = pytest.mark.usefixtures("unestimated")

E, NU, RHO, ALPHA = 1000.0, 0.3, 2.0, 1e-3


WALLS = [closing("bottom"), *rollers("left", "right"), drawn("top", [0, 0])]
"""Of a block between rigid walls and a free surface above."""


def steel(plane="strain"):
    return {**elastic(E, NU), "plane": plane, "density": RHO, "thermal_expansion": ALPHA}


def quarter_ring(a, b, x=0.0):
    return outline(bottom=[b + x, 0], outer=[x, b, b], left=[x, a], inner=[a + x, 0, -a])


def quarter_disc(a):
    return outline(bottom=[a, 0], rim=[0, a, a], left=[0, 0])


def spinning_ring(r, a, b, omega, plane):
    """u_r, σ_r, σ_θ of a rotating ring (S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, art.
    32)."""
    e, nu = (E, NU) if plane == "stress" else (E / (1.0 - NU**2), NU / (1.0 - NU))
    k = (3.0 + nu) / 8.0 * RHO * omega**2
    radial = k * (a * a + b * b - (a * b / r) ** 2 - r * r)
    hoop = k * (a * a + b * b + (a * b / r) ** 2 - (1.0 + 3.0 * nu) / (3.0 + nu) * r * r)
    return r * (hoop - nu * radial) / e, radial, hoop


def polar(stress, way):
    """σ_r and σ_θ (n, 2) of plane stresses (n, 3) at points along unit vectors (n, 2)."""
    radial = stress[:, 0] * way[:, 0] ** 2 + stress[:, 1] * way[:, 1] ** 2
    radial += 2.0 * stress[:, 2] * way[:, 0] * way[:, 1]
    return np.column_stack([radial, stress[:, 0] + stress[:, 1] - radial])


def ring_problem(plane="strain", x=0.0, mat_type="auto", order=3, step=()):
    sides = [closing("bottom"), *rollers("left"), drawn("inner", [0, 0]), drawn("outer", [0, 0])]
    return problem(
        material=steel(plane),
        geometry=quarter_ring(1.0, 2.0, x),
        mesh={"element_size": 0.2, "order": order},
        boundary=sides,
        loads={"angular_velocity": 3.0, "centre": [x, 0]},
        bem={"mat_type": mat_type},
        step=list(step),
    )


def ring_error(solution, plane="strain", x=0.0):
    """In L2 over the boundary."""
    away = solution.mesh.x - [x, 0.0]
    r = np.hypot(*away.T)
    u = (spinning_ring(r, 1.0, 2.0, 3.0, plane)[0] / r)[:, None] * away
    weight = solution.mesh.weight
    return np.sqrt(weight @ np.sum((solution.u - u) ** 2, axis=1) / (weight @ np.sum(u**2, axis=1)))


@pytest.mark.parametrize(("plane", "mat_type"), [("strain", "dense"), ("stress", "hodlr")])
def test_a_rotating_ring(plane, mat_type):
    """Inside, on both rims, and along the line of symmetry, whose traction is contact's."""
    solution = solve(ring_problem(plane, mat_type=mat_type))
    assert solution.converged and ring_error(solution, plane) < 5e-7
    angle = np.linspace(0.1, 1.4, 7)
    way = np.column_stack([np.cos(angle), np.sin(angle)])
    state = solution.state_at(1.5 * way)
    moved, radial, hoop = spinning_ring(1.5, 1.0, 2.0, 3.0, plane)
    assert np.abs(state.u - moved * way).max() < 5e-7 * moved
    assert np.abs(polar(state.stress, way) - [radial, hoop]).max() < 2e-7 * RHO * 9.0 * 4.0
    _, radial, hoop = spinning_ring(np.hypot(*solution.mesh.x.T), 1.0, 2.0, 3.0, plane)
    stress = solution.stress_on_boundary()
    assert np.abs(stress[:, 0] + stress[:, 1] - hoop - radial).max() < 1e-4 * hoop.max()
    middle = solution.state_at([[1.0, 0.0], [0.0, 2.0]])
    zz = 0.0 if plane == "stress" else NU * middle.stress[:, :2].sum(axis=1)
    assert np.allclose(middle.sigma_zz, zz)


def test_higher_order_far_from_the_origin():
    assert ring_error(solve(ring_problem(order=5))) < 1e-8
    assert ring_error(solve(ring_problem(x=1e6)), x=1e6) < 5e-7


def test_the_force_and_not_the_speed_grows_linearly_in_a_step():
    steps = [
        {"name": name, "increments": 2, "loads": [{"angular_velocity": speed}]}
        for name, speed in (("slow", 1.0), ("fast", 3.0))
    ]
    solution = solve(ring_problem(step=steps))
    largest = [np.abs(step.bodies["body"].u).max() for step in solution.steps]
    assert np.allclose(
        np.array(largest) / largest[-1], np.array([0.5, 1.0, 5.0, 9.0]) / 9.0, rtol=1e-12
    )
    assert ring_error(solution) < 5e-7
    u = solution.at([[1.2, 0.9]], step=3) / solution.at([[1.2, 0.9]])
    assert np.allclose(u, 5.0 / 9.0, rtol=1e-12)


def heated(temperature, boundary, plane="strain", order=3, **more):
    """A block 2 x 1."""
    return solve(
        problem(
            material=steel(plane),
            geometry=rectangle([0, 0], [2, 1]),
            mesh={"element_size": 0.5, "order": order},
            boundary=boundary,
            loads={"temperature": temperature},
            **more,
        )
    )


def test_a_solution_has_the_polynomials_that_it_was_solved_with(monkeypatch, tmp_path):
    """One that was read finds them again, the same."""
    sides = [closing("bottom"), *rollers("left")]
    solution = heated("exp(y)", [*sides, drawn("top", [0, 0]), drawn("right", [0, 0])])
    solution.save(tmp_path / "r.h5")
    points = np.array([[0.7, 0.3], [1.5, 0.9]])
    again = read_result(tmp_path / "r.h5").stress_at(points)
    monkeypatch.setattr("petcontact.results.evaluated.volume_solution", None)
    assert np.array_equal(solution.stress_at(points), again)


def test_a_temperature_that_no_polynomial_fits_is_told():
    solution = heated("tanh(20*(x - 1))", WALLS, order=1)
    assert any("the polynomial that stands for it misses it by" in w for w in solution.warnings)


def test_even_heat_in_a_clamped_block():
    """-EαT/(1-2ν) everywhere, on the boundary as inside."""
    held = [moved(part, [0, 0]) for part in ("left", "right", "top")]
    clamped = heated(40.0, [closing("bottom"), *held], order=2)
    state = clamped.state_at([[0.0, 0.3], [1.3, 1.0], [1.0, 0.5]])
    pressed = -E * ALPHA * 40.0 / 0.4
    assert np.allclose(state.stress, [pressed, pressed, 0.0], rtol=1e-11, atol=1e-11 * -pressed)
    assert np.allclose(state.sigma_zz, pressed, rtol=1e-11)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_a_quadratic_temperature_between_walls(plane):
    solution = heated("7*y**2", WALLS, plane)
    (body,) = solution.problem.body
    material, y = body.material, solution.mesh.x[:, 1]
    nu, beta = material.plane_strain_ratio, material.thermal_stress
    modulus = 2.0 * material.shear_modulus * (1.0 - nu) / (1.0 - 2.0 * nu)
    assert (
        np.abs(solution.u[:, 1] - beta / modulus * 7.0 * y**3 / 3.0).max() < 1e-12 * beta / modulus
    )
    points = np.array([[0.7, 0.3], [1.5, 0.9]])
    sideways = -beta * 7.0 * points[:, 1] ** 2 * (1.0 - nu / (1.0 - nu))
    assert (
        np.abs(solution.stress_at(points) - np.outer(sideways, [1.0, 0.0, 0.0])).max()
        < 1e-12 * beta * 7.0
    )
    # in plane strain σ_zz is σ_xx, in plane stress 0
    assert np.allclose(solution.von_mises_at(points), np.abs(sideways), rtol=1e-11)


def test_a_shrink_fit_loosens_with_speed():
    """Plane strain; at the speed of lift-off nothing is left."""
    a, b, overlap = 1.0, 2.0, 1e-3
    still = E / (1.0 - NU**2) * overlap * (b * b - a * a) / (2.0 * a * b * b)
    lost = RHO * (3.0 + NU / (1.0 - NU)) * (b * b - a * a) / 8.0
    lift_off = float(np.sqrt(still / lost))
    parts = {"shaft": quarter_disc(a), "hub": quarter_ring(a, b)}
    bodies = [
        solid(
            name,
            geometry,
            *rollers("bottom", "left"),
            material=steel(),
            mesh={"element_size": 0.2, "order": 5},
            loads={"angular_velocity": 1e-3},
        )
        for name, geometry in parts.items()
    ]
    shares = (0.6, 0.999, 1.001)
    steps = [
        {"loads": [{"body": name, "angular_velocity": share * lift_off} for name in parts]}
        for share in shares
    ]
    fit = touching("fit", "shaft.rim", "hub.inner", gap=-overlap)
    solution = solve(problem(body=bodies, step=steps, contact=[fit]))
    assert solution.converged
    for step, share in zip(solution.steps, shares, strict=True):
        exact = still * max(0.0, 1.0 - share**2)
        assert np.abs(step.pairs["fit"].pressure - exact).max() < 1e-6 * still


DENSE, SOFT, WEIGHT = steel(), elastic(E, NU), {"acceleration": [0, -1]}
HOLE = {"part": "hole", "center": [0, 0], "radius": 1.0}
PLATE = {
    "geometry": {"shape": "outline", "exterior": True, "loops": [HOLE]},
    "boundary": [closing("hole", friction_bound=1.0)],
}
DISC = {
    "geometry": quarter_disc(1.0),
    "boundary": [closing("bottom"), *rollers("rim"), drawn("left", [0, 0])],
}


@pytest.mark.parametrize(
    ("told", "material", "loads", "more"),
    [
        ("acceleration: the body has 2 dim", DENSE, {"acceleration": [0, 1, 2]}, {}),
        ("axis: a plane body turns", DENSE, {"angular_velocity": 1.0, "axis": [0, 0, 1]}, {}),
        (r"force\[1\]: unknown name 'nx'", DENSE, {"force": [0, "nx"]}, {}),
        ("rim.condition: symmetry needs a straight side or a plane face", DENSE, WEIGHT, DISC),
        ("an infinite plate has no volume loads", DENSE, WEIGHT, PLATE),
        ("density: must be greater than or equal to 0", {**SOFT, "density": -1.0}, {}, {}),
        ("acceleration: the material of the body has no d", SOFT, WEIGHT, {}),
        ("does nothing, the density of the body is 0", {**SOFT, "density": 0.0}, WEIGHT, {}),
        ("temperature: the material of the body has no th", SOFT, {"temperature": "x"}, {}),
        ("axis: must be a vector other than zero", SOFT, {"axis": [0.0, 0.0, 0.0]}, {}),
        (r"force\[1\]: must be a number or an", SOFT, {"force": [0.0, [1.0, 2.0]]}, {}),
    ],
)
def test_mistakes_are_one_line(told, material, loads, more):
    usual = {"geometry": rectangle([0, 0], [2, 3]), "boundary": WALLS, **more}
    with pytest.raises(InputError, match=told) as caught:
        solve(problem(material=material, mesh={"element_size": 0.5}, loads=loads, **usual))
    assert "\n" not in str(caught.value)
