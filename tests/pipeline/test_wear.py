"""Wear: closed forms, tables of an explicit scheme with small jumps, and what any scheme keeps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shapes import cuboid, drawn, elastic, moved, problem, rectangle, rollers, touching

from petcontact import InputError, load, read_result, solve

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

SPECIMEN = Path(__file__).parents[2] / "configs" / "fretting_specimen.toml"
NU = 0.499
LOAD = np.pi / (4.0 * (1.0 - NU**2))
"""Pi E*/4: contact on |x| < 1 for a parabola of radius 1."""


def parabola(size, order, wear, forth, back, cycle, **law):
    """A rigid parabola on a block of 40 x 20 that hardly couples, moved or drawn to and fro."""
    x = (20, 1.4, 0.6, -0.6, -1.4, -20)
    vertices = [[-20, -20], [20, -20], *([at, 0] for at in x)]
    parts = ["bottom", "right", "land", "contact", "contact", "contact", "land", "left"]
    free = {"displacement": ["free" if "force" in forth else 0.0, "free"], "force": [0.0, -LOAD]}
    law |= {"gap": "x**2/2", "wear_coefficient": wear}
    return problem(
        material=elastic(1.0, NU),
        geometry={"shape": "polygon", "vertices": vertices, "parts": parts},
        mesh={"element_size": 2.5, "element_sizes": {"contact": size}, "order": order},
        boundary=[
            moved("bottom", [0.0, 0.0]),
            *(drawn(part, [0.0, 0.0]) for part in ("right", "land", "left")),
        ],
        obstacle=[{"name": "pad", **free}],
        contact=[touching("c", "contact", "pad", **law)],
        step=[
            {"name": "press"},
            {"name": "push", "obstacle": [{"name": "pad", **forth}]},
            {"name": "pull", "obstacle": [{"name": "pad", **back}]},
        ],
        cycle={"first": "push", "last": "pull", **cycle},
    )


def gross_slip(jumps):
    """k s = 0.5 in so many jumps."""
    forth, back = ({"displacement": [along, "free"]} for along in (100.0, 0.0))
    cycle = {"count": jumps, "jump": 1}
    return solve(parabola(0.06, 0, 0.25 / jumps / 100.0, forth, back, cycle))


def partial_slip(size, order, tolerance):
    """20 of k times cycles, Q = ±0.64 µP: stick in |x| < 0.6."""
    forth, back = ({"force": [way * 0.64 * 0.4 * LOAD, -LOAD]} for way in (1.0, -1.0))
    cycle = {"count": 10_000, "jump": "auto", "tolerance": tolerance}
    law = {"friction_coefficient": 0.4}
    return solve(parabola(size, order, 20.0 / 10_000, forth, back, cycle, **law))


def middle(solution):
    """Pressure in the middle after each jump."""
    nearest = np.argsort(np.abs(solution.pairs["c"].x[:, 0]))[:2]
    return solution.wear.pressure["c"][:, nearest].mean(axis=1)


def volume(solution, name="c"):
    return solution.wear.depth[name] @ solution.pairs[name].weight


@pytest.mark.parametrize("dim", [2, 3])
def test_the_volume_is_k_times_force_times_slip_at_every_moment(dim):
    """A block between rollers under a flat pad that slides over it: p and slip are even."""
    shape = (rectangle, cuboid)[dim - 2]([0.0] * dim, [2.0, *[1.0] * (dim - 1)])
    sides = ("bottom", "left", "right") + (("front", "back") if dim == 3 else ())
    rest = [0.0] * (dim - 2)

    def pad(along, **more):
        return {"name": "pad", "displacement": [along, *rest, "free"], **more}

    solution = solve(
        problem(
            material=elastic(1.0, 0.3),
            geometry=shape,
            mesh={"element_size": 0.5 if dim == 2 else 1.0, "order": 2 if dim == 2 else 1},
            boundary=rollers(*sides),
            obstacle=[pad(0.0, force=[0.0, *rest, -0.5])],
            contact=[touching("c", "top", "pad", wear_coefficient=1e-2, wear_share=0.25)],
            step=[
                {"name": "press"},
                {"name": "push", "increments": 3, "obstacle": [pad(0.3)]},
                {"name": "pull", "obstacle": [pad(0.0)]},
            ],
            cycle={"first": "push", "last": "pull", "count": 20},
        )
    )
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


@pytest.mark.slow
def test_gross_slip_in_few_jumps():
    """p_0 of an explicit scheme in 400 jumps; five jumps against twenty in L2."""
    few, more = (gross_slip(jumps) for jumps in (5, 20))
    assert middle(few) == pytest.approx([0.6382, 0.6113, 0.5863, 0.5635, 0.5416], rel=1e-3)
    apart = few.wear.pressure["c"][-1] - more.wear.pressure["c"][-1]
    assert np.linalg.norm(apart) < 2e-3 * np.linalg.norm(more.wear.pressure["c"][-1])
    # the explicit scheme would have had to take 2.2 λ_min here, and is off by 39 %
    assert volume(few) == pytest.approx(0.1 * LOAD * few.wear.cycle, rel=1e-4)


@pytest.mark.slow
def test_partial_slip_over_cycles():
    """p(0) and V by k times cycles: constant elements of 0.03, explicit, 200 jumps."""
    table = {1: (0.68336, 0.02965), 4: (0.73382, 0.12409), 20: (0.75817, 0.17380)}
    solution = partial_slip(0.03, 0, 0.03)
    assert solution.converged and len(solution.wear.cycle) < 100
    done = solution.wear.cycle * 20.0 / 10_000
    for cycles, (pressure, worn) in table.items():
        assert np.interp(cycles, done, middle(solution)) == pytest.approx(pressure, rel=1e-2)
        assert np.interp(cycles, done, volume(solution)) == pytest.approx(worn, rel=3e-2)


@pytest.mark.slow
def test_the_limit_of_partial_slip():
    """The stick zone keeps its parabola and carries all: p = E*/2R √(c²-x²) + P_1/(π√(c²-x²))."""
    solution = partial_slip(0.06, 2, 0.1)
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


COARSE = {"cycle.count": 100, "body.0.mesh.element_sizes.contact": 0.1}


@pytest.mark.slow
def test_files_and_restart(tmp_path):
    def worn(**changes):
        return solve(load(SPECIMEN, COARSE | {k.replace("__", "."): changes[k] for k in changes}))

    first, whole = worn(cycle__count=30), worn()
    first.save(tmp_path / "half.h5")
    again = read_result(tmp_path / "half.h5")
    assert again.verdict() == first.verdict() and "cycle 30" in again.verdict()
    (name,) = first.wear.depth
    assert np.array_equal(again.wear.depth[name], first.wear.depth[name])
    assert np.array_equal(again.wear.cycle, first.wear.cycle)
    assert np.array_equal(again.pairs[name].wear, first.pairs[name].wear)
    start = str(tmp_path / "half.h5")
    on = worn(method__start=start)
    assert volume(on, name)[-1] == pytest.approx(volume(whole, name)[-1], rel=5e-3)
    assert np.all(np.diff(on.wear.cycle) > 0) and 30 in on.wear.cycle and on.steps[-1].cycle == 100
    with pytest.raises(
        InputError, match=r"half.h5 has .* worn with wear_coefficient = .*, here it"
    ):
        worn(method__start=start, contact__1__wear_coefficient=1e-2)
    # the same file once more is nothing to do
    on.save(tmp_path / "on.h5")
    once_more = worn(method__start=str(tmp_path / "on.h5"))
    assert once_more.wear.cycle.tolist() == on.wear.cycle.tolist()


@pytest.mark.parametrize("done", [1, 2, 3])
def test_cycles_go_on_from_steps_that_a_file_has_once(done, tmp_path):
    """They are those of the first cycle: later cycles left out the steps that the file had, and pull
    alone was done again and again."""
    forth, back = ({"displacement": [along, "free"]} for along in (100.0, 0.0))
    whole = parabola(0.3, 0, 1e-4, forth, back, {"count": 3, "jump": 1})
    before = whole.model_copy(update={"step": whole.step[:done], "cycle": None})
    solve(before).save(tmp_path / "before.h5")
    method = whole.method.model_copy(update={"start": str(tmp_path / "before.h5")})
    on, once = solve(whole.model_copy(update={"method": method})), solve(whole)
    assert on.wear.cycle.tolist() == [1, 2, 3] and len(on.steps) == len(once.steps)
    assert volume(on) == pytest.approx(volume(once), rel=1e-9)


def test_a_jump_that_fails_keeps_what_was_before():
    calls = []

    def monitor(state):
        calls.append(state.where)
        late = len(calls) > 50 and "step 2 (pull), load factor 0." in state.where
        return "enough" if late else None

    solution = solve(load(SPECIMEN, COARSE), monitor=monitor)
    assert solution.status == "failed" and solution.reason.startswith("enough")
    assert "cycle" in calls[-1]
    assert solution.last.cycle == solution.wear.cycle[-1] > 1
