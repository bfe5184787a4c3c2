"""Bodies without contact and without `[mesh]`: what is printed has a ± that holds."""

from __future__ import annotations

import numpy as np
import pytest
from marks import slow
from shapes import cuboid, drawn, elastic, outline, problem, rectangle, rollers, solid, touching

from petcontact import solve


def quarter(outer, middle, inner):
    """A quarter of a ring of radii 1 and `outer`, or of the half section of a hollow sphere."""
    sides = {"start": (outer, 0.0), "rim": (0.0, outer, outer), middle: (0.0, 1.0)}
    return outline(**sides, **{inner: (1.0, 0.0, -1.0)})


def von_mises(*principal):
    return np.sqrt(0.5 * np.sum((np.array(principal) - np.roll(principal, 1)) ** 2))


@pytest.mark.parametrize(("outer", "poisson"), [(1.3, 0.1), (2.7, 0.42)])
@pytest.mark.parametrize("round_", [False, True], ids=["ring", "sphere"])
def test_a_body_without_a_mesh_is_solved_to_an_accuracy(round_, outer, poisson):
    """Lamé: what is printed has a ± that holds."""
    power = 3 if round_ else 2
    hoop = (outer**power / (power - 1.0) + 1.0) / (outer**power - 1.0)
    body = {
        "material": elastic(1000.0, poisson),
        "geometry": quarter(outer, "axis" if round_ else "end", "hole"),
        "boundary": [
            *rollers(*["start"] if round_ else ["start", "end"]),
            drawn("rim", [0.0, 0.0]),
            {"part": "hole", "condition": "traction", "pressure": 1.0},
        ],
    }
    solution = solve(problem(**body, **({"symmetry": "axial"} if round_ else {})))
    along = hoop if round_ else poisson * (hoop - 1.0)
    exact = {
        "first principal stress on the surface": hoop,
        "von Mises stress on the surface": von_mises(-1.0, hoop, along),
    }
    found = {number.name: number for number in solution.numbers}
    assert solution.accuracy.error <= solution.accuracy.wanted
    assert all(number.error < 0.02 * number.size for number in found.values())
    for name, value in exact.items():
        assert abs(found[name].size - value) <= found[name].error
    assert "error of u:" in solution.verdict()


@pytest.mark.parametrize("size", [slow(None), 0.5])
def test_bodies_in_space_have_an_error_for_each_number(size):
    """A bar on rollers that turns about the z axis, u_x = ρω²(l²x/2 - x³/6)/E without Poisson's
    ratio, on meshes of its own and on a given one. Quadrature leaves 1e-4."""
    bar = problem(
        material=elastic(1000.0, 0.0) | {"density": 1.0},
        geometry=cuboid([0.0, 0.0, 0.0], [2.0, 1.0, 1.0]),
        loads={"force": ["x", 0.0, 0.0]},
        mesh={} if size is None else {"element_size": size},
        boundary=[
            *rollers("left", "front", "bottom"),
            *(drawn(part, [0.0, 0.0, 0.0]) for part in ("right", "back", "top")),
        ],
    )
    found = {number.name: number for number in solve(bar).numbers}
    exact = {
        "largest displacement": (2.0**3 / 2.0 - 2.0**3 / 6.0) / 1000.0,
        "force on left": np.array([-2.0, 0.0, 0.0]),
        "von Mises stress on the surface": 2.0,
        "first principal stress on the surface": 2.0,
    }
    assert all(np.isfinite(number.error) for number in found.values())
    for name, value in exact.items():
        off = np.abs(found[name].value - value).max()
        assert off <= found[name].error + 1e-4 * np.abs(value).max(), name
        assert found[name].error < 0.1 * np.abs(value).max(), name


def test_two_rings_that_touch_and_carry_nothing_end_soon():
    """The difference of two meshes of round-off is no error of 1."""
    rings = [
        solid(name, rectangle([x, 0.0], [x + 0.1, 0.1]), material=elastic(210000.0, 0.3))
        for name, x in (("a", 0.95), ("b", 1.05))
    ]
    contact = touching("c", "b.left", "a.right")
    solution = solve(problem(symmetry="axial", body=rings, contact=[contact]))
    assert solution.converged and len(solution.accuracy.elements) <= 3
    assert "contact carries nothing" in solution.verdict()


def test_a_largest_stress_that_presses_is_told_once():
    """Under pressure alone all of it is -2ν of the pressure; the stress inside is named only where it
    is more than on the surface."""
    ring = problem(
        material=elastic(1000.0, 0.3),
        geometry=quarter(2.0, "end", "hole"),
        boundary=[
            *rollers("start", "end"),
            {"part": "rim", "condition": "traction", "pressure": 1.0},
            {"part": "hole", "condition": "traction", "pressure": 1.0},
        ],
    )
    found = {number.name: number for number in solve(ring).numbers}
    assert "first principal stress inside" not in found
    largest = found["first principal stress on the surface"]
    assert abs(largest.value[0] + 0.6) <= largest.error < 1e-3
