"""Whether the number of increments matters, by what another number gives."""

from __future__ import annotations

import functools
import tomllib
from contextlib import closing
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shapes import drawn, elastic, moved, problem, rectangle, touching

from petcontact import MeshOptions, solve
from petcontact.pipeline import run
from petcontact.pipeline.adapt import fixed_mesh, loop
from petcontact.pipeline.steps import path
from petcontact.pipeline.steps.start import following
from petcontact.results.numbers.path_errors import path_errors

pytestmark = pytest.mark.usefixtures("unsampled")


@functools.cache
def pressed(gap, increments, friction=0.3):
    """A rigid roller or plate on a block, in one step with the pair of the contact at its end."""
    law = {"gap": gap, "friction_coefficient": friction}
    return solve(
        problem(
            material=elastic(1.0, 0.3),
            geometry=rectangle([-3.0, -3.0], [3.0, 0.0]),
            mesh={"element_size": 1.0, "element_sizes": {"top": 0.06}, "order": 1},
            boundary=[
                moved("bottom", [0.0, 0.0]),
                *(drawn(part, [0.0, 0.0]) for part in ("left", "right")),
            ],
            obstacle=[{"name": "tool", "displacement": [0.0, -0.06]}],
            contact=[touching("pair", "top", "tool", **law)],
            step=[{"name": "press", "increments": increments}] if increments else [],
        )
    )


def warned(solution):
    """Shares of q that are reported."""
    assert solution.converged
    texts = [text for text in solution.warnings if "depends on the path" in text]
    return [float(text.split("differs by ")[1].split("%")[0]) / 100.0 for text in texts]


def test_one_increment_in_which_a_contact_grows_is_reported_with_about_its_error():
    one, exact = (pressed("x**2/8", increments) for increments in (1, 16))
    pair, other = one.pairs["pair"], exact.pairs["pair"]
    off = np.linalg.norm(pair.weight[:, None] ** 0.5 * (pair.sigma_t - other.sigma_t))
    size = np.linalg.norm(pair.weight[:, None] ** 0.5 * other.sigma_t)
    (found,) = warned(one)
    assert warned(exact) == [] and 0.5 * off < found * size < 1.5 * off
    assert "depends on the path" in " ".join(one.verdict().split())


@pytest.mark.parametrize("method", ["projection", "operator-robin"])
def test_other_methods_take_the_increments_of_newton(method):
    """Other paths are those of the problem. A disc in a bore was solved in one increment by
    operator-robin, for nearly a minute, and its slip was off by 5 times without a word."""
    bore = {"name": "bore", "shape": "circle", "centre": [0.0, 0.0], "radius": 1.01}
    table = {
        "material": elastic(1000.0, 0.3),
        "geometry": {
            "shape": "outline",
            "loops": [{"part": "rim", "center": [0.0, 0.0], "radius": 1.0}],
        },
        "mesh": {"element_size": 0.2, "order": 2},
        "boundary": [],
        "obstacle": [bore | {"hollow": True}],
        "point_force": [{"at": [0.0, 0.3], "force": [0.5, -5.0]}],
        "contact": [touching("pair", "rim", "bore", friction_coefficient=0.3)],
    }
    newton, other = (
        solve(problem(**table, method={"name": name})) for name in ("semismooth-newton", method)
    )
    assert len(other.steps) == len(newton.steps) == 16
    assert other.accuracy.path == pytest.approx(newton.accuracy.path)
    assert other.accuracy.error == pytest.approx(newton.accuracy.error, rel=1e-3)
    one, two = newton.pairs["pair"], other.pairs["pair"]
    assert np.abs(one.sigma_t - two.sigma_t).max() < 1e-3 * np.abs(one.sigma_t).max()


