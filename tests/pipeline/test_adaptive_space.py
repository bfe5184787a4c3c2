"""Adaptive meshes in space: Hertz, two blocks through load steps, surfaces from files, and what a
budget leaves."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from marks import slow
from prepared import compressed_from
from shapes import cuboid, elastic, moved, problem, solid, touching

from petcontact import InputError, Problem, adapt, solve
from petcontact.mesh.panelling import box_mesh
from petcontact.model.base import parse
from petcontact.pipeline.adapt import budget, first_mesh, level_solver
from petcontact.pipeline.adapt.budget import Budget
from petcontact.pipeline.adapt.first_mesh import FirstMeshes
from petcontact.pipeline.adapt.surfaces import PanelTails
from petcontact.pipeline.pose.interfaces import body_alone
from petcontact.pipeline.solve import adapts_itself
from petcontact.reference.half_space import elliptic_load
from petcontact.reference.hertz import elliptic
from petcontact.refinement.panels.marks import largest
from petcontact.refinement.panels.tail import Tails

SOFT = elastic(1.0, 0.3)


@functools.cache
def pressed(points: bytes):
    """Displacements at points (q, 3) of a half space below Hertz's pressure, half its radius from
    it at least: once for all meshes, and to 1e-9 with a fifth of the default's points."""
    x = np.frombuffer(points).reshape(-1, 3) * [1.0, 1.0, -1.0]
    return elliptic_load(x, 1.0, 1.0, 0.0, 0.3, 8) * [1.0, 1.0, -1.0]


def hertz(exact=False):
    """A block cut out of a half space under a rigid sphere, a = p_0 = 1, without a mesh; or one that
    its bottom holds."""

    def component(c):
        return lambda x, y, z: pressed(np.column_stack([x, y, z]).tobytes())[:, c]

    parts = ("left", "right", "front", "back", "bottom") if exact else ("bottom",)
    value = [component(c) if exact else 0.0 for c in range(3)]
    sides = [moved(part, value) for part in parts]
    block = solid("block", cuboid([-1.5] * 3, [1.5, 1.5, 0.0]), *sides)
    gap = f"{0.25 * np.pi * (1.0 - 0.3**2)}*(x**2 + y**2 - 2)"
    return {
        "body": [block],
        "obstacle": [{"name": "sphere"}],
        "contact": [touching("pair", "block.top", "sphere", gap=gap)],
    }


def true_error(solution):
    """Of the function p, relative, by points on a fine grid of the face."""
    mesh, line = solution.meshes["block"], 1.5 * (2.0 * (np.arange(60) + 0.5) / 60.0 - 1.0)
    x = np.stack([*np.meshgrid(line, line), np.zeros((60, 60))], axis=-1).reshape(-1, 3)
    numbers, faces = mesh.faces("top")
    hits = faces.cast(x - [0.0, 0.0, 1.0], np.tile([0.0, 0.0, -1.0], (len(x), 1)))
    nodes, pair = solution.nodes["pair"], solution.pairs["pair"]
    found = mesh.basis_at(numbers[hits.face], hits.place)[:, nodes] @ pair.pressure
    exact = elliptic(np.hypot(x[:, 0], x[:, 1]), 1.0)
    return np.linalg.norm(found - exact) / np.linalg.norm(exact)


@pytest.mark.slow
def test_hertz_is_solved_to_the_wanted_error_on_panels_that_follow_the_contact():
    shown = []
    solution = adapt(parse(Problem, hertz(exact=True), "hertz"), 0.15, reached=shown.append)
    error, true = solution.accuracy.error, true_error(solution)
    assert solution.converged and error <= 0.15 and 1.0 < error / true < 4.0
    assert len(solution.nodes["pair"]) <= 300 and true < 0.04
    element = solution.meshes["block"].element[solution.nodes["pair"]]
    closed = solution.pairs["pair"].pressure > 0.0
    count, some = np.bincount(element), np.bincount(element, closed)
    assert np.all((some == 0) | (some == count)), "sides of panels are the edge of contact"
    assert "0.15 wanted" in solution.verdict() or "1.5e-01 wanted" in solution.verdict()
    # each mesh is reported
    assert [each.number for each in shown] == list(range(1, len(shown) + 1)) and len(shown) > 1
    assert [each.estimate for each in shown] == solution.accuracy.estimates
    assert shown[-1].nodes == solution.meshes["block"].n_nodes
    assert shown[0].seconds < shown[1].seconds


