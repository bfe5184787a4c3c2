"""Contact in space against fields that are exact on finite blocks, the plane solver, and what must
not change an answer.

Blocks cut out of a half space under sqrt(1 - r²/a²): exact displacement on all sides but the
contact face, exact gap there.
"""

from __future__ import annotations

import numpy as np
import pytest
from shapes import cuboid, elastic, moved, touching

from petcontact import Problem
from petcontact.model.base import parse
from petcontact.pipeline.adapt.surface_errors import TailErrors
from petcontact.pipeline.pose import discretise as assemble
from petcontact.pipeline.run import prepare, run
from petcontact.reference.half_space import elliptic_load
from petcontact.reference.hertz import elliptic

HALF = 1.5
HELD = {
    "lower": ("left", "right", "front", "back", "bottom"),
    "upper": ("left", "right", "front", "back", "top"),
}


def block(name, nu, h, order):
    lower, upper = (
        ([-HALF, -HALF, -HALF], [HALF, HALF, 0.0])
        if name == "lower"
        else ([-HALF, -HALF, 0.0], [HALF] * 3)
    )
    face = "top" if name == "lower" else "bottom"
    return {
        "name": name,
        "material": elastic(1.0, nu),
        "geometry": cuboid(lower, upper),
        "mesh": {
            "element_size": 2.0 * h,
            "element_sizes": {face: h},
            "order": order,
            "exponent": 1.0,
        },
        "boundary": [moved(part, [0.0] * 3) for part in HELD[name]],
    }


def solved(data, states):
    """The problem with displacements states[b](x) (K, n, 3) of body b on all held parts in its load
    states."""
    problem = parse(Problem, data, "exact blocks in space")
    discrete = assemble.discretise(problem)
    for mesh, known, exact in zip(discrete.meshes, discrete.data, states, strict=True):
        held = ~known.traction_known.any(axis=1)
        known.value[1:, held] = exact(mesh.x[held])
    solution = run(prepare(problem, discrete=discrete))
    assert solution.converged, solution.reason
    return solution


def relative(weight, found, exact):
    return float(
        np.sqrt(weight @ np.sum((found - exact) ** 2, axis=1) / (weight @ np.sum(exact**2, axis=1)))
    )


def test_hertz_on_a_rigid_sphere():
    """p_0 = 1, a = 1, ν = 0.3: pressure, and its resultant 2π/3."""
    nu = 0.3
    rise = 0.25 * np.pi * (1.0 - nu**2)
    data = {
        "body": [block("lower", nu, 0.5, 1)],
        "obstacle": [{"name": "sphere"}],
        "contact": [touching("top", "lower.top", "sphere", gap=f"{rise}*(x**2 + y**2 - 2)")],
    }
    flip = np.array([1.0, 1.0, -1.0])
    solution = solved(data, [lambda x: elliptic_load(x * flip, 1.0, 1.0, 0.0, nu)[None] * flip])
    pair = solution.last.pairs["top"]
    p = elliptic(np.hypot(pair.x[:, 0], pair.x[:, 1]), 1.0)
    assert relative(pair.weight, pair.pressure[:, None], p[:, None]) < 0.02
    assert pair.force == pytest.approx([0.0, 0.0, -2.0 * np.pi / 3.0], abs=2e-3)
    assert np.abs(pair.moment).max() < 1e-12
    # of the function between the nodes, on points of 50 x 50 squares
    mesh = solution.meshes["lower"]
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


def pressed(x, sign):
    """Displacements (1, n, 3) of the lower (sign -1) or upper body."""
    flip = np.array([1.0, 1.0, sign])
    return elliptic_load(x * flip, 1.0, 1.0, 0.0, 0.0)[None] * flip
