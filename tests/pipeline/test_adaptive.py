"""The adaptive solve against the reference solutions: true errors, honest estimates, transition
points."""

from __future__ import annotations

import itertools
import math
import re
import time

import numpy as np
import pytest
from contact_lines import line_of
from examples import example
from shapes import closing, drawn, elastic, moved, problem, rectangle, solid, touching

from petcontact import InputError, Polygon, adapt
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.mesh.hp_grading import Grading, graded_mesh
from petcontact.pipeline import run
from petcontact.pipeline.adapt import level_solver
from petcontact.pipeline.adapt.level_solver import LevelSolver
from petcontact.pipeline.adapt.slip_ladder import (
    Slip,
)
from petcontact.pipeline.eliminate import eliminated
from petcontact.pipeline.judge.thickness import slenderness
from petcontact.refinement.contact_line import (
    ContactLine,
    displacement,
    grading_points,
    transition,
    without_specks,
)
from petcontact.refinement.levels import MOST_GAIN, SLIP_LADDER, believed
from petcontact.refinement.marks import GradedOutline, marks_for

# u_t at some points of Γ_C and its norm, transition points: shared/reference, good to 1e-8 or
# better
TRANSITIONS = {
    1: (3.377767813205719, 7.999854958057404),
    2: (2.4115453362464914, 8.435704696178437),
}
NORM = {1: 0.053203416272211854, 2: 0.6837781009339343}
NEWTON = {"name": "semismooth-newton", "rule": None}


@pytest.fixture(scope="module")
def best(comm):
    """Both examples, two levels beyond what the tests ask for: within 2e-8 of the reference."""
    return {number: adapt(example(number, **NEWTON), 2e-8, comm=comm) for number in (1, 2)}


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("accuracy", [1e-2, 1e-6])
def test_estimate_is_honest(number, accuracy, best, comm):
    solution = adapt(example(number, **NEWTON), accuracy, comm=comm)
    contact, reference = solution.contact, best[number].contact
    norm = np.sqrt(reference.weight @ reference.u_t[:, 0] ** 2)
    assert norm == pytest.approx(NORM[number], rel=3e-8)
    exact = displacement(line_of(best[number]), contact.arc_length)
    error = np.sqrt(contact.weight @ (contact.u_t[:, 0] - exact) ** 2) / NORM[number]
    assert solution.converged
    assert error <= accuracy
    assert solution.accuracy.error <= accuracy
    # where a rough one is wanted two meshes are believed, whose difference is the error of the
    # first
    assert 0.5 < solution.accuracy.error / error < (30.0 if accuracy < SLIP_LADDER.rough else 400.0)
    # the transition points too, the one that is 0.00015 from the end among them, without being
    # given
    found = [zone.end for zone in solution.zones[:-1]]
    assert found == pytest.approx(TRANSITIONS[number], abs=1e-5 if accuracy <= 1e-6 else 5e-3)


def test_an_accuracy_that_no_mesh_reaches_is_reported(comm, monkeypatch):
    monkeypatch.setattr(Slip, "levels", SLIP_LADDER.levels[:2])
    solution = adapt(example(1, **NEWTON), 1e-5, comm=comm)
    assert solution.status == "not converged"
    assert "1e-05" in solution.reason
    # where: next to the transition point at 3.378, or the narrow zone at 8
    place = float(re.search(r"differ most on 'bottom' at s = ([\d.]+)", solution.reason)[1])
    assert min(abs(place - at) for at in TRANSITIONS[1]) < 0.5
    assert "1e-05 was wanted" in " ".join(solution.verdict().split())


def test_a_mesh_that_is_too_large_leaves_the_one_before(comm, monkeypatch):
    made, solved = [], LevelSolver.solved

    def limited(*words):
        made.append(words)
        if len(made) == 2:
            raise InputError("mesh: too large")
        return solved(*words)

    monkeypatch.setattr(LevelSolver, "solved", limited)
    for method in (NEWTON, {}):  # a method of one's own solves that mesh, too
        made.clear()
        solution = adapt(example(1, **method), 2e-4, comm=comm)
        assert solution.reason.endswith("mesh: too large (on the mesh after the last)")
        assert solution.provenance.method == solution.problem.method.resolved_name


