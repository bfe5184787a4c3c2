"""Bodies, obstacles, laws and load steps in space: what must not change an answer, what cannot be
held, what is refused."""

from __future__ import annotations

import copy
from pathlib import Path

import meshio
import numpy as np
import pytest
import scipy
from shapes import closing, cuboid, drawn, elastic, moved, solid, touching

from petcontact import solve
from petcontact.contact.laws import SignoriniCoulomb
from petcontact.geometry.surface import BOX_PARTS, BoxSurface
from petcontact.mesh.panelling import box_mesh
from petcontact.model.case import load, parse_problem

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"
STILL, MESH = [0.0, 0.0, 0.0], {"element_size": 0.5, "order": 1}
BLOCK = {
    "material": elastic(100.0, 0.3),
    "geometry": cuboid(STILL, [2.0, 1.0, 1.0]),
    "mesh": MESH,
    "boundary": [
        closing("bottom", normal="unilateral", friction_coefficient=0.3),
        drawn("top", [0.0, 0.0, -1.0]),
        *(drawn(part, STILL) for part in ("left", "right", "front", "back")),
    ],
    "step": [
        {"name": "press"},
        {"name": "push", "boundary": [{"part": "top", "value": [0.15, 0.1, -1.0]}]},
    ],
}
BALL = touching("top", "block.top", "ball", gap="(x**2 + y**2)/4", friction_coefficient=0.3)
PUNCHED = {
    "body": [
        solid("block", cuboid([-1.0] * 3, [1.0, 1.0, 0.0]), moved("bottom", STILL), mesh=MESH)
    ],
    "obstacle": [{"name": "ball", "displacement": [0.0, 0.0, -0.1], "centre": [0.0, 0.0, 0.5]}],
    "contact": [BALL],
    "step": [{}, {"obstacle": [{"name": "ball", "displacement": [0.03, 0.01, -0.1]}]}],
}
STACK = {
    "body": [
        solid(
            "base",
            cuboid([-1.0] * 3, [3.0, 2.0, 0.0]),
            moved("bottom", STILL),
            material=elastic(200.0, 0.25),
            mesh={"element_size": 1.0, "order": 2},
        ),
        solid(
            "block",
            cuboid(STILL, [2.0, 1.0, 1.0]),
            drawn("top", [0.15, 0.1, -1.0]),
            material=elastic(100.0, 0.3),
            mesh=MESH,
        ),
    ],
    "contact": [touching("pair", "block.bottom", "base.top", friction_coefficient=0.3)],
}


def solved(tables, **changes):
    changes = {key.replace("__", "."): value for key, value in changes.items()}
    return solve(parse_problem(copy.deepcopy(tables), "test", changes, Path()))


def vectors(pair, components):
    return np.einsum("mt,mtc->mc", components, pair.tangent)


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


def test_a_block_on_the_floor_held_by_friction():
    """Six motions, no known displacement: equilibrium to round-off; mirrored loads mirror the
    answer."""
    one, other = solved(BLOCK), solved(BLOCK, step__1__boundary__0__value=[-0.15, 0.1, -1.0])
    assert one.converged and one.provenance.motions == {"body": 6}
    pair, mirrored = one.last.pairs["bottom"], other.last.pairs["bottom"]
    assert pair.force == pytest.approx([-0.3, -0.2, 2.0], abs=1e-12)
    assert pair.moment == pytest.approx([1.0 + 0.2, -2.0 - 0.3, -0.05], abs=1e-12)
    assert_law(pair, 0.3)
    place = scipy.spatial.cKDTree(mirrored.x).query(pair.x * [-1.0, 1.0, 1.0] + [2.0, 0.0, 0.0])[1]
    assert np.allclose(pair.pressure, mirrored.pressure[place], atol=1e-4)
    assert np.allclose(pair.sigma_t, mirrored.sigma_t[place] * [-1.0, 1.0], atol=1e-4)


