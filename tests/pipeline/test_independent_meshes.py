"""Bodies that are meshed each for itself: solved, balanced, near what matching meshes give, never diagnosed falsely."""

from __future__ import annotations

import facets
import numpy as np
import pytest

from petcontact import Problem, solve
from petcontact.model.base import parse
from petcontact.pipeline.assemble import discretise

SOFT = {"young_modulus": 1.0, "poisson_ratio": 0.3}


def pressed(p):
    return {"condition": "traction", "value": [0.0, 0.0, p]}


def held(*value):
    return {"condition": "displacement", "value": list(value)}


def body(name, file, order=1, **conditions):
    return {"name": name, "material": SOFT, "geometry": {"shape": "gmsh", "file": file}, "mesh": {"order": order},
            "boundary": [{"part": part, **condition} for part, condition in conditions.items()]}  # fmt: skip


def posed(bodies, *contacts):
    return parse(Problem, {"body": bodies, "contact": list(contacts), "bem": {"mat_type": "dense"}}, "test")


def solved(bodies, *contacts):
    solution = solve(posed(bodies, *contacts))
    assert solution.converged, solution.reason
    return solution


def on(solution, place):
    """Forces at the nodes of a part, "body.part", and where they act."""
    name, part = place.split(".")
    mesh = solution.meshes[name]
    nodes = mesh.nodes_of(part)
    return mesh.x[nodes], mesh.weight[nodes, None] * solution.last.bodies[name].traction[nodes]


def balances(solution, contact):
    """Force, and moment where nothing rubs, are the same on both sides of a pair; returns the force on the secondary."""
    (x, mine), (y, theirs) = on(solution, contact["secondary"]), on(solution, contact["primary"])
    size = np.abs(mine).sum()
    assert np.abs(mine.sum(axis=0) + theirs.sum(axis=0)).max() < 1e-12 * size
    if "friction_coefficient" not in contact:
        assert np.abs(np.cross(x, mine).sum(axis=0) + np.cross(y, theirs).sum(axis=0)).max() < 1e-11 * size
    return mine.sum(axis=0)


def blocks(tmp_path, top=None, bottom=None, **upper):
    """Two blocks of triangles, 5 × 4 against 6 × 7 rectangles cut in two."""
    lower = facets.box(tmp_path / "lower.msh", (0, 0, 0), (2, 2, 1), (5, 4, 2))
    over = facets.box(tmp_path / "upper.msh", (0, 0, 1), (2, 2, 2), (6, 7, 3), power=1.2)
    return [body("lower", lower, bottom=bottom or pressed(0.01)), body("upper", over, top=top or pressed(-0.01), **upper)]


def test_bonded_cubes_under_an_even_pressure(tmp_path):
    """Only the bond holds them: p is the pressure everywhere, on both sides, and nothing is left over."""
    contact = {"name": "bond", "secondary": "upper.bottom", "primary": "lower.top", "normal": "bonded"}
    solution = solved(blocks(tmp_path), contact)
    assert solution.last.pairs["bond"].pressure == pytest.approx(0.01, rel=1e-9)
    assert balances(solution, contact) == pytest.approx([0.0, 0.0, 0.04], abs=1e-12)
    assert on(solution, "lower.top")[1].sum(axis=0) == pytest.approx([0.0, 0.0, -0.04], abs=1e-12)
    for name, mesh in solution.meshes.items():
        assert np.abs(mesh.weight @ solution.last.bodies[name].traction).max() < 1e-12
    assert "the coarser side is the better secondary" in solution.info["warnings"][0]
    (told,) = discretise(posed(blocks(tmp_path), {**contact, "secondary": "lower.top", "primary": "upper.bottom"})).warnings
    assert "better" not in told and "do not match" in told


