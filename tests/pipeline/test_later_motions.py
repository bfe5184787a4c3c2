"""A part or an obstacle stays where a step has left it, or moves on from there: bars whose stress is
known."""

from __future__ import annotations

import json

import numpy as np
import pytest
from problems import block, contact_pair, load_step, obstacle, posed

from petcontact import solve
from petcontact.errors import InputError

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

E, LENGTH, PULL, WAY, HEAT = 1000.0, 2.0, 4.0, 0.01, 3e-3
"""Of a bar without lateral contraction: it is pulled, held, heated (expansion times rise), and
moved on."""
STRESS = PULL, PULL - E * HEAT, PULL - E * HEAT + E * WAY / LENGTH, 0.0
TOPS = {
    "plane": ([0.0, 0.0], [1.0, LENGTH], "top"),
    "axial": ([0.0, 0.0], [1.0, LENGTH], "top"),
    "space": ([0.0, 0.0, 0.0], [1.0, 1.0, LENGTH], "top"),
}


def bar(kind: str, mesh: str = "element_size = 1.0, order = 1") -> str:
    """Pulled by a traction, held where it is and heated, moved on, and let go."""
    low, high, top = TOPS[kind]
    d = len(low)
    free, still = ["free"] * (d - 1), [0.0] * (d - 1)
    given = {top: ("traction", [*still, PULL]), "bottom": [*free, 0.0]}
    if kind != "axial":
        given["left"] = [0.0, *free]
    if kind == "space":
        given["front"] = ["free", 0.0, "free"]
    text = 'symmetry = "axial"\n' if kind == "axial" else ""
    text += block("bar", low, high, E, 0.0, mesh, **given)
    text = text.replace(
        "poisson_ratio = 0.0 }", f"poisson_ratio = 0.0, thermal_expansion = {HEAT} }}"
    )
    change = f'[[step]]\n[[step.boundary]]\npart = "{top}"\n'
    return (
        text
        + '[[step]]\nname = "pull"\n'
        + f"{change}value = {json.dumps([*free, 'hold'])}\n[[step.loads]]\ntemperature = 1.0\n"
        + f"{change}by = {json.dumps([*free, WAY])}\n"
        + f"{change}value = {json.dumps([*free, 'free'])}\n"
    )


@pytest.mark.parametrize("kind", TOPS)
def test_a_bar_is_held_where_it_was_pulled_to_and_moved_on(kind):
    solution = solve(posed(bar(kind)))
    heights = PULL * LENGTH / E + np.array([0.0, 0.0, WAY])
    top = solution.meshes["bar"].nodes_of(TOPS[kind][2])
    for step, stress in zip(solution.steps, STRESS, strict=True):
        result = step.bodies["bar"]
        assert np.allclose(result.traction[top, -1], stress, atol=1e-8 * E)
    for step, height in zip(solution.steps, heights, strict=False):
        assert np.allclose(step.bodies["bar"].u[top, -1], height, rtol=1e-8)


@pytest.mark.parametrize("kind", ["plane", "axial", "space"])
def test_a_tool_is_held_where_a_force_has_pressed_it(kind, tmp_path):
    low, high, top = TOPS[kind]
    d, force = len(low), np.pi * PULL if kind == "axial" else PULL
    still = [0.0] * (d - 1)
    text = 'symmetry = "axial"\n' if kind == "axial" else ""
    text += block("bar", low, high, E, 0.0, "element_size = 1.0, order = 1", bottom=[0.0] * d)
    text += obstacle("tool", [*still, "free"], f"force = {json.dumps([*still, -force])}")
    text += contact_pair("pad", f"bar.{top}", "tool", 0.0)
    change = '[[step]]\n[[step.obstacle]]\nname = "tool"\n'
    text += load_step("press") + change + f"displacement = {json.dumps([*still, 'hold'])}\n"
    text += change + f"by = {json.dumps([*still, -WAY])}\n"
    text += change + f"displacement = {json.dumps([*still, 'free'])}\n"
    solution = solve(posed(text))
    area = force / PULL
    forces = np.array([PULL, PULL, PULL + E * WAY / LENGTH, PULL]) * area
    found = [step.pairs["pad"].force[-1] for step in solution.steps]
    assert np.allclose(found, -forces, rtol=1e-6)
    solution.save(tmp_path / "r.h5")
    start = {"start": f"{tmp_path / 'r.h5'}:2"}
    problem = solution.problem
    again = solve(problem.model_copy(update={"method": problem.method.model_copy(update=start)}))
    assert np.allclose([step.pairs["pad"].force[-1] for step in again.steps], found, rtol=1e-9)


