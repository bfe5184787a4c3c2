"""Cattaneo and Mindlin on two finite blocks cut out of half planes: the field is exact, so that
orders can be measured.

Muskhelishvili's potentials of p = p_0 sqrt(1 - x²/a²) and q = µp - µ p_0 c/a sqrt(1 - x²/c²); the
far sides carry the exact displacement and traction. `scripts/verify` prints errors and orders.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from shapes import moved, problem, rectangle, solid, touching
from smooth_field import pull
from verification.cases.half_planes import SHEAR, TWO, cattaneo_field

from petcontact.pipeline.adapt import level_solver
from petcontact.pipeline.adapt import loop as adaptive
from petcontact.pipeline.pose import discretise as assemble
from petcontact.pipeline.run import prepare, run


def discretise(posed, make_mesh=None, law=None):
    """The problem with exact data at the end of its step."""
    discrete = assemble.discretise(posed, make_mesh, law)
    for sign, far, mesh, data in zip(
        (1.0, -1.0), ("bottom", "top"), discrete.meshes, discrete.data, strict=True
    ):
        part = np.array(mesh.part_names)[mesh.node_part]
        held, sides = part == far, (part == "left") | (part == "right")
        u, *stress = cattaneo_field(sign * mesh.x)
        data.value[1, held] = sign * u[held]
        data.value[1, sides] = pull(np.column_stack(stress), mesh.normal)[sides]
    return discrete


def blocks(**mesh):
    held = {"lower": ([-3, -3], [3, 0], "bottom"), "upper": ([-3, 0], [3, 3], "top")}
    bodies = [
        solid(name, rectangle(low, high), moved(far, [0.0, 0.0]), mesh=mesh)
        for name, (low, high, far) in held.items()
    ]
    law = {"friction_coefficient": 0.4, "gap": "x**2/2"}
    pair = touching("pair", "lower.top", "upper.bottom", **law)
    return problem(body=bodies, contact=[pair], step=[{"increments": 1}])


def errors(solution):
    """Relative L2 errors of p and q; τ points to -x on the lower block's top."""
    pair = solution.last.pairs["pair"]
    x, weight = pair.x[:, 0], pair.weight
    both = zip(
        (pair.pressure, -pair.sigma_t[:, 0]), (TWO.pressure(x), SHEAR.traction(x)), strict=True
    )
    return np.array([np.sqrt(weight @ (a - b) ** 2 / (weight @ b**2)) for a, b in both])


def solved(**mesh):
    posed = blocks(**mesh)
    solution = run(prepare(posed, discrete=discretise(posed)))
    assert solution.converged, solution.reason
    return solution


GIVEN = [[-1.0, 0.0], [-0.6, 0.0], [0.6, 0.0], [1.0, 0.0]]


@pytest.mark.parametrize(
    ("order", "sizes", "rate", "last"),
    [(0, (0.2, 0.1, 0.05), 0.75, (9e-3, 1.8e-2)), (3, (0.4, 0.2), 0.9, (1.4e-3, 2.8e-3))],
)
def test_uniform_meshes_are_of_first_order(order, sizes, rate, last):
    found = [errors(solved(element_size=h, order=order)) for h in sizes]
    assert np.all(found[-1] <= last), found[-1]
    for coarse, fine in itertools.pairwise(found):
        assert np.all(np.log2(coarse / fine) > rate)


def test_meshes_graded_to_given_edges():
    assert np.all(
        errors(solved(graded_points=GIVEN, levels=4, order=3, grading=0.3)) < (1e-4, 2.7e-4)
    )


@pytest.mark.slow
def test_edges_are_found(monkeypatch):
    """Joints go to the edges of contact and stick, mesh after mesh; the estimate is honest."""
    monkeypatch.setattr(level_solver, "discretise", discretise)
    solution = adaptive.adapt(blocks(), 2e-4)
    assert solution.converged and np.all(errors(solution) < (5e-6, 2e-5))
    assert errors(solution).max() < solution.accuracy.error <= 2e-4
    assert np.allclose(
        np.array(solution.accuracy.edges["pair"]) - 3.0, [-1.0, -0.6, 0.6, 1.0], atol=1e-6
    )
    assert max(step.iterations for step in solution.steps) <= 6
