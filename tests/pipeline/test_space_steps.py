"""Bodies, obstacles, laws and load steps in space: what must not change an answer, and what is
told."""

from __future__ import annotations

from pathlib import Path

import facets
import meshio
import numpy as np
import pytest
import scipy
from shapes import closing, cuboid, drawn, elastic, moved, problem, solid, touching

from petcontact import solve
from petcontact.contact.laws import SignoriniCoulomb
from petcontact.model.case import load

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"
STILL = [0.0, 0.0, 0.0]


def assert_law(pair, mu, tolerance=2e-5, reach=1e-6):
    """Unilateral contact with Coulomb's law at every node, whoever found it; what displacements
    reach scales overlaps."""
    size = np.abs(pair.pressure).max(initial=1e-300)
    assert pair.pressure.min() >= -tolerance * size and pair.gap.min() >= -1e-6 * reach
    assert not pair.pressure[pair.state == 2].any() and not pair.sigma_t[pair.state == 2].any()
    shear, moved = np.linalg.norm(pair.sigma_t, axis=1), np.linalg.norm(pair.slip_increment, axis=1)
    assert np.all(shear <= mu * pair.pressure + tolerance * size)
    slides = (pair.state == 1) & (moved > 1e-6 * moved.max(initial=1e-300))
    against = pair.slip_increment[slides] / moved[slides, None]
    assert np.allclose(
        pair.sigma_t[slides],
        -mu * pair.pressure[slides, None] * against,
        atol=10 * tolerance * size,
    )
    assert np.all(moved[pair.state == 0] <= 1e-10 + tolerance * moved.max(initial=0.0))


def test_a_bound_alone_is_the_bilateral_solve_of_the_paper():
    """Tresca's law as a case of the law in all directions, against the tangents alone with known
    normals."""
    problem = load(CONFIGS / "space_b.toml", {"mesh.element_size": 2.0, "method.tolerance": 1e-11})
    paper = solve(problem).contact

    def in_all_directions(nodes):
        m = len(nodes.weight)
        return SignoriniCoulomb(np.full(m, np.inf), np.full(m, 150.0), np.zeros(m, dtype=bool), 3)

    pair = solve(problem, law=in_all_directions).last.pairs["bottom"]
    assert np.abs(pair.gap).max() < 1e-12
    assert np.allclose(pair.slip, paper.u_t, atol=1e-8 * np.abs(paper.u_t).max())
    assert np.allclose(pair.sigma_t, paper.sigma_t, atol=1e-7 * 150.0)
    assert np.allclose(-pair.pressure, paper.sigma_n, atol=1e-7 * 150.0)


def pushed(along):
    """A block on a rigid floor, pressed and pushed along x and y."""
    push = {"part": "top", "value": [along, 0.1, -1.0]}
    return problem(
        material=elastic(100.0, 0.3),
        geometry=cuboid(STILL, [2.0, 1.0, 1.0]),
        mesh={"element_size": 0.5, "order": 1},
        boundary=[
            closing("bottom", normal="unilateral", friction_coefficient=0.3),
            drawn("top", [0.0, 0.0, -1.0]),
            *(drawn(part, STILL) for part in ("left", "right", "front", "back")),
        ],
        step=[{"name": "press"}, {"name": "push", "boundary": [push]}],
    )


def test_a_block_on_the_floor_held_by_friction():
    """Six motions, no known displacement: equilibrium to round-off; mirrored loads mirror the
    answer."""
    one, other = solve(pushed(0.15)), solve(pushed(-0.15))
    assert one.converged and one.provenance.motions == {"body": 6}
    pair, mirrored = one.last.pairs["bottom"], other.last.pairs["bottom"]
    assert pair.force == pytest.approx([-0.3, -0.2, 2.0], abs=1e-12)
    assert pair.moment == pytest.approx([1.0 + 0.2, -2.0 - 0.3, -0.05], abs=1e-12)
    assert_law(pair, 0.3)
    place = scipy.spatial.cKDTree(mirrored.x).query(pair.x * [-1.0, 1.0, 1.0] + [2.0, 0.0, 0.0])[1]
    assert np.allclose(pair.pressure, mirrored.pressure[place], atol=1e-4)
    assert np.allclose(pair.sigma_t, mirrored.sigma_t[place] * [-1.0, 1.0], atol=1e-4)