def test_meshes_that_adapt_hold_what_they_have_moved():
    solution = solve(posed(bar("plane", "")))
    top = solution.meshes["bar"].nodes_of("top")
    stresses = [step.bodies["bar"].traction[top, -1] for step in solution.steps]
    assert all(np.allclose(a, b, atol=1e-6 * E) for a, b in zip(stresses, STRESS, strict=True))
    # it is loaded in the first step, and held from then on
    reactions = {each.step: each.value[1] for each in solution.numbers["force on top"]}
    assert reactions == pytest.approx(dict(zip((2, 3, 4), STRESS[1:], strict=True)), abs=1e-6 * E)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ('value = ["free", 0.1]\nby = [0.0, 0.1]', r"by\[1\]: must be 0 where value\[1\] is not"),
        ('value = ["hold", "hold"]\nby = [0.0, 0.1, 0.0]', "as many components as value, 2, got 3"),
        ('value = ["hold", "hold", "hold"]', "has 2 components, got 3"),
        ("pressure = 1.0\nby = [0.0, 0.1]", "either value = .* or pressure"),
    ],
)
def test_what_cannot_go_on_is_refused(given, said):
    text = bar("plane").partition("[[step]]")[0]
    with pytest.raises(InputError, match=said):
        posed(f'{text}[[step]]\n[[step.boundary]]\npart = "top"\n{given}\n')


@pytest.mark.parametrize(
    "change", ["value = ['hold', 'hold']", "by = [0.1, 0.0]", "pressure = 1.0"]
)
@pytest.mark.parametrize(
    ("part", "told"), [("lft", "no part 'lft', did you mean 'left'"), ("bottom", "is in contact")]
)
def test_parts_that_a_step_cannot_change_are_refused(part, told, change):
    text = block("pad", [0.0, 0.0], [1.0, 1.0], mesh="element_size = 0.5", top=[0.0, -0.1])
    text += obstacle("floor", [0.0, 0.0]) + contact_pair("seat", "pad.bottom", "floor", 0.3)
    with pytest.raises(InputError, match=rf"step\[1\].boundary\[0\].part: .*{told}"):
        step = f'[[step]]\n[[step]]\n[[step.boundary]]\npart = "{part}"\n{change}\n'
        solve(posed(text + step))


def test_a_pressure_loads_a_part_that_was_free():
    """As on one with a traction of zero."""
    text = block("pad", [0.0, 0.0], [1.0, 1.0], mesh="element_size = 0.5", top=[0.0, -0.1])
    free = '[[body.boundary]]\npart = "left"\ncondition = "traction"\nvalue = [0.0, 0.0]\n'
    pair = obstacle("floor", [0.0, 0.0]) + contact_pair("seat", "pad.bottom", "floor", 0.3)
    pair += '[[step]]\n[[step]]\n[[step.boundary]]\npart = "left"\npressure = 0.01\n'
    found, wanted = (solve(posed(text + more + pair)) for more in ("", free))
    np.testing.assert_allclose(found.pairs["seat"].force, wanted.pairs["seat"].force, rtol=1e-9)
    assert abs(found.pairs["seat"].force[0]) > 1e-3
