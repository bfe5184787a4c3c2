"""petcontact field: from a result file to ParaView's files and the figure."""

from __future__ import annotations

import csv
from pathlib import Path

import meshio
import numpy as np
import pytest
from examples import example

from petcontact import MeshOptions, load, solve, write_solution
from petcontact.commands.main import main

pytestmark = pytest.mark.usefixtures("unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"


def test_field_writes_what_paraview_reads(tmp_path, capsys):
    """Inside, the ends of the block; on its boundary parts, states of contact and tractions."""
    write_solution(tmp_path / "r.h5", solve(example(1, mesh=MeshOptions(element_size=0.1))))
    words = "field {0}/r.h5 --grid 40x20 -o {0}/f.vtu --boundary {0}/b.vtu --figure {0}/f.png"
    assert main(words.format(tmp_path).split()) == 0
    assert "largest von Mises stress" in capsys.readouterr().out
    assert (tmp_path / "f.png").stat().st_size > 10_000
    inside, back = (meshio.read(tmp_path / name) for name in ("f.vtu", "b.vtu"))
    ends = inside.points[:, 0].min(), inside.points[:, 0].max()
    assert ends == pytest.approx((0.0, 8.0), abs=1e-3)
    assert np.isfinite(inside.point_data["displacement"]).all()
    lines, data = back.cells_dict["line"], back.point_data
    length = np.hypot(*(back.points[lines[:, 1]] - back.points[lines[:, 0]])[:, :2].T)
    assert length.sum() == pytest.approx(24.0)
    part, contact = back.cell_data["part"][0], back.cell_data["contact"][0]
    assert np.array_equal(part == 0, contact >= 0)
    slips, ends = lines[contact == 1], lines[contact >= 0]
    assert length[contact == 1].sum() == pytest.approx(3.378, abs=0.2)
    assert np.allclose(data["sigma_t"][slips], -150.0, atol=2.0)
    assert np.abs(data["sigma_t"][ends]).max() <= 150.0 * (1.0 + 1e-12)
    assert np.allclose(data["friction_bound"][ends], 150.0, rtol=1e-12)
    names = {"part 0 is bottom", "contact 1 is slip", "contact 2 is open"}
    assert names <= back.field_data.keys()
    assert np.abs(data["displacement"][lines[part == 2]]).max() < 1e-14


def rows(path):
    with open(path) as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def steps(tmp_path_factory):
    """Two blocks in four increments."""
    path = tmp_path_factory.mktemp("steps") / "f.h5"
    once = {f"step.{k}.increments": 1 for k in (1, 2, 3)}
    coarse = {"body.0.mesh.element_sizes.top": 0.4, **once}
    solution = solve(load(CONFIGS / "fretting.toml", coarse))
    solution.save(path)
    return solution, path


def test_points_in_space(tmp_path):
    solution = solve(load(CONFIGS / "space_b.toml", {"mesh.element_size": 2.0, "mesh.order": 0}))
    solution.save(tmp_path / "b.h5")
    middle = solution.mesh.x.mean(axis=0)
    given = [",".join(map(str, x)) for x in (middle, solution.mesh.x[3])]
    (tmp_path / "p.csv").write_text("\n".join(given))
    words = "field {0}/b.h5 --points {0}/p.csv -o {0}/o.csv --figure {0}/o.png --quantity sigma_xz"
    assert main(words.format(tmp_path).split()) == 0
    inside, surface = rows(tmp_path / "o.csv")
    on_boundary, within = solution.stress_on_boundary()[3], solution.stress_at([middle])[0]
    assert float(surface["sigma_yz"]) == pytest.approx(on_boundary[5], rel=1e-9)
    assert float(inside["sigma_zz"]) == pytest.approx(within[2], rel=1e-9)


def test_one_body_one_increment_one_window(steps, tmp_path):
    solution, path = steps
    words = f"field {path} --body upper --step last --window -1 0 1 0.5 --grid 16x8"
    assert main(f"{words} -o {tmp_path}/w.vtu".split()) == 0
    mesh = meshio.read(tmp_path / "w.vtu")
    low, high = mesh.points[:, :2].min(axis=0), mesh.points[:, :2].max(axis=0)
    assert np.all(low >= [-1.0, 0.0]) and np.all(high <= [1.0, 0.5])
    assert np.prod(high - low) == pytest.approx(1.0, rel=0.05)
    inside = np.argmin(np.linalg.norm(mesh.points[:, :2] - [0.0, 0.25], axis=1))
    wanted = solution.stress_at(mesh.points[[inside], :2], "upper")
    assert mesh.point_data["stress"][inside, [0, 1, 3]] == pytest.approx(wanted[0], rel=1e-8)
    # one increment of all bodies is a collection; bodies outside the window are left out
    assert main(f"field {path} --step 1 --grid 4x4 -o {tmp_path}/c.vtu".split()) == 0
    files = (f"c-001-{body}{end}.vtu" for body in ("lower", "upper") for end in ("", "-boundary"))
    assert {file.name for file in tmp_path.glob("c*")} == {"c.pvd", *files}
    words = f"field {path} --window -1 0.1 1 0.5 --step 1 --grid 4x4 -o {tmp_path}/d.vtu"
    assert main(words.split()) == 0
    assert not [*tmp_path.glob("d*lower*")] and len([*tmp_path.glob("d*upper*")]) == 2


POINTS = "a table of --points is of these points alone"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        *((f"--grid={grid}", "--grid") for grid in ("40", "40x", "0x3", "axb", "-3x4", "1e9x2")),
        ("--quantity sigma_xx", "--quantity sigma_xx: is what a figure shows"),
        ("--grid 8x8 -o own.vtk", "own.vtk: a field is written as .vtu"),
        ("--grid 8x8 --figure own.tif", "own.tif: a figure is .png, .pdf or .svg"),
        ("--grid 8x8x8", "the body has 2 dimensions"),
        ("--points p.csv --grid 20x10", f"--grid: {POINTS}"),
        ("--points p.csv --window 0 0 1 1", f"--window: {POINTS}"),
        ("--step 9", "--step 9: there are increments 1 to 4, and `last`"),
        ("--body uper", "no body 'uper', did you mean 'upper'?"),
        ("--window 0 0 1", "expected the lower and the upper corner"),
        ("--window 8 8 9 9 --step 1", "--window: nothing of the body lies in it"),
        ("--window 0 0 0 1 1 1", "--window: the body has 2 dimensions: 4 numbers are needed"),
        ("--quantity von_mise --figure f.png", "no 'von_mise', did you mean 'von_mises'?"),
        ("--points none.csv --body upper", "none.csv: cannot be read (No such file"),
        ("--points points.csv", "--body must name one body; there are lower, upper"),
        (
            "--points points.csv --body upper",
            "line 2 of points.csv has 1 columns, those before have 2",
        ),
        ("--points points.csv -o o.vtu", "o.vtu: a table is written as .csv"),
    ],
)
def test_mistakes_in_what_is_asked(steps, tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "points.csv").write_text("0, 1\n1\n")
    assert main(f"field {steps[1]} {words}".split()) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1 and not list(tmp_path.glob("*.vtu"))