def test_a_step_that_names_no_increments_takes_as_many_as_it_needs():
    """A block on its sliding bottom wears: p = (d E/H) exp(-k E s/H), .1353 after k E s/H = 2. Half
    of it is missed in one increment, and the coarser meshes have one."""
    bottom = {"part": "bottom", "condition": "contact", "normal": "unilateral"}
    block = problem(
        material=elastic(100.0, 0.0),
        geometry=rectangle([0, 0], [1, 1]),
        boundary=[
            moved("top", [0.0, -0.01]),
            {**bottom, "wear_coefficient": 0.4},
            *(drawn(side, [0, 0]) for side in ("left", "right")),
        ],
        step=[
            {"name": "press"},
            {"name": "slide", "boundary": [{"part": "top", "value": [0.05, -0.01]}]},
        ],
    )
    solution = loop.adapt(block, 5e-2)
    assert solution.converged and not warned(solution)
    ends = {number.name: number for number in solution.numbers if number.step == 2}
    for name, right in (("largest p", np.exp(-2.0)), ("worn volume", 0.01 * (1 - np.exp(-2.0)))):
        off = abs(float(ends[name].value[0]) - right)
        assert off <= ends[name].error < 0.05 * right


def test_a_step_that_names_no_increments_takes_more_until_they_are_enough():
    """Six leave an error of 6.8e-2, twelve of 3.6e-2."""
    roller = pressed("x**2/8", None).problem
    tool = roller.obstacle[0].model_copy(update={"displacement": (0.015, -0.06)})
    body = roller.body[0].model_copy(update={"mesh": MeshOptions()})
    solution = loop.adapt(roller.model_copy(update={"obstacle": (tool,), "body": (body,)}), 5e-2)
    assert solution.converged and not warned(solution) and len(solution.steps) > 6


def test_what_moves_before_bodies_touch_is_no_slip():
    """Two increments, of which the first closes no gap, agree with one: only what follows after the
    first touch tells."""
    once, many, auto = (pressed("x**2/8 + 0.05", count) for count in (1, 64, "auto"))
    shear = [found.pairs["pair"].sigma_t for found in (once, auto, many)]
    size = np.linalg.norm(shear[2])
    assert np.linalg.norm(shear[0] - shear[2]) > 0.15 * size
    assert np.linalg.norm(shear[1] - shear[2]) < 0.05 * size
    work = [sum(step.pairs["pair"].dissipated for step in found.steps) for found in (once, many)]
    assert auto.converged and len(auto.steps) > 5 and work[0] > 1.5 * work[1]
    before = auto.steps[0]  # the nodes nearest to the middle are a little off it
    begins, first, last = 0.05 / 0.06, before.pairs["pair"], auto.pairs["pair"]
    assert begins < before.load_factor < begins + 0.06
    assert first.pressure.max() < 1e-12 * last.pressure.max()


@pytest.mark.parametrize(("gap", "friction"), [(0.0, 0.3), ("x**2/8", None)])
def test_flat_faces_and_those_without_friction_need_one(gap, friction):
    assert warned(pressed(gap, None, friction)) == []


def test_a_contact_that_grows_from_nothing_takes_increments_until_q_is_known():
    """q of a roller that is pressed, without and with named increments, against 128 that grow with
    the contact (as (k/n)² of the load). One increment leaves 5 % of p."""
    posed = pressed("x**2/8", None)
    (result,), pair = (posed.tracked or posed).paths, posed.pairs["pair"]
    assert len(posed.steps) > len(result.steps) and posed.accuracy.path < 1e-2 and not warned(posed)
    prepared = run.prepare(posed.problem)
    try:
        finest = replace(prepared, factors={1: [(k / 128) ** 2 for k in range(1, 129)]})
        exact = run.unreported(finest, None).pairs["pair"]
    finally:
        prepared.close()
    off, p = (
        float(np.linalg.norm(pair.weight[:, None] ** 0.5 * values))
        for values in (pair.sigma_t - exact.sigma_t, exact.pressure[:, None])
    )
    assert off < posed.accuracy.path * p


