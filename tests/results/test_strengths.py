"""K of cracks and punches against known values, and the same places on every mesh."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapes import (
    closing,
    cuboid,
    drawn,
    elastic,
    moved,
    problem,
    rectangle,
    rollers,
    solid,
    touching,
)

from petcontact import adapt, solve
from petcontact.pipeline.adapt.first_mesh import FirstMeshes
from petcontact.refinement.corner_exponents import SLIDING
from petcontact.refinement.corner_modes import corner_expansion
from petcontact.results.strength.corners import corners_of
from petcontact.results.strength.singular_places import singular_places
from petcontact.results.strength.strengths import fits
from petcontact.results.strength.touching import growing, nodes_beside, pressed_at
from petcontact.sweep.quantities import unbounded_pressure


def polygon(**starts):
    """A polygon by its sides and where each starts."""
    vertices = [[float(x) for x in start] for start in starts.values()]
    return {"shape": "polygon", "vertices": vertices, "parts": list(starts)}


def strengths(solution):
    return [number for number in solution.numbers if number.name.startswith("K")]


@pytest.mark.parametrize(("axial", "left"), [(False, -20.0), (True, 0.0)])
def test_a_flat_punch_without_friction(axial, left):
    """p = P/(π √(a² - x²)) on a half plane, P/(2πa √(a² - r²)) on a half space: K = P/(π √(2a)),
    P/(2πa √(2a)), and 1/√r. The block is 20 times as wide as the punch: its bounds change K by 2 and
    0.1 thousandths. Stress is told at a tenth of the width of the punch from its edge."""
    block = solid("block", rectangle([left, -20.0], [20.0, 0.0]), moved("bottom", [0.0, 0.0]))
    punch = {"name": "punch", "displacement": [0.0, "free"], "force": [0.0, -0.01]}
    pair = touching("c", "block.top", "punch", gap="where(abs(x) <= 1, 0, 1)")
    more = {"symmetry": "axial"} if axial else {}
    solution = solve(problem(body=[block], obstacle=[punch], contact=[pair], **more))
    edges = [number for number in strengths(solution) if "edge" in number.name]
    at = sorted(number.place[0] for number in edges)
    assert at == pytest.approx([1.0] if axial else [-1.0, 1.0])
    for number in edges:
        assert number.exponent == pytest.approx(0.5, abs=1e-9)
        expected = 0.01 / (math.pi * math.sqrt(2.0)) / (2.0 if axial else 1.0)
        assert number.value[0] == pytest.approx(expected, rel=3e-3)
    found = unbounded_pressure(solution)
    assert found["max_pressure"] == math.inf
    assert found["stress_intensity"] == pytest.approx(expected, rel=1e-2)
    (places,) = singular_places(solution, solution.last).values()
    told = [place.distance for place in places if "edge" in place.sides]
    assert told == pytest.approx([0.2] * len(edges))


def test_the_end_of_a_roller_presses_where_it_is_in_contact():
    """There is a place for each element in contact at the two ends, with the width of contact for
    its size, and p has no bound there."""
    low, high = [-4.0, -4.0, -4.0], [4.0, 4.0, 0.0]
    mesh = {"element_size": 2.0, "element_sizes": {"top": 1.0}, "order": 1}
    block = solid("block", cuboid(low, high), moved("bottom", [0.0] * 3), mesh=mesh)
    ends = {"shape": "cylinder", "from": [0.0, -2.0, 5.0], "to": [0.0, 2.0, 5.0], "radius": 5.0}
    free = {"displacement": [0.0, 0.0, "free"], "force": [0.0, 0.0, -0.2]}
    pair = touching("c", "block.top", "roller", direction=[0.0, 0.0, 1.0])
    solution = solve(
        problem(body=[block], obstacle=[{"name": "roller"} | ends | free], contact=[pair])
    )
    (largest,) = (each for each in solution.numbers if each.name == "largest p")
    assert largest.error == math.inf and abs(largest.place[1]) == pytest.approx(2.0)
    places = singular_places(solution, solution.last)["block"]
    edges = [place for place in places if "edge" in place.sides]
    assert len(edges) == 4 and {place.elements for place in edges} <= {(74,), (77,), (82,), (85,)}
    assert all(place.is_edge and abs(place.x[0]) < 1.0 for place in edges)


def test_a_contact_between_two_samples_of_an_edge_is_found():
    """Pieces are as long as the elements beside the edge, and of one line as the contact is wide;
    in the plane they are the point at which the edge presses."""
    samples = np.column_stack([np.arange(-9.8, 10.0, 0.4), np.full(50, 2.0), np.zeros(50)])
    centre = np.array([[-0.05, 1.95, 0.0], [0.05, 1.95, 0.0], [0.05, 1.0, 0.0]])
    found = pressed_at(samples, centre, np.full(3, 0.06))
    middles = sorted(ends.mean(axis=0).tolist() for ends, _ in found)
    assert middles == [pytest.approx([x, 2.0, 0.0]) for x in (-0.05, 0.05)]
    for _, stretch in found:
        assert sorted(stretch[:, 0]) == pytest.approx([-0.11, 0.11])
    (ends, stretch), *rest = pressed_at(np.array([[1.0, 0.0]]), np.array([[0.9, 0.0]]), np.ones(1))
    assert not rest and np.all(np.stack([ends, stretch]) == [1.0, 0.0])


def test_what_lies_beside_a_piece_of_an_edge_lies_across_it():
    """A line contact ends at an edge: most of what is as near along the edge is open."""
    body = solid("b", cuboid([0.0] * 3, [1.0] * 3), moved("bottom", [0.0] * 3))
    data = problem(body=[body | {"mesh": {"element_size": 0.125, "order": 1}}])
    (mesh,) = FirstMeshes(data.posed, 4000).meshes
    corners = corners_of(mesh)
    number = int(np.linalg.norm(corners.x - [0.5, 0.0, 1.0], axis=1).argmin())
    piece = corners.ends[number]
    top = mesh.part_names.index("top")
    (element,) = corners.element[number][mesh.part[corners.element[number]] == top].tolist()
    beside = mesh.x[nodes_beside(mesh, piece, "top", element, 0.3)]
    low, high = np.sort(piece[:, 0])
    assert low <= beside[:, 0].min() and beside[:, 0].max() <= high
    assert beside[:, 1].max() > 0.2 > high - low


def test_an_edge_in_space_has_one_strength():
    """That of its strongest segment, however many elements there are."""
    ends = moved("bottom", [0.0] * 3), drawn("top", [0.1, 0.0, 0.0])
    shape = cuboid([0.0] * 3, [1.0] * 3)
    solution = solve(problem(body=[solid("block", shape, *ends, mesh={"element_size": 0.5})]))
    found = strengths(solution)
    assert len(found) == 4
    own = [fit for fit in fits(solution, solution.last) if fit.place.sides in found[0].name]
    assert len(own) > 1 and abs(found[0].value[0]) == max(abs(fit.value) for fit in own)


FINE = {"accuracy": 1e-3, "order": 3}


def cracked(depth, mesh=FINE, sides=("ahead",)):
    """Half a strip of width 1 and length 4 with a crack from its edge, drawn at its ends."""
    corners = polygon(crack=(0, 0), ahead=(depth, 0), right=(1, 0), top=(1, 2), left=(0, 2))
    strip = solid("strip", corners, *rollers(*sides), drawn("top", [0.0, 1.0]), mesh=mesh)
    return solve(problem(body=[strip]))


@pytest.mark.parametrize(
    ("sides", "depth", "factor"),
    [
        (("ahead",), 0.5, 2.8246),
        (("ahead",), 0.7, 6.3549),
        (("ahead", "left"), 0.2, 1.0246),
        (("ahead", "left"), 0.5, 1.1867),
    ],
)
def test_cracks_on_default_meshes_are_within_their_errors(sides, depth, factor):
    """Of an edge crack by Kaya and Erdogan (1987), of a central one by Isida (1971): elements next
    to the tip are off by several hundredths, which is fitted, too."""
    (tip,) = strengths(cracked(depth, {}, sides))
    expected = factor * math.sqrt(depth * math.pi)
    assert abs(tip.value[0] - expected) < tip.error < 5e-2 * expected
    assert tip.value[0] == pytest.approx(expected, rel=2e-3)


def test_a_notch_of_three_degrees_is_nearly_a_crack():
    """Its exponent is 1/2 to 1e-6. Errors of the elements at its tip reach as far as the fit."""
    open_ = 0.5 * math.tan(math.radians(1.5))
    sides = {"start": (0, -2), "right": (1, -2), "top": (1, 2), "left": (0, 2)}
    notch = {"up": (0, open_), "low": (0.5, 0), "end": (0, -open_)}
    ends = drawn("start", [0.0, -1.0]), drawn("top", [0.0, 1.0])
    solution = solve(problem(body=[solid("strip", polygon(**sides, **notch), *ends)]))
    first, second = strengths(solution)
    expected = 2.8246 * math.sqrt(0.5 * math.pi)
    assert abs(first.value[0] - expected) < first.error
    assert first.value[0] == pytest.approx(expected, rel=5e-3)
    assert abs(second.value[0]) < 1e-3 * expected


def pressed_pad(unit):
    """A pad that slips next to its edges, its lengths in some unit."""
    ends = ([-1, 0], [1, 2], [-5, -5], [5, 0])
    low, high, under, over = ([unit * float(x) for x in end] for end in ends)
    pad = solid("pad", rectangle(low, high), drawn("top", [0.003, -0.01]))
    block = solid("block", rectangle(under, over), moved("bottom", [0.0, 0.0]))
    pair = touching("c", "pad.bottom", "block.top", friction_coefficient=0.4)
    return solve(problem(body=[pad, block], contact=[pair]))


def test_slip_next_to_an_edge_that_sticks_does_not_count():
    """K of the modes of stick is fitted beyond the slip, and is that of both bodies; which nodes
    lie there does not depend on units."""
    solution = pressed_pad(1.0)
    assert all(fit.place.core for fit in fits(solution, solution.last) if fit.place.x[1] == 0.0)
    own, under = (number for number in strengths(solution) if number.name.startswith("K_1"))
    assert {own.of, under.of} == {"pad", "block"}
    assert abs(own.value[0] - under.value[0]) < own.error + under.error < 0.5 * own.value[0]
    other = strengths(pressed_pad(1e-3))
    for one, two in zip(strengths(solution), other, strict=True):
        assert two.value[0] == pytest.approx(1e-3 ** (1.0 - one.exponent) * one.value[0], rel=1e-8)


def test_contact_that_sticks_may_have_no_bound_where_its_end_slips():
    """Beside an oblique support at 104 degrees stick has λ > 1, slip 0.41. Its end slips, so
    that stress there grows with every mesh."""
    vertices = [[-0.4, 0.8], [0.9, 1.3], [1.2, 1.9], [0.4, 2.7], [-0.6, 2.5], [-1.0, 1.3]]
    parts = ["below", "oblique", "contact", "top", "left", "base"]
    solution = adapt(
        problem(
            material=elastic(29000.0, 0.41),
            geometry={"shape": "polygon", "vertices": vertices, "parts": parts},
            boundary=[
                *(drawn(part, [0.0, 0.0]) for part in ("below", "top", "left")),
                moved("oblique", [1e-3, "free"]),
                moved("base", [0.0, "free"]),
                closing("contact", friction_bound=1000.0),
            ],
        )
    )
    places = singular_places(solution, solution.last)["body"]
    (place,) = (each for each in places if each.sides == "contact and oblique")
    assert place.expansions[0].least == pytest.approx(0.415, abs=1e-3)


def test_what_the_nodes_of_one_fit_do_not_tell_others_do():
    """K at the ends of a clamped side is known to a twentieth, not to an eighth; the truth is that
    of a wanted 1e-5."""
    plate = problem(
        material=elastic(1000.0, 0.3),
        geometry=rectangle([0.0, 0.0], [9.0, 1.4]),
        boundary=[
            moved("left", [0.0, 0.0]),
            *(drawn(part, [0.0, 0.0]) for part in ("bottom", "right")),
            drawn("top", [1.0, -1.0]),
        ],
    )
    usual, best = (adapt(plate, accuracy) for accuracy in (1e-2, 1e-5))
    for fit, other in zip(fits(usual, usual.last), fits(best, best.last), strict=True):
        assert abs(fit.value - other.value) < fit.spread < 0.05 * abs(fit.value)


def test_the_energy_that_a_crack_releases():
    """K_I² = E' dW/da, whatever the fit of K: W is the energy of the strip, twice that of half."""
    step, energy = 0.02, []
    for depth in (0.5 - step, 0.5 + step):
        solution = cracked(depth)
        mesh, result = solution.meshes["strip"], solution.last.bodies["strip"]
        rows = mesh.nodes_of("top")
        energy.append(mesh.weight[rows] @ result.u[rows, 1])
    released = (energy[1] - energy[0]) / (2.0 * step)
    (tip,) = strengths(cracked(0.5))
    assert tip.value[0] == pytest.approx(math.sqrt(released / (1.0 - 0.3**2)), rel=5e-3)


