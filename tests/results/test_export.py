"""What goes to other programs: CSV tables, the VTKHDF file, animations, and the scales of
drawings."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
from PIL import Image
from problems import block, contact_pair, obstacle, posed

from petcontact import solve
from petcontact.commands.main import main
from petcontact.given.tables.units import Units
from petcontact.model.case import load
from petcontact.results.figures.view import view_of
from petcontact.results.records import BodyResult
from petcontact.results.tables import write_tables
from petcontact.results.vtu.boundary import write_boundary_vtu
from petcontact.results.vtu.inner_fields import field_inside, grid_inside, write_vtu

pytestmark = pytest.mark.usefixtures("unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"
MESH = "element_size = 0.25, order = 1"
STEP = """
[[step]]
name = "{}"
{}
[[step.obstacle]]
name = "plate"
force = [{}, -1.0]
"""
STEPPED = block("block", [0.0, 0.0], [2.0, 1.0], 100.0, mesh=MESH, bottom=[0.0, 0.0])
STEPPED += obstacle("plate", ["free", "free"], "force = [0.5, -1.0]")
STEPPED += contact_pair("top", "block.top", "plate", 0.8)
STEPPED += STEP.format("press", "", 0.0) + STEP.format("push", "increments = 2", 0.5)
"""A block on which a rigid plate is pressed, then pushed, by its force."""


@pytest.fixture(scope="module")
def plane(tmp_path_factory):
    solution = solve(posed(STEPPED))
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
def test_tables_hold_what_the_solution_has(kind, request, tmp_path):
    solution, path = request.getfixturevalue(kind)
    assert main(f"export {path} --csv {tmp_path}/out".split()) == 0
    table = {name.stem: rows(name) for name in (tmp_path / "out").iterdir()}
    count, axes = len(solution.steps), "xyz"[: next(iter(solution.meshes.values())).dim]
    assert len(table["pairs"]) == count * sum(map(len, solution.nodes.values()))
    assert len(table["boundary"]) == count * sum(m.n_nodes for m in solution.meshes.values())

    def of(name, number):
        return [row for row in table[name] if row["increment"] == str(number)]

    for number, step in enumerate(solution.steps, 1):
        (pair,), mine = step.pairs.values(), of("pairs", number)
        force = sum(float(row["weight"]) * float(row["pressure"]) for row in mine)
        assert force == pytest.approx(float(pair.weight @ pair.pressure), rel=1e-12)
        assert [row["state"] for row in mine] == [("stick", "slip", "open")[k] for k in pair.state]
        moved = [[float(row[f"u{axis}"]) for axis in axes] for row in of("boundary", number)]
        assert np.array_equal(moved, np.concatenate([body.u for body in step.bodies.values()]))
        (total,) = of("resultants", number)
        assert [float(total[f"F{axis}"]) for axis in axes] == pair.force.tolist()
    assert len(table["history"]) == solution.iterations
    assert {row["part"]: float(row["Fx"]) for row in of("reactions", count)} == {
        part: force[0] for part, force in solution.reactions().items()
    }
    assert ("obstacles" in table) == bool(solution.last.obstacles)


def test_one_table_of_one_increment_goes_into_the_file_that_is_named(plane, tmp_path, capsys):
    """Its head names the units that the problem does."""
    solution, path = plane
    words = f"export {path} --csv {tmp_path}/b.csv --table obstacles --step 2"
    assert main(words.split()) == 0
    (row,) = rows(tmp_path / "b.csv")
    assert float(row["Fx"]) == pytest.approx(0.25) and row["obstacle"] == "plate"
    units = Units(length="mm", stress="MPa")
    problem = solution.problem.model_copy(update={"units": units})
    write_tables(replace(solution, problem=problem), tmp_path / "u.csv", ["resultants"])
    head = (tmp_path / "u.csv").read_text().splitlines()[0]
    assert head.endswith("Fx [N/mm],Fy [N/mm],M [N],area [mm],dissipated [N]")
    for given, line in (
        ("", "nothing to write"),
        ("--csv x --table pair", "no table 'pair'"),
        ("--csv x.csv --table pairs --table history", "holds one table"),
        ("--csv x --step 9", "there are increments 1 to 3"),
        ("--csv x --step end", "--step end: there are increments 1 to 3, and `last`"),
        ("--vtkhdf x.vtu", "must end in .vtkhdf"),
    ):
        assert main(f"export {path} {given}".split()) == 2
        assert line in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["plane", "space"])
def test_one_file_for_paraview_has_all_increments(kind, request, tmp_path):
    """Sizes and offsets as the format wants them, and fields of each increment at its place."""
    solution, path = request.getfixturevalue(kind)
    d = next(iter(solution.meshes.values())).dim
    grid = "x".join("4" * d)
    assert main(f"export {path} --vtkhdf {tmp_path}/r.vtkhdf --grid {grid}".split()) == 0
    with h5py.File(tmp_path / "r.vtkhdf") as file:
        root = file["VTKHDF"]
        assert root.attrs["Type"] == b"UnstructuredGrid" and tuple(root.attrs["Version"]) == (2, 2)
        points, cells = int(root["NumberOfPoints"][0]), int(root["NumberOfCells"][0])
        ends, corners = root["Offsets"][()], root["Connectivity"][()]
        assert root["Points"].shape == (points, 3) and corners.max() < points
        assert len(root["Types"]) == cells == len(ends) - 1
        assert ends[-1] == len(corners) == root["NumberOfConnectivityIds"][0]
        count = root["Steps"].attrs["NSteps"]
        times = [step.step - 1 + step.load_factor for step in solution.steps]
        assert count == len(solution.steps) and np.allclose(root["Steps/Values"], times)
        for key, values in root["PointData"].items():
            assert len(values) == count * points
            offsets = root[f"Steps/PointDataOffsets/{key}"][()].tolist()
            assert offsets == [points * k for k in range(count)]
        assert len(root["CellData/contact"]) == count * cells
        assert set(root["CellData/contact"][()]) <= {-1, 0, 1, 2}
        inside = np.isnan(root["PointData/traction"][-points:, 0])
        x = root["Points"][()][inside][:, :d]
        assert inside.any()
        assert np.allclose(root["PointData/displacement"][-points:][inside][:, :d], solution.at(x))
        assert np.allclose(root["PointData/von_mises"][-points:][inside], solution.von_mises_at(x))


@pytest.mark.slow
def test_an_animation_has_a_frame_an_increment(plane, space, tmp_path, capsys):
    assert main(f"plot {plane[1]} --animate {tmp_path}/a.gif".split()) == 0
    with Image.open(tmp_path / "a.gif") as picture:
        assert picture.n_frames == len(plane[0].steps) == 3
    assert main(f"plot {space[1]} --animate {tmp_path}/b.gif".split()) == 2
    assert "needs several increments, there is 1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("size", "gap", "text"),
    [
        (1e-4, 1e-7, "displacements × 1000"),
        (1e-4, -0.1, "displacements to scale"),
        (1.5, 0.0, "displacements to scale"),
        (30.0, 0.1, "displacements / 200"),
    ],
)
def test_displacements_are_shrunk_beyond_the_size_of_bodies_and_magnified_only_where_sides_fit(
    plane, size, gap, text
):
    solution, _ = plane
    step, problem = solution.last, solution.problem
    moved = {
        name: BodyResult(size / np.sqrt(2.0) * np.ones_like(body.u), body.traction)
        for name, body in step.bodies.items()
    }
    closed = {
        name: replace(pair, state=0 * pair.state, gap=0.0 * pair.x[:, 0])
        for name, pair in step.pairs.items()
    }
    contact = (problem.contact[0].model_copy(update={"gap": gap}),)
    steps = [replace(step, bodies=moved, pairs=closed)]
    given = problem.model_copy(update={"contact": contact})
    assert view_of(replace(solution, problem=given, steps=steps)).text == text


def test_constant_stress_in_files_for_paraview(tmp_path):
    """Of the plain data of a field: inside, and on panels."""
    solution = solve(load(CONFIGS / "space_b.toml", {"mesh.element_size": 4.0, "mesh.order": 1}))
    mesh, material = solution.mesh, solution.problem.material
    strain = np.array([[1.0, 0.2, 0.0], [0.2, -0.5, 0.3], [0.0, 0.3, 0.1]])
    mu, nu = material.shear_modulus, material.poisson_ratio
    stress = 2.0 * mu * (strain + nu / (1.0 - 2.0 * nu) * np.trace(strain) * np.eye(3))
    found = {"body": BodyResult(mesh.x @ strain, mesh.normal @ stress)}
    patch = replace(solution, steps=[replace(solution.last, bodies=found)])
    write_vtu(tmp_path / "v.vtu", field_inside(patch, grid_inside(mesh, (3, 2, 2)), "body"))
    write_boundary_vtu(tmp_path / "s.vtu", patch)
    volume, surface = (meshio.read(tmp_path / name) for name in ("v.vtu", "s.vtu"))
    for each in (volume, surface):
        moved = each.point_data["displacement"]
        np.testing.assert_allclose(moved, each.points @ strain, atol=1e-9)
    wanted = np.tile(stress[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]], (len(volume.points), 1))
    np.testing.assert_allclose(volume.point_data["stress"], wanted, atol=1e-6 * mu)
    assert len(volume.cells_dict["hexahedron"]) == 12
    inside, wanted = (
        patch.stress_at([[4.0, 2.0, 2.0]])[0],
        stress[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]],
    )
    np.testing.assert_allclose(inside, wanted, atol=1e-6 * mu)
    # constant tractions of order 1
    assert surface.cell_data_dict["traction_error"]["quad"].max() < 1e-9 * mu
