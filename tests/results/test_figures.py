"""Figures: units on the axes, whole titles, nothing hidden, and what Newton's history shows."""

from __future__ import annotations

import base64
import io
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from examples import example
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Annotation

from petcontact import MeshOptions, Problem, load, solve
from petcontact.contact.law_protocol import OPEN, STICK
from petcontact.fields.boundary.places import best_places
from petcontact.given.tables.units import Units
from petcontact.mesh.curve_building import build_mesh
from petcontact.model.shapes.plane import Rectangle
from petcontact.results.figures import curves, plane_figures
from petcontact.results.figures.finite import end_at_corners
from petcontact.results.figures.hoop import hoop_stress
from petcontact.results.figures.outline_curves import outlines
from petcontact.results.figures.plots import drawings
from petcontact.results.figures.stress_figure import draw_von_mises
from petcontact.results.figures.surroundings import evenly
from petcontact.results.figures.view import view_of
from petcontact.results.hdf5 import write_solution
from petcontact.results.numbers.number import Number
from petcontact.results.records import ObstacleResult
from petcontact.results.solution import read_result
from petcontact.runtime.figure_style import name_what_is_seen, png

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"
COARSE = MeshOptions(element_size=0.4)


@pytest.fixture(scope="module")
def solution():
    case = example(1, mesh=COARSE, name="semismooth-newton", rule=None)
    return solve(case.model_copy(update={"units": Units(length="mm", stress="N/mm²")}))


@pytest.fixture(scope="module")
def plate():
    return solve(load(CONFIGS / "gallery_plate.toml", {"mesh.element_size": 0.5}))


def drawn(draw, solution):
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    draw(figure, solution)
    return figure


def test_newtons_history_shows_residuals_and_the_set(solution, tmp_path):
    assert solution.last.history.exchanged[-1] == 0
    assert len(solution.last.history.exchanged) == solution.iterations
    left, right = drawn(curves.draw_history, solution).axes
    assert right.get_title() == "active sets"
    assert np.array_equal(right.lines[0].get_ydata(), solution.last.history.exchanged)
    assert not left.lines[0].get_ydata()[-1] > 1e-12
    write_solution(tmp_path / "r.h5", solution)
    assert read_result(tmp_path / "r.h5").last.history == solution.last.history
    left, right = drawn(curves.draw_history, solve(example(1, mesh=COARSE))).axes
    assert right.get_title() == "Robin parameter [consistent units]" and len(left.lines) == 3


def test_a_title_says_what_is_no_result(solution):
    """A limit load ends the steps; what came before it has converged and is drawn as such."""
    failed = replace(solution.last, status="not converged")
    limit = replace(solution, status="not converged", failed=failed)
    assert "solved up to load factor 1 of step" in curves.headed(limit)
    for without in (replace(limit, steps=[]), replace(solution, status="not converged")):
        assert "not converged: no result" in curves.headed(without)


def test_a_path_that_returns_has_a_hysteresis(solution):
    """Slip of all nodes grows from step to step, or turns back."""
    ((name, pair),) = solution.pairs.items()

    def stepped(*slips):
        pairs = [replace(pair, slip=np.full_like(pair.slip, slip)) for slip in slips]
        return replace(solution, steps=[replace(solution.last, pairs={name: p}) for p in pairs])

    assert "hysteresis" in drawings(stepped(1.0, 2.0, -1.0))
    assert "hysteresis" not in drawings(stepped(1.0, 2.0, 3.0))


def test_a_single_curve_has_its_symbol_and_axes_have_their_units(solution):
    axes = drawn(plane_figures.draw_displacement, solution).axes[0]
    assert axes.get_xlabel() == "arc length along bottom [mm]"
    assert axes.get_ylabel() == "tangential displacement [mm]"
    assert axes.lines[0].get_label() == "$u_t$"


def test_a_view_that_is_wanted_has_its_magnification_and_holds_the_body(solution):
    view = view_of(solution, factor=7.0)
    axes = drawn(partial(plane_figures.draw_deformed, view=view), solution).axes[0]
    low, high = np.transpose([axes.get_xlim(), axes.get_ylim()])
    assert np.all(low < view.low) and np.all(high > view.high)
    assert view.text == "displacements × 7"


def test_the_moment_on_an_obstacle_is_drawn_over_its_rotation(solution):
    """And no panel for a displacement that it does not have."""
    still = ObstacleResult(np.zeros(2), 0.0, np.zeros(2), 0.0)
    turned = [replace(still, rotation=-angle, moment=-7.0 * angle) for angle in (0.1, 0.2)]
    steps = [replace(solution.last, obstacles={"plug": each}) for each in turned]
    (axes,) = drawn(curves.draw_motion, found := replace(solution, steps=steps)).axes
    path = np.array([[0.0, 0.0], [-0.1, -0.7], [-0.2, -1.4]])
    assert axes.lines[0].get_xydata() == pytest.approx(path)
    assert "motion" in drawings(found) and "motion" not in drawings(solution)


def test_the_way_of_a_motion_is_named(solution):
    moved = ObstacleResult(np.array([-0.03, -0.04]), 0.0, np.array([0.0, -5.0]), 0.0)
    steps = [replace(solution.last, obstacles={"plug": moved})]
    (axes,) = drawn(curves.draw_motion, replace(solution, steps=steps)).axes
    assert axes.lines[0].get_label() == "plug along (0.6, 0.8)"
    assert axes.lines[0].get_xydata()[1] == pytest.approx([-0.05, -4.0])