@pytest.mark.parametrize("asked", [False, True])
def test_a_budget_ends_with_the_estimate_that_it_bought(asked, monkeypatch):
    monkeypatch.setattr(budget, "BUDGETS", {key: Budget(300, 10.0) for key in (False, True)})
    posed = problem(**hertz())
    solution = adapt(posed, 0.05) if asked else solve(posed)
    assert solution.accuracy.error > 0.05
    said = "is 300 nodes and 10 s of processor time; "
    if asked:
        assert solution.status == "not converged"
        assert f"{said}a [mesh] of your own may have more" in solution.reason
    else:
        told = f"{said}--accuracy 0.02 goes on, to at most 300 nodes"
        assert solution.converged and any(told in text for text in solution.warnings)


def failing(monkeypatch, number, status, **residuals):
    """The solve on a mesh by number, from 1 on, is not accepted; the numbers of those that were."""
    count, true_run = [], level_solver.unreported

    def run(problem, monitor):
        found = true_run(problem, monitor)
        count.append(problem.system.describe())
        if len(count) != number:
            return found
        step = replace(
            found.steps[-1], status=status, residuals={**found.steps[-1].residuals, **residuals}
        )
        return replace(found, steps=[], failed=step, status=status, reason="not accepted")

    monkeypatch.setattr(level_solver, "unreported", run)
    return count


@pytest.mark.parametrize(
    ("given", "meshes"), [slow(False, ["0.00075", "0.0001875", "0.0001875"]), (True, ["0.0001"])]
)
def test_compressed_operators_have_the_digits_that_are_asked_for_and_more_where_these_are_too_few(
    given, meshes, monkeypatch
):
    """The tolerance follows the wanted error, and falls where the elastic residual says so; a
    user's own stays."""
    made = failing(monkeypatch, 1, "failed", elastic=2e-3)
    data = hertz() | {"bem": {"mat_type": "hmatrix"} | ({"hmatrix_tol": 1e-4} if given else {})}
    solution = adapt(parse(Problem, data, "hertz"), 0.15)
    assert [text.split()[2] for text in made][:3] == meshes
    assert solution.status == ("failed" if given else "converged")


@pytest.mark.slow
def test_a_mesh_that_is_not_solved_on_leaves_the_solution_of_the_one_before(monkeypatch):
    made = failing(monkeypatch, 2, "not converged")
    solution = adapt(parse(Problem, hertz(), "hertz"), 0.05)
    assert len(made) == 2 and solution.status == "not converged"
    assert "not accepted (on the mesh after the last)" in solution.reason
    assert solution.pairs["pair"].pressure.max() > 0.9 and solution.accuracy.error < 0.5


@pytest.mark.slow
def test_a_ball_adapts_itself_and_stays_a_ball(monkeypatch):
    """A sphere of radius 1 pressed on a block on three meshes, the first one of few panels."""
    monkeypatch.setattr(first_mesh, "FIRST", 16)
    monkeypatch.setattr(first_mesh, "ROUND", 9)
    block = solid("block", cuboid([-1.0] * 3, [1.0, 1.0, 0.0]), moved("bottom", [0.0] * 3))
    sphere = {"shape": "sphere", "centre": [0.0, 0.0, 1.0], "radius": 1.0}
    body = [block, solid("ball", sphere, moved("top", [0.0, 0.0, -0.05]))]
    contact = [touching("pair", "ball.bottom", "block.top", gap="geometry")]
    posed = problem(body=body, contact=contact)
    ball = adapt(posed, 0.3)
    assert adapts_itself(posed) and ball.converged
    mesh = ball.meshes["ball"]
    points = np.concatenate([mesh.corners, mesh.middles], axis=1)
    off = np.abs(np.linalg.norm(points - [0.0, 0.0, 1.0], axis=2) - 1.0)
    # sides that hang are pieces of quadratic ones
    assert mesh.n_elements > 54 and off[:, 8].max() < 1e-14 and np.median(off) < 1e-14
    assert off.max() < 5e-4
    # Hertz: about a² = δ R, δ = .05, ∫p r² = 2/5 a² ∫p, p_0 / mean p = 3/2
    pair = ball.pairs["pair"]
    load = pair.weight * pair.pressure
    area = np.pi * 2.5 * (load @ (pair.x[:, 0] ** 2 + pair.x[:, 1] ** 2)) / load.sum()
    assert area == pytest.approx(np.pi * 0.05, rel=0.05)
    assert pair.pressure.max() * area / (pair.weight @ pair.pressure) == pytest.approx(1.5, abs=0.2)


