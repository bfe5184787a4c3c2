"""Figures: units on the axes, whole titles, nothing hidden, and what Newton's history shows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot
import numpy as np
import pytest
from examples import example
from matplotlib.figure import Figure

from petcontact import (
    MeshOptions,
    Problem,
    Step,
    field_on_grid,
    load,
    solve,
)
from petcontact.commands.main import main
from petcontact.fields.boundary.places import best_places
from petcontact.mesh.curve_building import build_mesh
from petcontact.model.bodies import Units
from petcontact.model.shapes.plane import Rectangle
from petcontact.results.figures import curves, plane
from petcontact.results.figures.hoop import hoop_stress
from petcontact.results.figures.plots import drawings, plot_all
from petcontact.results.figures.stress import draw_von_mises
from petcontact.results.figures.view import view_of
from petcontact.results.hdf5 import write_solution
from petcontact.results.peaks import largest_at
from petcontact.results.records import ObstacleResult
from petcontact.results.solution import read_result
from petcontact.runtime.figure_style import label, save

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


@pytest.mark.slow
def test_figures_have_the_same_bytes_again(solution, tmp_path):
    for suffix in ("pdf", "svg"):
        for name in "ab":
            save(tmp_path / f"{name}.{suffix}", plane.draw_displacement, solution)
        one, other = (tmp_path / f"{name}.{suffix}" for name in "ab")
        assert one.read_bytes() == other.read_bytes()


def test_units_stand_on_every_axis(solution):
    labels = {
        plane.draw_deformed: ["x [mm]", "y [mm]"],
        plane.draw_displacement: ["arc length along bottom [mm]", "tangential displacement [mm]"],
        plane.draw_traction: ["arc length along bottom [mm]", "tangential traction [N/mm²]"],
        plane.draw_normal: ["arc length along bottom [mm]", "pressure [N/mm²]"],
    }
    for draw, expected in labels.items():
        axes = drawn(draw, solution).axes[0]
        assert [axes.get_xlabel(), axes.get_ylabel()] == expected
    assert label("x", None) == "x"


def test_newtons_history_shows_residuals_and_the_set(solution, tmp_path):
    assert solution.history.exchanged[-1] == 0
    assert len(solution.history.exchanged) == solution.iterations
    left, right = drawn(curves.draw_history, solution).axes
    assert right.get_title() == "active sets"
    assert np.array_equal(right.lines[0].get_ydata(), solution.history.exchanged)
    assert not left.lines[0].get_ydata()[-1] > 1e-12
    write_solution(tmp_path / "r.h5", solution)
    assert read_result(tmp_path / "r.h5").history == solution.history
    left, right = drawn(curves.draw_history, solve(example(1, mesh=COARSE))).axes
    assert right.get_title() == "Robin parameter" and len(left.lines) == 3


def test_titles_are_whole_and_say_what_is_no_result(solution):
    """A limit load ends the steps; what came before it has converged and is drawn as such."""
    long = "A block that is clamped at its top and pushed over a foundation with friction by forces"
    problem = solution.problem.model_copy(update={"title": long})
    text = curves.headed(replace(solution, problem=problem))
    assert text.replace("\n", " ") == long and max(map(len, text.splitlines())) < 70
    failed = replace(solution.last, status="not converged")
    limit = replace(solution, status="not converged", failed=failed)
    assert "no result" not in curves.headed(limit)
    assert "solved up to load factor 1 of step" in curves.headed(limit)
    for without in (replace(limit, steps=[]), replace(solution, status="not converged")):
        assert "not converged: no result" in curves.headed(without)


def with_paths(solution, *scales):
    """Steps of a solution, slip and shear being multiplied by numbers."""
    steps = []
    for number, scale in enumerate(scales, 1):
        pairs = {
            name: replace(pair, slip=scale * np.ones_like(pair.slip), sigma_t=scale * pair.sigma_t)
            for name, pair in solution.pairs.items()
        }
        steps.append(replace(solution.last, name=f"step {number}", step=number, pairs=pairs))
    named = tuple(Step(name=step.name) for step in steps)
    problem = solution.problem.model_copy(update={"step": named})
    return replace(solution, problem=problem, steps=steps)


def test_steps_have_lines_of_their_own_and_a_path_that_returns_a_hysteresis(solution):
    there, back = with_paths(solution, 1.0, 2.0, 3.0), with_paths(solution, 1.0, 2.0, -1.0)
    assert "hysteresis" not in drawings(there) and "hysteresis" in drawings(back)
    lines = drawn(plane.draw_traction, back).axes[0].lines
    steps = [line for line in lines if line.get_label().startswith("step")]
    assert len({line.get_linestyle() for line in steps}) == 3


def test_a_plot_in_a_notebook_fills_its_figure_and_takes_the_view_that_is_wanted(
    solution, tmp_path, monkeypatch
):
    """The legend lies below the axes and takes nothing of their room."""
    monkeypatch.setenv("MPLBACKEND", "agg")
    axes = solution.plot()
    axes.figure.canvas.draw()
    wide, high = axes.get_window_extent().size / axes.figure.dpi
    assert wide > 5.0 and high > 2.5
    matplotlib.pyplot.close("all")
    view = view_of(solution, factor=7.0)
    assert plot_all(solution, tmp_path, names=["deformed"], formats=["svg"], view=view)
    assert "displacements × 7" in (tmp_path / "result-deformed.svg").read_text()


def test_the_moment_on_an_obstacle_is_drawn_over_its_rotation(solution):
    """And no panel for a displacement that it does not have."""
    still = ObstacleResult(np.zeros(2), 0.0, np.zeros(2), 0.0)
    turned = [replace(still, rotation=-angle, moment=-7.0 * angle) for angle in (0.1, 0.2)]
    steps = [replace(solution.last, obstacles={"plug": each}) for each in turned]
    (axes,) = drawn(curves.draw_motion, found := replace(solution, steps=steps)).axes
    path = np.array([[0.0, 0.0], [-0.1, -0.7], [-0.2, -1.4]])
    assert axes.lines[0].get_xydata() == pytest.approx(path)
    assert "motion" in drawings(found) and "motion" not in drawings(solution)


def test_colours_reach_to_the_largest_stress_that_is_bounded(plate):
    """Away from the corner of right and bottom that is the notch stress at the hole."""
    figure = drawn(draw_von_mises, plate)
    image = figure.axes[0].collections[0]
    state = plate.boundary_state()[1]
    away = np.hypot(*(state.x - [10.0, 0.0]).T) > 1.5
    assert image.get_clim()[1] == pytest.approx(state.von_mises[away].max(), rel=0.05)
    cross = next(line for line in figure.axes[0].lines if line.get_label() == "largest")
    assert np.hypot(cross.get_xdata()[0] - 5.0, cross.get_ydata()[0] - 3.0) < 1.8


def test_a_curve_ends_where_only_a_corner_is_larger_and_round_off_is_zero(solution):
    (name, pair), *_ = solution.pairs.items()

    def axes_of(pressure):
        pairs = {name: replace(pair, pressure=pressure)}
        changed = replace(solution, steps=[replace(solution.last, pairs=pairs)])
        return drawn(plane.draw_normal, changed).axes[0]

    axes = axes_of(np.where(pair.arc_length > 7.7, 1e4, pair.pressure))  # beside a sharp corner
    assert axes.get_ylim()[1] < 2.0 * pair.pressure.max()
    assert any("cut at corners" in text.get_text() for text in axes.texts)
    axes = axes_of(np.where(np.abs(pair.arc_length - 4.0) < 1.0, 1e4, pair.pressure))
    assert axes.get_ylim()[1] > 1e4 and not axes.texts
    assert not axes_of(1e-15 * pair.pressure).lines[0].get_ydata().any()


def test_outlines_run_round_over_elements_of_mixed_orders():
    square = Rectangle(lower_left=(0.0, 0.0), upper_right=(2.0, 2.0)).outline()
    orders = [np.array(side) for side in ([2, 0, 1], [1, 0, 3], [1, 1, 0, 2], [4])]
    mesh = build_mesh(square, [np.linspace(0.0, 1.0, len(side) + 1) for side in orders], orders)
    ((initial, deformed),) = plane.outlines(mesh, mesh.x, 0.5)  # grows by half: area 9
    for curve, area in ((initial, 4.0), (deformed, 9.0)):
        (x, y), (x_after, y_after) = curve[:-1].T, curve[1:].T
        assert 0.5 * np.sum(x * y_after - x_after * y) == pytest.approx(area, rel=1e-12)


def test_the_largest_stress_is_told_with_its_place(solution):
    field = field_on_grid(
        solution.mesh, solution.u, solution.traction, solution.problem.material, (30, 30)
    )
    told = largest_at(solution, "body", field.x, field.von_mises)
    assert told.endswith("next to left and top, where stress has no bound"), told
    inside = np.hypot(*(field.x - [4.0, 2.0]).T)
    high = replace(field, stress=field.stress * (1e6 * (inside == inside.min()) + 1.0)[:, None])
    assert "no bound" not in largest_at(solution, "body", field.x, high.von_mises)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-o", "own.vtk"], "own.vtk: a field is written as .vtu"),
        (["--boundary", "b.xml"], "b.xml: a field is written as"),
        (["--figure", "own.tif"], "own.tif: a figure is .png, .pdf or .svg"),
    ],
)
def test_other_suffixes_are_refused_before_any_work(
    solution, tmp_path, monkeypatch, capsys, words, message
):
    monkeypatch.chdir(tmp_path)
    write_solution("r.h5", solution)
    assert main(["field", "r.h5", "--grid", "8x8", *words]) == 2
    assert message in capsys.readouterr().err and not Path(words[1]).exists()


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
    r = np.hypot(*(ring.mesh.variables_at(element, place)[axis] for axis in "xy"))
    radial, around = TUBE.stress(r)
    arc = ring.mesh.curvature[element] != 0.0
    state = ring.body_fields().on_boundary(element, place)
    hoop = hoop_stress(ring.mesh, element, place, state)
    assert np.abs(hoop - np.where(arc, around, radial)).max() < 1e-4 * around.max()
