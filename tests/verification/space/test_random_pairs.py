"""Random pairs of bodies in space: H-matrices against dense operators, whatever the shapes, laws,
loads and orders."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import cuboid, drawn, elastic, moved, problem, solid

from petcontact import solve

TOLERANCE = 1e-5
SIZES = (0.25, 0.45, 0.6)
"""Of panels, by order."""
LAWS = ("frictionless", "Coulomb", "Tresca", "both", "bonded")
BODIES = {
    "box": (cuboid([-0.6, -0.7, 0.0], [0.8, 0.5, 0.8]), "bottom", "top"),
    "sphere": ({"shape": "sphere", "centre": [0, 0, 0.8], "radius": 0.8}, "bottom", "top"),
    "standing": (
        {"shape": "cylinder", "from": [0, 0, 0], "to": [0, 0, 0.8], "radius": 0.7},
        "bottom",
        "top",
    ),
    "lying": (
        {"shape": "cylinder", "from": [-0.8, 0, 0.6], "to": [0.8, 0, 0.6], "radius": 0.6},
        "side",
        "bottom",
    ),
}
"""Geometry of the upper body, the part that faces the lower one, and the part that is loaded."""


def posed(seed):
    """A body on a block, either the secondary; driven by displacements, or by loads alone."""
    draw = np.random.default_rng(seed)
    kind, law = str(draw.choice(list(BODIES))), str(draw.choice(LAWS))
    orders = draw.integers(3, size=2).tolist()
    young, mu = float(10.0 ** draw.uniform(-2, 2)), float(draw.uniform(0.2, 0.6))
    press, depth = 0.01 * min(1.0, young), float(draw.uniform(0.01, 0.03))
    geometry, facing, loaded = BODIES[kind]
    flat = kind in ("box", "standing")
    contact = {"gap": "geometry"} if not flat else {}
    contact |= {"friction_coefficient": mu} if law in ("Coulomb", "both") else {}
    contact |= {"friction_bound": 0.3 * press} if law in ("Tresca", "both") else {}
    contact = {"normal": "bonded"} if law == "bonded" else contact
    sides = [f"upper.{facing}", "lower.top"][:: draw.choice([1, -1])]
    contact |= {"name": "pair"} | dict(zip(("secondary", "primary"), sides, strict=True))
    # what contact alone holds is pressed by less shear than it can hold
    free = law in ("Coulomb", "bonded") and flat and draw.random() < 0.7
    way = [0.4 * mu * press, 0.0, -press] if free else [0.3 * depth, 0.0, -depth]
    drive = (drawn if free else moved)(loaded, [0.0, 0.0, way[2]])
    meshes = [{"order": order, "element_size": SIZES[order]} for order in orders]
    block, held = cuboid([-1, -1, -1], [1, 1, 0]), moved("bottom", [0.0, 0.0, 0.0])
    bodies = [
        solid("lower", block, held, material=elastic(young, 0.25), mesh=meshes[0]),
        solid("upper", geometry, drive, mesh=meshes[1]),
    ]
    push = {"boundary": [{"body": "upper", "part": loaded, "value": way}]}
    push |= {"increments": int(draw.integers(1, 3))}
    return {"body": bodies, "contact": [contact], "step": [{}, push], "method": {"tolerance": 1e-7}}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_random_pairs_are_solved_as_on_dense_operators(seed):
    """The same outcome; the same sets, and forces, pressures and displacements to ten times the
    tolerance."""
    data = posed(seed)
    dense, found = (
        solve(problem(**data, bem={"mat_type": kind, "hmatrix_tol": TOLERANCE}))
        for kind in ("dense", "hmatrix")
    )
    assert (found.status, len(found.steps)) == (dense.status, len(dense.steps)), found.reason
    for step, wanted in zip(found.steps, dense.steps, strict=True):
        assert max(step.history.ksp_iterations) <= 60
        pair, other = step.pairs["pair"], wanted.pairs["pair"]
        assert np.array_equal(pair.state, other.state)
        for values in ("force", "pressure"):
            off, size = getattr(pair, values) - getattr(other, values), getattr(other, values)
            assert np.abs(off).max() <= 10 * TOLERANCE * np.abs(size).max(), values
        most = max(np.abs(body.u).max() for body in wanted.bodies.values())
        for name, body in wanted.bodies.items():
            assert np.abs(step.bodies[name].u - body.u).max() <= 10 * TOLERANCE * most