def written_as_facets(path, turn):
    """The block of PUNCHED as quadrilaterals of a Gmsh file, turned in space."""
    mesh = box_mesh(
        BoxSurface(np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 0.0])),
        lambda part: 0.5,
        1,
        1.4,
    )
    points, numbers = np.unique(mesh.corners.reshape(-1, 3).round(12), axis=0, return_inverse=True)
    tags = mesh.part + 1
    meshio.write(
        path,
        meshio.Mesh(
            points @ turn.T,
            [("quad", numbers.reshape(-1, 4))],
            cell_data={"gmsh:physical": [tags], "gmsh:geometrical": [tags]},
            field_data={name: np.array([k + 1, 2]) for k, name in enumerate(BOX_PARTS)},
        ),
        file_format="gmsh22",
        binary=False,
    )


def test_a_turned_body_has_a_turned_answer(tmp_path):
    """A Gmsh surface turned in space, with its loads, gap and obstacle, against the box."""
    turn = scipy.spatial.transform.Rotation.from_rotvec([0.4, -0.7, 0.3]).as_matrix()
    written_as_facets(tmp_path / "turned.msh", turn)
    x, y = (
        " + ".join(
            f"({factor:.16g})*{name}" for factor, name in zip(turn[:, k], "xyz", strict=True)
        )
        for k in (0, 1)
    )
    straight = solved(PUNCHED, method__tolerance=1e-10)
    turned = solved(
        PUNCHED,
        method__tolerance=1e-10,
        **{
            "body__0__geometry": {"shape": "gmsh", "file": str(tmp_path / "turned.msh")},
            "body__0__mesh": {"order": 1},
            "obstacle__0__displacement": (turn @ [0.0, 0.0, -0.1]).tolist(),
            "obstacle__0__centre": (turn @ [0.0, 0.0, 0.5]).tolist(),
            "step__1__obstacle__0__displacement": (turn @ [0.03, 0.01, -0.1]).tolist(),
            "contact__0__gap": f"(({x})**2 + ({y})**2)/4",
        },
    )
    assert straight.converged and turned.converged
    for one, other in zip(straight.steps, turned.steps, strict=True):
        a, b = one.pairs["top"], other.pairs["top"]
        place = scipy.spatial.cKDTree(b.x).query(a.x @ turn.T)[1]
        size = a.pressure.max()
        assert np.allclose(a.pressure, b.pressure[place], atol=1e-7 * size)
        assert np.allclose(
            vectors(a, a.sigma_t) @ turn.T, vectors(b, b.sigma_t)[place], atol=1e-7 * size
        )
        assert np.allclose(vectors(a, a.slip) @ turn.T, vectors(b, b.slip)[place], atol=1e-8)
        for key in ("force", "moment"):
            assert np.allclose(turn @ getattr(a, key), getattr(b, key), atol=1e-7 * size)
            assert np.allclose(
                turn @ getattr(one.obstacles["ball"], key),
                getattr(other.obstacles["ball"], key),
                atol=1e-7,
            )


def test_meshes_that_do_not_match_are_told(tmp_path):
    """A Gmsh surface on a box: the verdict says so, and forces balance to round-off."""
    written_as_facets(tmp_path / "cube.msh", np.eye(3))
    solution = solved(
        STACK,
        body__0__geometry={"shape": "gmsh", "file": str(tmp_path / "cube.msh")},
        body__0__mesh={"order": 1},
        body__1__geometry__lower=[-0.7, -0.4, 0.0],
        body__1__geometry__upper=[0.7, 0.6, 1.0],
    )
    assert solution.converged and "do not match" in solution.warnings[0]
    assert "warning: " in solution.verdict()
    base, traction = solution.meshes["base"], solution.last.bodies["base"].traction
    nodes = base.nodes_of("top")
    assert base.weight[nodes] @ traction[nodes] == pytest.approx(
        -solution.last.pairs["pair"].force, abs=1e-12
    )
