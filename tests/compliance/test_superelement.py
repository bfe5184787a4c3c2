"""Superelements: a body put in its own place changes nothing; finite elements of other bodies
against closed solutions."""

from __future__ import annotations

import pickle
from pathlib import Path

import finite_elements as fe
import numpy as np
import pytest
from matplotlib.figure import Figure
from shapes import closing, drawn, elastic, moved, problem, rectangle, solid, touching

from petcontact import (
    Contact,
    InputError,
    MeshOptions,
    Obstacle,
    PointForce,
    Superelement,
    load,
    read_result,
    solve,
)
from petcontact.commands.main import main
from petcontact.pipeline.condensation import condensed_body

pytestmark = pytest.mark.usefixtures("unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"
STEEL, COARSE = {**elastic(1.0, 0.3), "density": 1.0}, {"element_size": 0.25, "order": 1}


def bodies(top, *steps, **more):
    """Two blocks of squares of one size, the upper one pressed down."""
    of = {"material": STEEL, "mesh": COARSE}
    lower = solid("lower", rectangle([-1, -1], [1, 0]), moved("bottom", [0, 0]), **of)
    upper = solid("upper", rectangle([-1, 0], [1, 1]), top, **of, **more)
    pair = touching("interface", "upper.bottom", "lower.top", friction_coefficient=0.4)
    return problem(body=[lower, upper], contact=[pair], step=[{"name": "press"}, *steps])


def changed(value, **more):
    """A step that moves the top of the upper block, or loads it."""
    return {"boundary": [{"body": "upper", "part": "top", "value": value}], **more}


def pressed_and_pushed():
    return bodies(moved("top", [0.0, -0.02]), changed([0.01, -0.02], increments=2))


def floating():
    """Under its weight, pressed and sheared."""
    weight = {"acceleration": [0.0, -0.005]}
    return bodies(drawn("top", [0.0, -0.01]), changed([0.002, -0.01]), loads=weight)


def cylinder():
    return problem(
        material=STEEL,
        geometry={"shape": "cylinder", "from": [0, 0, 0], "to": [0, 0, 1], "radius": 1.0},
        mesh={"element_size": 1.0, "order": 1},
        boundary=[
            closing("bottom", normal="unilateral", friction_coefficient=0.3),
            moved("top", [0.02, 0, -0.02]),
            drawn("side", [0, 0, 0]),
        ],
    )


PROBLEMS = {
    "plane, normals held, Tresca": (
        lambda: load(CONFIGS / "example1.toml", {"mesh.element_size": 0.5}),
        "body",
    ),
    "plane, secondary, two steps": (pressed_and_pushed, "upper"),
    "plane, primary": (pressed_and_pushed, "lower"),
    "plane, floating, weight": (floating, "upper"),
    "space, curved": (cylinder, "body"),
}


def replaced(given, name, file):
    """The problem with a superelement for one body, and without its other conditions and loads."""
    own = next(body for body in given.body if body.name == name)
    contacts = tuple(c for c in own.boundary if isinstance(c, Contact))
    new = own.model_copy(
        update={
            "geometry": Superelement(file=str(file)),
            "mesh": MeshOptions(),
            "boundary": contacts,
            "loads": None,
        }
    )
    steps = tuple(
        step.model_copy(update={"boundary": tuple(c for c in step.boundary if c.body != name)})
        for step in given.step
    )
    return given.model_copy(
        update={"body": tuple(new if b.name == name else b for b in given.body), "step": steps}
    )


@pytest.mark.parametrize("kind", PROBLEMS)
def test_a_body_in_its_own_place_gives_the_same_solution(kind, tmp_path):
    make, name = PROBLEMS[kind]
    solution = solve(make())
    assert solution.converged, solution.reason
    assert any(pair.sigma_t.any() for pair in solution.pairs.values())
    condensed_body(solution, name).save(tmp_path / "s.npz")
    other = solve(replaced(solution.problem, name, tmp_path / "s.npz"))
    assert other.converged and len(other.steps) == len(solution.steps), other.reason
    for step, same in zip(solution.steps, other.steps, strict=True):
        for key, pair in step.pairs.items():
            assert np.array_equal(pair.state, same.pairs[key].state)
            loaded = np.append(pair.pressure, pair.sigma_t)
            for field in ("pressure", "sigma_t", "slip", "gap"):
                scale = np.abs(pair.slip if field in ("slip", "gap") else loaded).max()
                off = np.abs(getattr(pair, field) - getattr(same.pairs[key], field)).max()
                assert off <= 1e-10 * scale, field
        for body, mesh in solution.meshes.items():
            nodes = np.isin(mesh.x, other.meshes[body].x).all(axis=1).nonzero()[0]
            if len(nodes) == other.meshes[body].n_nodes:
                off = np.abs(step.bodies[body].u[nodes] - same.bodies[body].u).max()
                assert off <= 1e-10 * np.abs(step.bodies[body].u[nodes]).max()


def alone(file, **more):
    """A block of a file on the ground."""
    shape = {"shape": "superelement", "file": str(file)}
    return problem(
        body=[solid("block", shape, material=elastic(100.0, 0.25))],
        obstacle=[{"name": "ground"}],
        contact=[touching("under", "block.contact", "ground", **more)],
    )


@pytest.mark.parametrize("d", [2, 3])
def test_finite_elements_pressed_on_a_plate_have_the_pressure_of_theory(d, tmp_path):
    """Squares and cubes on smooth ground, their top lowered, sides free to slide: p = Eδ/H, in the
    plane E/(1-ν²)."""
    points, cells = fe.grid((3, 2, 2)[:d], (2.0, 1.5, 1.0)[:d])
    matrix = fe.stiffness(points, cells, fe.isotropic(100.0, 0.25, d))
    used, faces = fe.bottom_faces(points, cells)
    kept = (d * used[:, None] + np.arange(d)).ravel()
    height, drop = points[:, -1].max(), 0.01
    top = d * np.flatnonzero(points[:, -1] == height) + d - 1
    # symmetry planes where the other coordinates are 0, outside of the contact face
    rollers = [
        d * np.flatnonzero((points[:, c] == 0.0) & (points[:, -1] > 0.0)) + c for c in range(d - 1)
    ]
    lowered = np.zeros(len(matrix))
    lowered[top] = -drop
    held = np.unique(np.concatenate([top, *rollers]))
    small, force = fe.condensed(matrix, kept, -(matrix @ lowered), held)
    file = tmp_path / "block.npz"
    np.savez(file, points=points[used], elements=faces, stiffness=small, force=force)
    solution = solve(alone(file))
    assert solution.converged, solution.reason
    modulus = 100.0 / (1.0 - 0.25**2) if d == 2 else 100.0
    assert np.allclose(solution.pairs["under"].pressure, modulus * drop / height, rtol=1e-9)


def test_the_stiffness_is_the_inverse_and_abaqus_gets_it(tmp_path, capsys):
    solution = solve(floating())
    solution.save(tmp_path / "r.h5")
    body = condensed_body(solution, "upper")
    stiffness, n = body.stiffness(), body.x.size
    motions = body.arrays["modes"].reshape(n, -1)
    even = np.tile([0.0, 1.0], len(body.x))
    assert motions.shape[1] == 3
    for rigid in (motions, even):
        assert np.abs(stiffness @ rigid).max() <= 1e-9 * np.abs(stiffness).max()
    export = f"export {tmp_path}/r.h5 --superelement {tmp_path}/"
    assert main(f"{export}k.inp --body upper".split()) == 0
    lines = (tmp_path / "k.inp").read_text().splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("*MATRIX INPUT"))
    entries = [line.split(",") for line in lines[start + 1 : -1]]
    assert len(entries) == n * (n + 1) // 2 and lines[-1].startswith("*MATRIX ASSEMBLE")
    a, i, b, j = (int(word) for word in entries[7][:4])
    assert float(entries[7][4]) == stiffness[2 * a - 2 + i - 1, 2 * b - 2 + j - 1]
    for words, line in (
        ("k.txt", "a superelement is .npz"),
        ("k.npz", "name the one to condense"),
        ("k.npz --body uper", "did you mean 'upper'?"),
    ):
        assert main(f"{export}{words}".split()) == 2
        assert line in capsys.readouterr().err


