"""Loads of input files that are held, renewed, warmed or named by a surface: none is lost."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from inp_decks import converted

from petcontact import solve

DECK = """*NODE
1, 0., 0.
2, 2., 0.
3, 2., 1.
4, 0., 1.
*ELEMENT, TYPE=CPS4, ELSET=ALL
1, 1, 2, 3, 4
*NSET, NSET=FOOT
1, 2
*NSET, NSET=HEAD
3, 4
*NSET, NSET=EVERY
1, 2, 3, 4
*SURFACE, NAME=TOP
ALL, S3
*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*EXPANSION
1e-3
*SOLID SECTION, ELSET=ALL, MATERIAL=M
{section}
*BOUNDARY
FOOT, 2, 2
"""


def deck(tmp_path: Path, *steps: str, section: str = "1.", **more: str) -> tuple[Any, list[str]]:
    text = DECK.format(section=section) + more.get("first", "")
    text += "".join(f"*STEP\n*STATIC\n{step}\n*END STEP\n" for step in steps)
    problem, notes = converted(tmp_path, text)
    return problem, [note for note in notes if "*SURFACE TOP" not in note]


def raised(problem: Any) -> list[float]:
    """How far the head has moved at the end of each step."""
    solution = solve(problem)
    ends = [step for step in solution.steps if step.ends]
    top = solution.meshes["body1"].x[:, 1] > 1.0 - 1e-9
    return [float(step.bodies["body1"].u[top, 1].mean()) for step in ends]


@pytest.mark.parametrize(
    "load", ["*DLOAD\nTOP, P, 2.", "*DLOAD\nTOP, P3, 2.", "*DSLOAD\nTOP, P, 2."]
)
def test_a_pressure_may_be_on_a_surface(load: str, tmp_path: Path) -> None:
    problem, notes = deck(tmp_path, load)
    assert not notes
    assert raised(problem) == pytest.approx([-0.002], rel=1e-6)


@pytest.mark.parametrize(
    ("load", "held"), [("*DLOAD\nTOP, P, 2.", "HEAD, 2, 2"), ("*CLOAD\nHEAD, 2, -2.", "HEAD, 1, 2")]
)
def test_what_is_fixed_stays_where_it_is(load: str, held: str, tmp_path: Path) -> None:
    problem, notes = deck(tmp_path, load, f"*BOUNDARY, FIXED\n{held}\n*DLOAD, OP=NEW")
    assert not notes
    assert raised(problem) == pytest.approx([-0.002, -0.002], rel=1e-6)


def test_new_loads_take_the_place_of_old_ones(tmp_path: Path) -> None:
    problem, notes = deck(
        tmp_path,
        "*DLOAD\nTOP, P, 2.\nALL, GRAV, 4., 0., -2.",
        "*DLOAD, OP=NEW\nTOP, P, 3.",
        first="*MATERIAL, NAME=M\n*DENSITY\n1.\n",
    )
    assert not notes
    # the weight moves the head by half of what its resultant would
    assert raised(problem) == pytest.approx([-0.002 - 0.002, -0.003], rel=1e-5)


def test_loads_of_one_step_add_up(tmp_path: Path) -> None:
    """Programs differ only in what a surface does to the load of another in an earlier step."""
    lid = "*SURFACE, NAME=LID\nALL, S3\n"
    problem, notes = deck(
        tmp_path, "*DSLOAD\nTOP, P, 2.\nLID, P, 1.", "*DSLOAD\nLID, P, 3.", first=lid
    )
    assert len(notes) == 1 and "LID: 1 element (1) that another surface presses" in notes[0]
    assert raised(problem) == pytest.approx([-0.003, -0.003], rel=1e-6)


def test_weights_in_two_directions_act_together(tmp_path: Path) -> None:
    problem, notes = deck(
        tmp_path,
        "*DLOAD\nALL, GRAV, 4., 0., -2.\nALL, GRAV, 3., 1., 0.\nALL, BY, 2.\nALL, BY, 1.",
        "*DLOAD\nALL, GRAV, 5., 0., -1.",
        first="*MATERIAL, NAME=M\n*DENSITY\n1.\n",
    )
    assert not notes
    assert problem.body[0].loads.acceleration == (3.0, -4.0)
    assert problem.body[0].loads.force == (0.0, 3.0)
    assert problem.step[1].loads[0].acceleration == (0.0, -5.0)


def test_conditions_and_forces_are_renewed_too(tmp_path: Path) -> None:
    problem, notes = deck(
        tmp_path,
        "*BOUNDARY\nHEAD, 2, 2, -0.004\n*CLOAD\n3, 2, 1.",
        "*BOUNDARY, OP=NEW\nFOOT, 2, 2\n*CLOAD, OP=NEW\n3, 2, 1.\n4, 2, 1.",
    )
    assert not [note for note in notes if "CLOAD" not in note]
    assert raised(problem)[-1] == pytest.approx(0.001, rel=1e-6)


@pytest.mark.parametrize(
    ("step", "held"),
    [
        ("*BOUNDARY, OP=NEW\nHEAD, 1, 2", ["HEAD"]),
        ("*BOUNDARY\nHEAD, 1, 2\n*BOUNDARY, OP=NEW\nHEAD, 2, 2", ["FOOT", "HEAD"]),
    ],
)
def test_the_first_step_may_renew_what_the_model_holds(
    step: str, held: list[str], tmp_path: Path
) -> None:
    """Only the first keyword of a kind in a step renews it: boundarys.f of CalculiX."""
    problem, _ = deck(tmp_path, step)
    conditions = [each.part for each in problem.body[0].boundary if each.condition != "traction"]
    assert sorted(conditions) == held


def test_a_temperature_warms_the_body(tmp_path: Path) -> None:
    problem, notes = deck(
        tmp_path,
        "*TEMPERATURE\nEVERY, 30.",
        "*TEMPERATURE\nEVERY, 40.",
        "*TEMPERATURE\nFOOT, 30.\nHEAD, 40.",
        first="*INITIAL CONDITIONS, TYPE=TEMPERATURE\nEVERY, 20.\n",
    )
    assert not notes
    assert raised(problem)[:2] == pytest.approx([0.01, 0.02], rel=1e-5)
    assert problem.step[2].loads[0].temperature == "10 +10*y"


def test_a_temperature_that_is_not_taken_is_named(tmp_path: Path) -> None:
    _, notes = deck(tmp_path, "*TEMPERATURE\n1, 30.\n2, 0.\n3, 30.\n4, 0.")
    assert notes == ["*TEMPERATURE of body1: neither uniform nor linear; not taken"]


def test_of_a_thickness_forces_are_whole_ones(tmp_path: Path) -> None:
    problem, notes = deck(tmp_path, "*CLOAD\n3, 2, -2.\n4, 2, -2.", section="0.5")
    assert not notes
    assert problem.body[0].material.thickness == 0.5
    assert raised(problem) == pytest.approx([-0.004], rel=1e-6)
