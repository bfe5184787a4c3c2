"""Files for ParaView of bodies in space: what is written is what a state of constant stress must
be."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import meshio
import numpy as np
import pytest

from petcontact.model.case import load
from petcontact.pipeline.run import prepare, run
from petcontact.results.records import BodyResult
from petcontact.results.vtu.boundary import write_boundary_vtu
from petcontact.results.vtu.inside import field_inside, grid_inside, write_vtu

CONFIG = Path(__file__).parents[2] / "configs" / "space_b.toml"


@pytest.fixture(scope="module")
def solution():
    case = load(CONFIG, {"mesh.element_size": 4.0, "mesh.order": 1})
    prepared = prepare(case)
    found = run(prepared)
    prepared.close()
    return found


def test_constant_stress(solution, tmp_path: Path) -> None:
    mesh, material = solution.mesh, solution.problem.material
    strain = np.array([[1.0, 0.2, 0.0], [0.2, -0.5, 0.3], [0.0, 0.3, 0.1]])
    mu, nu = material.shear_modulus, material.poisson_ratio
    stress = 2.0 * mu * (strain + nu / (1.0 - 2.0 * nu) * np.trace(strain) * np.eye(3))
    found = {"body": BodyResult(mesh.x @ strain, mesh.normal @ stress)}
    patch = dataclasses.replace(solution, steps=[dataclasses.replace(solution.last, bodies=found)])
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