def test_a_method_is_compared_on_the_path_that_it_takes(comm):
    """Friction while contact grows: increments that are divided for accuracy's sake are no error of
    the method that solves them."""
    ground = closing("top", normal="unilateral", friction_coefficient=0.2, gap="x**2/4")
    free = (drawn(part, [0.0, 0.0]) for part in ("left", "right"))
    block = problem(
        material=elastic(1000.0, 0.3),
        geometry=rectangle([-2.0, -3.0], [2.0, 0.0]),
        boundary=[ground, moved("bottom", [0.0, 0.02]), *free],
    )
    solution = adapt(block, method=SemismoothNewton(), comm=comm)
    assert solution.converged and len(solution.steps) > 1
    assert solution.accuracy.error == adapt(block, comm=comm).accuracy.error


def test_a_method_is_as_accurate_as_the_mesh(comm):
    """A tolerance that nobody gave is what the accuracy needs; a given one is kept."""
    loads = drawn("left", [12.7, 0.0]), drawn("right", [0.0, 0.0]), moved("top", [0.0, 0.0])
    block = problem(
        material=elastic(13_000.0, 0.45),
        geometry=rectangle([0.0, 0.0], [2.0, 1.0]),
        boundary=[closing("bottom", friction_bound=7.6), *loads],
        method={"name": "projection"},
    )
    assert adapt(block, comm=comm).converged
    kept = block.method.model_copy(update={"tolerance": 1e-6})
    coarse = adapt(block.model_copy(update={"method": kept}), comm=comm)
    assert "projection leaves an error" in coarse.reason


def test_figures_of_the_verdict_are_known_to_their_last_digit(best, comm):
    solution = adapt(example(1, **NEWTON), 1e-4, comm=comm)
    text = solution.verdict()
    # the reference: transition points 3.377768 and 7.999855, max |u_t| at the very end of the side,
    # where there is no node
    assert "slip + 0 .. 3.3778," in text or "slip + 0 .. 3.37777," in text
    s = np.array([0.0])
    peak = abs(displacement(line_of(best[1]), s)[0])
    digits, _, error = text.partition("largest |u_t| ")[2].split()[:3]
    assert len(digits.replace("0.", "").lstrip("0")) <= 4
    last = 0.1 ** len(digits.partition(".")[2])
    assert 0.9 * last < float(error) < 2e-4 and float(digits) == pytest.approx(
        peak, abs=float(error)
    )


def test_accuracy_must_make_sense(comm):
    with pytest.raises(ValueError, match="between 0 and 1"):
        adapt(example(1), 0.0, comm=comm)


def test_the_estimate_is_the_last_difference_and_claims_no_gain():
    assert believed([3e-3]) == math.inf
    assert believed([3e-3, 2e-4]) == pytest.approx(2e-4)
    # levels that are alike by chance are no proof
    assert believed([3e-3, 1e-9]) == pytest.approx(3e-3 / MOST_GAIN)
    # round-off that grows is no error
    assert believed([0.0, 1e-14]) < 1e-13
    assert believed([1e-27, 3e-14, 2e-13]) < 1e-12
    assert believed([1e-27, 1e-5]) > 1.0


def test_nothing_that_slips_needs_no_mesh_for_its_round_off(comm):
    # a ring under pressure on a rigid pin: u_t = 0; the signs of what meshes leave of it are no
    # zones to grade to
    circles = [
        {"part": part, "center": [0.0, 0.0], "radius": radius}
        for part, radius in (("outer", 2.0), ("hole", 1.0))
    ]
    case = problem(
        material=elastic(1000.0, 0.3),
        geometry={"shape": "outline", "loops": circles},
        boundary=[
            {"part": "hole", "condition": "contact", "friction_bound": 1e-9},
            {"part": "outer", "condition": "traction", "pressure": 1.0},
        ],
    )
    solution = adapt(case, 1e-5, comm=comm)
    assert solution.converged and solution.mesh.n_nodes < 600
    assert np.abs(solution.contact.u_t).max() <= 1e-7 * np.abs(solution.u).max()


# -- pieces
# --------------------------------------------------------------------------------------------------