def test_faces_of_symmetry_have_no_places():
    """An octant of a hollow sphere under pressure: its curved panels meet planes at right angles,
    and pressure is no shear."""
    loop = [
        {"part": "out", "to": [0.0, 2.0], "radius": 2.0},
        {"part": "axis", "to": [0.0, 1.0]},
        {"part": "in", "to": [1.0, 0.0], "radius": -1.0},
        {"part": "mid", "to": [2.0, 0.0]},
    ]
    octant = {"shape": "revolved", "loops": [loop], "angle": 90.0}
    inner = {"part": "in", "condition": "traction", "pressure": 1.0}
    free = drawn("out", [0.0] * 3)
    body = solid(
        "shell", octant, *rollers("mid", "start", "end"), inner, free, mesh={"element_size": 0.7}
    )
    solution = solve(problem(body=[body]))
    assert not singular_places(solution, solution.last)["shell"]
    assert not strengths(solution)


def test_shears_that_differ_by_the_error_of_a_solution_do_not_grow():
    """Where a contact meets a plane of symmetry, say. Of an O-ring they made p ten times as
    uncertain."""
    right = corner_expansion(math.pi / 2.0, 1.8, SLIDING, SLIDING)
    assert not growing((right,), (0.001, 0.001), 0.01)
    assert growing((right,), (0.02, 0.02), 0.01) == (right,)


