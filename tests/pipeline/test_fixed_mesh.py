"""The error of a mesh that the user fixed, against the reference of the examples."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from scipy.interpolate import CubicSpline
from shapes import closing, drawn, elastic, moved, problem, rectangle

from petcontact import (
    MeshOptions,
    solve,
)
from petcontact.errors import PetcontactError, SolverError
from petcontact.geometry.outline import as_outline
from petcontact.mesh.grading import mesh_outline
from petcontact.pipeline.adapt import fixed_mesh
from petcontact.pipeline.adapt.fixed_mesh import joined, with_estimate
from petcontact.pipeline.adapt.level_solver import LevelSolver


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


def test_pairs_are_joined_from_both_ends_and_what_is_odd_lies_in_the_middle():
    """So the estimate does not depend on where a side begins, and sees the ends, where errors are
    largest."""
    outline = as_outline(example(1).geometry.outline(), "a test")
    mesh = mesh_outline(outline, MeshOptions(element_size=8.0 / 5.0))
    coarse = joined(mesh, outline)
    assert mesh.n_elements == 5 + 3 + 5 + 3
    np.testing.assert_allclose(coarse.length, 2 * [3.2, 1.6, 3.2, 4.0])
    coarse = joined(mesh_outline(outline, MeshOptions(element_size=8.0 / 7.0)), outline)
    np.testing.assert_allclose(coarse.length * 7.0 / 8.0, 2 * [2.0, 3.0, 2.0, 1.75, 1.75])


@pytest.mark.parametrize("known", [True, False])
def test_a_mesh_that_none_follows_is_compared_with_half_as_many_elements(known, comm, monkeypatch):
    """Or the verdict says in its first line that the error is not known, and why."""
    once, levels = LevelSolver._once, []

    def first_only(self, strategy, level, last):
        levels.append(level)
        if len(levels) > 1:
            raise SolverError("iterate", "no second mesh", "no advice")
        return once(self, strategy, level, last)

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
