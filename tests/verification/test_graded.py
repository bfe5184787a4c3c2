"""Examples 1 and 2 on uniform and on graded meshes: errors over the number of elements, energy,
transition points.

Reference figures are copied from converged finite elements of order 4 on graded triangles (plane
strain; the last two refinements agree to 1e-11 in the energy and 5e-9 in u_t);
tests/paper/example*_u_t.csv holds u_t itself.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from conftest import example
from scipy.interpolate import CubicSpline

from petcontact import MeshOptions, solve

pytestmark = pytest.mark.usefixtures("unestimated")

ENERGY = {1: -57.33072119395112, 2: -1708.0131192238318}
FRICTION = {1: 11.769261272421286, 2: 455.87759261972184}
SIGMA_T = {1: -741.9213651876003, 2: -364.3738052669273}
SIGMA_N = {1: -424.2001502152988, 2: -905.2842032517168}
LARGEST = {1: 0.05918620517628334, 2: 0.8491954500478794}
TRANSITIONS = {
    1: (3.377767813205719, 7.999854958057404),
    2: (2.4115453362464914, 8.435704696178437),
}
UNIFORM = [{"element_size": h} for h in (0.2, 0.1, 0.05)]
GRADED = [
    {"order": order, "levels": levels, "grading": grading}
    for order, levels, grading in ((1, 4, 0.25), (2, 6, 0.25), (3, 8, 0.35))
]


def run(number, **mesh):
    if "grading" in mesh:
        mesh["graded_points"] = [(x, 0.0) for x in TRANSITIONS[number]]
    solution = solve(example(number, mesh=MeshOptions(**mesh), tolerance=1e-8, max_iterations=5000))
    assert solution.converged
    return solution


def figures(solution, number):
    """Nodes, and errors relative to the reference: u_t in L2(Γ_C), total energy, friction energy,
    two resultants, max."""
    mesh, contact = solution.mesh, solution.contact
    weight = contact.weight
    x, u = np.loadtxt(
        Path(__file__).parents[1] / "paper" / f"example{number}_u_t.csv", delimiter=",", skiprows=1
    ).T
    exact = CubicSpline(x, u)(contact.x[:, 0])
    pushed = np.concatenate([mesh.nodes_of("left"), mesh.nodes_of("right")])
    work = mesh.weight[pushed] @ np.sum(solution.traction[pushed] * solution.u[pushed], axis=1)
    friction = weight @ (contact.friction_bound * np.abs(contact.u_t[:, 0]))
    return mesh.n_nodes, np.array(
        [
            np.sqrt(weight @ (contact.u_t[:, 0] - exact) ** 2 / (weight @ exact**2)),
            # the work of the tractions on Γ_C is -friction, so that a(u, u) = work - friction
            abs(0.5 * (friction - work) / ENERGY[number] - 1.0),
            abs(friction / FRICTION[number] - 1.0),
            abs(weight @ contact.sigma_t[:, 0] / SIGMA_T[number] - 1.0),
            abs(weight @ contact.sigma_n / SIGMA_N[number] - 1.0),
            abs(np.abs(contact.u_t).max() / LARGEST[number] - 1.0),
        ]
    )


def rates(results):
    """Orders in the number of nodes, of every figure."""
    return [
        np.log(coarse[1] / fine[1]) / np.log(fine[0] / coarse[0])
        for coarse, fine in itertools.pairwise(results)
    ]


@pytest.mark.parametrize("number", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_graded_meshes_converge_faster_than_uniform_ones(number):
    uniform, graded = (
        [figures(run(number, **mesh), number) for mesh in meshes] for meshes in (UNIFORM, GRADED)
    )
    # uniform constant elements: first order; graded ones with rising order: beyond any order of
    # uniform meshes
    for rate in rates(uniform):
        assert 0.9 < rate[0] < 1.2
    for rate in rates(graded):
        assert rate[0] > 2.5
    nodes, errors = graded[-1]
    assert nodes < uniform[-1][0]
    assert np.all(errors < (1e-5, 3e-6, 1e-5, 1e-4, 1e-3, 1e-4)), errors
    assert errors[0] < 0.01 * uniform[-1][1][0]


@pytest.mark.parametrize("number", [1, 2])
def test_transition_points_of_a_graded_mesh(number):
    """Found to a hundredth although the mesh is graded towards guesses that lie 0.05 beside
    them."""
    guesses = [(x + 0.05, 0.0) for x in TRANSITIONS[number] if x < 7.9 or number == 2]
    mesh = MeshOptions(order=2, levels=8, element_size=0.1, grading=0.35, graded_points=guesses)
    solution = solve(example(number, mesh=mesh, tolerance=1e-8, max_iterations=5000))
    ends = [zone.end for zone in solution.zones][: len(guesses)]
    assert np.abs(np.array(ends) - TRANSITIONS[number][: len(guesses)]).max() < 0.015