def test_a_large_error_is_warned_of():
    data = hertz()
    data["body"][0]["mesh"] = {"element_size": 0.5, "order": 1}
    solution = solve(parse(Problem, data, "hertz"))
    assert solution.converged and solution.accuracy.error > 0.1
    assert any("the error is estimated to be" in text for text in solution.warnings)


def test_few_panels_have_no_small_error():
    """A spot on one panel: all of p is uncertain; on three, a half."""
    box = parse(Problem, hertz(), "hertz").body[0].geometry.outline()
    mesh = box_mesh(box, lambda part: 1.0, 1, 1.0)
    nodes = mesh.nodes_of("top")
    tails = Tails(mesh, nodes)
    element = np.unique(mesh.element[nodes], return_inverse=True)[1]
    for loaded, share in ((1, 1.0), (3, 0.5), (9, 0.0)):
        p = np.where(element < loaded, 1.0, 0.0)
        error = (
            tails.pressure_errors(p, p == 0.0) if loaded < 9 else tails.pressure_errors(p, p > 0.0)
        )
        weight = mesh.weight[nodes]
        assert np.sqrt(weight @ error**2 / (weight @ p**2)) == pytest.approx(share, abs=1e-12)


def test_the_fewest_panels_that_make_up_a_share_of_the_error_are_marked():
    square = np.array([1.0, 5.0, 2.0, 2.0])
    assert largest(square, 0.5).tolist() == [False, True, False, False]
    assert largest(square, 0.6).tolist() == [False, True, True, True]
    assert not largest(np.zeros(3), 0.5).any()


def test_an_accuracy_beside_a_mesh_is_refused():
    data = hertz()
    data["body"][0]["mesh"] = {"element_size": 0.5, "accuracy": 1e-2}
    with pytest.raises(InputError, match=r"mesh\.accuracy: is for adaptive meshes"):
        solve(parse(Problem, data, "hertz"))
    assert PanelTails(parse(Problem, hertz(), "hertz")).estimate == np.inf


def test_a_part_may_be_the_secondary_of_two_contacts(monkeypatch):
    """As of one whose gap is the smaller one; compressed surfaces, which do not take it, are not
    chosen for it."""
    compressed_from(10, "hmatrix", monkeypatch)
    held, mesh = moved("bottom", [0.0] * 3), {"element_size": 0.5, "order": 1}
    block = solid("block", cuboid([0.0] * 3, [1.0] * 3), held, mesh=mesh)
    gaps = {"0": "x**2 - 0.02", "1": "(x - 1)**2 - 0.02", "both": "(0.5 - abs(x - 0.5))**2 - 0.02"}
    contact = {name: touching(name, "block.top", name, gap=gap) for name, gap in gaps.items()}
    data = {"body": [block], "obstacle": [{"name": name} for name in gaps]}
    one, two = (
        solve(problem(**data, contact=[contact[name] for name in names]))
        for names in (["both"], ["0", "1"])
    )
    assert "hmatrix" in one.provenance.solver and "hmatrix" not in two.provenance.solver
    both = two.pairs["0"].pressure + two.pairs["1"].pressure
    assert both == pytest.approx(one.pairs["both"].pressure, rel=1e-3, abs=1e-3 * both.max())
    assert both.max() > 0.0


