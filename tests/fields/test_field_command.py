"""petcontact field: from a result file to ParaView's files and the figure."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from conftest import example

from petcontact import MeshOptions, field_on_grid, solve, write_solution
from petcontact.commands.main import main


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    path = tmp_path_factory.mktemp("field") / "result.h5"
    write_solution(path, solve(example(1, mesh=MeshOptions(element_size=0.2))))
    return path


def test_field_writes_what_paraview_reads(result, tmp_path, capsys):
    field, boundary, figure = (tmp_path / name for name in ("f.vtu", "b.vtu", "f.png"))
    words = ["field", str(result), "--grid", "40x20", "-o", str(field), "--boundary", str(boundary), "--figure", str(figure)]
    assert main(words) == 0
    assert "largest von Mises stress" in capsys.readouterr().out
    inside = meshio.read(field)
    assert inside.points[:, 0].min() == pytest.approx(0.0, abs=1e-3)
    assert inside.points[:, 0].max() == pytest.approx(8.0, abs=1e-3)
    assert np.isfinite(inside.point_data["displacement"]).all()
    assert len(meshio.read(boundary).points) > 100
    assert figure.stat().st_size > 10_000


@pytest.mark.parametrize("grid", ["40", "40x", "0x3", "axb", "-3x4", "1e9x2"])
def test_a_grid_that_is_none_is_refused(result, grid, capsys):
    assert main(["field", str(result), f"--grid={grid}"]) == 2
    assert "--grid" in capsys.readouterr().err


def test_progress_rises_from_nothing_and_changes_nothing():
    solution = solve(example(1, mesh=MeshOptions(element_size=0.02)))
    arguments = solution.mesh, solution.u, solution.traction, solution.problem.material, (20, 20)
    shares = []
    told, silent = field_on_grid(*arguments, shares.append), field_on_grid(*arguments)
    assert shares[0] == 0.0 and len(shares) > 3 and shares == sorted(shares) and shares[-1] < 1.0
    assert np.array_equal(told.stress, silent.stress)