OCTAGON = [
    [2.0 + 0.5 * math.cos(t), 2.0 + 0.5 * math.sin(t)]
    for t in -np.arange(8) * math.pi / 4.0 - math.pi / 8.0
]


def hole(mesh):
    """A plate with an octagonal hole, drawn."""
    sides = [{"part": part, "to": to} for part, to in zip("abcd", SQUARE, strict=True)]
    ring = [{"part": "hole", "to": to} for to in OCTAGON]
    plate = {"shape": "outline", "loops": [sides, ring]}
    return solid("plate", plate, *rollers("a"), drawn("c", [0.0, 1.0]), mesh=mesh)


SQUARE = [[4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]]


def clamped(mesh):
    """A block that is clamped at an end and drawn at the other, so that K is about 0 at (1, 0). Where
    its end meets free sides the shears differ, and stress has bounds that depend on the angle."""
    ends = moved("bottom", [0.0, 0.0]), drawn("top", [0.17, 1.0])
    return solid("block", rectangle([0, 0], [1, 1]), *ends, mesh=mesh)


def kinked(mesh):
    """A side with a kink of 0.011 degrees."""
    corners = polygon(bottom=(0, 0), r1=(2, 0), r2=(1.9998, 2), top=(2, 4), left=(0, 4))
    ends = *rollers("bottom", "left"), drawn("top", [0.0, 1.0])
    return solid("bar", corners, *ends, mesh=mesh)


