"""Input files of Abaqus and CalculiX: the problem that they hold is solved, and what is not taken is named."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from petcontact import load, solve
from petcontact.commands.main import main

YOUNG, POISSON, DROP = 1000.0, 0.25, 0.002


def grid(lower, upper, counts, first_node, first_element, kind, elset):
    """*NODE and *ELEMENT of a grid of squares or cubes, and its nodes by place."""
    d = len(counts)
    lines = [np.linspace(a, b, n + 1) for a, b, n in zip(lower, upper, counts, strict=True)]
    places = list(itertools.product(*(range(n + 1) for n in counts)))
    number = {place: first_node + k for k, place in enumerate(places)}
    text = ["*NODE"]
    text += [f"{number[p]}, " + ", ".join(f"{lines[c][p[c]]:.12g}" for c in range(d)) for p in places]
    text.append(f"*Element, type={kind}, elset={elset}")
    ring = ((0, 0), (1, 0), (1, 1), (0, 1))
    order = ring if d == 2 else [(*xy, z) for z in (0, 1) for xy in ring]
    for k, cell in enumerate(itertools.product(*(range(n) for n in counts))):
        nodes = [number[tuple(a + b for a, b in zip(cell, corner, strict=True))] for corner in order]
        text.append(f"{first_element + k}, {', '.join(map(str, nodes))}")
    return text, number


def sets(name, number, axis, at):
    """*NSET of the nodes of a face of the grid."""
    chosen = [node for place, node in number.items() if place[axis] == at]
    return [f"*NSET, NSET={name}", *(", ".join(map(str, chosen[k : k + 8])) for k in range(0, len(chosen), 8))]


def stacked(d):
    """Two equal blocks, one on the other, rollers at the sides, the top lowered: p is that of one-dimensional strain."""
    kind, counts = ("CPE4R", (4, 2)) if d == 2 else ("C3D8", (2, 2, 2))
    up = d - 1
    size = [2.0, 1.0] if d == 2 else [1.0, 1.0, 1.0]
    bottom, lower = grid([0.0] * d, size, counts, 1, 1, kind, "LOWER")
    raised = [0.0] * up + [1.0]
    top, upper = grid(raised, [a + b for a, b in zip(size, raised, strict=True)], counts, 1001, 1001, kind, "UPPER")
    faces = ("S3", "S1") if d == 2 else ("S2", "S1")
    text = ["*HEADING", "two blocks", "** a comment", *bottom, *top]
    text += [*sets("FOOT", lower, up, 0), *sets("HEAD", upper, up, counts[up])]
    for c in range(up):
        for name, nodes in (("A", lower), ("B", upper)):
            text += [*sets(f"{name}{c}0", nodes, c, 0), *sets(f"{name}{c}1", nodes, c, counts[c])]
    first = [k for k, cell in enumerate(itertools.product(*(range(n) for n in counts))) if cell[up] == counts[up] - 1]
    last = [k for k, cell in enumerate(itertools.product(*(range(n) for n in counts))) if cell[up] == 0]
    text += ["*ELSET, ELSET=UNDER", ", ".join(str(1 + k) for k in first), "*ELSET, ELSET=OVER",
             ", ".join(str(1001 + k) for k in last), "*SURFACE, NAME=LOW, TYPE=ELEMENT", f"UNDER, {faces[0]}",
             "*SURFACE, NAME=HIGH", f"OVER, {faces[1]}", "*MATERIAL, NAME=STEEL", "*ELASTIC", f"{YOUNG}, {POISSON}",
             "*SOLID SECTION, ELSET=LOWER, MATERIAL=STEEL", "*SOLID SECTION, ELSET=UPPER, MATERIAL=STEEL",
             "*SURFACE INTERACTION, NAME=RUB", "*FRICTION", "0.3,",
             "*CONTACT PAIR, INTERACTION=RUB, TYPE=SURFACE TO SURFACE", "HIGH, LOW",
             "*BOUNDARY", f"FOOT, 1, {d}, 0."]  # fmt: skip
    rollers = [f"{name}{c}{side}, {c + 1}, {c + 1}" for c in range(up) for name in "AB" for side in "01"]
    return [*text, "*BOUNDARY", *rollers, "*STEP, NAME=press", "*STATIC", "*BOUNDARY",
            f"HEAD, {d}, {d}, {-DROP}", "*CLOAD", "HEAD, 1, 0.5", "*NODE PRINT", "*END STEP"]  # fmt: skip


@pytest.mark.parametrize("d", [2, 3])
def test_two_blocks_are_pressed_as_theory_says(d, tmp_path, capsys):
    (tmp_path / "part.inp").write_text("\n".join(stacked(d)))
    assert main(["init", str(tmp_path / "own"), "--from", str(tmp_path / "part.inp")]) == 0
    told = capsys.readouterr()
    assert "*CLOAD: not taken" in told.err and told.err.count("\n") == 1
    assert "# not taken: line" in (tmp_path / "own.toml").read_text()
    problem = load(tmp_path / "own.toml")
    assert [body.name for body in problem.body] == ["body1", "body2"] and problem.contact[0].friction_coefficient == 0.3
    assert problem.contact[0].secondary == "body2.HIGH" and problem.contact[0].primary == "body1.LOW"
    solution = solve(problem)
    assert solution.converged, solution.reason
    stiff = YOUNG * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON))
    assert np.allclose(solution.pairs["pair1"].pressure, stiff * DROP / 2.0, rtol=0.02)


def test_pressure_weight_plane_stress_ties_and_steps(tmp_path, capsys):
    text = stacked(2)
    text = [line.replace("CPE4R", "CPS4") for line in text if not line.startswith("HEAD, 2")]
    text = [line.replace("*CONTACT PAIR, INTERACTION=RUB, TYPE=SURFACE TO SURFACE", "*TIE, NAME=T") for line in text]
    end = text.index("*CLOAD")
    text[end : end + 2] = ["*DLOAD", "UPPER, GRAV, 9.81, 0., -1.", "LIFTED, P3, 2.0"]
    text[-1:] = ["*END STEP", "*STEP", "*STATIC", "*DLOAD", "LIFTED, P3, 5.0", "*END STEP"]
    place = text.index("*STEP, NAME=press")
    text[place:place] = ["*ELSET, ELSET=LIFTED, GENERATE", "1002, 1008, 2", "*DENSITY", "7.8e-9"]
    (tmp_path / "part.inp").write_text("\n".join(text))
    assert main(["init", str(tmp_path / "own"), "--from", str(tmp_path / "part.inp")]) == 0, capsys.readouterr().err
    problem = load(tmp_path / "own.toml")
    pair, upper = problem.contact[0], problem.body[1]
    assert pair.normal == "bonded" and upper.material.plane == "stress" and upper.material.density == 7.8e-9
    assert upper.loads.acceleration == (0.0, -9.81)
    assert [c.pressure for c in upper.boundary if c.condition == "traction"] == [2.0]
    assert len(problem.step) == 2 and problem.step[1].boundary[0].pressure == 5.0
    solution = solve(problem)
    assert solution.converged, solution.reason
    forces = [step.pairs["pair1"].force[1] for step in solution.steps]
    assert forces[1] / forces[0] == pytest.approx(2.5, rel=0.01)  # pressed ×2.5; the weight is next to nothing


@pytest.mark.parametrize(("change", "told"), [
    (("*HEADING", "*PART, NAME=P"), "line 1: \\*PART: parts and instances are not read"),
    (("*ELASTIC", "*ELASTIC, TYPE=ORTHOTROPIC"), "\\*ELASTIC: materials are isotropic; take the body as a superelement"),
    (("*SOLID SECTION, ELSET=UPPER, MATERIAL=STEEL", "** none"), "has no \\*SOLID SECTION with an \\*ELASTIC"),
    (("UNDER, S3", "UNDERS, S3"), "no ELSET 'UNDERS'; there are LOWER, UPPER, UNDER, OVER"),
    (("FOOT, 1, 2, 0.", "FOOT, 1, 2, zero"), "\\*BOUNDARY: numbers are expected"),
    (("*HEADING", "*INCLUDE, INPUT=other.inp"), "\\*INCLUDE: other files are not read"),
])  # fmt: skip
def test_what_cannot_be_read_is_refused_in_one_line(change, told, tmp_path, capsys):
    text = [change[1] if line == change[0] else line for line in stacked(2)]
    (tmp_path / "part.inp").write_text("\n".join(text))
    assert main(["init", str(tmp_path / "own"), "--from", str(tmp_path / "part.inp")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and __import__("re").search(told, error), error
    assert list(tmp_path.iterdir()) == [tmp_path / "part.inp"]
