"""Contact in space against a field that is exact on a finite block.

The block is cut out of a half space under sqrt(1 - r²/a²): exact displacement on all sides but the
contact face, exact gap there.
"""

from __future__ import annotations

import numpy as np
import pytest
from shapes import cuboid, elastic, moved, problem, touching

from petcontact import solve
from petcontact.pipeline.adapt.surface_errors import TailErrors
from petcontact.reference.half_space_displacement import elliptic_load
from petcontact.reference.hertz import elliptic

pytestmark = pytest.mark.usefixtures("unestimated")

HALF, NU = 1.5, 0.3
FACES = ("left", "right", "front", "back", "bottom")


def component(k):
    """Of the displacement under the pressure, which acts along -z."""
    flip = np.array([1.0, 1.0, -1.0])

    def values(x, y, z):
        at = np.column_stack([x, y, z]) * flip
        return flip[k] * elliptic_load(at, 1.0, 1.0, 0.0, NU)[:, k]

    return values


def relative(weight, found, exact):
    return float(
        np.sqrt(weight @ np.sum((found - exact) ** 2, axis=1) / (weight @ np.sum(exact**2, axis=1)))
    )


def test_hertz_on_a_rigid_sphere():
    """p_0 = 1, a = 1, ν = 0.3: pressure, and its resultant 2π/3."""
    rise, field = 0.25 * np.pi * (1.0 - NU**2), tuple(component(k) for k in range(3))
    block = problem(
        material=elastic(1.0, NU),
        geometry=cuboid([-HALF, -HALF, -HALF], [HALF, HALF, 0.0]),
        mesh={"element_size": 1.0, "element_sizes": {"top": 0.5}, "order": 1, "exponent": 1.0},
        boundary=[moved(part, field) for part in FACES],
        obstacle=[{"name": "sphere"}],
        contact=[touching("top", "top", "sphere", gap=f"{rise}*(x**2 + y**2 - 2)")],
    )
    solution = solve(block)
    assert solution.converged, solution.reason
    pair = solution.last.pairs["top"]
    p = elliptic(np.hypot(pair.x[:, 0], pair.x[:, 1]), 1.0)
    assert relative(pair.weight, pair.pressure[:, None], p[:, None]) < 0.02
    assert pair.force == pytest.approx([0.0, 0.0, -2.0 * np.pi / 3.0], abs=2e-3)
    assert np.abs(pair.moment).max() < 1e-12
    # of the function between the nodes, on points of 50 x 50 squares
    mesh = solution.mesh
    line = np.linspace(-HALF, HALF, 50, endpoint=False) + 0.5 * HALF / 25.0
    x = np.stack([*np.meshgrid(line, line), np.zeros((50, 50))], axis=-1).reshape(-1, 3)
    numbers, faces = mesh.faces("top")
    hits = faces.cast(x - [0.0, 0.0, 1.0], np.tile([0.0, 0.0, -1.0], (len(x), 1)))
    found = mesh.basis_at(numbers[hits.face], hits.place)[:, solution.nodes["top"]] @ pair.pressure
    true = relative(
        np.ones(len(x)), found[:, None], elliptic(np.hypot(x[:, 0], x[:, 1]), 1.0)[:, None]
    )
    error, of_force = TailErrors(solution).error()
    assert 1.0 < error / true < 3.0
    assert abs(pair.force[2] + 2.0 * np.pi / 3.0) < of_force * 2.0 * np.pi / 3.0