@pytest.mark.parametrize(("body", "count"), [(hole, 8), (clamped, 2), (kinked, 0)])
def test_places_without_a_bound_are_the_same_on_every_mesh(body, count):
    """And so is where stress is told to have none, also where it is small; at the kink it is a
    value."""
    listed = []
    for size, order in ((0.1, 2), (0.05, 1)):
        solution = solve(problem(body=[body({"element_size": size, "order": order})]))
        endless = {n.name for n in solution.numbers if math.isinf(n.error)}
        (places,) = singular_places(solution, solution.last).values()
        at = {(place.sides, *place.x.round(9).tolist()) for place in places}
        listed.append((endless, at))
    assert listed[0] == listed[1]
    assert len({name.partition(" at ")[2] for name in listed[0][0]}) == count


def test_shears_that_differ_on_free_sides_have_bounds():
    """A right angle of a block, of which one side is sheared by 1: the Airy function
    r² (-θ/2 + sin(2θ)/4 + π/8 (1 - cos 2θ)) draws the other side with π/2."""
    ends = moved("bottom", [0.0, 0.0]), drawn("right", [0.0, 1.0])
    block = solid("block", rectangle([0, 0], [1, 1]), *ends)
    solution = solve(problem(body=[block]))
    places = {place.sides for place in singular_places(solution, solution.last)["block"]}
    assert places == {"right and bottom", "bottom and left"}
    pressed = solution.stress_at([[0.97, 1.0]], part="top")[0, 0]
    assert pressed == pytest.approx(-math.pi / 2.0, rel=0.02)