def test_a_gap_of_round_off_is_none_and_a_cut_curve_has_room_at_its_peak(solution):
    name, pair = next(iter(solution.last.pairs.items()))
    closed = replace(pair, gap=1e-21 * np.arange(len(pair.gap)))
    step = replace(solution.last, pairs={name: closed})
    axes = drawn(plane_figures.draw_gap, replace(solution, steps=[step])).axes[0]
    assert not axes.lines[0].get_ydata().any()
    endless, axes = np.ones(len(pair.gap)), Figure().subplots()
    endless[0] = -100.0
    end_at_corners(axes, solution, name, [endless])
    assert axes.texts and axes.get_ylim()[0] > -2.0 and axes.get_ylim()[1] > 1.05


def test_colours_reach_to_the_largest_stress_away_from_where_it_has_no_bound(solution):
    """The numbers say at which corner that is; stress is told at 0.4 from it."""
    corner, sides = np.array([0.0, 4.0]), "left and top"
    end = "body", 0, 0, np.array([np.inf]), "stress", 0.0, np.inf, 0.0
    endless = Number(f"von Mises stress at {sides} (0, 4)", *end, corner, sides, corner)
    solution.__dict__["numbers"] = [endless]
    image = drawn(draw_von_mises, solution).axes[0].collections[0]
    state = solution.boundary_state()[1]
    assert image.get_clim()[1] < 0.9 * state.von_mises.max()
    (caption,) = drawn(draw_von_mises, solution).findobj(Annotation)
    assert "where stress has no bound" in caption.get_text()
    del solution.__dict__["numbers"]


def test_a_caption_stands_below_the_legend_and_flat_axes_have_room(plate):
    figure = drawn(draw_von_mises, plate)
    figure.draw_without_rendering()
    (caption,), legend = figure.findobj(Annotation), figure.axes[0].get_legend()
    assert caption.get_window_extent().y1 < legend.get_window_extent().y0
    axes = figure.axes[0]
    axes.set(xlim=(0.0, 100.0), ylim=(0.0, 1.0))
    plane_figures.fit_height(figure, axes, beside=1.0, above=1.0)
    assert np.ptp(axes.get_ylim()) * 6.0 / 100.0 == pytest.approx(plane_figures.LOWEST)


def test_a_legend_names_what_lies_within_the_axes():
    axes = Figure().add_subplot()
    axes.plot([0.0, 1.0], [0.0, 1.0], "--", color="0.5")
    axes.plot([], [], "--", color="0.5", label="initial")
    axes.plot([5.0], [5.0], "o", label="roller")
    axes.fill([4.0, 6.0, 6.0], [4.0, 4.0, 6.0], label="obstacle")
    axes.set(xlim=(0.0, 2.0), ylim=(0.0, 2.0))
    name_what_is_seen(axes)
    assert axes.get_legend_handles_labels()[1] == ["initial"]


def test_a_contact_of_one_node_is_shown_with_its_neighbours():
    state, s = np.array([OPEN, STICK, OPEN, OPEN]), np.array([0.0, 1.0, 3.0, 9.0])
    axes = Figure().add_subplot()
    plane_figures._window(axes, [SimpleNamespace(state=state, arc_length=s)])
    assert axes.get_xlim() == (0.0, 3.0)


def test_outlines_run_round_over_elements_of_mixed_orders():
    square = Rectangle(lower_left=(0.0, 0.0), upper_right=(2.0, 2.0)).outline()
    orders = [np.array(side) for side in ([2, 0, 1], [1, 0, 3], [1, 1, 0, 2], [4])]
    mesh = build_mesh(square, [np.linspace(0.0, 1.0, len(side) + 1) for side in orders], orders)
    ((initial, deformed),) = outlines(mesh, mesh.x, 0.5)  # grows by half: area 9
    for curve, area in ((initial, 4.0), (deformed, 9.0)):
        (x, y), (x_after, y_after) = curve[:-1].T, curve[1:].T
        assert 0.5 * np.sum(x * y_after - x_after * y) == pytest.approx(area, rel=1e-12)


def test_the_stress_along_the_boundary_of_a_ring_is_its_hoop_stress():
    from verification.test_exact_solutions import METHOD, STEEL, TUBE, Lame

    ring = solve(
        Problem(
            material=STEEL,
            geometry=Lame.body,
            mesh=MeshOptions(element_size=0.2, order=3),
            boundary=Lame.boundary,
            method=METHOD,
        )
    )
    element, place = best_places(ring.mesh)
    r = np.hypot(*ring.mesh.at(element, place)[0].T)
    radial, around = TUBE.stress(r)
    arc = ring.mesh.curvature[element] != 0.0
    state = ring.body_fields().on_boundary(element, place)
    hoop = hoop_stress(ring.mesh, element, place, state)
    assert np.abs(hoop - np.where(arc, around, radial)).max() < 1e-4 * around.max()


def test_values_along_a_curve_are_even_on_a_graded_mesh():
    s = 4.0 * np.linspace(0.0, 1.0, 40) ** 3
    even = evenly(np.column_stack([s, 0.0 * s, 2.0 * s]), 0.5)
    assert np.allclose(even[:, 0], np.arange(9) * 0.5) and np.allclose(even[:, 2], 2 * even[:, 0])


def test_a_picture_holds_the_names_of_axes_in_space():
    def draw(figure, away):
        figure.add_subplot(projection="3d").set_zlabel("z", labelpad=away)

    wide = [imread(io.BytesIO(base64.b64decode(png(draw, a)))).shape[1] for a in (0.0, 60.0, 120.0)]
    assert wide[0] < wide[1] < wide[2]