def test_the_path_is_looked_at_on_a_coarser_mesh_where_that_resolves_the_contact(monkeypatch):
    """Errors that its increments leave are those that the mesh itself shows, or a little more.
    Where no coarser one is good enough the mesh itself is asked, not where errors are large."""
    coarse = pressed.__wrapped__("x**2/20", 8)
    monkeypatch.setattr(fixed_mesh, "RESOLVED", 0.0)
    alone = pressed.__wrapped__("x**2/20", 8)
    assert coarse.tracked is not None and alone.tracked is None and alone.paths
    for solution in (coarse, alone):
        assert [each.kind for each in solution.findings].count("path") == 1
    assert coarse.tracked.meshes["body"].n_nodes < 0.6 * alone.meshes["body"].n_nodes
    assert 0.8 < coarse.accuracy.path / alone.accuracy.path < 1.25
    found, right = (path_errors(each, each.numbers) for each in (coarse, alone))
    for name in (
        "force",
        "largest p",
        "largest q",
        "largest slip",
        "slipping",
        "dissipated energy",
    ):
        assert 1.0 < found[name, "pair", 1, 0] / right[name, "pair", 1, 0] < 4.0, name


def test_only_steps_that_add_to_the_error_are_divided_also_after_a_restart(tmp_path):
    """A roller that is pressed and then drawn along. What the first increments were is no matter:
    the rest of the step has the error that it has by itself."""
    pressing = pressed("x**2/8", None).problem
    drawn_along = {"name": "tool", "displacement": [0.005, -0.06]}
    steps = [{"name": "press"}, {"name": "draw", "obstacle": [drawn_along]}]
    table = tomllib.loads(pressing.toml()) | {"step": steps}
    whole = solve(problem(**table))
    counts = [sum(result.step == number for result in whole.steps) for number in (1, 2)]
    assert counts[0] > 10 * counts[1] and not warned(whole)
    whole.save(tmp_path / "whole.h5")
    solve(problem(**table | {"step": [steps[0] | {"increments": 1}]})).save(tmp_path / "once.h5")
    for start in ("whole.h5:2", "once.h5"):
        again = solve(problem(**table | {"method": {"start": f"{tmp_path / start}"}}))
        assert [r.load_factor for r in again.steps] == [r.load_factor for r in whole.steps]
        for one, other in zip(whole.steps, again.steps, strict=True):
            assert np.allclose(one.pairs["pair"].sigma_t, other.pairs["pair"].sigma_t, atol=1e-9)


def test_other_paths_cost_no_more_than_the_solve_or_are_not_known(monkeypatch):
    """Five increments of 2 s are within a mesh's budget of 10 s, and six only within a longer
    solve, here of 20 s more."""
    solution = pressed("x**2/8", 1)
    (step,), (mesh,) = solution.steps, solution.meshes.values()
    discrete = SimpleNamespace(posed=None, meshes=[mesh])
    joint, single = (
        SimpleNamespace(
            discrete=discrete,
            system=SimpleNamespace(bodies=[SimpleNamespace(is_solved_jointly=way)]),
        )
        for way in (True, False)
    )
    products = sum(step.history.ksp_iterations) + step.iterations * (1 + len(step.alpha))
    monkeypatch.setattr(path, "PRODUCT", 2.0 / (products * mesh.n_nodes))
    for others, problem_, most in ((0.0, joint, 5), (20.0, joint, 11), (0.0, single, 64)):
        monkeypatch.setattr(path, "posed_seconds", lambda *_, others=others: others)
        told = [path.is_affordable(problem_, solution, count) for count in (most, most + 1)]
        assert told == [True, problem_ is single]
    monkeypatch.setattr(path, "is_affordable", lambda *_: False)
    dear = pressed.__wrapped__("x**2/8", None)
    assert np.isnan(dear.accuracy.path) and "error of the path not known" in dear.verdict()


def test_a_contact_that_begins_at_once_has_no_increment_of_its_own_before():
    """Of a step in which a thousandth or less comes before contact, as between nodes."""
    solution = pressed("x**2/8 + 3e-5", 1)
    (other,) = solution.paths
    assert len(other.steps) == 4 and 0.0 < solution.accuracy.path < 0.1


def test_increments_that_were_solved_before_take_one_iteration_each():
    solution = pressed("x**2/8", 4)
    with closing(following(run.prepare(solution.problem), solution)) as prepared:
        again = run.unreported(prepared, None)
    assert (
        [step.iterations for step in again.steps]
        == [1] * 4
        < [step.iterations for step in solution.steps]
    )
    assert np.allclose(again.pairs["pair"].sigma_t, solution.pairs["pair"].sigma_t, atol=1e-9)
