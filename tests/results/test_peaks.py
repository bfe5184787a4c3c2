"""The largest stresses of a verdict: inside the body, on its surface, and where there is no bound."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import cuboid, drawn, moved, outline, problem, rectangle, rollers, solid, touching

from petcontact import adapt, solve
from petcontact.refinement.singular_points import corner_exponents
from petcontact.results.numbers.peaks import stress_peaks
from petcontact.results.numbers.stress_samples import Samples
from petcontact.results.strength.corners import corners_of
from petcontact.results.strength.singular_places import singular_places


def test_under_a_cylinder_the_largest_von_mises_stress_lies_inside():
    """Johnson, Contact Mechanics, 4.2: at a depth of 0.70 half widths; the value is that of a grid."""
    solution = solve("configs/hertz.toml")
    pair = next(iter(solution.pairs.values()))
    peaks = [each for each in stress_peaks(solution) if each.name.startswith("von Mises")]
    inside, surface = (each for each in peaks if not np.isinf(each.error))
    half = 0.5 * pair.area
    assert -inside.place[1] == pytest.approx(0.70 * half, rel=0.05)
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 13) * half, np.linspace(-1.1, -0.4, 29) * half)
    grid = solution.von_mises_at(np.column_stack([x.ravel(), y.ravel()]))
    assert grid.max() * (1.0 - 1e-12) <= inside.value[0] <= 1.001 * grid.max()
    assert surface.value[0] < 0.7 * inside.value[0]


@pytest.mark.parametrize("d", [2, 3])
def test_stress_is_told_at_a_tenth_of_a_side_from_a_clamped_corner(d):
    """Nearer it grows without an end; where the block is drawn at its other end it is uniform."""
    shape = rectangle([0, 0], [1, 1]) if d == 2 else cuboid([0] * 3, [1] * 3)
    sides = moved("bottom", [0.0] * d), drawn("top", [0.1, *[0.0] * (d - 1)])
    mesh = {"element_size": (0.1, 0.5)[d - 2], "order": (2, 1)[d - 2]}
    peaks = stress_peaks(solve(problem(body=[solid("block", shape, *sides, mesh=mesh)])))
    beside = [peak for peak in peaks if peak.beside is not None and np.isnan(peak.error)]
    assert len(beside) == 2
    for peak in beside:
        assert np.linalg.norm(peak.place - peak.beside) == pytest.approx(0.1)
        assert peak.value[0] > 0.173
    assert any(np.isinf(peak.error) for peak in peaks)


SIDES = ["bottom", "right", "top", "left"]


def four_sided(corners):
    return {"shape": "polygon", "vertices": np.asarray(corners).tolist(), "parts": SIDES}


def test_a_corner_makes_stress_unbounded_where_its_side_faces_the_other_body():
    """A tilted block: along the normal of its side, which is not the nearest place. Corners of the
    other one that reach beyond the block press on nothing."""
    upper = [[-1.0, 0.05], [1.0, 0.01], [1.0, 1.0], [-1.0, 1.0]]
    lower = [[-1.5, -1.0], [1.5, -1.0], [1.5, 0.0], [-1.5, 0.0]]
    mesh = {"element_size": 0.5}
    bodies = [
        solid("upper", four_sided(upper), moved("top", [0.0, -0.05]), mesh=mesh),
        solid("lower", four_sided(lower), moved("bottom", [0.0, 0.0]), mesh=mesh),
    ]
    pairs = [touching("pair", "upper.bottom", "lower.top")]
    solution = solve(problem(body=bodies, contact=pairs))
    places = singular_places(solution, solution.last)
    under = [place.x for place in places["lower"] if "under" in place.sides]
    np.testing.assert_allclose(under, [[-1.0 - 0.05 * 0.02, 0.0], [1.0 - 0.01 * 0.02, 0.0]], 1e-12)
    assert not [place for place in places["upper"] if "under" in place.sides]


@pytest.mark.parametrize(("length", "singular"), [(1.0, []), (0.9, [0.9])])
def test_corners_face_one_another_across_an_overlap(length, singular):
    """Without friction the pressure of equal blocks is uniform; a shorter one presses with a corner,
    and the longer one ends in the air, if by less than an element."""
    mesh, shapes = (
        {"element_size": 0.25},
        (([0.0, -0.01], [length, 1.0]), ([0.0, -1.0], [1.0, 0.0])),
    )
    bodies = [
        solid(name, rectangle(*shape), *rollers("left", far), mesh=mesh)
        for name, shape, far in zip(("upper", "lower"), shapes, ("top", "bottom"), strict=True)
    ]
    solution = solve(problem(body=bodies, contact=[touching("pair", "upper.bottom", "lower.top")]))
    places = singular_places(solution, solution.last)
    found = [[place.x[0].round(9) for place in own] for own in places.values()]
    assert found == [singular, singular]


@pytest.mark.parametrize("turned", [0.0, 90.0, 30.0])
def test_a_roller_counts_as_its_direction_and_its_side_have_it(turned):
    """Stress has no bound at the same corners of a block on a roller as its mesh is graded to."""
    way = np.radians(turned)
    turn = np.array([[np.cos(way), -np.sin(way)], [np.sin(way), np.cos(way)]])
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.8, 1.0], [0.0, 1.0]]) @ turn.T
    held = [0.0, "free"] if turned == 90.0 else ["free", 0.0]
    sides = [moved("bottom", held), moved("left", [0.0, 0.0])]
    sides += [drawn("top", [0.1, 0.1]), drawn("right", [0.0, 0.0])]
    block = solid("block", four_sided(corners), *sides, mesh={"element_size": 0.5})
    given = problem(body=[block])
    solution, outline = solve(given), given.boundaries[0]
    (places,) = singular_places(solution, solution.last).values()
    exponents = corner_exponents(given.bodies[0], outline)
    expected = [
        side.start for side, (least, _) in zip(outline.sides, exponents, strict=True) if least < 1.0
    ]
    there = [place.x for place in places]
    assert expected
    assert sorted(map(tuple, np.round(there, 9))) == sorted(map(tuple, np.round(expected, 9)))


def test_stress_counts_at_edges_where_given_data_leave_none_without_a_bound():
    """u = c ∇(x²y - yz²) in a cube with two planes of symmetry: its top is displaced and other
    faces are drawn as that field is, so that K is 0 at edges where λ < 1. Its stress is largest at
    the corner (1, 1, 1) of such edges."""
    sides = [
        *({"part": part, "condition": "symmetry"} for part in ("left", "bottom")),
        moved("top", ["2e-3*x*y", "1e-3*(x**2 - 1)", "-2e-3*y"]),
        drawn("right", ["1.6*y", 1.6, 0.0]),
        drawn("front", ["-1.6*x", 0.0, "1.6*z"]),
        drawn("back", ["1.6*x", 0.0, "-1.6*z"]),
    ]
    block = solid("block", cuboid([0.0] * 3, [1.0] * 3), *sides)
    block["material"] = {"young_modulus": 1000.0, "poisson_ratio": 0.25}
    peaks = stress_peaks(adapt(problem(body=[block])))
    assert not [peak for peak in peaks if np.isinf(peak.error)]
    mises, principal = (
        max(p.value[0] for p in peaks if name in p.name) for name in ("Mises", "first")
    )
    assert (mises, principal) == pytest.approx((4.8, 0.8 * np.sqrt(12.0)), rel=1e-2)


def test_a_corner_is_listed_on_every_mesh_however_small_its_k_is():
    """A narrow load makes the largest stress. At the reentrant corner of two parts that stick K is
    small, and in elements of 1e-5 beside it stress is as large as K r^(λ-1) is uncertain."""
    ends = {
        "loaded": (-5.72, 1.99),
        "held": (-2.83, 1.12),
        "low": (-2.80, 2.26),
        "high": (-2.94, 3.43),
    }
    sides = drawn("loaded", [0.0, "-1.77/(1 + ((s - 2.01)/7.3e-3)**2)"]), moved("held", [0.0, 0.0])
    held = {"condition": "contact", "normal": "bilateral"}
    held_parts = (
        {"part": "low", "friction_bound": 2.3e-3},
        {"part": "high", "friction_bound": 3.2e-4},
    )
    body = solid("body", outline(**ends), *sides, *(held | part for part in held_parts))
    body["material"] = {"young_modulus": 2.17, "poisson_ratio": 0.32, "plane": "stress"}
    given = problem(body=[body])
    every = [stress_peaks(adapt(given, accuracy)) for accuracy in (1e-2, 1e-3)]
    for peaks in every:
        known = [peak for peak in peaks if not np.isinf(peak.error)]
        assert [peak.value[0] for peak in known] == pytest.approx([2.1616, 0.38581], rel=1e-4)
        assert all(np.linalg.norm(peak.place - [-4.72, 2.51]) < 0.02 for peak in known)
        assert {peak.part for peak in peaks if np.isinf(peak.error)} == {"high and low"}


def test_the_largest_stress_beside_corners_is_that_of_any_of_them():
    """A narrow tension lies in the ring of one corner, and the arc about another has more stress
    than that about this one. Below its top all stress is as large as the tension."""
    sides = moved("bottom", [0.0, 0.0]), drawn("top", [0.0, "300*(1 - x)"])
    peak = drawn("right", ["1000/(1 + ((y - 0.15)/5e-4)**2)", 0.0])
    body = solid("body", rectangle([0, 0], [1, 1]), *sides, peak, drawn("left", [0.0, 0.0]))
    (largest, *_) = (
        each
        for each in adapt(problem(body=[body])).numbers
        if "first principal stress b" in each.name
    )
    assert largest.value[0] == pytest.approx(1000.0, rel=0.02)
    np.testing.assert_allclose(largest.place, [1.0, 0.15], atol=1e-4)


def test_stress_beside_a_punch_on_a_round_body_is_told_on_its_surface_too():
    """Without friction the first principal stress is largest there, off the tangent of the corner;
    left and right it is the same."""
    ends = {"left": (-1.5, -2.0), "bottom": (1.5, -2.0), "right": (1.5, -0.677124344467705)}
    lower = outline(**ends, top=(-1.5, -0.677124344467705, 2.0))
    foot = -0.0404082057734577
    sides = {"right": (0.4, 1.0), "top": (-0.4, 1.0), "left": (-0.4, foot)}
    upper = outline(bottom=(0.4, foot, -2.0), **sides)
    bodies = [
        solid("upper", upper, moved("top", [0.0, -0.02])),
        solid("lower", lower, moved("bottom", [0.0, 0.0])),
    ]
    solution = adapt(problem(body=bodies, contact=[touching("pair", "upper.bottom", "lower.top")]))
    samples = Samples(solution, "lower", solution.last)
    under = [
        place
        for place in singular_places(solution, solution.last)["lower"]
        if place.sides == "under a corner of upper"
    ]
    (left, at), (right, other) = (
        samples.largest_on_arc("first_principal", place)[:2] for place in under
    )
    assert left == pytest.approx(4.0e-4, rel=0.02) and right == pytest.approx(left, rel=0.01)
    for x in (at, other):
        assert np.hypot(x[0], x[1] + 2.0) == pytest.approx(2.0, rel=1e-9)


def test_stress_that_grows_up_to_the_surface_has_no_top_inside():
    """A narrow tension in the ring of a corner: below it stress was told as an inner maximum, at the
    rim of the layer that is as thick as elements are: 13 273 where more than 20 000 acts."""
    ends = {
        "top": (-1.263, 1.142),
        "held": (-1.769, -0.623),
        "slides": (0.0, 0.0),
        "loaded": (0.928, 0.372),
        "free": (1.401, 0.866),
    }
    sides = [moved("held", [0.0, 0.0]), *(drawn(part, [0.0, 0.0]) for part in ("top", "free"))]
    sides += [
        drawn("loaded", [0.0, "-19894/(1 + ((s - 0.1755)/0.00766)**2)"]),
        {"part": "slides", "condition": "contact", "normal": "bilateral", "friction_bound": 125.7},
    ]
    peaks = stress_peaks(adapt(problem(body=[solid("body", outline(**ends), *sides)])))
    assert not [peak for peak in peaks if "inside" in peak.name]
    assert max(peak.value[0] for peak in peaks if "beside" in peak.name) > 20_000.0


def test_a_body_that_nothing_loads_has_no_stress_and_no_place_without_a_bound():
    sides = moved("bottom", [0.0, 0.0]), drawn("top", [0.0, 0.0])
    peaks = stress_peaks(adapt(problem(body=[solid("block", rectangle([0, 0], [1, 1]), *sides)])))
    assert not any(peak.value.any() or np.isinf(peak.error) for peak in peaks)


def test_edges_of_a_body_are_there_where_smaller_panels_hang_on_larger_ones():
    """A face with smaller panels meets four with larger ones."""
    mesh = {"element_size": 1.0, "element_sizes": {"bottom": 0.25}}
    block = solid("block", cuboid([0.0] * 3, [1.0] * 3), moved("top", [0.0] * 3), mesh=mesh)
    (surface,) = solve(problem(body=[block])).meshes.values()
    corners = corners_of(surface)
    below = (corners.x[:, 2] == 0.0).sum()
    assert below == 4 * 4


def test_a_long_way_of_one_stress_up_to_a_corner_keeps_its_value():
    """A shaft that is turned in its hub: √3 2T/(π r³) on all of its free length, from which stress
    grows to the edge of the hub, where it has no bound."""
    solution = solve("configs/axial_torque.toml")
    torque = 2.5 * 2.0 * np.pi * 20.0**2 * 20.0
    (surface,) = [n for n in stress_peaks(solution) if n.name == "von Mises stress on the surface"]
    assert surface.part == "right" and surface.place[1] < 0.0
    assert surface.value[0] == pytest.approx(3.0**0.5 * 2.0 * torque / (np.pi * 1e3), rel=1e-3)
