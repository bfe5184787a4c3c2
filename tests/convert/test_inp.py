"""Input files of Abaqus and CalculiX: the problem that they hold is solved, and what is not taken
is named."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from inp_decks import converted, grid, sets

from petcontact import load, solve
from petcontact.commands.main import main

pytestmark = pytest.mark.usefixtures("unsampled")

YOUNG, POISSON, DROP = 1000.0, 0.25, 0.002


SECTIONS = """*MATERIAL, NAME=STEEL
*ELASTIC
1000.0, 0.25
*SOLID SECTION, ELSET=LOWER, MATERIAL=STEEL
*SOLID SECTION, ELSET=UPPER, MATERIAL=STEEL
*SURFACE INTERACTION, NAME=RUB
*FRICTION
0.3,
*CONTACT PAIR, INTERACTION=RUB, TYPE=SURFACE TO SURFACE
HIGH, LOW
*BOUNDARY"""
LOADS = """*DFLUX
UPPER, BF, 0.5
*NODE PRINT
*END STEP"""


def stacked(d):
    """Two equal blocks, one on the other, rollers at the sides, the top lowered: p is that of
    one-dimensional strain."""
    kind, counts, size = ("CPE4R", (4, 2), (2, 1)) if d == 2 else ("C3D8", (2, 2, 2), (1, 1, 1))
    up, foot = d - 1, [0.0] * (d - 1)
    bottom, lower = grid([*foot, 0.0], size, counts, 1, 1, kind, "LOWER")
    top, upper = grid([*foot, 1.0], [*size[:up], 2.0], counts, 1001, 1001, kind, "UPPER")
    text = ["*HEADING", "two blocks", "** a comment", *bottom, *top]
    text += [*sets("FOOT", lower, up, 0), *sets("HEAD", upper, up, counts[up])]
    for c in range(up):
        for name, nodes in (("A", lower), ("B", upper)):
            text += [*sets(f"{name}{c}0", nodes, c, 0), *sets(f"{name}{c}1", nodes, c, counts[c])]
    cells = [*itertools.product(*(range(n) for n in counts))]
    under, over = (
        ", ".join(str(first + k) for k, cell in enumerate(cells) if cell[up] == layer)
        for first, layer in ((1, counts[up] - 1), (1001, 0))
    )
    text += ["*ELSET, ELSET=UNDER", under, "*ELSET, ELSET=OVER", over]
    text += ["*SURFACE, NAME=LOW, TYPE=ELEMENT", "UNDER, S3" if d == 2 else "UNDER, S2"]
    text += ["*SURFACE, NAME=HIGH", "OVER, S1", *SECTIONS.splitlines(), f"FOOT, 1, {d}, 0."]
    rollers = [
        f"{name}{c}{side}, {c + 1}, {c + 1}" for c in range(up) for name in "AB" for side in "01"
    ]
    text += ["*BOUNDARY", *rollers, "*STEP, NAME=press", "*STATIC", "*BOUNDARY"]
    return [*text, f"HEAD, {d}, {d}, {-DROP}", *LOADS.splitlines()]


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("d", [2, 3])
def test_two_blocks_are_pressed_as_theory_says(d, clockwise, tmp_path, capsys):
    """Elements that are numbered clockwise are taken as they lie; their faces keep the numbers that
    they have in the file: the upper one is S1 then, of hexahedra still S2."""
    text = stacked(d)
    if clockwise:
        start = text.index("*Element, type=" + ("CPE4R" if d == 2 else "C3D8") + ", elset=LOWER")
        for k in range(start + 1, start + 9):
            number, *nodes = text[k].split(", ")
            text[k] = ", ".join([number, *nodes[:4][::-1], *nodes[4:][::-1]])
        text = [line.replace("UNDER, S3", "UNDER, S1") for line in text]
    (tmp_path / "part.inp").write_text("\n".join(text))
    assert main(f"init {tmp_path}/own --from {tmp_path}/part.inp".split()) == 0
    problem, named = load(tmp_path / "own.toml"), capsys.readouterr().err.splitlines()
    lie = "8 elements (1, 2, ...) numbered clockwise, or inside out; taken as they lie"
    assert [lie in line for line in named] == [True] * clockwise + [False]
    assert "*DFLUX: not taken" in named[-1]
    assert "# not taken: line" in (tmp_path / "own.toml").read_text()
    assert [body.name for body in problem.body] == ["body1", "body2"]
    (pair,) = problem.contact
    assert pair.friction_coefficient == 0.3
    assert (pair.secondary, pair.primary) == ("body2.HIGH", "body1.LOW")
    solution = solve(problem)
    assert solution.converged, solution.reason
    stiff = YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))
    assert np.allclose(solution.pairs["pair1"].pressure, stiff * DROP / 2.0, rtol=0.02)


def test_a_displacement_that_a_later_step_changes_is_that_of_the_deck_in_each(tmp_path):
    """The deck of the manual: pressed by 0.005, and only then pushed by 0.001."""
    deck = Path(__file__).parents[2] / "configs/recipes/blocks.inp"
    problem, _ = converted(tmp_path, deck.read_text())
    (head,) = problem.body[1].boundary
    assert head.value == (0.0, -0.005)
    assert [step.name for step in problem.step] == ["press", "push"]
    assert [c.value for c in problem.step[1].boundary] == [(0.001, -0.005)]


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return converted(tmp_path_factory.mktemp("plain"), "\n".join(stacked(2)))


HIDDEN = "load on faces of 1 element (1001) that lie inside, are held or in contact; not taken"
LOST = "without a face that is neither held nor in contact; not taken"


@pytest.mark.parametrize(
    ("lines", "named"),
    [
        ("*DLOAD/77, P1, 2.0", "*DLOAD: 77: 1 element (77) not there; not taken"),
        (
            "*DLOAD/UPPER, P6, 2.0",
            "UPPER: 8 elements (1001, 1002, ...) without a face P6; not taken",
        ),
        (
            "*SURFACE INTERACTION, NAME=S/*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
            "PRESSURE-OVERCLOSURE=LINEAR; hard contact is taken",
        ),
        (
            "*BOUNDARY/1, 1, 1",
            "(1 node (1)) covers no face of a body that is not in contact; not taken",
        ),
        ("*DSLOAD/LID, P, 2.0", "*DSLOAD: load P on LID; not taken"),
        ("*DLOAD/1001, P2, 2.0", HIDDEN),
        ("*SURFACE, NAME=HIGH/1001, S2", "HIGH: faces inside of 1 element (1001); not taken"),
        ("*NSET, NSET=LOST/1, 500, 501, 502", "3 nodes (500, 501, ...) not there; not taken"),
        (
            "*EQUATION/2/1, 1, 1., 2, 1, -1./*EQUATION/2/1, 2, 1., 2, 2, -1.",
            "*EQUATION: ties displacements of nodes to each other: not taken (2 times)",
        ),
        ("*BOUNDARY, TYPE=VELOCITY/FOOT, 1", "*BOUNDARY: TYPE=VELOCITY; not taken"),
        ("*BOUNDARY, USER/FOOT, 1", "*BOUNDARY: USER; not taken"),
        ("*STEP, PERTURBATION/*END STEP", "*STEP: PERTURBATION; not taken"),
        ("*TIE, NAME=T, CYCLIC SYMMETRY/LOW, HIGH", "*TIE: CYCLIC SYMMETRY; not taken"),
        ("*CONTACT PAIR, INTERACTION=RUB/HIGH", "contact of a surface with itself; not taken"),
        ("*FRICTION/0.3, 0.0/0.2, 1.0", "slip rate, pressure or temperature; the first is taken"),
        ("*ELEMENT, TYPE=B31/99, 1, 2", "*ELEMENT, TYPE=B31: not taken"),
        (
            "*SURFACE, NAME=MORE/1001, S4/*SURFACE, NAME=LESS, TYPE=NODE/1",
            "*SURFACE MORE, LESS: in no contact pair or load; not taken",
        ),
        ("*CLOAD/A01, 4, 1.0", "*CLOAD: A01: moments act on no node of a solid; not taken"),
        ("*CLOAD/9, 2, 1.0", f"*CLOAD: 1 node (9) {LOST}"),
        (
            "*NODE/9999, 0.5, 9.0, 0.0/*CLOAD/9999, 2, 1.0",
            "*CLOAD: 1 node (9999) of no body, or across its plane; not taken",
        ),
        ("*CLEARANCE, MASTER=LOW/", "*CLEARANCE: not taken; MASTER, SLAVE and VALUE are read"),
        (
            "*SURFACE INTERACTION, NAME=S/*FRICTION/0.3, 5000.",
            "*FRICTION: stick slope 5000; what sticks does not move here",
        ),
    ],
)
def test_what_is_not_taken_is_named_in_one_line(lines, named, plain, tmp_path):
    """And the rest of the file is: the problem is that without these lines."""
    (problem, before), text, more = plain, stacked(2), lines.split("/")
    early = lines.startswith(("*NSET", "*SURFACE", "*ELEMENT"))
    place = text.index("*STEP, NAME=press") if early else len(text) - 1
    found, after = converted(tmp_path, "\n".join([*text[:place], *more, *text[place:]]))
    assert len(after) == len(before) + 1 and any(line.endswith(named) for line in after), after
    assert [body.boundary for body in found.body] == [body.boundary for body in problem.body]
    assert len(found.contact) == 1


def test_faces_of_one_pressure_at_the_end_keep_their_own_ways_there(tmp_path):
    text = [line for line in stacked(2) if not line.startswith(("HEAD, 2", "*DFLUX", "UPPER, BF"))]
    first = ["*DLOAD", "1002, P3, 1.0", "1004, P3, 3.0", "*END STEP"]
    second = ["*STEP", "*STATIC", "*DSLOAD", "LID, P, 5.0", "*END STEP"]
    place = text.index("*STEP, NAME=press")
    text[place:place] = ["*SURFACE, NAME=LID", "1002, S3", "1004, S3"]
    problem, _ = converted(tmp_path, "\n".join([*text[:-1], *first, *second]))
    pressed = [c for c in problem.body[1].boundary if c.condition == "traction"]
    assert sorted(c.pressure for c in pressed) == [1.0, 3.0]
    assert [change.pressure for change in problem.step[1].boundary] == [5.0, 5.0]


BLOCK = "*Element, type={}, elset=UPPER"
SECTION = "*SOLID SECTION, ELSET=UPPER, MATERIAL=STEEL"


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("*HEADING", "*INSTANCE, NAME=I, PART=P", "line 1: *INSTANCE: no part 'P'; there are none"),
        ("*ELASTIC", "*ELASTIC, TYPE=ORTHOTROPIC", "materials are isotropic; take the body as a"),
        (SECTION, "** none", "has no *SOLID SECTION with an *ELASTIC"),
        ("UNDER, S3", "UNDERS, S3", "no ELSET 'UNDERS'; there are LOWER, UPPER, UNDER, OVER"),
        ("FOOT, 1, 2, 0.", "FOOT, 1, 2, zero", "*BOUNDARY: numbers are expected"),
        (BLOCK.format("CPE4R"), BLOCK.format("CAX4"), "bodies of revolution (CAX) beside others"),
        ("*HEADING", "*INCLUDE, INPUT=../other.inp", "only files of the same folder are read"),
        (
            "*HEADING",
            "*EXPANSION, TYPE=ORTHO\n1,2,3",
            "materials are isotropic; take the body as a",
        ),
        ("*HEADING", "*NODE, SYSTEM=C", "*NODE: nodes in another system are not read"),
        ("1, 1, 4, 5, 2", "1, 1, 4, 5", "*ELEMENT: 39 numbers are no multiple of 5"),
        ("1, 1, 4, 5, 2", "1, 1, 5, 4, 2", "element 1 is folded: its corners turn both ways"),
        ("1, 1, 4, 5, 2", "1, 1, 4, 7, 10", "element 1 has no area"),
        ("1, 1, 4, 5, 2", "2, 1, 4, 5, 2", "*ELEMENT: number 2 is there already"),
        ("2, 0, 0.5", "2, 0, nan", "node 2 has coordinates that are not finite"),
        ("*HEADING", "*NSET, NSET=A, GENERATE\n1,1000000000", "are more numbers than"),
        ("1000.0, 0.25", "1e999, 0.25", "numbers are expected"),
        ("FOOT, 1, 2, 0.", "FOOT, 1, 1e40", "degrees of freedom are 1 to 99"),
    ],
)
def test_what_cannot_be_read_is_refused_in_one_line(old, new, line, tmp_path, capsys):
    text = [new if given == old else given for given in stacked(2)]
    (tmp_path / "part.inp").write_text("\n".join(text))
    assert main(f"init {tmp_path}/own --from {tmp_path}/part.inp".split()) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and line in error, error
    assert list(tmp_path.iterdir()) == [tmp_path / "part.inp"]
