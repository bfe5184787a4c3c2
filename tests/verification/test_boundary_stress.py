"""Stress on the boundary of solved problems against closed forms: rings, holes, contact edges,
volume loads, corners."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from marks import slow
from shapes import closing, drawn, elastic, moved, problem, rectangle, rollers
from verification.test_exact_blocks import GIVEN, exact, solved
from verification.test_exact_solutions import METHOD, STEEL, Kirsch, Lame
from verification.test_volume_loads import ALPHA, E, heated

from petcontact import (
    InputError,
    MeshOptions,
    Problem,
    read_result,
    solve,
)
from petcontact.fields.boundary.places import best_places

pytestmark = pytest.mark.usefixtures("unestimated")


@pytest.mark.slow
@pytest.mark.parametrize(("problem", "bound"), [(Lame, 1.1e-4), (Kirsch, 2e-4)])
def test_a_ring_and_a_hole(problem, bound, tmp_path):
    """Nodal stress in the file, too, and points given by coordinates."""
    solution = solve(
        Problem(
            material=STEEL,
            geometry=problem.body,
            mesh=MeshOptions(element_size=0.2, order=3),
            boundary=problem.boundary,
            method=METHOD,
        )
    )
    mesh = solution.mesh
    at = mesh.variables_at(*best_places(mesh))
    x = np.column_stack([at["x"], at["y"]])
    stress = problem.exact(x)[1]
    assert np.abs(solution.stress_at(x) - stress).max() < bound * np.abs(stress).max()
    # next to the boundary, too, but for the ends of parts
    ends = mesh.start[mesh.part != np.roll(mesh.part, 1)]
    away = np.linalg.norm(x[:, None] - ends, axis=2).min(axis=1) > 0.1
    normal = np.column_stack([at["nx"], at["ny"]])
    for depth in (1e-5, 1e-3, 1e-2):
        under = (x - depth * normal)[away]
        off = np.abs(solution.stress_at(under) - problem.exact(under)[1])
        assert off.max() < bound * np.abs(stress).max()
    solution.save(tmp_path / "r.h5")
    with h5py.File(tmp_path / "r.h5") as file:
        stored = file["boundary/stress"][()]
        assert file["boundary/stress"] == file["steps/1/body/body/stress"]
    exact_nodes = problem.exact(mesh.x)[1]
    assert np.abs(stored - exact_nodes).max() < bound * np.abs(exact_nodes).max()
    again = read_result(tmp_path / "r.h5").stress_on_boundary()
    assert np.abs(again - stored).max() < 1e-10 * np.abs(stored).max()


@pytest.mark.parametrize(("order", "levels", "bound"), [(4, 6, 3e-4), slow(5, 8, 1e-4)])
def test_stress_along_contact_graded_to_its_edges(order, levels, bound):
    """σ_xx under Cattaneo's tractions, on the secondary and on the primary."""
    solution = solved(order=order, levels=levels, grading=0.3, graded_points=GIVEN)
    for body, part, side in (("lower", "top", 1.0), ("upper", "bottom", -1.0)):
        own = solution.meshes[body]
        element, place = best_places(own)
        here = own.part[element] == own.part_names.index(part)
        at = own.variables_at(element[here], place[here])
        x = np.column_stack([at["x"], at["y"]])
        wanted = exact(side * x)[1]
        found = solution.stress_at(x, body, part=part)[:, 0]
        assert np.abs(found - wanted).max() < bound * np.abs(wanted).max()


def test_heat():
    """A clamped block has -EαT/(1-2ν) everywhere, on the boundary as inside."""
    held = [moved(part, [0, 0]) for part in ("left", "right", "top")]
    clamped = heated(40.0, [closing("bottom"), *held], order=2)
    state = clamped.state_at([[0.0, 0.3], [1.3, 1.0], [1.0, 0.5]])
    pressed = -E * ALPHA * 40.0 / 0.4
    assert np.allclose(state.stress, [pressed, pressed, 0.0], rtol=1e-11, atol=1e-11 * -pressed)
    assert np.allclose(state.sigma_zz, pressed, rtol=1e-11)


def test_both_sides_of_a_corner_and_what_is_refused():
    """Pulled along x between rollers in steps: at a corner each part has its own stress, here the
    same."""
    block = problem(
        material=elastic(200.0, 0.3),
        geometry=rectangle([0, 0], [2, 1]),
        mesh={"element_size": 0.5, "order": 1},
        boundary=[
            *rollers("left"),
            closing("bottom"),
            drawn("right", [3.0, 0]),
            drawn("top", [0, 0]),
        ],
        step=[{"name": "half", "increments": 2}, {"name": "whole"}],
    )
    solution = solve(block)
    for part in ("right", "top"):
        assert np.allclose(solution.stress_at([[2.0, 1.0]], part=part), [3.0, 0.0, 0.0], atol=1e-11)
    assert np.allclose(
        solution.stress_at([[2.0, 0.4], [1.0, 0.5]], step=1), [1.5, 0.0, 0.0], atol=1e-11
    )
    assert np.allclose(
        solution.at([[2.0, 1.0]]), [[6.0 * (1 - 0.3**2) / 200.0, -3.0 * 0.3 * 1.3 / 200.0]]
    )
    with pytest.raises(InputError, match="no part 'rigth', did you mean 'right'"):
        solution.stress_at([[2.0, 1.0]], part="rigth")
    with pytest.raises(InputError, match=r"part 'right': the point \(1, 0.5\) does not lie on it"):
        solution.stress_at([[2.0, 0.5], [1.0, 0.5]], part="right")
    with pytest.raises(InputError, match="does not lie inside"):
        solution.stress_at([[2.0, 1.001]])
