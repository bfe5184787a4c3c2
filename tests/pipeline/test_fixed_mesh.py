"""The error of a mesh that the user fixed: against the reference of the examples, and by what
changes with the order of panels."""

from __future__ import annotations

import importlib
import math
from pathlib import Path

import numpy as np
import pytest
from examples import example
from scipy.interpolate import CubicSpline
from shapes import (
    closing,
    cuboid,
    drawn,
    elastic,
    moved,
    problem,
    rectangle,
    rollers,
    solid,
)

from petcontact import (
    MeshOptions,
    load,
    solve,
)
from petcontact.errors import PetcontactError, SolverError
from petcontact.pipeline.adapt import fixed_mesh
from petcontact.pipeline.adapt.fixed_mesh import with_estimate
from petcontact.pipeline.adapt.level_solver import LevelSolver
from petcontact.results.evaluated import displacement_scale


@pytest.mark.parametrize(("number", "h"), [(1, 0.2), (2, 0.1)])
def test_error_of_constant_elements(number, h, comm, request):
    solution = with_estimate(
        solve(example(number, mesh=MeshOptions(element_size=h)), comm=comm), comm
    )
    x, u = np.loadtxt(
        request.config.rootpath / "tests" / "paper" / f"example{number}_u_t.csv",
        delimiter=",",
        skiprows=1,
    ).T
    exact, weight = CubicSpline(x, u)(solution.contact.x[:, 0]), solution.contact.weight
    true = np.sqrt(weight @ (solution.contact.u_t[:, 0] - exact) ** 2 / (weight @ exact**2))
    assert 0.4 < true / solution.accuracy.error < 1.5
    assert "against half as many elements" in solution.verdict()


@pytest.mark.parametrize("known", [True, False])
def test_a_mesh_that_none_follows_is_compared_with_half_as_many_elements(known, comm, monkeypatch):
    """Or the verdict says in its first line that the error is not known, and why."""
    once, levels = LevelSolver._once, []

    def first_only(self, meshes, last, error):
        levels.append(meshes.level)
        if len(levels) > 1:
            raise SolverError("iterate", "no second mesh", "no advice")
        return once(self, meshes, last, error)

    def refused(*args):
        raise PetcontactError("no coarser mesh")

    monkeypatch.setattr(LevelSolver, "_once", first_only)
    if not known:
        monkeypatch.setattr(fixed_mesh, "_coarser", refused)
    solution = solve(example(1, mesh=MeshOptions()), comm=comm)
    error, said = solution.accuracy.error, "no second mesh"
    assert len(levels) == 2 and solution.converged == known
    if known:
        assert 1e-4 < error < 0.1 and said in " ".join(solution.warnings)
    else:
        assert error == np.inf
        assert f"the error is not known, 0.0001 was wanted: iterate: {said}" in solution.reason
        assert solution.verdict().splitlines()[1].startswith("  the error is not known")


@pytest.mark.parametrize(
    ("gap", "load", "said"),
    [
        (0.0, [0.29, -1.0], "half as many elements is not solved"),
        (0.1, [0.0, 0.0], "contact carries nothing"),
    ],
)
def test_an_error_that_is_not_known_has_its_own_reason(gap, load, said, comm):
    """A block just below the limit of friction, on so few nodes that half of them tip over; and one
    above its floor."""
    bottom = closing("bottom", normal="unilateral", gap=gap, friction_coefficient=0.3)
    left = (moved if gap else drawn)("left", [0.0, 0.0])
    block = problem(
        material=elastic(100.0, 0.3),
        geometry=rectangle([0.0, 0.0], [1.0, 1.0]),
        mesh={"element_size": 0.25},
        boundary=[bottom, drawn("top", load), left, drawn("right", [0.0, 0.0])],
    )
    solution = with_estimate(solve(block, comm=comm), comm)
    assert solution.converged and said in solution.accuracy.unknown


SPACE_B = Path(__file__).parents[2] / "configs" / "space_b.toml"


def block(order, size, bound=0.02, beside=2.0):
    """A block on its bottom face, held at its top, pushed and twisted at one side; panels beside
    the contact are larger."""
    sizes = {"element_size": beside * size, "element_sizes": {"bottom": size}}
    changes = {
        "material": elastic(1.0, 0.3),
        "geometry": cuboid([0.0] * 3, [1.0, 1.0, 1.6]),
        "mesh": {"order": order, **sizes},
        "boundary.0.friction_bound": bound,
        "boundary.2.value": [0.04, 0.03, 0.0],
        "boundary.4.value": [0.0] * 3,
    }
    return load(SPACE_B, changes)


def apart(solution, fine):
    """‖u_t - u_t'‖ of two solutions over ‖u_t'‖, at the nodes of the second one."""
    mesh, (numbers, faces) = solution.mesh, solution.mesh.faces("bottom")
    up = np.tile([0.0, 0.0, 1.0], (len(fine.contact.x), 1))
    hits = faces.cast(fine.contact.x - 0.1 * up, up)
    u = mesh.basis_at(numbers[hits.face], hits.place) @ solution.u - fine.u[fine.contact.nodes]
    return math.sqrt(fine.contact.weight @ np.sum(u[:, :2] ** 2, axis=1)) / displacement_scale(fine)


@pytest.mark.slow
def test_the_error_of_coarse_sides_is_bounded():
    """Of orders 1 to 3, against finer panels, and where linear panels as large as the sides see
    nothing of their bending."""
    fine = solve(block(2, 1.0 / 3.0, beside=1.0))
    for order, beside in ((1, 4.0), (2, 2.0), (3, 2.0)):
        solution = solve(block(order, 0.5, beside=beside))
        assert 0.98 < solution.accuracy.error / apart(solution, fine) < 5.0


def test_where_nothing_slips_nor_nearly_does_the_error_is_zero():
    sticks, slips = (solve(block(2, 0.5, bound)) for bound in (10.0, 0.02))
    assert np.abs(sticks.contact.u_t).max() < 1e-12
    assert sticks.accuracy.error == 0.0 < slips.accuracy.error


def test_the_only_element_of_a_side_is_another_one_on_the_mesh_before():
    """What two meshes share shows no error: a notch with one element a side."""
    corners = [[0, 0], [2, 0], [2, 1], [1.1, 1], [1.0, 0.5], [0.9, 1], [0, 1]]
    parts = ["bottom", "right", "top", "notch 1", "notch 2", "top", "left"]
    shape = {"shape": "polygon", "vertices": corners, "parts": parts}
    ends = drawn("left", [-1.0, 0.0]), drawn("right", [1.0, 0.0])
    mesh = {"element_size": 0.5, "order": 2}
    solution = solve(problem(body=[solid("bar", shape, *ends, *rollers("bottom"), mesh=mesh)]))
    now, before = (each.meshes["bar"] for each in (solution, solution.coarser))
    for part in ("notch 1", "notch 2"):
        orders = [mesh.order[mesh.elements_of(part)].tolist() for mesh in (now, before)]
        assert orders == [[2], [1]]


def test_peak_memory_is_that_after_the_errors_are_judged(monkeypatch):
    """Judging took .25 GB of 1 GB that the verdict did not have."""
    module, done = importlib.import_module("petcontact.pipeline.solve"), []

    def judged(solution, *args):
        done.append("judged")
        return solution

    monkeypatch.setattr(module, "with_estimate", judged)
    monkeypatch.setattr(module, "peak_memory", lambda comm: done.append("peak") or 7e9)
    solution = solve(example(1, mesh=MeshOptions(element_size=1.0)))
    assert done == ["judged", "peak"] and "peak memory 7.00 GB" in solution.verdict()
