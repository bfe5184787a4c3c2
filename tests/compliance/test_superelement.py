"""Superelements: a body put in its own place changes nothing; finite elements of other bodies
against closed solutions."""

from __future__ import annotations

import pickle
import tomllib
from pathlib import Path

import finite_elements as fe
import numpy as np
import pytest
from matplotlib.figure import Figure

from petcontact import (
    Body,
    BoundaryChange,
    Contact,
    Cylinder,
    Displacement,
    InputError,
    Material,
    MeshOptions,
    Obstacle,
    Pair,
    PointForce,
    Problem,
    Rectangle,
    Step,
    Superelement,
    Traction,
    VolumeLoads,
    load,
    read_result,
    solve,
)
from petcontact.commands.main import main
from petcontact.model.case import parse_problem
from petcontact.pipeline.superelement import condensed_body

pytestmark = pytest.mark.usefixtures("unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"
STEEL, COARSE = Material(1.0, 0.3, density=1.0), MeshOptions(element_size=0.25, order=1)


def bodies(top, *steps, loads=None):
    """Two blocks of squares of one size, the upper one pressed down."""
    lower = Body(
        "lower",
        STEEL,
        Rectangle((-1, -1), (1, 0)),
        COARSE,
        boundary=[Displacement("bottom", (0, 0))],
    )
    upper = Body("upper", STEEL, Rectangle((-1, 0), (1, 1)), COARSE, boundary=[top], loads=loads)
    pair = Pair(
        "interface", secondary="upper.bottom", primary="lower.top", friction_coefficient=0.4
    )
    return Problem(body=[lower, upper], contact=[pair], step=list(steps))


PUSHED = Step(
    "push", increments=2, boundary=[BoundaryChange(body="upper", part="top", value=(0.01, -0.02))]
)
SHEARED = Step("shear", boundary=[BoundaryChange(body="upper", part="top", value=(0.002, -0.01))])
PROBLEMS = {
    "plane, normals held, Tresca": (
        lambda: load(CONFIGS / "example1.toml", {"mesh.element_size": 0.5}),
        "body",
    ),
    "plane, unilateral, Coulomb": (
        lambda: Problem(
            material=STEEL,
            geometry=Rectangle((0, 0), (4, 2)),
            mesh=COARSE,
            boundary=[
                Contact("bottom", normal="unilateral", friction_coefficient=0.3),
                Displacement("top", (0.02, -0.02)),
                Traction("left", (0, 0)),
                Traction("right", (0.001, 0)),
            ],
        ),
        "body",
    ),
    "plane, secondary, two steps": (
        lambda: bodies(Displacement("top", (0.0, -0.02)), Step("press"), PUSHED),
        "upper",
    ),
    "plane, primary": (
        lambda: bodies(Displacement("top", (0.0, -0.02)), Step("press"), PUSHED),
        "lower",
    ),
    "plane, floating, weight": (
        lambda: bodies(
            Traction("top", (0.0, -0.01)),
            Step("press"),
            SHEARED,
            loads=VolumeLoads(acceleration=(0.0, -0.005)),
        ),
        "upper",
    ),
    "space, curved": (
        lambda: Problem(
            material=STEEL,
            geometry=Cylinder((0, 0, 0), (0, 0, 1), 1.0),
            mesh=MeshOptions(element_size=1.0, order=1),
            boundary=[
                Contact("bottom", normal="unilateral", friction_coefficient=0.3),
                Displacement("top", (0.02, 0, -0.02)),
                Traction("side", (0, 0, 0)),
            ],
        ),
        "body",
    ),
    "space, Tresca": (
        lambda: load(CONFIGS / "space_b.toml", {"mesh.element_size": 2.0, "mesh.order": 0}),
        "body",
    ),
}


def replaced(problem, name, file):
    """The problem with a superelement for one body, and without its other conditions and loads."""
    given = next(body for body in problem.body if body.name == name)
    contacts = tuple(c for c in given.boundary if isinstance(c, Contact))
    new = given.model_copy(
        update={
            "geometry": Superelement(file=str(file)),
            "mesh": MeshOptions(),
            "boundary": contacts,
            "loads": None,
        }
    )
    steps = tuple(
        step.model_copy(update={"boundary": tuple(c for c in step.boundary if c.body != name)})
        for step in problem.step
    )
    return problem.model_copy(
        update={"body": tuple(new if b.name == name else b for b in problem.body), "step": steps}
    )


@pytest.mark.parametrize("kind", PROBLEMS)
def test_a_body_in_its_own_place_gives_the_same_solution(kind, tmp_path):
    make, name = PROBLEMS[kind]
    solution = solve(make())
    assert solution.converged and any(pair.sigma_t.any() for pair in solution.pairs.values()), (
        solution.reason
    )
    condensed_body(solution, name).save(tmp_path / "s.npz")
    other = solve(replaced(solution.problem, name, tmp_path / "s.npz"))
    assert other.converged and len(other.steps) == len(solution.steps), other.reason
    for step, same in zip(solution.steps, other.steps, strict=True):
        for key, pair in step.pairs.items():
            assert np.array_equal(pair.state, same.pairs[key].state)
            for field in ("pressure", "sigma_t", "slip", "gap"):
                values, found = getattr(pair, field), getattr(same.pairs[key], field)
                scale = np.abs(
                    pair.slip
                    if field in ("slip", "gap")
                    else np.append(pair.pressure, pair.sigma_t)
                ).max()
                assert np.abs(values - found).max() <= 1e-10 * scale, field
        for body in solution.meshes:
            nodes = np.isin(solution.meshes[body].x, other.meshes[body].x).all(axis=1).nonzero()[0]
            if len(nodes) == other.meshes[body].n_nodes:
                moved = step.bodies[body].u[nodes]
                assert np.allclose(
                    moved, same.bodies[body].u, rtol=0.0, atol=1e-10 * np.abs(moved).max()
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
    np.savez(
        tmp_path / "block.npz", points=points[used], elements=faces, stiffness=small, force=force
    )
    ground = Obstacle("ground")
    problem = Problem(
        body=[Body("block", Material(100.0, 0.25), Superelement(file=str(tmp_path / "block.npz")))],
        obstacle=[ground],
        contact=[Pair("under", secondary="block.contact", primary="ground")],
    )
    solution = solve(problem)
    assert solution.converged, solution.reason
    modulus = 100.0 / (1.0 - 0.25**2) if d == 2 else 100.0
    assert np.allclose(solution.pairs["under"].pressure, modulus * drop / height, rtol=1e-9)


def test_a_floating_anisotropic_block_slides_when_it_should(tmp_path):
    """Its weight and a push at its foot are in the file; friction holds 0.3 of the weight, and not
    less."""
    points, cells = fe.grid((4, 2), (2.0, 0.5))
    elasticity = fe.isotropic(10.0, 0.2, 2)
    elasticity[0, 0, 0, 0] *= 5.0  # stiffer along x
    matrix = fe.stiffness(points, cells, elasticity)
    used, faces = fe.bottom_faces(points, cells)
    kept = (2 * used[:, None] + np.arange(2)).ravel()
    lumped = np.zeros(len(points))
    np.add.at(lumped, cells.ravel(), 0.25 / len(cells))  # area 1 shared out to the corners
    for push, status in ((0.29, "converged"), (0.31, "not converged")):
        force = np.stack([push * lumped, -1.0 * lumped], axis=1).ravel()
        small, load_ = fe.condensed(matrix, kept, force)
        np.savez(
            tmp_path / "block.npz",
            points=points[used],
            elements=faces,
            stiffness=0.5 * (small + small.T),
            force=load_,
        )
        problem = Problem(
            body=[
                Body("block", Material(10.0, 0.2), Superelement(file=str(tmp_path / "block.npz")))
            ],
            obstacle=[Obstacle("ground")],
            contact=[
                Pair("under", secondary="block.contact", primary="ground", friction_coefficient=0.3)
            ],
        )
        solution = solve(problem)
        assert solution.status == status, solution.reason
        if status == "converged":
            pair = solution.pairs["under"]
            assert np.allclose(pair.force, [-push, 1.0], rtol=1e-9)
            assert np.all(np.abs(pair.sigma_t[:, 0]) <= 0.3 * pair.pressure * (1.0 + 1e-9))
    assert "cannot be held: the load pushes it along +x" in solution.reason


def test_the_stiffness_is_the_inverse_and_abaqus_gets_it(tmp_path, capsys):
    solution = solve(PROBLEMS["plane, floating, weight"][0]())
    solution.save(tmp_path / "r.h5")
    body = condensed_body(solution, "upper")
    stiffness, n = body.stiffness(), body.x.size
    motions = body.arrays["modes"].reshape(n, -1)
    assert np.abs(stiffness @ motions).max() <= 1e-9 * np.abs(stiffness).max()
    even = np.tile([0.0, 1.0], len(body.x))
    assert motions.shape[1] == 3
    assert np.abs(stiffness @ even).max() <= 1e-9 * np.abs(stiffness).max()
    assert (
        main(
            [
                "export",
                str(tmp_path / "r.h5"),
                "--superelement",
                str(tmp_path / "k.inp"),
                "--body",
                "upper",
            ]
        )
        == 0
    )
    lines = (tmp_path / "k.inp").read_text().splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("*MATRIX INPUT"))
    entries = [line.split(",") for line in lines[start + 1 : -1]]
    assert len(entries) == n * (n + 1) // 2 and lines[-1].startswith("*MATRIX ASSEMBLE")
    a, i, b, j = (int(word) for word in entries[7][:4])
    assert float(entries[7][4]) == stiffness[2 * a - 2 + i - 1, 2 * b - 2 + j - 1]
    file = str(tmp_path / "k.npz")
    for words, told in (
        (["--superelement", "k.txt"], "a superelement is .npz"),
        (["--superelement", file], "name the one to condense"),
        (["--superelement", file, "--body", "uper"], "did you mean 'upper'?"),
    ):
        assert main(["export", str(tmp_path / "r.h5"), *words]) == 2
        assert told in capsys.readouterr().err


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
        ({"stiffness": None, "compliance": -np.eye(8)}, "positive on its diagonal"),
        ({"order": np.array([99, 1])}, "order: must hold numbers from 0 to 5"),
        (
            {"stiffness": None, "compliance": np.eye(8), "curvature": np.full(2, 1e9)},
            "curvature: a circle's radius",
        ),
    ],
)
def test_a_file_that_says_something_else_is_refused_in_one_line(changes, told, tmp_path):
    path = block_file(tmp_path / "s.npz", **changes)
    problem = Problem(
        body=[Body("block", STEEL, Superelement(file=str(path)))],
        obstacle=[Obstacle("ground")],
        contact=[Pair("under", secondary="block.contact", primary="ground")],
    )
    with pytest.raises(InputError, match=f"s.npz: .*{told}"):
        solve(problem)


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