@pytest.mark.slow
def test_a_press_fit_has_an_even_pressure_on_adaptive_panels():
    """A solid pin in a ring, both held along the axis only. Lamé, plane stress: p = E δ (1/b -
    b/c²) / (2 · b) · b of equal materials, 150.2. Sides whose middles are not half way left the
    cylinder beside panels of other sizes: p scattered by a half, more on finer panels."""
    corners = {"bottom": [10, 0], "outside": [10, 10], "top": [4.99, 10], "bore": [4.99, 0]}
    ring = {
        "shape": "revolved",
        "loops": [[{"part": part, "to": to} for part, to in corners.items()]],
    }
    pin = {"shape": "cylinder", "from": [0, 0, 0], "to": [0, 0, 10], "radius": 5.0}
    bodies = [
        solid(
            name,
            shape,
            {"part": "bottom", "condition": "symmetry"},
            material=elastic(200_000.0, 0.3),
        )
        for name, shape in (("pin", pin), ("ring", ring))
    ]
    fit = touching("fit", "pin.side", "ring.bore")
    solution = adapt(problem(body=bodies, contact=[fit]), 0.02)
    pair, b, c = solution.pairs["fit"], 5.0, 10.0
    exact = 200_000.0 * 0.01 * (c**2 - b**2) / (2.0 * b * c**2)
    mean = pair.weight @ pair.pressure / pair.weight.sum()
    scatter = np.sqrt(pair.weight @ (pair.pressure / mean - 1.0) ** 2 / pair.weight.sum())
    assert solution.converged and mean == pytest.approx(exact, rel=6e-3) and scatter < 0.02
    assert sum(mesh.n_nodes for mesh in solution.meshes.values()) < 2000


def test_a_ball_smaller_than_the_panels_it_touches_is_not_overlooked():
    """No node of the first panels in contact faces it there: that was taken for no contact."""
    ball = [
        {"part": "top", "to": [0.0, 0.5]},
        {"part": "axis", "to": [0.0, 0.0]},
        {"part": "ball", "to": [0.5, 0.5], "radius": 0.5},
    ]
    shaft = {"shape": "cylinder", "from": [-2.0, 0.0, -2.0], "to": [2.0, 0.0, -2.0], "radius": 2.0}
    held = [moved(part, [0.0, 0.0, 0.0]) for part in ("bottom", "top")]
    pressed = moved("top", [0.0, 0.0, -0.005])
    ball = {"shape": "revolved", "loops": [ball]}
    bodies = [
        solid("shaft", shaft, *held, mesh={"element_size": 2.0, "order": 1}),
        solid("ball", ball, pressed, mesh={"element_size": 0.5, "order": 1}),
    ]
    pair = touching("pair", "shaft.side", "ball.ball")
    solution = solve(problem(body=bodies, contact=[pair]))
    assert solution.status == "not converged"
    assert "overlap between nodes: pair 'pair'" in solution.reason


@pytest.mark.parametrize(
    ("length", "height", "held", "order"),
    [(20, 1, "left", 2), (4, 3, "left", 1), (20, 1, "bottom", 1)],
)
def test_first_panels_of_a_body_that_bends_have_order_two(length, height, held, order):
    """A cantilever on linear panels as long as it is thick had an estimate of 1 and cycling
    sets."""
    beam = solid("beam", cuboid([0, -1, -height], [length, 1, 0]), moved(held, [0, 0, 0]))
    pair = touching("c", "beam.top", "ball", gap=f"((x-{0.9 * length})**2 + y**2)/20")
    ball = {"name": "ball", "displacement": [0, 0, -0.2]}
    posed = problem(body=[beam], obstacle=[ball], contact=[pair])
    (surface,) = posed.boundaries
    body = body_alone(posed, 0, surface)
    assert set(FirstMeshes(posed).mesh(0, body, surface, 4000).order) == {order}
