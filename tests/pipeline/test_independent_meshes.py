"""Bodies that are meshed each for itself: solved, balanced, near what matching meshes give, never
diagnosed falsely."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import facets
import numpy as np
import pytest
import scipy
from shapes import cuboid, moved, problem, rectangle, solid, touching

from petcontact import load, solve
from petcontact.compliance.interface import Interface
from petcontact.pipeline.pose import facing
from petcontact.pipeline.steps.traction_errors import TractionErrors

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

STACK = Path(__file__).parents[2] / "configs" / "space_stack.toml"


def force_and_moment(solution, place):
    """What acts on a part, "body.part", and the sum of the sizes of all forces there."""
    name, part = place.split(".")
    mesh = solution.meshes[name]
    nodes = mesh.nodes_of(part)
    force = mesh.weight[nodes, None] * solution.last.bodies[name].traction[nodes]
    x, three = (np.pad(each, ((0, 0), (0, 3 - mesh.dim))) for each in (mesh.x[nodes], force))
    return force.sum(axis=0), np.cross(x, three).sum(axis=0), np.abs(force).sum()


@pytest.mark.parametrize(
    ("dim", "law"),
    [(2, {"normal": "bonded"}), (3, {"normal": "bilateral", "friction_bound": 0.02})],
)
def test_what_faces_nothing_is_not_held_along_the_face(dim, law):
    """A block on a wider one, whose top is the secondary and is bare beside it, drawn along."""
    flat, still, mesh = dim - 1, [0.0] * (dim - 1), {"element_size": 0.4, "order": 1}

    def block(name, half, low, high, part, along):
        shape = (rectangle, cuboid)[dim - 2]([-half] * flat + [low], [half] * flat + [high])
        return solid(name, shape, moved(part, [along, *still]), mesh=mesh)

    lower = block("lower", 1.0, -0.5, 0.0, "bottom", 0.0)
    upper = block("upper", 0.5, 0.0, 0.5, "top", 1.0)
    contact = touching("bond", "lower.top", "upper.bottom", **law)
    solution = solve(problem(body=[lower, upper], contact=[contact]))
    assert solution.converged, solution.reason
    pair = solution.last.pairs["bond"]
    bare = ~np.isfinite(pair.gap)
    assert bare.any() and not pair.sigma_t[bare].any() and np.abs(pair.slip[bare]).min() > 0.0
    acts, reacts = (force_and_moment(solution, contact[side]) for side in ("secondary", "primary"))
    assert np.abs(acts[0] + reacts[0]).max() < 1e-12 * acts[2]
    assert np.abs(acts[1] + reacts[1]).max() < 1e-11 * acts[2]


def test_forces_that_do_not_balance_are_not_converged(monkeypatch):
    """What the primary feels is scaled in its map: 3 % less, and the verdict is another one."""
    halved = facing.face

    def face(*given):
        facing = halved(*given)
        return dataclasses.replace(facing, loads=0.97 * facing.loads)

    monkeypatch.setattr(facing, "face", face)
    coarse = {f"body.{k}.mesh": {"element_size": 1.0, "order": 1} for k in range(2)}
    solution = solve(load(STACK, coarse | {"body.1.boundary.0.condition": "displacement"}))
    assert solution.status == "not converged"
    assert "differ by 3.0e-02 of all that acts there" in solution.reason


def test_tractions_of_both_sides_differ_where_elements_do_not_match():
    """One node of the primary has the mean of two nodes: p differs by 1, σ_t by (1, 2)."""
    nodes, up, two = np.arange(2), np.eye(3)[2], np.ones((2, 1))
    maps = scipy.sparse.csr_array(two), scipy.sparse.csr_array(0.5 * two.T)
    normals, tangents = np.tile(up, (2, 1)), np.tile(np.eye(3)[:2], (2, 1, 1))
    face = Interface("c", 0, nodes, normals, tangents, np.zeros(2), 1, nodes[:1], *maps)
    tails = SimpleNamespace(
        pressure_errors=lambda *given: np.array([0.5, 3.0]), errors=lambda *given: np.zeros(2)
    )
    sheared = np.array([[0.0, 0.0], [2.0, 4.0]])
    of_p, of_q = TractionErrors(lambda: tails, face)(np.array([4.0, 2.0]), sheared, nodes)
    assert of_p.tolist() == [1.0, 3.0]
    assert of_q == pytest.approx(np.hypot(1.0, 2.0))


@pytest.mark.parametrize(("turn", "overlap", "named"), [(0.1, 0.02, True), (0.1, 0.4, False)])
def test_facets_that_are_too_coarse_for_the_gap_are_named(tmp_path, turn, overlap, named):
    """h²/8R = .019 of 16 facets on a circle of radius 1, against what contact closes."""
    inner = facets.ring(tmp_path / "i.msh", (0.5, 1.0 + overlap), 0.6, (16, 1, 1))
    outer = facets.ring(tmp_path / "o.msh", (1.0, 1.6), 0.6, (16, 1, 1), turn=turn)
    bodies = [
        solid(name, {"shape": "gmsh", "file": file}, mesh={"order": 1})
        for name, file in (("inner", inner), ("outer", outer))
    ]
    fit = touching("fit", "inner.outer", "outer.inner")
    solution = solve(problem(body=bodies, contact=[fit], bem={"mat_type": "dense"}))
    told = [warning for warning in solution.warnings if "miss the curved faces" in warning]
    assert len(told) == named
    assert all(f"up to {0.01915 * (1.0 + overlap):.2g}" in warning for warning in told)