def block_file(path, **changes):
    points, cells = fe.grid((2, 1), (2.0, 1.0))
    used, faces = fe.bottom_faces(points, cells)
    kept = (2 * used[:, None] + np.arange(2)).ravel()
    small, _ = fe.condensed(
        fe.stiffness(points, cells, fe.isotropic(1.0, 0.3, 2)), kept, np.zeros(points.size)
    )
    arrays = {
        "points": points[used],
        "elements": faces,
        "stiffness": 0.5 * (small + small.T),
    } | changes
    np.savez(path, **{key: value for key, value in arrays.items() if value is not None})
    return path


COMPLIANCE = {"stiffness": None, "compliance": np.eye(8)}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"stiffness": None}, "needs either an array 'stiffness' or an array 'compliance'"),
        ({"points": None}, "has no array 'points'"),
        ({"stiffness": np.ones((4, 4))}, "stiffness: must have shape \\(6, 6\\), has \\(4, 4\\)"),
        ({"stiffness": np.triu(np.ones((6, 6)))}, "stiffness must be symmetric"),
        ({"stiffness": np.full((6, 6), np.nan)}, "stiffness: must hold numbers from"),
        ({"stiffness": -np.eye(6)}, "positive semi-definite"),
        ({"elements": np.array([[0, 9]])}, "elements: must be numbers of points, 0 to 2"),
        ({"elements": np.array([[0, 1]])}, "point 2 belongs to no element"),
        ({"part": np.array([0, 1])}, "must be 2 numbers of the 1 names"),
        ({"middles": np.zeros((2, 5), dtype=int)}, "middles: must be numbers of points"),
        ({"force": np.ones(4)}, "force: must have shape \\(6,\\), has"),
        ({"part_names": np.array(["a\0b"])}, "is no name"),
        ({"part_names": np.array(["a", "a"])}, "the same is there twice"),
        ({"elements": np.array([[0, 1], [1, 0]])}, "the same is there twice"),
        ({"points": np.zeros((3, 2))}, "a side has no length"),
        ({"points": np.ones((3, 2), np.longdouble)}, "numbers of 128 bits"),
        (COMPLIANCE | {"compliance": -np.eye(8)}, "positive on its diagonal"),
        ({"order": np.array([99, 1])}, "order: must hold numbers from 0 to 5"),
        (COMPLIANCE | {"curvature": np.full(2, 1e9)}, "curvature: a circle's radius"),
    ],
)
def test_a_file_that_says_something_else_is_refused_in_one_line(changes, told, tmp_path):
    path = block_file(tmp_path / "s.npz", **changes)
    with pytest.raises(InputError, match=f"s.npz: .*{told}"):
        solve(alone(path))