@pytest.mark.parametrize(
    ("ratio", "places"), [(0.0, {"right and bottom", "bottom and left"}), (0.3, set())]
)
def test_a_clamped_side_without_contraction_does_not_fit_a_pressure(ratio, places):
    """With ν = 0 nothing but σ_xx strains the clamped side, which pressure makes -1."""
    sides = [{"part": part, "condition": "traction", "pressure": 1.0} for part in ("left", "right")]
    block = solid("block", rectangle([0, 0], [1, 1]), moved("bottom", [0.0, 0.0]), *sides)
    block["material"]["poisson_ratio"] = ratio
    solution = solve(problem(body=[block]))
    found = singular_places(solution, solution.last)["block"]
    assert {place.sides for place in found if not place.expansions} == places


def test_a_contact_may_be_narrower_than_what_lies_beside_a_corner():
    """A ball on a quarter of a block, of a twentieth of its size: both planes of symmetry meet
    contact, whose panels do not count as free since most of those near them are. Where they slip
    the whole body is smooth."""
    block = solid("block", cuboid([0.0, 0.0, -3.0], [2.0, 2.0, 0.0]), moved("bottom", 3 * [0.0]))
    block["boundary"] += rollers("left", "front")
    block["mesh"] = {"accuracy": 0.4}
    tool = {"name": "tool", "displacement": [0.0, 0.0, "free"], "force": [0.0, 0.0, -5e-4]}
    pair = touching("pair", "block.top", "tool", gap="(x**2 + y**2)/2", friction_coefficient=0.3)
    solution = solve(problem(body=[block], obstacle=[tool], contact=[pair]))
    found = [place.x for place in singular_places(solution, solution.last)["block"]]
    inside = [x for x in found if x[2] == 0.0 and np.linalg.norm(x) < 0.1]
    assert solution.converged and not inside
