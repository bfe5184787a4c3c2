"""Warnings of what a user hardly meant; each has its limit in the table of findings."""

from __future__ import annotations

import pytest
from shapes import closing, drawn, elastic, moved, outline, problem, rectangle, solid, touching

from petcontact import solve

pytestmark = pytest.mark.usefixtures("unsampled")


@pytest.mark.parametrize(
    ("words", "law", "pushes"),
    [
        (None, {}, [-0.01]),
        ("a friction coefficient of 3", {"friction_coefficient": 3.0}, [-0.01]),
        ("bilateral contact closes a gap of 0.01", {"normal": "bilateral", "gap": 0.01}, [-0.01]),
        ("overlaps by 0.2, 14% of the size of a body, far for the theory", {"gap": -0.2}, [-0.01]),
        ("is strained by", {}, [-0.08]),
        ("have the same unit", {}, [-1e-12]),
        ("step '1': its contact carries nothing", {}, [0.01, -0.01]),
        ("step '2': it moves no body: check what it gives", {}, [-0.01, -0.01]),
    ],
)
def test_each_warning(words, law, pushes):
    """A small block on a floor, and steps that move its top; the usual one has none."""
    steps = [
        {"name": f"{k}", "boundary": [{"part": "top", "value": [0, push]}]}
        for k, push in enumerate(pushes, 1)
    ]
    block = problem(
        material=elastic(1000.0, 0.3),
        geometry=rectangle([0, 0], [1, 1]),
        mesh={"element_size": 0.25},
        boundary=[
            closing("bottom", **{"normal": "unilateral", **law}),
            moved("top", [0, 0]),
            *(drawn(part, [0, 0]) for part in ("left", "right")),
        ],
        step=steps,
    )
    solution = solve(block)
    said = " ".join(solution.verdict().split())
    assert solution.converged
    assert words in said if words else "warning" not in said


def test_bodies_that_nothing_joins_and_loads_in_pascals():
    pressed = {"part": "top", "condition": "traction", "pressure": 400.0}
    steel = {"material": elastic(210e9, 0.3), "mesh": {"element_size": 0.5}}
    bodies = [
        solid(name, rectangle([0, 0], [1, 1]), moved("bottom", [0, 0]), pressed, **steel)
        for name in "ab"
    ]
    bodies[1] = {**bodies[1], "material": {**bodies[1]["material"], "plane": "stress"}}
    said = " ".join(solve(problem(body=bodies)).verdict().split())
    assert "body 'a': touches no other body; bodies meet where a [[contact]]" in said
    assert "check that loads and moduli have the same unit" in said
    assert "bodies 'a' in plane strain and 'b' in plane stress have other stiffnesses" in said


@pytest.mark.parametrize(("ground", "warned"), [("-1", False), ("-sqrt(1.21 - x**2) + 0.1", True)])
def test_a_direction_off_the_normals_of_both_sides(ground, warned):
    """Of half a disc that is pressed into a plane, whose normal is right, and into a hole."""
    loop = [{"part": "top", "to": [-1, 0]}, {"part": "rim", "to": [1, 0], "through": [0, -1]}]
    disc = problem(
        material=elastic(1.0, 0.3),
        geometry={"shape": "outline", "loops": [loop]},
        mesh={"element_size": 0.2, "order": 1},
        boundary=[moved("top", [0, 0])],
        obstacle=[{"name": "tool", "displacement": [0.0, 0.1]}],
        contact=[
            touching("pair", "rim", "tool", direction=[0.0, -1.0], gap=f"y - ({ground})"),
        ],
    )
    assert ("off the normals" in " ".join(solve(disc).warnings)) == warned


@pytest.mark.parametrize(("low", "rise", "word"), [(0, 0, ""), (0.1, 0, "apart"), (0, 0.1, "fits")])
def test_a_shape_that_contact_leaves_out_is_named(low, rise, word):
    """Of a joined part over a block, and of an obstacle under its own bottom, which may slant."""
    corners = [[0, low], [1, low + rise], [1, 1], [0, 1]]
    shape = {"shape": "polygon", "vertices": corners, "parts": ["bottom", "right", "top", "left"]}
    mesh = {"mesh": {"element_size": 0.5}}
    bodies = [
        solid("upper", shape, moved("top", [0, -0.01]), **mesh),
        solid("lower", rectangle([0, -1], [1, 0]), moved("bottom", [0, 0]), **mesh),
    ]
    primary, law = ("floor", "unilateral") if word == "fits" else ("lower.top", "bonded")
    pair = touching("pair", "upper.bottom", primary, normal=law)
    given = {"obstacle": [{"name": "floor"}]} if word == "fits" else {}
    posed = problem(body=bodies[: 2 - len(given)], contact=[pair], **given)
    assert [word in text for text in solve(posed).warnings if "pair" in text] == [True] * bool(word)


@pytest.mark.parametrize(("pressure", "told"), [(0.3, True), (0.03, False)])
def test_a_plate_that_bends_by_more_than_half_its_thickness_is_warned_of(pressure, told):
    """A round plate of thickness 20 and radius 200 on its rim: 1.8 and 0.18 thicknesses."""
    solution = solve(
        problem(
            symmetry="axial",
            material=elastic(1000.0, 0.4),
            geometry=rectangle([0.0, 0.0], [200.0, 20.0]),
            mesh={"element_size": 5.0, "order": 2},
            boundary=[
                {"part": "bottom", "condition": "traction", "pressure": pressure},
                drawn("top", [0.0, 0.0]),
                moved("right", ["free", 0.0]),
            ],
        )
    )
    assert any("of its thickness" in warning for warning in solution.warnings) == told


@pytest.mark.parametrize("is_round", [True, False])
def test_a_contact_that_ends_where_its_surface_goes_on(is_round):
    """A floor under one half of a round bottom; under one half of a flat one it may end."""
    round_one = {"top": [-1, 0], "free": [0, -1, 1], "under": [1, 0, 1]}
    flat = {"top": [-1, 0], "left": [-1, -1], "free": [0, -1], "under": [1, -1], "right": [1, 0]}
    sides = round_one if is_round else flat
    law = {"normal": "unilateral", "gap": "y + 1" if is_round else 0.0}
    solution = solve(
        problem(
            material=elastic(1.0, 0.3),
            geometry=outline(**sides),
            mesh={"element_size": 0.05},
            boundary=[
                moved("top", [0, -0.02]),
                closing("under", **law),
                *(drawn(part, [0, 0]) for part in sides if part not in ("top", "under")),
            ],
        )
    )
    said = " ".join(solution.verdict().split())
    assert solution.converged
    words = "ends where 'under' does, but the surface goes on smoothly as 'free' without contact"
    assert (words in said) == ('secondary = ["under", "free"]' in said) == is_round


def test_a_given_gap_that_jumps_within_an_element_is_no_overlap():
    """The polynomial through its values at nodes of order 3 falls far below 0."""
    block = solid(
        "block",
        rectangle([-2.0, -2.0], [2.0, 0.0]),
        moved("bottom", [0.0, 0.0]),
        mesh={"element_size": 0.5, "order": 3},
    )
    tool = {"name": "tool", "displacement": [0.0, "free"], "force": [0.0, -1.0]}
    pair = touching("pair", "block.top", "tool", gap="where(abs(x - 0.1) <= 0.3, x**2, 1e3)")
    assert solve(problem(body=[block], obstacle=[tool], contact=[pair])).converged