def test_a_config_with_a_superelement_is_solved_plotted_and_told_what_it_lacks(tmp_path):
    block_file(tmp_path / "s.npz")
    text = """
    [[body]]
    name = "block"
    material = { young_modulus = 1.0, poisson_ratio = 0.3 }
    geometry = { shape = "superelement", file = "s.npz" }
    [[obstacle]]
    name = "ground"
    displacement = [0.0, 0.01]
    [[contact]]
    name = "under"
    secondary = "block.contact"
    primary = "ground"
    normal = "bilateral"
    friction_coefficient = 0.5
    """
    problem = parse_problem(tomllib.loads(text), "s.toml", {}, tmp_path)
    solution = solve(problem)
    assert (
        solution.converged and np.abs(solution.pairs["under"].pressure).max() < 1e-12
    )  # it is free to follow
    assert np.allclose(solution.u[:, 1], 0.01)
    assert solution.accuracy.unknown == "contact carries nothing"
    solution.save(tmp_path / "r.h5")
    assert read_result(tmp_path / "r.h5").verdict() == solution.verdict()
    lines = solution.plot(Figure().add_subplot()).lines
    assert 3 in [len(line.get_xdata()) for line in lines]  # not closed: it is no outline
    assert main(["export", str(tmp_path / "r.h5"), "--vtkhdf", str(tmp_path / "r.vtkhdf")]) == 0
    with pytest.raises(InputError, match="is a superelement: fields inside it are not known"):
        solution.stress_at([[1.0, 0.5]])
    (block,) = problem.body
    for change, told in (
        ({"point_force": (PointForce((1.0, 0.5), (0.0, 1.0)),)}, "point_force: loads inside"),
        ({"mesh": MeshOptions(0.1)}, "mesh.element_size: the faces of a superelement"),
    ):
        with pytest.raises(InputError, match=told):
            solve(problem.model_copy(update={"body": (block.model_copy(update=change),)}))
