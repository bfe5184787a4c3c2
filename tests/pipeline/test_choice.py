"""`mat_type = "auto"` takes what costs less, and never loses a solve to a compression that went
wrong."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from prepared import compressed_from

from petcontact import Bem, Circle, MeshOptions, Rectangle, SideBySide, solve
from petcontact.compliance.body.hodlr import HodlrBody
from petcontact.errors import SolverError
from petcontact.mesh.grading import mesh_outline
from petcontact.mesh.surface_mesh import SurfaceMesh
from petcontact.pipeline import choice

pytestmark = pytest.mark.usefixtures("unestimated")

SIDES = [
    {"part": name, "to": to}
    for name, to in (("b", (8, 0)), ("r", (8, 4)), ("t", (0, 4)), ("l", (0, 0)))
]
SQUARE = [
    {"part": name, "to": to}
    for name, to in (("b", (32, 0)), ("r", (32, 32)), ("t", (0, 32)), ("l", (0, 0)))
]
CROWD = [
    Circle(part="h", center=(4 * k + 2, 4 * j + 2), radius=1.0) for k in range(8) for j in range(8)
]
HOLES = [Circle(part="h", center=(0.8 * k + 0.4, 2.0), radius=0.3) for k in range(10)]


def box(width, height):
    return Rectangle(lower_left=(0, 0), upper_right=(width, height))


@pytest.mark.parametrize(
    ("geometry", "mesh", "compressed"),
    [
        (box(8, 4), {"element_size": 0.025}, False),  # 960 nodes
        (box(8, 4), {"element_size": 0.015}, True),  # 1600
        # 1440 nodes: 1.2 s compressed, 0.5 s dense
        (SideBySide(loops=[SIDES, *HOLES]), {"element_size": 0.03}, False),
        # 5376 nodes: 49 s compressed, 26 s dense
        (SideBySide(loops=[SQUARE, *CROWD]), {"element_size": 0.4, "order": 3}, False),
        (box(400, 30), {"element_size": 1.0, "order": 2}, True),  # 1.2 s
        (box(400, 4), {"element_size": 1.0, "order": 2}, False),
        # 1240 nodes, graded: the compression fails
        (box(8, 4), {"order": 3, "grading": 0.5, "levels": 38}, False),
    ],
)
def test_the_cheaper_operator_is_taken(geometry, mesh, compressed):
    made = mesh_outline(geometry.outline(), MeshOptions(**mesh))
    assert (choice.compression_of(Bem(), made) is not None) == compressed
    assert choice.compression_of(Bem(mat_type="hodlr"), made).name == "hodlr"
    assert choice.compression_of(Bem(mat_type="dense"), made) is None


@pytest.mark.parametrize(
    ("height", "size", "seconds", "memory"), [(0.02, 0.02, 8.2, 0.19e9), (0.01, 0.01, 68.0, 0.7e9)]
)
def test_the_sides_of_a_strip_cost_what_was_measured(height, size, seconds, memory):
    """They see each other all along, though equal stretches share the blocks of each."""
    made = mesh_outline(box(4, height).outline(), MeshOptions(element_size=size, order=2))
    curves = choice.COMPRESSIONS["hodlr"]
    assert seconds / 1.5 < curves.exact_seconds(Bem(), made) < 1.5 * seconds
    assert memory / 1.5 < curves.memory(made) < 1.5 * memory


GRADED = example(1, mesh=MeshOptions(order=3, grading=0.5, levels=30), name="semismooth-newton")


@pytest.mark.slow
def test_a_compression_that_misses_is_replaced_by_itself(monkeypatch, comm):
    """A tolerance of 1e-7 leaves more than the integral equations may miss."""
    lost = solve(
        GRADED.model_copy(update={"bem": Bem(mat_type="hodlr", hodlr_tol=1e-7)}), comm=comm
    )
    assert lost.status == "failed" and lost.last.residuals["elastic"] > 1e-7
    assert "hodlr" in lost.provenance.solver
    compressed_from(100, "hodlr", monkeypatch)
    solution = solve(GRADED.model_copy(update={"bem": Bem(hodlr_tol=1e-7)}), comm=comm)
    assert solution.converged and solution.last.residuals["elastic"] < 1e-9
    assert "dense" in solution.provenance.solver


def test_a_compression_that_raises_is_replaced_too(monkeypatch, comm):
    def refuse(self, *words):
        raise SolverError("assemble", "the compressed operator is off by 1e-3", "none")

    monkeypatch.setattr(HodlrBody, "__init__", refuse)
    compressed_from(100, "hodlr", monkeypatch)
    small = example(1, mesh=MeshOptions(element_size=0.1))
    assert "dense" in solve(small, comm=comm).provenance.solver
    with pytest.raises(SolverError):
        solve(small.model_copy(update={"bem": Bem(mat_type="hodlr")}), comm=comm)


MEASURED = [
    ((5760,), 1e-6, 1, 0, 6, 15.3),
    ((1485, 1485), 1e-4, 2, 0, 6, 4.7),
    ((3753, 3753), 1e-3, 2, 6, 6, 21.4),
    ((930, 696, 756), 1e-4, 2, 3, 6, 7.9),
    ((5280, 2940), 1e-4, 2, 3, 9, 43.0),
]
"""Nodes of bodies, tolerance, increments, motions that only contact holds, Newton steps of an
increment, processor seconds of one core."""


@pytest.mark.parametrize(
    ("counts", "tolerance", "increments", "motions", "steps", "seconds"), MEASURED
)
def test_the_seconds_of_a_whole_solve(counts, tolerance, increments, motions, steps, seconds):
    bem = Bem(mat_type="hmatrix", hmatrix_tol=tolerance)
    meshes = [object.__new__(SurfaceMesh) for _ in counts]
    for mesh, count in zip(meshes, counts, strict=True):
        vars(mesh)["element"] = np.zeros(count)
    none = [0] * len(meshes)
    newton = choice.Newton(steps)
    told = choice.solve_seconds(bem, meshes, none, 0, increments, motions, newton)
    assert seconds / 1.5 < told < 1.5 * seconds