def test_files_run_no_code_and_are_files(tmp_path):
    (tmp_path / "evil.npz").write_bytes(pickle.dumps([1, 2]))
    points, others = np.array([{}, []], dtype=object), np.zeros((1, 2))
    np.savez(tmp_path / "objects.npz", points=points, elements=others, stiffness=others)
    for name, told in (
        ("evil.npz", r"evil\.npz: damaged \(File is not a zip file"),
        ("objects.npz", "points: must hold real numbers"),
        ("none.npz", "cannot be read"),
        (".", "is no regular file|not a regular file|is not a file|must be a"),
    ):
        with pytest.raises(InputError, match=told):
            Superelement(file=str(tmp_path / name)).outline()


def test_a_superelement_is_read_plotted_and_told_what_it_lacks(tmp_path):
    """It follows the ground, which is raised; its fields and loads inside are not known."""
    given = alone(block_file(tmp_path / "s.npz"), normal="bilateral", friction_coefficient=0.5)
    raised = (Obstacle("ground", displacement=(0.0, 0.01)),)
    posed = given.model_copy(update={"obstacle": raised})
    solution = solve(posed)
    assert solution.converged and np.abs(solution.pairs["under"].pressure).max() < 1e-12
    assert np.allclose(solution.u[:, 1], 0.01)
    assert solution.accuracy.unknown == "contact carries nothing"
    solution.save(tmp_path / "r.h5")
    assert read_result(tmp_path / "r.h5").verdict() == solution.verdict()
    lines = solution.plot(Figure().add_subplot()).lines
    assert 3 in [len(line.get_xdata()) for line in lines]  # not closed: it is no outline
    assert main(f"export {tmp_path}/r.h5 --vtkhdf {tmp_path}/r.vtkhdf".split()) == 0
    with pytest.raises(InputError, match="is a superelement: fields inside it are not known"):
        solution.stress_at([[1.0, 0.5]])
    (block,) = posed.body
    for change, line in (
        ({"point_force": (PointForce((1.0, 0.5), (0.0, 1.0)),)}, "point_force: loads inside"),
        ({"mesh": MeshOptions(0.1)}, "mesh.element_size: the faces of a superelement"),
    ):
        with pytest.raises(InputError, match=line):
            solve(posed.model_copy(update={"body": (block.model_copy(update=change),)}))
