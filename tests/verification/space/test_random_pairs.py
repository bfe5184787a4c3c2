"""Random pairs of bodies in space: H-matrices against dense operators, whatever the shapes, laws,
loads and meshes."""

from __future__ import annotations

import facets
import numpy as np
import pytest
from shapes import cuboid, elastic, moved

from petcontact import Problem, solve
from petcontact.model.base import parse

TOLERANCE = 1e-5
SIZES = (0.25, 0.45, 0.6)
"""Of panels, by order."""
LAWS = ("frictionless", "Coulomb", "Tresca", "both", "bonded")


def shape(kind, draw, folder, size):
    """Geometry and mesh of the upper body, the part that faces the lower one, the part that is
    loaded, and the gap."""
    if kind == "sphere":
        return (
            {"shape": "sphere", "centre": [0, 0, 0.8], "radius": 0.8},
            size,
            "bottom",
            "top",
            "geometry",
        )
    if kind == "lying":
        lying = {"shape": "cylinder", "from": [-0.8, 0, 0.6], "to": [0.8, 0, 0.6], "radius": 0.6}
        return lying, size, "side", "bottom", "geometry"
    if kind == "standing":
        return (
            {"shape": "cylinder", "from": [0, 0, 0], "to": [0, 0, 0.8], "radius": 0.7},
            size,
            "bottom",
            "top",
            None,
        )
    low, high = (draw.uniform(0.5, 0.9, 2).tolist() for _ in range(2))
    corners = [-low[0], -low[1], 0.0], [*high, 0.8]
    gap = f"{draw.uniform(0.01, 0.05):.3f}*(x**2 + y**2)" if draw.random() < 0.4 else None
    if kind == "box":
        return (cuboid(corners[0], corners[1]), size, "bottom", "top", gap)
    count = max(2, round(1.4 / size))
    file = facets.box(
        folder / "upper.msh", *corners, (count, count + 1, 2), triangles=draw.random() < 0.5
    )
    return {"shape": "gmsh", "file": file}, None, "bottom", "top", gap


def posed(seed, folder):
    """A body on a block, either the secondary, or on a rigid floor: driven by displacements, or by
    loads alone."""
    draw = np.random.default_rng(seed)
    kind = str(draw.choice(["box", "gmsh", "gmsh", "sphere", "standing", "lying"]))
    law = str(draw.choice(LAWS))
    orders = draw.integers(3, size=2).tolist()
    young = float(10.0 ** draw.uniform(-2, 2))
    geometry, size, facing, loaded, gap = shape(kind, draw, folder, SIZES[orders[1]])
    press = 0.01 * min(1.0, young)
    mu = float(draw.uniform(0.2, 0.6))
    depth = float(draw.uniform(0.01, 0.03))
    upper = {
        "name": "upper",
        "material": elastic(1.0, 0.3),
        "geometry": geometry,
        "mesh": {"order": orders[1], **({"element_size": size} if size else {})},
    }
    lower = {
        "name": "lower",
        "material": elastic(young, float(draw.uniform(0.0, 0.45))),
        "geometry": cuboid([-1, -1, -1], [1, 1, 0]),
        "mesh": {"order": orders[0], "element_size": SIZES[orders[0]]},
        "boundary": [moved("bottom", [0.0, 0.0, 0.0])],
    }
    sides = [f"upper.{facing}", "lower.top"]
    contact = {"name": "pair"} | dict(
        zip(("secondary", "primary"), sides[:: draw.choice([1, -1])], strict=True)
    )
    contact |= {"friction_coefficient": mu} if law in ("Coulomb", "both") else {}
    contact |= {"friction_bound": 0.3 * press} if law in ("Tresca", "both") else {}
    contact |= {"normal": "bonded"} if law == "bonded" else {"gap": gap} if gap else {}
    # what contact alone holds is pressed by less shear than it can hold
    free = law in ("Coulomb", "bonded") and gap is None and draw.random() < 0.7
    way = [0.4 * mu * press, 0.0, -press] if free else [0.3 * depth, 0.0, -depth]
    drive = {
        "part": loaded,
        "condition": "traction" if free else "displacement",
        "value": [0.0, 0.0, way[2]],
    }
    upper["boundary"] = [drive]
    if draw.random() < 0.4 and kind != "lying":
        upper["point_force"] = [{"at": [0.1, 0.05, 0.4], "force": [0.0, 0.0, -0.05 * press]}]
    data = {"body": [lower, upper], "contact": [contact], "method": {"tolerance": 1e-7}}
    if kind == "box" and not free and draw.random() < 0.3:
        given = (
            {"displacement": [0.0, 0.0, "free"], "force": [0.0, 0.0, press]}
            if draw.random() < 0.5
            else {}
        )
        data |= {
            "body": [upper],
            "obstacle": [{"name": "floor", **given}],
            "contact": [{**contact, "secondary": sides[0], "primary": "floor"}],
        }
    if count := int(draw.integers(3)):
        push = {
            "name": "push",
            "increments": count,
            "boundary": [{"body": "upper", "part": loaded, "value": way}],
        }
        data["step"] = [{"name": "press"}, push]
    return data


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 30))
def test_random_pairs_are_solved_as_on_dense_operators(seed, tmp_path):
    """The same outcome; the same sets, and forces, pressures and displacements to ten times the
    tolerance."""
    data = posed(seed, tmp_path)
    dense, found = (
        solve(parse(Problem, {**data, "bem": {"mat_type": kind, "hmatrix_tol": TOLERANCE}}, "test"))
        for kind in ("dense", "hmatrix")
    )
    assert (found.status, len(found.steps)) == (dense.status, len(dense.steps)), (
        found.reason,
        dense.reason,
    )
    for step, wanted in zip(found.steps, dense.steps, strict=True):
        assert max(step.history.ksp_iterations) <= 60
        pair, other = step.pairs["pair"], wanted.pairs["pair"]
        assert np.array_equal(pair.state, other.state)
        for values in ("force", "pressure"):
            size = np.abs(getattr(other, values)).max()
            assert (
                np.abs(getattr(pair, values) - getattr(other, values)).max()
                <= 10 * TOLERANCE * size
            ), values
        most = max(np.abs(body.u).max() for body in wanted.bodies.values())
        for name, body in wanted.bodies.items():
            assert np.abs(step.bodies[name].u - body.u).max() <= 10 * TOLERANCE * most