@pytest.mark.parametrize("small", ["secondary", "primary"])
def test_a_sandwich_that_only_contact_holds(tmp_path, small):
    """A small block between two large ones, all free: whichever side is the secondary, and with nodes that face nothing."""
    lower, upper = blocks(tmp_path)
    upper["geometry"]["file"] = facets.box(tmp_path / "over.msh", (0, 0, 1.4), (2, 2, 2.4), (6, 7, 3), power=1.2)
    middle = body("middle", facets.box(tmp_path / "middle.msh", (0.5, 0.5, 1), (1.5, 1.5, 1.4), (3, 3, 2)))
    large = "primary" if small == "secondary" else "secondary"
    contacts = [{"name": "below", small: "middle.bottom", large: "lower.top", "friction_coefficient": 0.3},
                {"name": "above", small: "middle.top", large: "upper.bottom"}]  # fmt: skip
    solution = solved([lower, middle, upper], *contacts)
    sign = 1.0 if small == "secondary" else -1.0
    for contact, way in zip(contacts, (sign, -sign), strict=True):
        assert balances(solution, contact) == pytest.approx([0.0, 0.0, way * 0.04], abs=1e-9)
    assert not any("cannot be held" in warning for warning in solution.info["warnings"])


@pytest.mark.parametrize(("secondary", "ripple"), [("inner.outer", 0.05), ("outer.inner", 0.3)])
def test_a_press_fit_of_rings_that_nothing_else_holds(tmp_path, secondary, ripple):
    """16 facets in 21 of one overlap: p as of 16 in 16, in the mean; evener where the coarser side is the secondary."""
    found = {}
    for count in (16, 21):
        inner = facets.ring(tmp_path / f"i{count}.msh", (0.6, 1.0), 0.6, (16, 2, 1))
        outer = facets.ring(tmp_path / f"o{count}.msh", (1.0, 1.6), 0.6, (count, 2, 1), turn=0.05 * (count > 16))
        primary = "outer.inner" if secondary == "inner.outer" else "inner.outer"
        contact = {"name": "fit", "secondary": secondary, "primary": primary, "gap": "-0.02"}
        solution = solved([body("inner", inner), body("outer", outer)], contact)
        assert np.abs(balances(solution, contact)).max() < 1e-10
        pair = solution.last.pairs["fit"]
        found[count] = pair.weight @ pair.pressure / pair.weight.sum()
        assert np.ptp(pair.pressure) < ripple * found[count]
    assert found[21] == pytest.approx(found[16], rel=0.02)


def test_a_pin_in_a_lug(tmp_path):
    """Radius .99 in 1, facets of .3: the same force on both, near that of the plane solver, on arcs."""
    file = facets.ring(tmp_path / "pin.msh", (0.4, 0.99), 0.6, (21, 2, 2), turn=0.1)
    other = facets.ring(tmp_path / "lug.msh", (1.0, 2.0), 0.6, (24, 1, 3))
    flat = held("free", "free", 0.0)
    contact = {"name": "fit", "secondary": "pin.outer", "primary": "lug.inner"}
    solution = solved([body("pin", file, inner=held(0.05, 0.0, 0.0), bottom=flat, top=flat),
                       body("lug", other, outer=held(0.0, 0.0, 0.0), bottom=flat, top=flat)], contact)  # fmt: skip
    force = balances(solution, contact)[0] / 0.6

    def ring(name, radii, part, value):
        loops = [{"part": part, "center": [0, 0], "radius": r} for part, r in zip(("outer", "inner"), radii, strict=True)]
        return {"name": name, "material": SOFT, "geometry": {"shape": "outline", "loops": loops},
                "mesh": {"element_size": 0.2, "order": 2}, "boundary": [{"part": part, **held(*value)}]}  # fmt: skip

    plane = solved([ring("pin", (0.99, 0.4), "inner", (0.05, 0.0)), ring("lug", (2.0, 1.0), "outer", (0.0, 0.0))], contact)
    assert force == pytest.approx(plane.last.pairs["fit"].force[0], rel=0.03)
    assert plane.last.pairs["fit"].force[0] == pytest.approx(-0.05280, rel=1e-3)
