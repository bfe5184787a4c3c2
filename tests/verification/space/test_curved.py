"""Curved panels on the one path: Lamé's hollow sphere, shells in contact, H-matrices, volume loads,
what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy
from curved_bodies import icosphere, written
from shapes import closing, drawn, elastic, outline, problem, rollers, solid, touching

import petcontact
from petcontact import InputError, solve
from petcontact.geometry.gmsh import read_msh
from petcontact.geometry.gmsh_surface import gmsh_surface
from petcontact.mesh.panelling import facet_mesh
from petcontact.pipeline.adapt.fixed_mesh import with_estimate
from petcontact.reference.lame import Sphere

pytestmark = pytest.mark.usefixtures("unestimated")


OPEN = {"condition": "contact", "normal": "unilateral", "gap": 10.0}
"""Nothing pulls: the ground is far away."""


def radial(sphere: Sphere) -> dict:
    """The displacement A r + B/r² of a sphere under pressure, given."""
    r = np.array([1.0, 2.0])
    a, b = np.linalg.solve(np.column_stack([r, r**-2]), sphere.displacement(r)).tolist()
    return {
        "condition": "displacement",
        "value": [f"({a!r} + {b!r}/sqrt(x**2 + y**2 + z**2)**3)*{c}" for c in "xyz"],
    }


def body(name: str, file: str, order: int = 2, **conditions: dict) -> dict:
    boundary = [{"part": part, **condition} for part, condition in conditions.items()]
    return solid(name, {"shape": "gmsh", "file": file}, *boundary, mesh={"order": order})


def hollow(file: Path, pieces: int) -> str:
    return written(file, {"inner": icosphere(pieces), "outer": 2.0 * icosphere(pieces)})


@pytest.mark.slow
def test_shells_in_contact(tmp_path: Path, comm: Any, turn: float = 0.4) -> None:
    """A hollow sphere in another one, as if they were one: pressure between them on meshes that do
    not match."""
    turned = (
        icosphere(2)
        @ scipy.spatial.transform.Rotation.from_rotvec([turn, -0.7 * turn, 0.9 * turn]).as_matrix()
    )
    both = Sphere(1.0, 3.0, 1.0, 0.3, pressure_inside=1.0)
    core = body(
        "core", hollow(tmp_path / "core.msh", 2), inner={"condition": "traction", "pressure": 1.0}
    )
    file = written(tmp_path / "shell.msh", {"inner": 2.0 * turned, "outer": 3.0 * turned})
    shell = body("shell", file, outer=radial(both))
    contact = touching("fit", "core.outer", "shell.inner", friction_coefficient=0.3)
    bem = {"mat_type": "dense"}
    solution = solve(problem(body=[core, shell], contact=[contact], bem=bem))
    pair, exact = solution.pairs["fit"], -both.stress(np.array([2.0]))[0][0]
    error = np.sqrt(pair.weight @ (pair.pressure / exact - 1.0) ** 2 / pair.weight.sum())
    shear = np.sqrt(pair.weight @ np.sum(pair.sigma_t**2, axis=1) / pair.weight.sum()) / exact
    assert solution.converged and error < 5e-2 and shear < 1e-2, (error, shear)
    # an estimate is never too small, and up to 12 times too large
    assert 0.95 * error < with_estimate(solution, comm).accuracy.error < 12.0 * error


def test_distorted_elements_are_named(tmp_path: Path) -> None:
    cells = icosphere(1)
    moved = cells.copy()
    # a middle that three eighths of the edge away from a corner makes the area factor vary
    edge = np.linalg.norm(cells[:, 3:] - cells[0, 3], axis=2) < 1e-9
    moved[:, 3:][edge] = (0.62 * cells[0, 0] + 0.38 * cells[0, 1]) * 1.1
    file = written(tmp_path / "m.msh", {"inner": 0.5 * cells, "outer": moved})
    ball = body(
        "ball", file, 1, outer={"condition": "displacement", "value": [0.0, 0.0, 0.0]}, inner=OPEN
    )
    solution = solve(problem(body=[ball], bem={"mat_type": "dense"}))
    told = [text for text in solution.warnings if "area factor" in text]
    assert len(told) == 1 and "body 'ball'" in told[0] and "in element" in told[0]


def test_what_is_refused_in_one_line(tmp_path: Path) -> None:
    cells = icosphere(1)
    folded, gaping, crossing = cells.copy(), cells.copy(), cells.copy()
    edge = np.linalg.norm(cells[:, 3:] - cells[0, 3], axis=2) < 1e-9
    folded[:, 3:][edge] = cells[0, 0] + 0.05 * (cells[0, 1] - cells[0, 0])
    gaping[0, 3] *= 1.1
    crossing[:, 3:][edge] *= -1.5
    cases = {
        "is open": cells[:-1],
        "folded": folded,
        "different points": gaping,
        "crosses itself": crossing,
    }
    for number, (message, wrong) in enumerate(cases.items()):
        file = written(tmp_path / f"{number}.msh", {"skin": wrong})
        with pytest.raises(InputError) as caught:
            gmsh_surface(read_msh(file), file)
        assert message in str(caught.value) or (
            message == "crosses itself" and "folded" in str(caught.value)
        )
        assert "\n" not in str(caught.value)


def test_cavities_of_curved_cells_point_inward(tmp_path: Path) -> None:
    inner = icosphere(1)
    parts = {"inner": inner, "outer": 2.0 * inner[:, [0, 2, 1, 5, 4, 3]]}
    file = written(tmp_path / "shell.msh", parts)
    mesh = facet_mesh(gmsh_surface(read_msh(file), file), 2)
    outward = np.sum(mesh.normal * mesh.x, axis=1)
    assert np.all(outward[mesh.nodes_of("inner")] < 0.0)
    assert np.all(outward[mesh.nodes_of("outer")] > 0.0)


def test_a_cylinder_is_closed_and_carries_an_even_pressure() -> None:
    """Along a leaning axis: area and volume, and a column with ν = 0 on rough ground, whose
    displacement is linear."""
    start, end = np.array([1.0, -2.0, 0.5]), np.array([1.6, -1.2, 0.5])
    shape = {"shape": "cylinder", "from": start.tolist(), "to": end.tolist(), "radius": 0.7}
    column = problem(
        material=elastic(10.0, 0.0),
        geometry=shape,
        mesh={"element_size": 0.35, "order": 2},
        boundary=[
            closing("bottom", normal="unilateral", friction_coefficient=0.3),
            drawn("side", [0.0, 0.0, 0.0]),
            drawn("top", (start - end).tolist()),
        ],
    )
    solution = solve(column)
    mesh, (pair,) = solution.mesh, solution.last.pairs.values()
    assert np.abs(mesh.weight @ mesh.normal).max() < 1e-12
    assert abs(mesh.weight.sum() / (2.0 * np.pi * 0.7 * 1.7) - 1.0) < 3e-4
    volume = mesh.weight @ np.sum((mesh.x - start) * mesh.normal, axis=1) / 3.0
    assert abs(volume / (np.pi * 0.49) - 1.0) < 3e-4
    assert solution.converged and np.abs(pair.pressure - 1.0).max() < 1e-5
    assert np.abs(solution.u @ (end - start) + 0.1 * (mesh.x - start) @ (end - start)).max() < 1e-6
    with pytest.raises(InputError, match="a cylinder has a height"):
        petcontact.Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0)


@pytest.mark.slow
def test_stress_next_to_a_rim_is_that_on_the_boundary():
    """A quarter of a tube under pressure: points so near to the bore, close to the cut, that a jump
    of u between panels would add its own stress, which grows like the inverse of the distance (303
    at the panels, 41 at 2e-5)."""
    pressure = [
        {"part": part, "condition": "traction", "pressure": value}
        for part, value in (("inner", 10.0), ("outer", 0.0))
    ]
    flat = rollers("bottom", "top", "start", "end")
    loop = outline(bottom=[2.0, 0.0], outer=[2.0, 1.0], top=[1.0, 1.0], inner=[1.0, 0.0])
    tube = problem(
        material=elastic(1000.0, 0.3),
        mesh={"element_size": 0.4},
        geometry=loop | {"shape": "revolved", "angle": 90.0},
        boundary=[*pressure, *flat],
    )
    solution = solve(tube)
    for angle in (0.002, 0.02, 0.1):
        r = 1.0 + np.array([0.0, 1e-6, 2e-5, 1e-4, 5e-4, 3e-3])
        x = np.column_stack([r * np.cos(angle), r * np.sin(angle), np.full(len(r), 0.5)])
        # plane strain: Lamé's stresses at the bore
        exact = np.sqrt(
            0.5 * ((10.0 + 50.0 / 3.0) ** 2 + (50.0 / 3.0 - 2.0) ** 2 + (10.0 + 2.0) ** 2)
        )
        assert np.abs(solution.von_mises_at(x) / exact - 1.0).max() < 0.03
