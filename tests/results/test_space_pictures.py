"""Values spread over the panels of surfaces: cells of the second order for ParaView, small
triangles, bands of colour."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import h5py
import meshio
import numpy as np
import pytest
from matplotlib.figure import Figure
from problems import block, contact_pair, posed
from shapes import closing, moved, problem, solid, touching

from petcontact import solve
from petcontact.commands.main import main
from petcontact.contact.law_protocol import OPEN, STICK
from petcontact.results.figures.cuts import grid_of, outline_of, plane_of
from petcontact.results.figures.plots import drawings, plot_on
from petcontact.results.figures.space import draw_gap, draw_normal
from petcontact.results.figures.surface_figure import best_view
from petcontact.results.figures.view import Chart
from petcontact.results.vtu.boundary import write_boundary_vtu
from petcontact.results.vtu.spread_points import small_triangles
from petcontact.results.vtu.vtkhdf import write_vtkhdf

LOOP = {"foot": [1, 0], "side": [1, 1], "top": [0, 1], "axis": [0, 0]}


@pytest.fixture(scope="module")
def solution():
    """A cylinder that a rough floor stops, of curved quadrilaterals and triangles."""
    loop = [{"part": part, "to": to} for part, to in LOOP.items()]
    sides = (
        closing("foot", normal="unilateral", friction_coefficient=0.2),
        moved("top", [0.01, 0, -0.05]),
    )
    shape, mesh = {"shape": "revolved", "loops": [loop]}, {"element_size": 0.7, "order": 1}
    return solve(problem(body=[solid("cylinder", shape, *sides, mesh=mesh)]))


def test_curved_panels_are_cells_of_the_second_order(solution, tmp_path):
    write_boundary_vtu(tmp_path / "s.vtu", solution)
    found, mesh = meshio.read(tmp_path / "s.vtu"), solution.mesh
    kinds = {block.type: block.data for block in found.cells}
    triangle = np.isnan(mesh.corners[:, 3, 0])
    assert {kind: len(cells) for kind, cells in kinds.items()} == {
        "triangle6": triangle.sum(),
        "quad9": (~triangle).sum(),
    }
    for kind, mine, count in (("triangle6", triangle, 3), ("quad9", ~triangle, 4)):
        geometry = np.concatenate(
            [mesh.corners[mine, :count], mesh.middles[mine, : 2 * count - 3]], axis=1
        )
        assert found.points[kinds[kind]] == pytest.approx(geometry, abs=1e-12)
    # nothing acts on the side, of quadrilaterals
    errors = found.cell_data_dict["traction_error"].values()
    assert min(error.min() for error in errors) == 0.0 < max(error.max() for error in errors)
    write_vtkhdf(tmp_path / "s.vtkhdf", solution, (5, 5, 3))
    with h5py.File(tmp_path / "s.vtkhdf") as file:
        types, error = file["VTKHDF/Types"][()], file["VTKHDF/CellData/traction_error"][()]
    assert set(types) == {12, 22, 28} and np.array_equal(np.isnan(error), types == 12)


def test_a_cut_is_what_a_plane_has_in_common_with_the_body(solution, tmp_path, monkeypatch, capsys):
    """Of the cylinder of radius 1 and height 1: a disc and a rectangle; with a smaller one inside
    of it as a cavity a ring."""
    assert plane_of("z = 0.5") == (2, 0.5)
    disc, rectangle = (outline_of(solution.mesh, *plane_of(text)) for text in ("z=0.5", "x=0"))
    assert disc.area == pytest.approx(np.pi, rel=0.03) and rectangle.area == pytest.approx(
        2.0, rel=0.03
    )
    inner = SimpleNamespace(triangles=lambda: 0.5 * solution.mesh.triangles() + [0, 0, 0.25])
    both = [solution.mesh.triangles(), inner.triangles()]
    ring = outline_of(SimpleNamespace(triangles=lambda: np.concatenate(both)), 2, 0.5)
    assert ring.area == pytest.approx(0.75 * disc.area)
    x, triangles = grid_of(ring, 2, 0.5, 40)
    a, b, c = (x[triangles[:, k], :2] for k in range(3))
    assert 0.5 * np.abs(np.cross(b - a, c - a)).sum() == pytest.approx(ring.area, rel=0.02)
    assert np.all(x[:, 2] == 0.5) and np.linalg.norm(x[:, :2], axis=1).min() > 0.45
    monkeypatch.chdir(tmp_path)
    solution.save("c.h5")
    cut = ["field", "c.h5", "--section", "x=0", "--figure", "cut.png", "--grid", "9x9"]
    assert main(cut) == 0 and sorted(p.name for p in tmp_path.iterdir()) == ["c.h5", "cut.png"]
    box = ["--window", "-9", "0.1", "0.1", "9", "0.9", "0.9"]
    assert main([*cut, *box]) == 0 and main([*cut, "--window", "0", "0", "1", "1"]) == 2
    assert "--window: the body has 3 dimensions" in capsys.readouterr().err
    for section, said in (("x=7", "no body lies at x = 7"), ("r=1", "such as y=0")):
        assert main(["field", "c.h5", "--section", section, "--figure", "cut.png"]) == 2
        assert said in capsys.readouterr().err


@pytest.mark.parametrize("most", [10, 400, 10_000])
def test_small_triangles_tile_the_panels(solution, most):
    mesh = solution.mesh
    places, triangles, rims = small_triangles(mesh, most)
    x, normal = mesh.at(places.element, places.place)
    area = 0.5 * np.cross(
        x[triangles[:, 1]] - x[triangles[:, 0]], x[triangles[:, 2]] - x[triangles[:, 0]]
    )
    assert np.linalg.norm(area, axis=1).sum() == pytest.approx(
        mesh.weight.sum(), rel=0.05 if most < 1000 else 0.01
    )
    assert np.all(np.sum(area * normal[triangles[:, 0]], axis=1) > 0.0)  # outward, as the panels
    assert np.all(places.element[triangles] == places.element[triangles[:, :1]])
    assert np.all(places.element[rims[:, 0]] == places.element[rims[:, 1]])


def test_a_curved_body_has_a_picture_of_its_error_and_is_seen_from_its_contact(solution):
    drawings(solution)["error"](figure := Figure(), solution)
    (low, high), (pair,) = figure.axes[1].get_ylim(), solution.pairs.values()
    assert low == 0.0 and high > np.hypot(pair.pressure_error, pair.sigma_t_error).max() > 0.0
    assert plot_on(solution, Figure()).elev < 0.0


def test_the_pressure_at_a_sharp_rim_does_not_set_the_colours(solution):
    """A flat punch in space: the middle of the contact keeps its bands."""
    (pair,) = solution.pairs.values()
    rim = np.hypot(*pair.x[:, :2].T) > 0.95
    (name,) = solution.pairs
    pairs = {name: replace(pair, pressure=np.where(rim, 1e4, pair.pressure))}
    changed = replace(solution, steps=[replace(solution.last, pairs=pairs)])
    draw_normal(figure := Figure(), changed)
    assert figure.axes[1].get_ylim()[1] < 2.0 * pair.pressure.max()


def test_a_smooth_ball_that_hardly_touches_its_floor():
    """What is in contact fills the picture, with some nodes beside it and their levels; there is no
    picture of friction."""
    sphere = {"shape": "sphere", "centre": [0.0, 0.0, 1.0], "radius": 1.0}
    mesh, lowered = {"element_size": 0.4, "order": 1}, moved("top", [0.0, 0.0, -0.01])
    floor = touching("foot", "ball.bottom", "ground", gap="z", direction=[0, 0, -1])
    tables = {"obstacle": [{"name": "ground"}], "contact": [floor]}
    ball = solve(problem(body=[solid("ball", sphere, lowered, mesh=mesh)], **tables))
    pair, figure = ball.pairs["foot"], Figure()
    place, closed = pair.x[:, 0], pair.state != OPEN
    draw_gap(figure, ball)
    low, high = figure.axes[0].get_xlim()
    assert high - low < 0.8 * np.ptp(place) and low < place[closed].min()
    assert place[closed].max() < high
    assert pair.gap[~closed].min() < figure.axes[1].get_ylim()[1] < 0.5 * pair.gap.max()
    assert "traction" not in drawings(ball)


def test_bodies_that_hide_their_contact_are_drawn_alone_with_it_in_view():
    size = "element_size = 1.0, order = 1"
    text = block("low", [0, 0, 0], [1, 1, 1], mesh=size, bottom=[0.0, 0.0, 0.0])
    text += block("mid", [0, 0, 1], [1, 1, 2], mesh=size)
    text += block("up", [0, 0, 2], [1, 1, 3], mesh=size, top=[0.0, 0.0, -0.1])
    text += contact_pair("a", "mid.bottom", "low.top", 0.5)
    found = solve(posed(text + contact_pair("b", "up.bottom", "mid.top", 0.5)))
    from_above, from_below = best_view(found, "low")[0], best_view(found, "up")[0]
    assert from_above > 0.0 > from_below
    figure = Figure()
    drawings(found)["surface"](figure, found)
    titles = [axes.get_title() for axes in figure.axes]
    assert [title.split(",")[0] for title in titles[1:4]] == ["low", "mid", "up"]
    assert len(figure.axes) == 5
    alone = figure.axes[1]
    assert alone.get_zlim()[1] - alone.get_zlim()[0] < 0.6 * np.ptp(figure.axes[0].get_zlim())


def test_a_face_that_contact_goes_round_is_unrolled(solution):
    """Angles about the axis, those of one panel beside each other, and tangential vectors along
    them."""
    mesh = solution.mesh
    side = mesh.nodes_of("side")
    x = mesh.x[side]
    state = np.where(x[:, 0] < 0.2, STICK, OPEN)
    pair = SimpleNamespace(x=x, state=state, weight=mesh.weight[side])
    found = SimpleNamespace(
        pairs={"c": pair},
        meshes=solution.meshes,
        sides={"c": ("cylinder", "side")},
        nodes={"c": side},
        problem=solution.problem,
    )
    chart = Chart.of(found, "c")
    assert (
        chart.names == ("angle from x [degree]", "z [consistent units]")
        and abs(chart.middle) == 180.0
    )
    at = chart.at(pair.x)
    around = np.radians(at[:, 0])
    radius = np.hypot(*pair.x[:, :2].T)
    assert np.column_stack(
        [radius * np.cos(around), radius * np.sin(around), at[:, 1]]
    ) == pytest.approx(pair.x, abs=1e-12)
    assert np.ptp(at[pair.state == STICK, 0]) < 220.0 < np.ptp(at[:, 0])
    tangent = np.column_stack([-np.sin(around), np.cos(around), np.full(len(side), 2.0)])
    assert chart.vectors(pair.x, tangent) == pytest.approx(np.tile([1.0, 2.0], (len(side), 1)))
    for element in np.unique(mesh.element[side]):
        mine = mesh.element[side] == element
        assert np.ptp(chart.at(pair.x[mine], np.zeros(mine.sum(), dtype=int))[:, 0]) < 180.0
