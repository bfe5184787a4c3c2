"""The error of a mesh that the user fixed, against the reference of the examples."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import example
from scipy.interpolate import CubicSpline

from petcontact import MeshOptions, solve
from petcontact.geometry.outline import as_outline
from petcontact.mesh.grading import mesh_outline
from petcontact.pipeline.adaptive.fixed_mesh import CHEAP, joined, with_estimate


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("h", [0.2, 0.1])
def test_error_of_constant_elements(number, h, comm, request):
    solution = with_estimate(solve(example(number, mesh=MeshOptions(element_size=h)), comm=comm), comm)
    x, u = np.loadtxt(request.config.rootpath / "tests" / "paper" / f"example{number}_u_t.csv", delimiter=",", skiprows=1).T
    exact, weight = CubicSpline(x, u)(solution.contact.x[:, 0]), solution.contact.weight
    true = np.sqrt(weight @ (solution.contact.u_t[:, 0] - exact) ** 2 / (weight @ exact**2))
    assert 0.4 < true / solution.info["estimated_error"] < 1.5
    assert "against half as many elements" in solution.verdict()


def test_large_meshes_are_left_alone(comm):
    large = solve(example(1, mesh=MeshOptions(element_size=0.019)), comm=comm)
    assert large.mesh.n_nodes > CHEAP and "estimated_error" not in with_estimate(large, comm).info


def test_pairs_are_joined_and_the_odd_one_left():
    outline = as_outline(example(1).geometry.outline(), "a test")
    mesh = mesh_outline(outline, MeshOptions(element_size=8.0 / 5.0))
    coarse = joined(mesh, outline)
    assert mesh.n_elements == 5 + 3 + 5 + 3 and coarse.n_elements == 3 + 2 + 3 + 2
    assert coarse.length.sum() == pytest.approx(24.0) and coarse.length.max() == pytest.approx(3.2)
