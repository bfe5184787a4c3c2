"""Torsion of bodies of revolution against closed forms: shafts, press fits and their limits."""

from __future__ import annotations

import numpy as np
import pytest
from axial_forms import disc_error, turned_disc
from shapes import drawn, elastic, moved, problem, rectangle, touching

from petcontact import InputError, solve

SHEAR, TWIST = 200.0 / 2.6, 0.01


def ring(inner, outer, height, *conditions):
    return {
        "material": elastic(200.0, 0.3),
        "geometry": rectangle([inner, 0.0], [outer, height]),
        "mesh": {"element_size": 0.5, "order": 2},
        "boundary": list(conditions),
    }


@pytest.mark.parametrize("inner", [0.0, 0.5])
def test_a_shaft_is_twisted(inner):
    """T = G J φ/L; σ_zθ = G φ r/L inside and on the boundary, and nothing else."""
    sides = ("right",) if inner == 0.0 else ("left", "right")
    ends = moved("bottom", [0.0] * 3), moved("top", ["free", "free", f"{TWIST}*x"])
    shaft = ring(inner, 1.0, 3.0, *ends, *(drawn(side, [0.0, 0.0]) for side in sides))
    solution = solve(problem(symmetry="axial", **shaft))
    mesh, rate = solution.mesh, SHEAR * TWIST / 3.0
    top = mesh.nodes_of("top")
    torque = mesh.motions.moment(mesh.x[top], mesh.weight[top, None] * solution.traction[top])
    assert torque == pytest.approx(0.5 * np.pi * (1.0 - inner**4) * rate, rel=1e-9)
    x = np.array([[0.7, 1.0], [0.999, 2.0], [0.6, 2.9999]])
    wanted = np.zeros((3, 6))
    wanted[:, 5] = rate * x[:, 0]
    assert np.allclose(solution.state_at(x).stress, wanted, rtol=0.0, atol=1e-9 * rate)
    assert np.allclose(solution.von_mises_at(x), np.sqrt(3.0) * wanted[:, 5], rtol=1e-9)
    assert np.allclose(solution.stress_on_boundary()[:, 5], rate * mesh.x[:, 0], atol=1e-9 * rate)


def test_a_hot_hub_that_only_contact_holds_is_the_one_without_torsion():
    """Heat has no torque, so a third component that is 0 changes nothing."""
    held = moved("bottom", [0.0, 0.0])
    expanding = {**elastic(200.0, 0.3), "thermal_expansion": 1e-5}
    heat = {"material": expanding, "loads": {"temperature": "x"}}
    pairs = []
    for still in (held, {**held, "value": [0.0, 0.0, 0.0]}):
        hot = problem(
            symmetry="axial",
            body=[
                {"name": "shaft", **ring(0.0, 1.0, 2.0, still)},
                {"name": "hub", **ring(1.0, 2.0, 2.0), **heat},
            ],
            contact=[touching("fit", "hub.left", "shaft.right", gap=-1e-3, friction_bound=0.1)],
        )
        pairs.append(solve(hot).pairs["fit"])
    assert pairs[1].pressure == pytest.approx(pairs[0].pressure, rel=1e-8)
    assert pairs[1].sigma_t[:, :1] == pytest.approx(pairs[0].sigma_t, abs=1e-8)


def test_a_force_inside_a_hub_that_only_contact_holds_is_a_torque_of_its_arm():
    """The contact carries the force along the axis, and round it F r."""
    hub = ring(1.0, 2.0, 2.0) | {"point_force": [{"at": [1.6, 1.0], "force": [0.0, 0.02, 0.05]}]}
    pushed = problem(
        symmetry="axial",
        body=[
            {"name": "shaft", **ring(0.0, 1.0, 2.0, moved("bottom", [0.0, 0.0, 0.0]))},
            {"name": "hub", **hub},
        ],
        contact=[touching("fit", "hub.left", "shaft.right", gap=-1e-2, friction_coefficient=0.5)],
    )
    pair = solve(pushed).pairs["fit"]
    assert pair.force[1] == pytest.approx(-0.02, rel=1e-6)
    assert pair.moment == pytest.approx(-0.05 * 1.6, rel=1e-6)


def test_one_bound_for_both_directions():
    """A hub that is pulled and turned: the shear has the size µ p, against the slip."""
    ends = moved("bottom", ["free", 0.0, 0.0]), moved("top", ["free", 0.0, "free"])
    shaft = ring(0.0, 1.0, 2.0, *ends)
    hub = ring(1.0, 2.0, 2.0, moved("right", ["free", 0.0, 0.0]))
    law = {"gap": -1e-3, "friction_coefficient": 0.1}
    turn = {"body": "hub", "part": "right", "value": ["free", 4e-3, 4e-3]}
    pulled = problem(
        symmetry="axial",
        body=[{"name": "shaft", **shaft}, {"name": "hub", **hub}],
        contact=[touching("fit", "hub.left", "shaft.right", **law)],
        step=[{"name": "press"}, {"name": "turn", "boundary": [turn]}],
    )
    pair = solve(pulled).pairs["fit"]
    slips = pair.state == 1
    assert slips.sum() > 10
    size = np.linalg.norm(pair.sigma_t, axis=1)
    assert np.allclose(size[slips], 0.1 * pair.pressure[slips], rtol=1e-6)
    assert np.all(np.abs(pair.sigma_t[slips]).min(axis=0) > 0.0)
    unit = pair.slip_increment / np.linalg.norm(pair.slip_increment, axis=1)[:, None]
    assert np.allclose(pair.sigma_t[slips], -size[slips, None] * unit[slips], atol=1e-6)


def test_a_disc_turns_a_half_space():
    """The shear is infinite where the disc ends, and nothing but u_θ is held there."""
    assert disc_error(solve(turned_disc())) < 1e-3


def test_what_is_refused():
    held, free = (
        moved("bottom", [0.0, 0.0, 0.1]),
        [drawn(part, [0, 0]) for part in ("right", "top")],
    )
    with pytest.raises(InputError, match=r"bottom.value\[2\]: is 0.1 .* where u_θ is 0"):
        solve(problem(symmetry="axial", **ring(0.0, 1.0, 1.0, held, *free)))
