"""Bodies that are meshed each for itself: solved, balanced, near what matching meshes give, never
diagnosed falsely."""

from __future__ import annotations

import dataclasses

import facets
import numpy as np
import pytest
from shapes import cuboid, moved, problem, rectangle, solid, touching

from petcontact import solve
from petcontact.pipeline.pose import facing

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")


def pressed(p):
    return {"condition": "traction", "value": [0.0, 0.0, p]}


def held(*value):
    return {"condition": "displacement", "value": list(value)}


def body(name, file, order=1, **conditions):
    boundary = [{"part": part, **condition} for part, condition in conditions.items()]
    return solid(name, {"shape": "gmsh", "file": file}, *boundary, mesh={"order": order})


def posed(bodies, *contacts):
    return problem(body=bodies, contact=list(contacts), bem={"mat_type": "dense"})


def solved(bodies, *contacts):
    solution = solve(posed(bodies, *contacts))
    assert solution.converged, solution.reason
    return solution


def on(solution, place):
    """Forces at the nodes of a part, "body.part", and where they act."""
    name, part = place.split(".")
    mesh = solution.meshes[name]
    nodes = mesh.nodes_of(part)
    return mesh.x[nodes], mesh.weight[nodes, None] * solution.last.bodies[name].traction[nodes]


def balances(solution, contact):
    """Force, and moment where nothing rubs, are the same on both sides of a pair; returns the force
    on the secondary."""
    (x, mine), (y, theirs) = on(solution, contact["secondary"]), on(solution, contact["primary"])
    size = np.abs(mine).sum()
    assert np.abs(mine.sum(axis=0) + theirs.sum(axis=0)).max() < 1e-12 * size
    if "friction_coefficient" not in contact:
        places, forces = (
            np.pad(np.concatenate(part), ((0, 0), (0, 3 - x.shape[1])))
            for part in ((x, y), (mine, theirs))
        )
        assert np.abs(np.cross(places, forces).sum(axis=0)).max() < 1e-11 * size
    return mine.sum(axis=0)


def blocks(tmp_path, top=None, bottom=None, **upper):
    """Two blocks of triangles, 5 × 4 against 6 × 7 rectangles cut in two."""
    lower = facets.box(tmp_path / "lower.msh", (0, 0, 0), (2, 2, 1), (5, 4, 2))
    over = facets.box(tmp_path / "upper.msh", (0, 0, 1), (2, 2, 2), (6, 7, 3), power=1.2)
    return [
        body("lower", lower, bottom=bottom or pressed(0.01)),
        body("upper", over, top=top or pressed(-0.01), **upper),
    ]


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
    solution = solved([lower, upper], contact)
    pair = solution.last.pairs["bond"]
    bare = ~np.isfinite(pair.gap)
    assert bare.any() and not pair.sigma_t[bare].any() and np.abs(pair.slip[bare]).min() > 0.0
    balances(solution, contact)


@pytest.mark.slow
def test_forces_that_do_not_balance_are_not_converged(tmp_path, monkeypatch):
    """What the primary feels is scaled in its map: 3 % less, and the verdict is another one."""
    halved = facing.face

    def face(*given):
        facing = halved(*given)
        return dataclasses.replace(facing, loads=0.97 * facing.loads)

    monkeypatch.setattr(facing, "face", face)
    bodies = blocks(tmp_path, held(0.0, 0.0, -0.05), held(0.0, 0.0, 0.0))
    solution = solve(posed(bodies, touching("pair", "upper.bottom", "lower.top")))
    assert solution.status == "not converged"
    assert "differ by 3.0e-02 of all that acts there" in solution.reason


@pytest.mark.parametrize(("turn", "overlap", "named"), [(0.1, 0.02, True), (0.1, 0.4, False)])
def test_facets_that_are_too_coarse_for_the_gap_are_named(tmp_path, turn, overlap, named):
    """h²/8R = .019 of 16 facets on a circle of radius 1, against what contact closes."""
    inner = facets.ring(tmp_path / "i.msh", (0.5, 1.0 + overlap), 0.6, (16, 1, 1))
    outer = facets.ring(tmp_path / "o.msh", (1.0, 1.6), 0.6, (16, 1, 1), turn=turn)
    solution = solve(
        posed(
            [body("inner", inner), body("outer", outer)],
            touching("fit", "inner.outer", "outer.inner"),
        )
    )
    told = [warning for warning in solution.warnings if "miss the curved faces" in warning]
    assert len(told) == named
    assert all(f"up to {0.01915 * (1.0 + overlap):.2g}" in warning for warning in told)
