"""A step that ends where a whole contact slips, against loads that are known."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import h5py
import pytest

from petcontact import (
    Body,
    BoundaryChange,
    Box,
    Contact,
    Displacement,
    InputError,
    Material,
    MeshOptions,
    Method,
    Pair,
    Problem,
    Rectangle,
    Step,
    Traction,
    read_result,
    solve,
)
from petcontact.contact.state import ContactState
from petcontact.pipeline.eliminate import _increments
from petcontact.pipeline.pose.discretise import discretise
from petcontact.pipeline.steps.increment import Increment, Monitor

MATERIAL = Material(1000.0, 0.3)
GROUND = Contact("bottom", normal="unilateral", friction_coefficient=0.3)
WEIGHT, PUSH = 4.0, 2.0


def block(steps: list[Step], ground: Contact = GROUND, **more: Any) -> Problem:
    free = [Traction(part, (0.0, 0.0)) for part in ("left", "right")]
    return Problem(
        material=MATERIAL,
        geometry=Rectangle((0, 0), (4, 1)),
        mesh=MeshOptions(element_size=0.25),
        boundary=[ground, Traction("top", (0.0, -1.0)), *free],
        step=steps,
        **more,
    )


def pushed(share: float = 1.0, **more: Any) -> Step:
    return Step("push", boundary=[BoundaryChange("left", value=(share * PUSH, 0.0))], **more)


@pytest.mark.parametrize("method", ["semismooth-newton", "projection"])
def test_a_block_that_is_pushed_slides_at_mu_times_its_weight(method: str, tmp_path: Path) -> None:
    back = Step("back", boundary=[BoundaryChange("left", value=(0.0, 0.0))])
    solution = solve(
        block([Step("press"), pushed(until="sliding"), back], method=Method(name=method))
    )
    assert solution.converged
    (reached,) = [step for step in solution.steps if step.sliding]
    assert reached.load_factor == pytest.approx(0.3 * WEIGHT / PUSH, rel=2e-4)
    assert reached.sliding == "bottom"
    assert -reached.pairs["bottom"].force[0] == pytest.approx(0.3 * WEIGHT, rel=2e-4)
    # the search leaves a share of the load, which the error of the force has
    (force,) = (each for each in solution.numbers["force"] if each.step == 2)
    assert abs(-force.value[0] - 0.3 * WEIGHT) <= force.error
    # the next step begins at the loads that were reached
    assert solution.last.ends
    assert solution.last.pairs["bottom"].force == pytest.approx((0.0, WEIGHT), abs=1e-6)
    said = solution.verdict()
    assert "slips as a whole" in said and re.search(r"2 push .*\b100 % +100 %", said)
    two = {each.name: each for each in solution.numbers if each.step == 2 and each.unit == "area"}
    slips, area = two["slipping"], two["contact area"]
    assert (slips.value, slips.error) == (area.value, area.error)
    solution.save(tmp_path / "block.h5")
    with h5py.File(tmp_path / "block.h5") as file:
        ends = [step.attrs for step in file["steps"].values() if "sliding" in step.attrs]
        assert ends[0]["load_factor"] == reached.load_factor
    again = read_result(tmp_path / "block.h5")
    assert [step.sliding for step in again.steps] == [step.sliding for step in solution.steps]


def test_under_a_motion_the_load_is_that_at_which_the_last_node_slips() -> None:
    by = BoundaryChange("left", value=(0.004, "free"))
    free = Step("press"), Step("push", boundary=[by], until="sliding")
    problem = block(list(free))
    held = [c for c in problem.body[0].boundary if c.part != "left"]
    body = problem.body[0].model_copy(
        update={"boundary": (*held, Displacement("left", (0.0, "free")))}
    )
    solution = solve(problem.model_copy(update={"body": (body,)}))
    assert solution.converged
    assert 0.1 < solution.last.load_factor < 1.0
    assert abs(solution.last.pairs["bottom"].force[0]) == pytest.approx(0.3 * WEIGHT, rel=2e-4)


def test_the_error_of_an_iteration_does_not_end_the_search() -> None:
    """Where all of a ring slipped, at 0.309, a residual of 5e-6 passed for friction that is left."""
    ring = Problem(
        symmetry="axial",
        material=Material(9400.0, 0.04),
        geometry=Rectangle((1.0, 0.0), (3.35, 1.9)),
        mesh=MeshOptions(element_size=0.15, order=2),
        boundary=[
            Contact("bottom", friction_bound=5.25),
            Displacement("top", ("free", -0.0049)),
            Traction("right", (2.6, 0.0)),
            Traction("left", (0.0, 0.0)),
        ],
        step=[Step(), Step(boundary=[BoundaryChange("right", value=(21.0, 0.0))], until="sliding")],
    )
    ways = ("semismooth-newton", "projection")
    reached = [solve(ring, method=Method(name=way)).last.load_factor for way in ways]
    assert reached[1] == pytest.approx(reached[0], rel=2e-4)


def test_a_hub_is_pushed_off_by_mu_times_the_pressure_of_its_fit() -> None:
    shaft = Body(
        "shaft",
        MATERIAL,
        Rectangle((0.0, 0.0), (1.0, 6.0)),
        MeshOptions(element_size=0.25),
        (Displacement("bottom", (0.0, 0.0)),),
    )
    hub = Body(
        "hub",
        MATERIAL,
        Rectangle((1.0, 2.0), (2.0, 4.0)),
        MeshOptions(element_size=0.25),
        (Traction("bottom", (0.0, 0.0)),),
    )
    fit = Pair("fit", "hub.left", "shaft.right", friction_coefficient=0.1, interference=0.001)
    off = Step("off", boundary=[BoundaryChange("bottom", body="hub", value=(0.0, 1.0))])
    problem = Problem(
        symmetry="axial",
        body=[shaft, hub],
        contact=[fit],
        step=[Step("fit"), off.model_copy(update={"until": "sliding"})],
    )
    solution = solve(problem)
    assert solution.converged
    assert solution.last.sliding == "fit"
    pair = solution.last.pairs["fit"]
    assert abs(pair.force[1]) == pytest.approx(0.1 * float(pair.weight @ pair.pressure), rel=2e-4)


def test_all_loads_act_where_nothing_slides() -> None:
    solution = solve(block([Step("press"), pushed(0.1, until="sliding")]))
    assert solution.converged
    assert solution.last.load_factor == 1.0
    assert "no contact slips as a whole" in solution.verdict()


def test_a_limit_load_is_named() -> None:
    solution = solve(block([Step("press"), pushed()]))
    assert not solution.converged
    assert 'until = "sliding"' in solution.reason
    assert "near the limit load" in solution.reason


def test_the_search_ends_where_nothing_holds_any_load() -> None:
    lifted = Step("lift", until="sliding", boundary=[BoundaryChange("top", value=(0.0, 1.0))])
    solution = solve(block([lifted]))
    assert "cannot be held: the load pushes it along +y" in solution.reason


@pytest.mark.parametrize(
    ("steps", "more", "message"),
    [
        ([pushed(until="sliding")], {"ground": Contact("bottom", friction_bound=None)}, "friction"),
        (
            [Step("press"), pushed(until="sliding"), pushed(until="sliding"), Step("end")],
            {},
            "have it both",
        ),
        ([Step("press"), pushed(until="sliding"), Step("end")], {}, "let it grow on: give 'left'"),
        ([pushed(until="sliding"), Step("end")], {}, "all loads grow in the first step"),
    ],
)
def test_what_is_refused(steps: list[Step], more: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as info:
        block(steps, **more)
    assert "until" in str(info.value)


def test_an_unknown_word_is_refused() -> None:
    with pytest.raises(InputError, match="until: must be 'sliding', got 'slip'"):
        Step("push", until="slip")


def test_in_space_a_force_pushes_until_all_shear_points_against_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All nodes slip at 0.86 of that load, in directions that differ. Loads beyond it, which take
    longest, are hardly tried; the announced time counts all that are."""
    held, solved = list[bool](), Increment.solved

    def noted(self: Increment, monitor: Monitor | None) -> ContactState:
        outcome = solved(self, monitor)
        held.append(outcome.converged)
        return outcome

    monkeypatch.setattr(Increment, "solved", noted)
    sides = [Traction(part, (0.0, 0.0, 0.0)) for part in ("left", "right", "front", "back")]
    push = BoundaryChange("left", value=(3.0, 0.0, 0.0))
    solution = solve(
        Problem(
            material=MATERIAL,
            geometry=Box((0.0, 0.0, 0.0), (2.0, 2.0, 1.0)),
            mesh=MeshOptions(element_size=1.0, order=1),
            boundary=[GROUND, Traction("top", (0.0, 0.0, -1.0)), *sides],
            step=[Step("press"), Step("push", boundary=[push], until="sliding")],
        )
    )
    assert solution.converged
    assert solution.last.sliding == "bottom"
    assert solution.last.load_factor == pytest.approx(0.3 * 4.0 / 6.0, rel=1e-3)
    assert -solution.last.pairs["bottom"].force[0] == pytest.approx(0.3 * 4.0, rel=1e-3)
    assert held.count(False) < 25
    assert (
        len(held) < 1.6 * _increments(discretise(solution.problem), costly=False) < 2.5 * len(held)
    )
