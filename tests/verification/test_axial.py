"""Bodies of revolution against closed forms."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from axial_forms import indented, indented_errors
from climbs import solved
from random_revolution import random_revolution
from shapes import elastic, moved, solid, touching

from petcontact import InputError, adapt, operators, read_result, solve, write_solution
from petcontact.model.case import parse_problem
from petcontact.pipeline.superelement import condensed_body

STEEL = {"young_modulus": 100.0, "poisson_ratio": 0.3}
E, NU = 100.0, 0.3
LOADED = {**STEEL, "density": 2.0, "thermal_expansion": 1e-3}
FREE = {"condition": "traction", "value": [0, 0]}
SLIDING = {"condition": "symmetry"}
CLAMPED = {"condition": "displacement", "value": [0, 0]}


def rectangle(lower, upper, **more):
    return {"geometry": {"shape": "rectangle", "lower_left": lower, "upper_right": upper}, **more}


def problem(**data):
    return parse_problem({"symmetry": "axial", **data}, "case.toml", {}, Path())


def parts(**conditions):
    return [{"part": part, **condition} for part, condition in conditions.items()]


def tube(loads=None, material=STEEL, order=3, **sides):
    """A long tube, 1 < r < 2, between planes of symmetry."""
    sides = {"left": FREE, "right": FREE, "bottom": SLIDING, "top": SLIDING, **sides}
    posed = problem(
        material=material,
        boundary=parts(**sides),
        **rectangle([1, 0], [2, 1], mesh={"element_size": 0.5, "order": order}),
        **({"loads": loads} if loads else {}),
    )
    body = operators(posed).body
    return body, *body.solve()


def test_a_tube_under_pressure_is_lame_s():
    inside = {"condition": "traction", "pressure": 1.0}
    x = np.array([[1.0, 0.5], [1.2, 0.3], [1.7, 0.6], [2.0, 0.5]])
    radial, hoop = 1 / 3 * (1 - 4 / x[:, 0] ** 2), 1 / 3 * (1 + 4 / x[:, 0] ** 2)
    errors = []
    for order in (2, 4):
        body, u, t = tube(order=order, left=inside)
        r = body.mesh.x[:, 0]
        exact = 1.3 / E / 3 * (0.4 * r + 4 / r)
        assert body.mesh.weight.sum() == pytest.approx(2 * np.pi * (3 * 1 + 3), rel=1e-10)
        errors.append(np.abs(u[:, 0] - exact).max() / exact.max())
        state = body.state_at(x, u, t)
    assert errors[0] < 3e-4 and errors[1] < 0.1 * errors[0]
    assert state.stress[:, 0] == pytest.approx(radial, abs=1e-3)
    assert state.stress[:, 2] == pytest.approx(hoop, abs=1e-3)
    assert state.stress[:, 2] == pytest.approx(state.sigma_zz)


def test_speed_and_heat_of_a_tube():
    x = np.array([[1.2, 0.3], [1.7, 0.6]])
    r = x[:, 0]
    k, ratio = 2.0 * 9.0 / 8.0, NU / (1 - NU)
    body, u, t = tube({"angular_velocity": 3.0}, LOADED)
    state = body.state_at(x, u, t)
    assert state.stress[:, 0] == pytest.approx((3 + ratio) * k * (5 - 4 / r**2 - r**2), abs=1e-3)
    around = (3 + ratio) * k * (5 + 4 / r**2) - (1 + 3 * ratio) * k * r**2
    assert state.sigma_zz == pytest.approx(around, abs=1e-3)
    body, u, t = tube({"temperature": "x"}, LOADED)
    state = body.state_at(x, u, t)
    scale, within = E * 1e-3 / (1 - NU) / r**2, (r**3 - 1) / 3
    assert state.stress[:, 0] == pytest.approx(scale * ((r**2 - 1) * 7 / 9 - within), abs=1e-5)
    hoop = scale * ((r**2 + 1) * 7 / 9 + within - r**3)
    assert state.sigma_zz == pytest.approx(hoop, abs=1e-5)


def test_weight_is_carried_and_even_heat_strains_without_stress():
    posed = {
        "material": LOADED,
        "boundary": parts(
            right=FREE, top=FREE, bottom={"condition": "displacement", "value": ["free", 0]}
        ),
        **rectangle([0, 0], [1, 2], mesh={"element_size": 0.5, "order": 3}),
    }
    body = operators(problem(**posed, loads={"acceleration": [0, -5]})).body
    _, t = body.solve()
    under = body.mesh.nodes_of("bottom")
    assert body.mesh.weight[under] @ t[under, 1] == pytest.approx(2 * 5 * 2 * np.pi, rel=1e-5)
    body = operators(problem(**posed, loads={"temperature": 7})).body
    u, t = body.solve()
    assert u == pytest.approx(7e-3 * body.mesh.x, abs=1e-9)
    on_axis = body.state_at([[0.0, 1.0], [0.5, 1.0], [0.0, 2.0]], u, t)
    assert np.abs(on_axis.stress).max() < 1e-7 * E


def test_a_press_fit_is_lame_s_and_stays_in_files(tmp_path):
    def fitted(name, lower, upper, material):
        more = {"name": name, "material": material, "boundary": parts(bottom=SLIDING, top=SLIDING)}
        return rectangle(lower, upper, mesh={"element_size": 0.5, "order": 3}, **more)

    bodies = [
        fitted("shaft", [0, 0], [2, 1], STEEL),
        fitted("hub", [2, 0], [4, 1], elastic(50.0, 0.25)),
    ]
    law = {"gap": -0.002, "friction_coefficient": 0.2}
    found = solve(problem(body=bodies, contact=[touching("fit", "hub.left", "shaft.right", **law)]))
    soft = 1.3 * 0.4 / 100 * 2 + 1.25 / 50 * 4 / 12 * (0.5 * 2 + 16 / 2)
    assert found.converged
    assert found.pairs["fit"].pressure == pytest.approx(0.002 / soft, rel=1e-4)
    write_solution(tmp_path / "fit.h5", found)
    again = read_result(tmp_path / "fit.h5")
    for name, mesh in found.meshes.items():
        assert np.array_equal(again.meshes[name].weight, mesh.weight)
    point = [[2.5, 0.4]]
    assert again.stress_at(point, "hub") == pytest.approx(found.stress_at(point, "hub"))


def test_two_balls_are_hertz_s_in_what_force_edge_and_pressure_have_in_common():
    """On adaptive meshes; the force and the radius of contact determine p whatever the rest is."""
    sides = [
        {"part": "surface", "to": [8, 8], "radius": 8},
        {"part": "equator", "to": [0, 8]},
        {"part": "axis", "to": [0, 0]},
    ]
    pushed, shape = moved("equator", ["free", -0.01]), {"shape": "outline", "loops": [sides]}
    ball = solid("ball", shape, pushed, material=STEEL)
    flat = rectangle([0, -8], [8, 0], name="flat", material=STEEL, boundary=parts(bottom=CLAMPED))
    pair = touching("pair", "flat.top", "ball.surface")
    found = solve(problem(body=[ball, flat], contact=[pair]))
    pair = found.pairs["pair"]
    a, force = np.sqrt(pair.area / np.pi), -pair.force[1]
    assert found.converged and found.accuracy.error < 1e-2
    assert force == pytest.approx(4 / 3 * (E / (2 * (1 - NU**2))) * a**3 / 8, rel=5e-3)
    assert pair.pressure.max() == pytest.approx(1.5 * force / (np.pi * a**2), rel=5e-3)
    surface = found.state_at([[0.0, 0.0]], body="flat")
    assert surface.stress[0, :3] == pytest.approx(
        -pair.pressure.max() * np.array([0.8, 1.0, 0.8]), rel=2e-2
    )


def pressed(block, base):
    """A block on a base, both of elements of one size."""
    common = {"material": STEEL, "mesh": {"element_size": 0.5, "order": 1}}
    down = {"condition": "displacement", "value": ["free", -0.01]}
    return problem(
        body=[
            {"name": "block", **common, "boundary": parts(top=down), **block},
            {"name": "base", **common, **base},
        ],
        contact=[touching("pair", "block.bottom", "base.top", friction_coefficient=0.3)],
    )


BLOCK = rectangle([0, 0], [2, 1])
BASE = rectangle([0, -1], [3, 0], boundary=parts(bottom=CLAMPED))


def test_lines_of_mesh_files_on_the_axis_need_no_group(tmp_path):
    corners = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]], dtype=float)
    names = {name: np.array([k, 1]) for k, name in enumerate(("bottom", "right", "top"), 1)}
    kinds = [("line", np.array([[0, 1], [1, 2], [2, 3]]))]
    kinds += [("quad", np.array([[0, 1, 2, 3]]))]
    tags = [np.array([1, 2, 3]), np.array([9])]
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.Mesh(corners, kinds, cell_data=data, field_data=names).write(
        tmp_path / "block.msh", file_format="gmsh22", binary=False
    )
    file = {"geometry": {"shape": "gmsh", "file": str(tmp_path / "block.msh")}}
    forces = [solve(pressed(block, BASE)).pairs["pair"].force for block in (BLOCK, file)]
    assert forces[1] == pytest.approx(forces[0], rel=1e-12)


def test_a_superelement_carries_what_its_body_does_and_is_none_of_the_plane(tmp_path):
    whole = solve(pressed(BLOCK, BASE))
    condensed_body(whole, "base").save(tmp_path / "base.npz")
    file = {"geometry": {"shape": "superelement", "file": str(tmp_path / "base.npz")}, "mesh": {}}
    posed = pressed(BLOCK, file)
    assert solve(posed).pairs["pair"].force == pytest.approx(whole.pairs["pair"].force, rel=1e-9)
    with pytest.raises(InputError, match=r"base.npz: axial: this superelement is a body of revol"):
        solve(posed.model_copy(update={"symmetry": None}))


def test_what_is_no_body_of_revolution_is_refused():
    held = parts(bottom=CLAMPED, right=FREE)
    top = {"part": "top", "condition": "contact", "normal": "unilateral", "gap": -0.01}
    left = {"part": "left", **FREE}
    usual = {
        "material": LOADED,
        "mesh": {"element_size": 0.5, "order": 1},
        "boundary": [*held, top],
        **rectangle([0, 0], [1, 1]),
    }
    pushed = parts(bottom={"condition": "displacement", "value": [0.1, 0]}, right=FREE)
    around = {"part": "left", "condition": "periodic", "partner": "right"}
    punched = {"boundary": held, "contact": [touching("pair", "top", "punch")]}
    punch = {"name": "punch", "displacement": [0, -0.01]}
    force = [1, 1]
    for text, changes in {
        r"case.toml: geometry: side 'bottom' has r < 0 at \(-1, 0\)": {
            **rectangle([-1, 0], [1, 1]),
            "boundary": [*held, top, left],
        },
        r"case.toml: boundary\[3\].part: 'left' lies on the axis x = 0": {
            "boundary": [*held, top, left]
        },
        r"bottom.value\[0\]: is 0.1 at \(0, 0\), on the axis, where u_r is 0": {
            "boundary": [*pushed, top]
        },
        "left.partner: 'right' lies at other radii": {
            **rectangle([1, 0], [2, 1]),
            "boundary": [around, *parts(bottom=CLAMPED), top],
        },
        "obstacle 'punch': rotation: nothing turns about the axis here": {
            **punched,
            "obstacle": [{**punch, "rotation": "free"}],
        },
        r"'punch': force\[0\]: it moves along the axis of revolution only, got 1": {
            **punched,
            "obstacle": [{**punch, "force": [1, 0]}],
        },
        "material.plane: a body of revolution is no plate": {
            "material": {**STEEL, "plane": "stress"}
        },
        "compresses boundaries of plane bodies": {"bem": {"mat_type": "hodlr"}},
        r"acceleration\[0\]: is 9.8": {"loads": {"acceleration": [9.8, 0]}},
        r"loads.centre\[0\]: is 1; a body of revolution turns about its axis": {
            "loads": {"angular_velocity": 1, "centre": [1, 0]}
        },
        r"point_force\[0\].force\[0\]: is 1 on the axis": {
            "point_force": [{"at": [0, 0.5], "force": force}]
        },
        r"point_force\[0\].at: \[-0.5, 0.5\] does not lie inside the body": {
            "point_force": [{"at": [-0.5, 0.5], "force": force}]
        },
    }.items():
        with pytest.raises(InputError, match=text):
            solve(problem(**{**usual, **changes}))


@pytest.mark.parametrize(("name", "least"), [("cone", 1e-3), ("flat", np.inf)])
def test_indenters_of_a_half_space(name, least):
    """The pressure of a cone has a logarithm on the axis, which meshes are graded to; that of a
    flat punch is not square integrable."""
    found = adapt(indented(name), 1e-2)
    force, pressure = indented_errors(name, found)
    assert found.converged and found.accuracy.error < 1e-2
    assert force < 1e-5 and pressure < least


def test_a_random_problem_reaches_what_is_wanted_and_reports_no_less_than_the_error():
    """One of those that scripts/verify_axial draws."""
    (found,) = solved(random_revolution, 1, 0, [2e-2], 2e-4)
    assert found.status == "converged"
    assert found.true <= min(found.accuracy, found.estimate)