def test_a_stick_zone_too_narrow_to_be_seen_is_the_point_where_slip_changes_its_sign():
    # u_t is about linear there, as the balance of a jump of 2g against the smooth part leaves it:
    # the ends of a stick zone that powers 3/2 place from both sides come in the wrong order
    breaks = np.linspace(0.0, 2.0, 11)
    s = (breaks[:-1, None] + 0.1 * (1.0 + np.array([-0.7746, 0.0, 0.7746]))).ravel()
    sign = np.sign(s - 0.97).astype(np.int64)
    sign[np.abs(s - 0.97) < 0.08] = 0
    u = np.where(sign == 0, 0.0, s - 0.97)
    line = ContactLine(
        s, np.full(30, 0.2 / 3.0), np.repeat(np.arange(10), 3), breaks, u, -sign, np.ones(30), sign
    )
    first, last = (transition(line, int(k)) for k in line.cuts)
    assert last < first
    assert grading_points(line) == [(pytest.approx(0.97), True)]


def test_elements_of_a_sharp_wedge_are_no_longer_than_it_is_thick_behind_them():
    """But for those at its tip of 5 degrees; they were 41 times as long, and the default mesh was
    refused."""
    wedge = Polygon(vertices=((0, 0), (4, 0), (4, 0.35)), parts=("bottom", "right", "top"))
    case = example(1).model_copy(update={"geometry": wedge})
    body, grading = GradedOutline.from_body(case.bodies[0], wedge.outline()), Grading(2, 0.3)
    mesh = graded_mesh(body.outline, marks_for(body, grading, 1e-3, None), grading, [np.inf] * 3)
    over = slenderness(mesh) > 4.0
    assert over.any() and np.bincount(mesh.element, mesh.measure)[over].sum() < 0.01


# -- pressure and shear
# ----------------------------------------------------------------------------------------------
def test_a_narrow_load_of_a_later_step_is_seen():
    """A Gaussian of width 1e-4, which no node of a coarse mesh meets: the floor carries its
    integral, √π·1e-4."""
    top = {"part": "top", "condition": "traction", "pressure": "1.0"}
    peak = {"part": "top", "pressure": "1 + 100*exp(-((x - 0.7312345)/1e-4)**2)"}
    block = solid("block", rectangle([0.0, 0.0], [2.0, 1.0]), top, material=elastic(100.0, 0.3))
    pair = touching("sole", "block.bottom", "floor", friction_coefficient=0.3)
    steps = [{}, {"boundary": [{"body": "block", **peak}]}]
    floor = [{"name": "floor"}]
    solution = adapt(problem(body=[block], obstacle=floor, contact=[pair], step=steps), 3e-2)
    pressed = 2.0 + 100.0 * 1e-4 * np.sqrt(np.pi)
    assert solution.converged, solution.reason
    assert solution.last.pairs["sole"].force[1] == pytest.approx(pressed, rel=1e-6)


def test_specks_are_removed_and_zones_kept():
    element = np.repeat(np.arange(4), 3)
    sign = np.array([1, 1, 1, 0, 0, 0, 0, 1, 0, 1, 1, 1])
    assert without_specks(sign, element).tolist() == [1, 1, 1, 0, 0, 0, 0, 0, 0, 1, 1, 1]


def test_an_elimination_that_takes_far_longer_than_announced_is_given_up(monkeypatch):
    """That of the second mesh takes seconds more, of which it gets a tenth of one."""
    ended = []

    def slow(*args, **options):
        system, over = eliminated(*args, **options), time.process_time() + 3.0 * len(ended)
        while time.process_time() < over:
            pass
        ended.append(system)
        return system

    monkeypatch.setattr(level_solver, "OVER", 0.02)
    monkeypatch.setattr(run, "eliminated", slow)
    solution = adapt(example(1), 1e-9)
    assert len(ended) == 1 and len(solution.accuracy.elements) == 1
    assert "times the announced 5 s of processor time are over" in solution.reason


def test_a_mesh_that_takes_far_longer_than_announced_is_given_up(monkeypatch):
    """The clock stands still but in the third mesh, where it runs by an hour a look."""
    meshes, clock = [], itertools.count()
    late = lambda: 3600.0 * next(clock) if len(meshes) > 2 else 0.0  # noqa: E731
    monkeypatch.setattr(level_solver, "processor_time", late)
    solution = adapt(
        example(1), 1e-9, announce=lambda *size: meshes.append(size) or (lambda _: None)
    )
    assert len(meshes) == 3 and len(solution.accuracy.elements) == 2
    assert solution.status == "not converged"
    assert "4 times the announced 5 s of processor time are over" in solution.reason
