"""Surfaces and bolts of input files that one node holds, moves or loads."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from inp_decks import converted, grid, sets

from petcontact import solve

MATERIAL = """*MATERIAL, NAME=M
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=ALL, MATERIAL=M
*NODE
900, 0.5, {at}
901, 0.5, {at}
"""
CUT = "*SURFACE, NAME=CUT\n1, {face}\n*PRE-TENSION SECTION, SURFACE=CUT, NODE=900"
COUPLED = "*SURFACE, NAME=TOP\n2, {face}\n*COUPLING, REF NODE=900, SURFACE=TOP\n*"


def column(tmp_path: Path, kind: str, follows: str, *steps: str) -> tuple[Any, list[str]]:
    """A column of 1 x 2 (x 1), held at its foot, whose head or section follows node 900."""
    d = 3 if kind.startswith("C3D") else 2
    counts = (1,) * (d - 1) + (2,)
    text, number = grid([0.0] * d, [*[1.0] * (d - 1), 2.0], counts, 1, 1, kind, "ALL")
    text += sets("FOOT", number, d - 1, 0) + sets("HEAD", number, d - 1, 2)
    at = "0.5, 2.5" if d == 3 else "2.5"
    text += [MATERIAL.format(at=at).strip(), follows.format(face="S2" if d == 3 else "S3")]
    text += ["*BOUNDARY", f"FOOT, 1, {d}", *(f"*STEP\n{step}\n*END STEP" for step in steps)]
    problem, notes = converted(tmp_path, "\n".join(text))
    return problem, notes


def at_foot(solution: Any) -> list[np.ndarray]:
    """The reaction at the foot at the end of each step."""
    found = []
    for step in [step for step in solution.steps if step.ends]:
        forces = solution.reactions(step)
        found.append((forces if "FOOT" in forces else forces["body1"])["FOOT"])
    return found


@pytest.mark.parametrize(
    ("kind", "rigid"),
    [
        ("C3D8", COUPLED + "KINEMATIC\n1, 6"),
        ("C3D8", "*KINEMATIC COUPLING, REF NODE=900\nHEAD, 1, 3"),
        ("CPE4", "*RIGID BODY, NSET=HEAD, REF NODE=900"),
        ("CAX4", COUPLED + "KINEMATIC"),
    ],
)
def test_a_rigid_surface_moves_and_is_loaded_as_its_node_is(
    kind: str, rigid: str, tmp_path: Path
) -> None:
    axis = 3 if kind == "C3D8" else 2
    held = f"*BOUNDARY\n900, 1, {axis - 1}\n900, 4, 6\n900, {axis}, {axis}, -0.004"
    problem, notes = column(tmp_path, kind, rigid, held, "*BOUNDARY, FIXED\n900, 1, 6")
    area = np.pi if kind == "CAX4" else 1.0
    assert not notes
    assert [f[-1] for f in at_foot(solve(problem))] == pytest.approx([2.0 * area] * 2, rel=1e-3)
    free = f"*BOUNDARY\n900, 1, {axis - 1}\n900, 4, 6\n*CLOAD\n900, {axis}, -2."
    problem, notes = column(tmp_path, kind, rigid, free, f"*CLOAD\n900, {axis}, -3.")
    assert not notes
    assert [f[-1] for f in at_foot(solve(problem))] == pytest.approx([2.0, 3.0], rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "follows"),
    [
        ("C3D8", COUPLED + "DISTRIBUTING"),
        (
            "C3D8",
            "*ELEMENT, TYPE=DCOUP3D, ELSET=C\n99, 900\n*DISTRIBUTING COUPLING, ELSET=C\nHEAD, 1.",
        ),
        ("CPE4", COUPLED + "DISTRIBUTING\n1, 3"),
    ],
)
def test_a_force_and_a_moment_are_spread_over_a_surface(
    kind: str, follows: str, tmp_path: Path
) -> None:
    load = "*CLOAD\n900, 1, 2.\n900, 6, 0.5\n900, 2, -5."
    (body,) = column(tmp_path, kind, follows, load)[0].body
    traction = next(each.value for each in body.boundary if each.condition == "traction")
    gauss = 0.5 + np.array([-0.5, 0.5]) / np.sqrt(3.0)
    force, moment = np.zeros(3), np.zeros(3)
    for place in [(x, y, 2.0) for x in gauss for y in gauss]:
        place = place if kind == "C3D8" else (place[0], 2.0, 0.0)
        acting = np.pad(
            [eval(str(one), {}, dict(zip("xyz", place, strict=True))) for one in traction],
            (0, 3 - len(traction)),
        )
        force += 0.25 * acting
        moment += 0.25 * np.cross(np.array(place) - [0.5, 0.5 * (kind == "C3D8"), 0.0], acting)
    above = np.array([0.0, 0.0, 2.5] if kind == "C3D8" else [0.0, 2.5, 0.0])
    assert force == pytest.approx([2.0, -5.0, 0.0], abs=1e-8)
    assert moment == pytest.approx(np.cross(above, force) + np.array([0.0, 0.0, 0.5]), abs=1e-8)


def test_a_node_that_spreads_forces_is_not_held(tmp_path: Path) -> None:
    _, notes = column(tmp_path, "C3D8", COUPLED + "DISTRIBUTING", "*BOUNDARY\n900, 3, 3, -0.01")
    assert [note.partition(": ")[0] for note in notes] == ["*BOUNDARY"]


def test_a_surface_that_follows_in_some_directions_is_named(tmp_path: Path) -> None:
    _, notes = column(tmp_path, "C3D8", COUPLED + "KINEMATIC\n3, 3", "*CLOAD\n900, 3, 1.")
    assert any("follows it in all directions" in note for note in notes)
    assert any("*CLOAD: 1 node (900)" in note for note in notes)


@pytest.mark.parametrize("kind", ["C3D8", "CPE4", "CAX4"])
def test_a_bolt_is_pulled_and_then_locked(kind: str, tmp_path: Path) -> None:
    axis = 3 if kind == "C3D8" else 2
    held = f"*BOUNDARY\nHEAD, 1, {axis}\n"
    problem, notes = column(
        tmp_path,
        kind,
        CUT,
        f"{held}*CLOAD\n900, 1, 7.",
        f"*BOUNDARY, FIXED\n900, 1, 1\n*BOUNDARY\nHEAD, {axis}, {axis}, 0.002",
    )
    assert not notes
    more = 1.0 * (np.pi if kind == "CAX4" else 1.0)
    assert [-f[-1] for f in at_foot(solve(problem))] == pytest.approx([7.0, 7.0 + more], rel=1e-3)
    shorter, _ = column(tmp_path, kind, CUT, f"{held}900, 1, 1, 0.002")
    assert -at_foot(solve(shorter))[0][-1] == pytest.approx(more, rel=1e-3)


@pytest.mark.parametrize(
    ("normal", "force", "pulls", "said"),
    [
        ("0., 0., 2.", 7.0, 7.0, ""),
        ("0., 0., -1.", -7.0, 7.0, ""),
        ("0., 0., -1.", 7.0, 0.0, "7 would push"),
        ("", -7.0, 0.0, "7 would push"),
        ("0., 0.6, 0.8", 7.0, 7.0, "37°"),
    ],
)
def test_the_normal_of_a_section_says_which_way_its_force_acts(
    normal: str, force: float, pulls: float, said: str, tmp_path: Path
) -> None:
    """Outwards of the elements of the surface it is tension: pretensionsections.f of CalculiX."""
    problem, notes = column(
        tmp_path,
        "C3D8",
        f"{CUT}\n{normal}".strip(),
        f"*BOUNDARY\nHEAD, 1, 3\n*CLOAD\n900, 1, {force}",
    )
    assert [note for note in notes if said not in note] == []
    assert bool(notes) == bool(said)
    (pair,) = problem.contact
    assert pair.preload == pulls


def test_a_section_that_cuts_no_body_is_named(tmp_path: Path) -> None:
    _, notes = column(tmp_path, "CPE4", CUT.replace("{face}", "S2"), "*CLOAD\n900, 1, 7.")
    assert any("CUT: cuts no body in two" in note for note in notes)


def test_an_amplitude_and_a_file_of_loads(tmp_path: Path) -> None:
    """A load that is at half of its value at the end of the step, in a file of its own; in the
    total time it is there after the second one."""
    load = "*DSLOAD, AMPLITUDE=A\nTOP, TRVEC, 2., 0., -3."
    (tmp_path / "loads.inp").write_text(f"*STATIC\n0.1, 2.\n{load}\n")
    top = "*SURFACE, NAME=TOP\n2, S3\n*AMPLITUDE, NAME=A\n0., 0., 4., 1."
    problem, notes = column(tmp_path, "CPE4", top, "*INCLUDE, INPUT=loads.inp")
    assert not notes
    assert at_foot(solve(problem))[0] == pytest.approx([0.0, 1.0], abs=1e-3)
    total = top.replace("NAME=A", "NAME=A, TIME=TOTAL TIME")
    problem, notes = column(tmp_path, "CPE4", total, *[f"*STATIC\n0.1, 1.\n{load}"] * 2)
    assert not notes
    assert [f[1] for f in at_foot(solve(problem))] == pytest.approx([0.5, 1.0], abs=1e-3)


@pytest.mark.parametrize(
    "axes", ["TYPE=R\n0., 1., 0., -1., 0., 0.", "TYPE=C\n0.5, 9., 0., 0.5, 9., 1."]
)
def test_forces_along_turned_axes(axes: str, tmp_path: Path) -> None:
    """The first of them is y; about a far axis it is -y at the ends of the head but for 1/14."""
    turned = f"*TRANSFORM, NSET=HEAD, {axes}"
    problem, notes = column(tmp_path, "CPE4", turned, "*CLOAD\nHEAD, 1, 1.")
    size = 14.0 / np.hypot(14.0, 1.0) if "C" in axes[:8] else -1.0
    assert not notes
    assert at_foot(solve(problem))[0] == pytest.approx([0.0, 2.0 * size], abs=1e-3)
    assert "*TRANSFORM of HEAD" in column(tmp_path, "CPE4", turned, "*BOUNDARY\nHEAD, 2")[1][0]