def punched(turn, geometry, mesh):
    """A block under a rigid ball that presses on it and is drawn along; all is turned in space."""
    x, y = (
        " + ".join(f"({share:.16g})*{name}" for share, name in zip(turn[:, k], "xyz", strict=True))
        for k in (0, 1)
    )
    press, drag, centre = (
        (turn @ each).tolist() for each in ([0, 0, -0.1], [0.03, 0.01, -0.1], [0, 0, 0.5])
    )
    gap = f"(({x})**2 + ({y})**2)/4"
    return solve(
        problem(
            body=[solid("block", geometry, moved("bottom", STILL), mesh={"order": 1, **mesh})],
            obstacle=[{"name": "ball", "displacement": press, "centre": centre}],
            contact=[touching("top", "block.top", "ball", gap=gap, friction_coefficient=0.3)],
            step=[{}, {"obstacle": [{"name": "ball", "displacement": drag}]}],
            method={"tolerance": 1e-10},
        )
    )


def test_a_turned_body_has_a_turned_answer(tmp_path):
    """A Gmsh surface turned in space, with its loads, gap and obstacle, against the box."""
    turn = scipy.spatial.transform.Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix()
    corners, path = ([-1.0] * 3, [1.0, 1.0, 0.0]), tmp_path / "turned.msh"
    surface = meshio.read(facets.box(path, *corners, (4, 4, 2), triangles=False))
    surface.points = surface.points @ turn.T
    meshio.write(path, surface, file_format="gmsh22", binary=False)
    straight = punched(np.eye(3), cuboid(*corners), {"element_size": 0.5, "exponent": 1.0})
    turned = punched(turn, {"shape": "gmsh", "file": str(path)}, {})
    assert straight.converged and turned.converged
    for one, other in zip(straight.steps, turned.steps, strict=True):
        a, b = one.pairs["top"], other.pairs["top"]
        place = scipy.spatial.cKDTree(b.x).query(a.x @ turn.T)[1]
        size = a.pressure.max()
        assert np.allclose(a.pressure, b.pressure[place], atol=1e-7 * size)
        for key, apart in (("sigma_t", 1e-7 * size), ("slip", 1e-8)):
            along, other_way = (
                np.einsum("mt,mtc->mc", getattr(pair, key), pair.tangent) for pair in (a, b)
            )
            assert np.allclose(along @ turn.T, other_way[place], atol=apart)
        for key in ("force", "moment"):
            assert np.allclose(turn @ getattr(a, key), getattr(b, key), atol=1e-7 * size)
            held, held_turned = (getattr(step.obstacles["ball"], key) for step in (one, other))
            assert np.allclose(turn @ held, held_turned, atol=1e-7)


def test_meshes_that_do_not_match_are_told(tmp_path):
    """A Gmsh surface on a box: the verdict says so, and forces balance to round-off."""
    corners = [0.0, 0.0, -1.0], [2.0, 1.0, 0.0]
    file = facets.box(tmp_path / "base.msh", *corners, (3, 2, 1), triangles=False)
    changes = {
        "body.0.geometry": {"shape": "gmsh", "file": file},
        "body.0.mesh": {"order": 1},
        "body.1.mesh": {"element_size": 0.5, "order": 1},
        "body.1.geometry": cuboid([0.1, 0.1, 0.0], [1.8, 0.9, 1.0]),
    }
    solution = solve(load(CONFIGS / "space_stack.toml", changes))
    assert solution.converged and "do not match" in solution.warnings[0]
    assert "more at the rim of the secondary" in solution.warnings[0]
    assert "warning: " in solution.verdict()
    base, traction = solution.meshes["base"], solution.last.bodies["base"].traction
    nodes, force = base.nodes_of("top"), solution.last.pairs["interface"].force
    assert base.weight[nodes] @ traction[nodes] == pytest.approx(-force, abs=1e-12)
