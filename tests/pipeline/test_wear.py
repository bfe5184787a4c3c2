"""Wear: closed forms, tables of an explicit scheme with small jumps, and what any scheme keeps."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest
from shapes import cuboid, drawn, elastic, moved, rectangle, touching

from petcontact import InputError, read_result, solve
from petcontact.model.case import parse_problem

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

NU = 0.499
LOAD = np.pi / (4.0 * (1.0 - NU**2))
"""Pi E*/4: contact on |x| < 1 for a parabola of radius 1."""
FRICTION, STROKE = 0.4, 100.0


def parabola(size, order, wear, cycle, *, shear=None, width=1.4, **changes):
    """A rigid parabola on a block of 40 x 20 that hardly couples; it is moved to and fro by STROKE,
    or drawn by ± shear."""
    x = (20, width, 0.6, -0.6, -width, -20)
    vertices = [[-20, -20], [20, -20], *([at, 0] for at in x)]
    parts = ["bottom", "right", "land", "contact", "contact", "contact", "land", "left"]
    forth = {"displacement": [STROKE, "free"]} if shear is None else {"force": [shear, -LOAD]}
    back = {"displacement": [0.0, "free"]} if shear is None else {"force": [-shear, -LOAD]}
    pad = {"displacement": [0.0 if shear is None else "free", "free"], "force": [0.0, -LOAD]}
    return parse_problem(
        {
            "material": elastic(1.0, NU),
            "geometry": {"shape": "polygon", "vertices": vertices, "parts": parts},
            "mesh": {"element_size": 2.5, "element_sizes": {"contact": size}, "order": order},
            "boundary": [
                moved("bottom", [0.0, 0.0]),
                *(drawn(part, [0.0, 0.0]) for part in ("right", "land", "left")),
            ],
            "obstacle": [{"name": "pad", **pad}],
            "contact": [
                touching(
                    "c",
                    "contact",
                    "pad",
                    gap="x**2/2",
                    wear_coefficient=wear,
                    **{} if shear is None else {"friction_coefficient": FRICTION},
                )
            ],
            "step": [
                {"name": "press"},
                {"name": "push", "obstacle": [{"name": "pad", **forth}]},
                {"name": "pull", "obstacle": [{"name": "pad", **back}]},
            ],
            "cycle": {"first": "push", "last": "pull", **cycle},
        },
        "test",
        changes,
        Path(),
    )


@functools.cache
def partial_slip(size, order, count, jump, tolerance=0.02):
    """20 of k times cycles, Q = ±0.64 µP: stick in |x| < 0.6."""
    cycle = {"count": count, "jump": jump, "tolerance": tolerance}
    return solve(parabola(size, order, 20.0 / count, cycle, shear=0.64 * FRICTION * LOAD))


def volume(solution, name="c"):
    return solution.wear.depth[name] @ solution.pairs[name].weight


def middle(solution):
    """Pressure in the middle after each jump."""
    return solution.wear.pressure["c"][:, np.argsort(np.abs(solution.pairs["c"].x[:, 0]))[:2]].mean(
        axis=1
    )


def confined(wear, cycles=20, dim=2, **changes):
    """A block between rollers under a flat pad that slides over it: p and slip are even."""
    shape = (rectangle, cuboid)[dim - 2]([0.0] * dim, [2.0, *[1.0] * (dim - 1)])
    sides = ("left", "right") if dim == 2 else ("left", "right", "front", "back")
    rest = [0.0] * (dim - 2)

    def pad(along, **more):
        return {"name": "pad", "displacement": [along, *rest, "free"], **more}

    tables = {
        "material": elastic(1.0, 0.3),
        "geometry": shape,
        "mesh": {"element_size": 0.5 if dim == 2 else 1.0, "order": 2 if dim == 2 else 1},
        "boundary": [{"part": part, "condition": "symmetry"} for part in ("bottom", *sides)],
        "obstacle": [pad(0.0, force=[0.0, *rest, -0.5])],
        "contact": [touching("c", "top", "pad", wear_coefficient=wear, wear_share=0.25)],
        "step": [
            {"name": "press"},
            {"name": "push", "obstacle": [pad(0.3)]},
            {"name": "pull", "obstacle": [pad(0.0)]},
        ],
        "cycle": {"first": "push", "last": "pull", "count": cycles},
    }
    return parse_problem(tables, "test", changes, Path())


@pytest.mark.parametrize("dim", [2, 3])
def test_the_volume_is_k_times_force_times_slip_at_every_moment(dim):
    solution = solve(confined(1e-2, dim=dim, **{"step.1.increments": 3}))
    assert solution.converged and solution.wear.cycle[-1] == 20
    assert volume(solution) == pytest.approx(1e-2 * 0.5 * 0.6 * solution.wear.cycle, rel=1e-12)
    pair = solution.pairs["c"]
    assert pair.worn_volume == pytest.approx(
        1e-2 * 0.5 * 0.6 * 20 * np.array([0.25, 0.75]), rel=1e-12
    )
    first = [step.pairs["c"].worn_volume.sum() for step in solution.steps[:4]]
    assert first == pytest.approx(1e-2 * 0.5 * np.array([0.0, 0.1, 0.2, 0.3]), rel=1e-12, abs=1e-16)
    # an even depth lets the pad down and changes nothing else
    assert np.ptp(pair.pressure) < 1e-12
    assert solution.last.obstacles["pad"].displacement[-1] == pytest.approx(
        solution.steps[0].obstacles["pad"].displacement[-1] - pair.worn_depth, rel=1e-12
    )


"""p(0) and V by k times cycles: constant elements of 0.03, explicit, 200 jumps."""


@pytest.mark.slow
def test_the_limit_of_partial_slip():
    """The stick zone keeps its parabola and carries all: p = E*/2R √(c²-x²) + P_1/(π√(c²-x²))."""
    solution = partial_slip(0.06, 2, 10_000, "auto", 0.1)
    c, modulus, pair = 0.6, 1.0 / (1.0 - NU**2), solution.pairs["c"]
    rest = LOAD - 0.25 * np.pi * modulus * c**2
    x, depth = np.abs(pair.x[:, 0]), pair.wear.sum(axis=1)
    inside = x < 0.9 * c
    root = np.sqrt(c**2 - x[inside] ** 2)
    exact = 0.5 * modulus * root + rest / (np.pi * root)
    assert np.linalg.norm(pair.pressure[inside] - exact) < 5e-3 * np.linalg.norm(exact)
    assert middle(solution)[-1] == pytest.approx(0.75455, rel=3e-3)
    assert volume(solution)[-1] == pytest.approx(0.16862, rel=1e-2)
    assert x[depth > 1e-3].max() == pytest.approx(1.2457, abs=0.06) and depth[x < c].max() < 1e-4


@pytest.mark.slow
def test_files_and_restart(tmp_path):
    problem = parabola(0.3, 0, 2.0 / 100, {"count": 100}, shear=0.64 * FRICTION * LOAD)
    half = problem.model_copy(update={"cycle": problem.cycle.model_copy(update={"count": 30})})
    first, whole = solve(half), solve(problem)
    first.save(tmp_path / "half.h5")
    again = read_result(tmp_path / "half.h5")
    assert again.verdict() == first.verdict() and "cycle 30" in again.verdict()
    assert np.array_equal(again.wear.depth["c"], first.wear.depth["c"])
    assert np.array_equal(again.wear.cycle, first.wear.cycle)
    assert np.array_equal(again.pairs["c"].wear, first.pairs["c"].wear)
    method = problem.method.model_copy(update={"start": str(tmp_path / "half.h5")})
    on = solve(problem.model_copy(update={"method": method}))
    assert [step.cycle for step in on.steps] == [0, 1, 1, 30, 30, 100, 100]
    assert volume(on)[-1] == pytest.approx(volume(whole)[-1], rel=5e-3)
    assert np.all(np.diff(on.wear.cycle) > 0) and 30 in on.wear.cycle
    other = problem.contact[0].model_copy(update={"wear_coefficient": 1e-2})
    with pytest.raises(
        InputError, match=r"half.h5 has c worn with wear_coefficient = .*, here it is 0.01"
    ):
        solve(problem.model_copy(update={"method": method, "contact": (other,)}))
    # the same file once more is nothing to do
    on.save(tmp_path / "on.h5")
    method = problem.method.model_copy(update={"start": str(tmp_path / "on.h5")})
    assert (
        solve(problem.model_copy(update={"method": method})).wear.cycle.tolist()
        == on.wear.cycle.tolist()
    )


def test_a_jump_that_fails_keeps_what_was_before():
    calls = []

    def monitor(state):
        calls.append(state.where)
        return (
            "enough" if len(calls) > 60 and "step 2 (push), load factor 0." in state.where else None
        )

    problem = parabola(0.2, 0, 2.0 / 300, {"count": 300}, shear=0.64 * FRICTION * LOAD)
    solution = solve(problem, monitor=monitor)
    assert solution.status == "failed" and solution.reason.startswith("enough")
    assert "cycle" in calls[-1]
    assert solution.last.cycle == solution.wear.cycle[-1] > 1
