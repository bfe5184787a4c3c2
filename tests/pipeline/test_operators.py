"""Operators in public: they are those of the solve, of every kind of problem, and elastostatics
follows from them."""

from __future__ import annotations

import doctest
from pathlib import Path

import numpy as np
import pytest
from marks import some
from shapes import drawn, elastic, moved, problem, rectangle, solid

import petcontact.pipeline.public_operators as module
from petcontact import (
    InputError,
    load,
    operators,
    solve,
)

pytestmark = pytest.mark.usefixtures("unsampled", "unestimated")

CONFIGS = Path(__file__).parents[2] / "configs"
PROBLEMS = {
    "plane, one body": ("example1", {"mesh.element_size": 0.5}),
    "plane, bodies": ("stack", {"body.0.mesh.element_size": 0.5, "body.1.mesh.element_size": 0.5}),
    "space, one body": ("space_b", {"mesh.element_size": 2.0, "mesh.order": 0}),
    "space, bodies": (
        "space_stack",
        {f"body.{k}.mesh": {"element_size": 1.0, "order": 1} for k in range(2)},
    ),
}


@pytest.mark.parametrize("kind", some(PROBLEMS.keys() - {"space, bodies"}, PROBLEMS))
def test_a_solution_satisfies_the_operators(kind):
    """v = u_0 + Sσ + Mα - gap at what the solve found, and ½u + Hu = Gt in each body."""
    name, changes = PROBLEMS[kind]
    posed = load(CONFIGS / f"{name}.toml", changes)
    if posed.step:
        posed = posed.model_copy(update={"step": posed.step[:1]})
    solution, found = solve(posed), operators(posed)
    assert solution.converged and list(found.pairs) == list(solution.pairs)
    sigma, slip = (
        np.concatenate([getattr(pair, key) for pair in solution.pairs.values()])
        for key in ("sigma_t", "slip")
    )
    k = found.frame.shape[1]
    if k > sigma.shape[1]:
        sigma = np.column_stack(
            [sigma, -np.concatenate([pair.pressure for pair in solution.pairs.values()])]
        )
    moved = found.u_0 + (found.S @ sigma.ravel()).reshape(sigma.shape)
    assert np.allclose(found.apply(sigma), moved - found.u_0, atol=1e-12 * np.abs(moved).max())
    if not found.modes.shape[1] and not posed.obstacle:
        assert np.allclose(moved[:, : slip.shape[1]], slip, atol=1e-9 * np.abs(moved).max())
    assert np.array_equal(found.x, np.concatenate([pair.x for pair in solution.pairs.values()]))
    assert found.states.shape[0] == 2 and not found.states[0].any()
    if max(mesh.n_nodes for mesh in solution.meshes.values()) < 400:
        for key, body in found.bodies.items():
            u, t = solution.bodies[key].u.ravel(), solution.bodies[key].traction.ravel()
            defect = 0.5 * u + body.H @ u - body.G @ t
            if not body.eliminated.modes.shape[2]:
                assert np.abs(defect).max() <= 1e-9 * np.abs(u).max()
    matrix = found.petsc()
    assert matrix.getSize() == found.S.shape and np.array_equal(matrix.getDenseArray(), found.S)
    matrix.destroy()
    found.close()


def test_rows_of_h_sum_to_minus_a_half():
    """Rigid motions need no tractions."""
    body = operators(load(CONFIGS / "example1.toml", {"mesh.element_size": 0.5})).body
    n = body.mesh.n_nodes
    for c in range(2):
        motion = np.tile(np.eye(2)[c], n)
        assert np.allclose(body.H @ motion, -0.5 * motion, atol=1e-12)
    assert body.petsc("G").getSize() == (2 * n, 2 * n)
    with pytest.raises(InputError, match="no operator 'K'; there are G, H, S"):
        body.petsc("K")


def test_what_cannot_be_is_refused():
    held = problem(
        material=elastic(1.0, 0.3),
        geometry=rectangle([0, 0], [1, 1]),
        mesh={"element_size": 0.5},
        boundary=[
            moved("left", [0, 0]),
            *(drawn(part, [0, 0]) for part in ("right", "top", "bottom")),
        ],
    )
    found = operators(held)
    assert found.S.shape == (0, 0) and not found.pairs
    with pytest.raises(InputError, match="no part is in contact"):
        found.apply([])
    with pytest.raises(InputError, match="there are several"):
        _ = operators(CONFIGS / "stack.toml").body


def test_curved_panels_are_integrated_to_the_tolerance_that_is_asked_for():
    """1e-8 of the largest entries by default, 2e-10 with 1e-11."""
    sphere, mesh = {"shape": "sphere", "centre": [0, 0, 0], "radius": 1.0}, {"element_size": 1.0}
    held = [moved(part, [0.0] * 3) for part in ("left", "right", "front", "back", "bottom", "top")]
    ball = solid("ball", sphere, *held, mesh={**mesh, "order": 1})
    exact, asked, usual = (
        operators(problem(body=[ball], bem=bem)).bodies["ball"]
        for bem in ({"quadrature_tol": 1e-13}, {"quadrature_tol": 1e-11}, {})
    )
    for name in ("G", "H"):
        entries = getattr(exact, name)
        for found, allowed in ((asked, 2e-10), (usual, 1e-8)):
            assert (
                0.0
                < np.abs(getattr(found, name) - entries).max()
                <= allowed * np.abs(entries).max()
            )


def test_its_example_runs():
    assert doctest.testmod(module).failed == 0
