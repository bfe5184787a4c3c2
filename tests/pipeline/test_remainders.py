"""Gaps and loads in space that vary within panels: integrals are right, and what is left is told."""

from __future__ import annotations

import math
import re

import pytest
from marks import slow

from petcontact import (
    Box,
    Displacement,
    Material,
    MeshOptions,
    Obstacle,
    Pair,
    Problem,
    Symmetry,
    Traction,
    solve,
)
from petcontact.mesh.approximation import sampled
from petcontact.pipeline.pose.load_states import known_function
from petcontact.refinement.meshes import mesh_of

SOFT = Material(1.0, 0.3)
SIDES = tuple(Symmetry(part) for part in ("left", "right", "front", "back"))


def pressed(gap: str, size: float, *, free: bool = True) -> Problem:
    """A bar 2 x 2 x 2 under a rigid punch of some shape, on panels of a size."""
    motion = {"displacement": (0.0, 0.0, "free"), "force": (0.0, 0.0, -0.032)}
    return Problem(
        material=SOFT,
        geometry=Box((0.0, 0.0, -2.0), (2.0, 2.0, 0.0)),
        mesh=MeshOptions(size, order=1, exponent=1.0),
        boundary=[*SIDES, Displacement("bottom", (0.0, 0.0, 0.0))],
        obstacle=[Obstacle("punch", **motion if free else {"displacement": (0.0, 0.0, -0.01)})],
        contact=[Pair("c", "top", "punch", gap=gap)],
    )


@pytest.mark.parametrize(
    ("load", "exact"),
    [
        slow("where((x-1)**2+(y-1)**2 < 0.09, -0.01, 0.0)", -0.01 * math.pi * 0.09),
        ("-0.01*where(abs(x-.31) < .04, 1, 0)", -0.01 * 0.08 * 2.0),
    ],
)
def test_the_integral_of_a_load_is_right_on_any_panels(load, exact):
    block = Problem(
        material=SOFT,
        geometry=Box((0.0, 0.0, 0.0), (2.0, 2.0, 2.0)),
        mesh=MeshOptions(1.0, order=1, exponent=1.0),
        boundary=[*SIDES, Traction("top", (0.0, 0.0, load))],
        obstacle=[Obstacle("floor")],
        contact=[Pair("c", "bottom", "floor")],
    )
    found = solve(block)
    (mesh,), (body,) = found.meshes.values(), found.bodies.values()
    top = mesh.nodes_of("top")
    assert mesh.weight[top] @ body.traction[top, 2] == pytest.approx(exact, rel=1e-3)
    assert found.pairs["c"].force[2] == pytest.approx(-exact, rel=2e-2)


def test_the_integral_over_a_disc_is_known_to_what_the_samples_doubt():
    """Cells that the rim of the disc crosses had integrals that agreed with those of their halves
    by chance: it missed 2.3e-3."""
    box = Box((0.0, 0.0, 0.0), (2.0, 2.0, 2.0))
    load = "where((x-0.9)**2+(y-1.1)**2 < 0.09, 1.0, 0.0)"
    options = MeshOptions(0.2, order=1, exponent=1.0)
    block = Problem(
        material=SOFT, geometry=box, mesh=options, boundary=[Traction("top", (0, 0, 1))]
    )
    mesh, traction = mesh_of(block, box.outline()), Traction("top", (0.0, 0.0, load))
    samples = sampled(mesh, "top", known_function(traction, mesh, "top"), traction)
    exact = math.pi * 0.09
    assert samples.weight @ samples.values[:, 2] == pytest.approx(exact, abs=samples.doubt)
    assert samples.doubt < 1e-3 * exact


def test_a_bump_between_open_nodes_is_not_overlooked():
    found = solve(pressed("0.02 - 0.025*exp(-((x-.83)**2+(y-.83)**2)/0.002)", 0.5, free=False))
    assert not found.converged and "overlap between nodes" in found.reason
    place = [float(each) for each in re.findall(r"[\d.e+-]+", found.reason.split(" at (")[1])[:3]]
    assert place == pytest.approx([0.83, 0.83, 0.0], abs=5e-3)
