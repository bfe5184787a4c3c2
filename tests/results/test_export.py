"""What goes to other programs: CSV tables, the VTKHDF file, animations, and the scales of
drawings."""

from __future__ import annotations

import csv
import tomllib
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from petcontact import solve
from petcontact.commands.main import main
from petcontact.model.bodies import Units
from petcontact.model.case import load, parse_problem
from petcontact.results.figures.view import view_of
from petcontact.results.records import BodyResult
from petcontact.results.tables import write_tables

pytestmark = pytest.mark.usefixtures("unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"
STEPPED = """
[[body]]
name = "block"
material = { young_modulus = 100.0, poisson_ratio = 0.3 }
geometry = { shape = "rectangle", lower_left = [0.0, 0.0], upper_right = [2.0, 1.0] }
mesh = { element_size = 0.25, order = 1 }
[[obstacle]]
name = "plate"
force = [0.5, -1.0]
displacement = ["free", "free"]
[[contact]]
name = "top"
secondary = "block.top"
primary = "plate"
friction_coefficient = 0.8
[[body.boundary]]
part = "bottom"
condition = "displacement"
value = [0.0, 0.0]
[[step]]
name = "press"
[[step.obstacle]]
name = "plate"
force = [0.0, -1.0]
[[step]]
name = "push"
increments = 2
[[step.obstacle]]
name = "plate"
force = [0.5, -1.0]
"""


@pytest.fixture(scope="module")
def plane(tmp_path_factory):
    solution = solve(parse_problem(tomllib.loads(STEPPED), "stepped", {}, Path()))
    assert solution.converged, solution.reason
    return solution, _saved(solution, tmp_path_factory)


@pytest.fixture(scope="module")
def space(tmp_path_factory):
    solution = solve(load(CONFIGS / "space_b.toml", {"mesh.element_size": 2.0, "mesh.order": 0}))
    return solution, _saved(solution, tmp_path_factory)


def _saved(solution, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("result") / "r.h5"
    solution.save(path)
    return path


def rows(path: Path) -> list[dict[str, str]]:
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("kind", ["plane", "space"])
def test_tables_hold_what_the_solution_has(kind, request, tmp_path, capsys):
    solution, path = request.getfixturevalue(kind)
    d = next(iter(solution.meshes.values())).dim
    assert main(["export", str(path), "--csv", str(tmp_path / "out")]) == 0, capsys.readouterr().err
    pairs, boundary = rows(tmp_path / "out/pairs.csv"), rows(tmp_path / "out/boundary.csv")
    assert len(pairs) == len(solution.steps) * sum(map(len, solution.nodes.values()))
    assert len(boundary) == len(solution.steps) * sum(
        mesh.n_nodes for mesh in solution.meshes.values()
    )
    for number, step in enumerate(solution.steps, 1):
        (pair,) = step.pairs.values()
        mine = [row for row in pairs if row["increment"] == str(number)]
        force = sum(float(row["weight"]) * float(row["pressure"]) for row in mine)
        assert force == pytest.approx(float(pair.weight @ pair.pressure), rel=1e-12)
        assert [row["state"] for row in mine] == [("stick", "slip", "open")[k] for k in pair.state]
        nodes = [row for row in boundary if row["increment"] == str(number)]
        moved = np.array([[float(row[f"u{axis}"]) for axis in "xyz"[:d]] for row in nodes])
        assert np.array_equal(moved, np.concatenate([body.u for body in step.bodies.values()]))
        total = [
            row for row in rows(tmp_path / "out/resultants.csv") if row["increment"] == str(number)
        ]
        assert [float(total[0][f"F{axis}"]) for axis in "xyz"[:d]] == pair.force.tolist()
    assert len(rows(tmp_path / "out/history.csv")) == solution.iterations
    last = [
        row
        for row in rows(tmp_path / "out/reactions.csv")
        if row["increment"] == str(len(solution.steps))
    ]
    assert {row["part"]: float(row["Fx"]) for row in last} == {
        part: force[0] for part, force in solution.reactions().items()
    }
    assert (tmp_path / "out/obstacles.csv").exists() == bool(solution.last.obstacles)


def test_heads_of_tables_name_the_units_of_the_problem(plane, tmp_path):
    solution = replace(
        plane[0],
        problem=plane[0].problem.model_copy(update={"units": Units(length="mm", stress="MPa")}),
    )
    write_tables(solution, tmp_path / "out")
    heads = {path.stem: path.read_text().splitlines()[0] for path in (tmp_path / "out").iterdir()}
    assert "y [mm],nx,ny,arc_length [mm],weight [mm],pressure [MPa],sigma_t [MPa]" in heads["pairs"]
    assert heads["resultants"].endswith("Fx [N/mm],Fy [N/mm],M [N],area [mm],dissipated [N]")


@pytest.mark.parametrize("kind", ["plane", "space"])
def test_one_file_for_paraview_has_all_increments(kind, request, tmp_path, capsys):
    """Sizes and offsets as the format wants them, and fields of each increment at its place."""
    solution, path = request.getfixturevalue(kind)
    d = next(iter(solution.meshes.values())).dim
    assert (
        main(
            [
                "export",
                str(path),
                "--vtkhdf",
                str(tmp_path / "r.vtkhdf"),
                "--grid",
                "x".join("4" * d),
            ]
        )
        == 0
    )
    with h5py.File(tmp_path / "r.vtkhdf") as file:
        root = file["VTKHDF"]
        assert root.attrs["Type"] == b"UnstructuredGrid" and tuple(root.attrs["Version"]) == (2, 2)
        points, cells = int(root["NumberOfPoints"][0]), int(root["NumberOfCells"][0])
        assert root["Points"].shape == (points, 3)
        assert len(root["Types"]) == cells == len(root["Offsets"]) - 1
        assert (
            root["Offsets"][-1] == len(root["Connectivity"]) == root["NumberOfConnectivityIds"][0]
        )
        assert root["Connectivity"][()].max() < points
        count = root["Steps"].attrs["NSteps"]
        assert count == len(solution.steps)
        assert np.allclose(
            root["Steps/Values"], [s.step - 1 + s.load_factor for s in solution.steps]
        )
        for key, values in root["PointData"].items():
            assert len(values) == count * points
            assert root[f"Steps/PointDataOffsets/{key}"][()].tolist() == [
                points * k for k in range(count)
            ]
        assert len(root["CellData/contact"]) == count * cells
        assert set(root["CellData/contact"][()]) <= {-1, 0, 1, 2}
        inside = np.isnan(root["PointData/traction"][-points:, 0])
        x = root["Points"][()][inside][:, :d]
        assert inside.any()
        assert np.allclose(root["PointData/displacement"][-points:][inside][:, :d], solution.at(x))
        assert np.allclose(root["PointData/von_mises"][-points:][inside], solution.von_mises_at(x))


@pytest.mark.parametrize(
    ("size", "gap", "text"),
    [
        (1e-4, 0.0, "displacements × 1000"),
        (1e-4, 1e-7, "displacements × 1000"),
        (1e-4, -0.1, "displacements to scale"),
        (1e-4, "x**2", "displacements to scale"),
        (0.4, 0.0, "displacements to scale"),
        (1.5, 0.0, "displacements to scale"),
        (30.0, 0.1, "displacements / 200"),
    ],
)
def test_displacements_are_shrunk_beyond_the_size_of_bodies_and_magnified_only_where_sides_fit(
    plane, size, gap, text
):
    solution, _ = plane
    step, pair = solution.last, solution.problem.contact[0]
    bodies = {
        name: BodyResult(size / np.sqrt(2.0) * np.ones_like(body.u), body.traction)
        for name, body in step.bodies.items()
    }
    closed = {name: replace(pair, state=0 * pair.state) for name, pair in step.pairs.items()}
    contact = (pair.model_copy(update={"gap": gap}),)
    changed = replace(
        solution,
        problem=solution.problem.model_copy(update={"contact": contact}),
        steps=[replace(step, bodies=bodies, pairs=closed)],
    )
    assert view_of(changed).text == text
