"""Bands: the forecast against exact ellipses, ridges and their ends, panels that fill a face."""

from dataclasses import replace
from math import gamma
from types import SimpleNamespace

import numpy as np
import pytest
from curved_bodies import vector_area

from petcontact import Revolved
from petcontact.geometry.charts import chart_of, disc_of
from petcontact.geometry.round_surfaces import CylinderSurface, SphereSurface
from petcontact.geometry.surface import BoxSurface
from petcontact.given.values import as_given
from petcontact.mesh.panelling import box_mesh, round_mesh
from petcontact.pipeline.adapt.long_contacts import ZonedContact, followed
from petcontact.refinement.panels.bands import banded
from petcontact.refinement.panels.compact import ellipse_of
from petcontact.refinement.panels.face_gaps import face_gap, touching
from petcontact.refinement.panels.forecast import (
    Line,
    band_of,
    force_at,
    forecast_across,
    forecast_of,
    hertz_ellipse,
)
from petcontact.refinement.panels.frames import one_frame, outermost
from petcontact.refinement.panels.panel_cuts import too_large
from petcontact.refinement.panels.quartering import cut
from petcontact.refinement.panels.ridge import ridge_of
from petcontact.refinement.panels.zone import ContactEllipse

BOX = BoxSurface(np.array([-3.0, -3.0, -6.0]), np.array([3.0, 3.0, 0.0]))


def expected(text, force=0.1, modulus=1000.0):
    chart = chart_of(BOX, "top")
    ridge = ridge_of(face_gap(chart, as_given(text, "gap"), None, None), chart)
    return chart, ridge, forecast_of(ridge, Line(chart.at(ridge.points)), force, modulus)


def test_a_gap_that_is_least_in_a_corner_has_no_ridge():
    """As a quarter of a ball that is pressed on a quarter of a block."""
    chart = chart_of(BoxSurface(np.array([0.0, 0.0, -3.0]), np.array([3.0, 3.0, 0.0])), "top")
    gap = face_gap(chart, as_given("(x**2 + y**2)/8 - 0.02", "gap"), None, None)
    for start in (np.zeros(2), None):
        ridge = ridge_of(gap, chart, start)
        assert ridge is None or len(ridge.s) > 1


def test_slices_beside_a_bump_are_no_wider_than_the_ridge_is_long():
    """Where the gap is flat slices have no width: the loads of such cells cannot be told apart."""
    _, _, forecast = expected("0.05 - 0.05*exp(-(x**2 + y**2)/0.02)", force=5.0, modulus=100.0)
    assert np.isfinite(forecast.load).all()
    assert forecast.load @ np.gradient(forecast.s) == pytest.approx(5.0, rel=0.3)


@pytest.mark.parametrize("ratio", [1.5, 10.0, 100.0])
def test_the_ellipse_satisfies_hertz(ratio):
    """p0 = 3F/(2πab) makes both curvatures: Johnson 1985, (4.25) by a quadrature of his."""
    a, b, approach = hertz_ellipse((1.0, 0.002), 1.0, 1.0)
    half = np.geomspace(1e-12, 1e12, 20001)

    def integral(values):
        return np.trapezoid(values, half) if hasattr(np, "trapezoid") else np.trapz(values, half)

    root = np.sqrt((a**2 + half) * (b**2 + half) * half)
    # u_z(x, 0) = (3F/4πE*) ∫ (1 - x²/(a²+w) - y²/(b²+w)) dw / √((a²+w)(b²+w)w)
    assert 0.75 / np.pi * integral(1.0 / root) == pytest.approx(approach, rel=2e-3)
    for k, axis in ((1.0, a), (0.002, b)):
        bent = 2.0 * 0.75 / np.pi * integral(1.0 / root / (axis**2 + half))
        assert bent == pytest.approx(k, rel=2e-3)


@pytest.mark.parametrize("power", [1.5, 2.0, 4.0, 8.0])
@pytest.mark.parametrize("radius", [0.01, 0.5])
def test_the_ellipse_of_least_approach_is_the_circle_of_galin(power, radius):
    """A rigid body r^n: F = 2 E* a δ n/(n + 1) and δ = c √π Γ(n/2 + 1)/Γ((n + 1)/2) aⁿ."""
    chart, approach = chart_of(BOX, "top"), 0.01 * radius
    slope = np.sqrt(np.pi) * gamma(0.5 * power + 1.0) / gamma(0.5 * power + 0.5)
    force = 2.0 * 1000.0 * radius * approach * power / (power + 1.0)

    def gap(place):
        return approach / slope * (np.linalg.norm(place - [0.3, -0.2], axis=1) / radius) ** power

    zone, least, found = ellipse_of(gap, chart, np.array([0.3 + 0.5 * radius, -0.2]), force, 1000.0)
    assert np.linalg.norm(zone.axes, axis=0) == pytest.approx(radius, rel=2e-3)
    assert zone.centre == pytest.approx([0.3, -0.2], abs=1e-3 * radius)
    assert found - least == pytest.approx(approach, rel=1e-3)


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_the_ellipse_of_least_approach_is_that_of_hertz(angle):
    c, s = np.cos(angle), np.sin(angle)
    chart, turn = chart_of(BOX, "top"), np.array([[c, s], [-s, c]])
    a, b, approach = hertz_ellipse((20.0, 5.0), 1.0, 1000.0)
    zone, _, found = ellipse_of(
        lambda x: ((x @ turn.T) ** 2) @ [10.0, 2.5], chart, np.array([0.02, 0.01]), 1.0, 1000.0
    )
    assert np.linalg.norm(zone.axes, axis=0) == pytest.approx([a, b], rel=1e-3)
    assert np.abs(turn @ zone.axes) == pytest.approx(np.diag([a, b]), abs=1e-3 * a)
    assert found == pytest.approx(approach, rel=1e-3)


@pytest.mark.parametrize(
    "text",
    ["10*(x**4 + y**4)", "10*x**2 + y**4", "(x**2 + y**2 - 1)**2", "x**2", "x**2 + 1e-18*y**2"],
)
def test_contact_that_is_no_ellipse_has_none(text):
    chart = chart_of(BOX, "top")
    gap = face_gap(chart, as_given(text, "gap"), None, None)
    assert ellipse_of(gap, chart, np.array([0.05, 0.02]), 1.0, 1000.0) is None


def test_slices_follow_an_ellipse():
    a, b, approach = hertz_ellipse((20.0, 0.05), 0.1, 1000.0)
    _, _, exact = expected("10*x**2 + 0.025*y**2")
    assert exact.half.max() == pytest.approx(a)
    _, _, sliced = expected("10*x**2 + 0.025*y**2 + 1e-3*y**4")
    _, _, less = expected("10*x**2 + 0.025*y**2 + 1e-9*y**4")
    assert exact.elliptic and not expected("10*x**2 + y**4")[2].elliptic
    assert less.approach == pytest.approx(approach)
    assert sliced.ends[1] - sliced.ends[0] < 2.0 * b


@pytest.mark.parametrize(
    ("text", "ends", "across"),
    [
        ("where(abs(y) <= 0.5, x**2/0.05, 1)", [(0.0, -0.5), (0.0, 0.5)], (1.0, 0.0)),
        (
            "where(abs(0.8*x + 0.6*y) <= 0.5, (0.8*y - 0.6*x)**2, 1)",
            [(-0.4, -0.3), (0.4, 0.3)],
            None,
        ),
        ("(x - 0.3)**2/0.05", [(0.3, -3.0), (0.3, 3.0)], (1.0, 0.0)),
    ],
)
def test_a_ridge_ends_where_the_gap_jumps_or_the_face_ends(text, ends, across):
    _, ridge, forecast = expected(text)
    found = ridge.points[[0, -1]]
    assert min(np.abs(found - ends).max(), np.abs(found[::-1] - ends).max()) < 1e-6
    assert forecast.sharp == (True, True)
    if across:
        assert np.abs(ridge.across[0]) == pytest.approx(across, abs=1e-6)


@pytest.mark.parametrize("angle", [0.0, 0.1, 0.7, 2.97])
def test_the_ridge_of_a_crown_has_its_direction(angle):
    """The differences of a fourth power are no curvatures: the line is turned into the ridge."""
    c, s = float(np.cos(angle)), float(np.sin(angle))
    x, y = f"({c}*x + {s}*y)", f"({c}*y - {s}*x)"
    _, ridge, forecast = expected(f"where(abs({y}) <= 1, 0.86*{x}**2 + 0.227*{y}**4, 1e3)")
    assert np.abs(ridge.across @ np.array([c, s])) == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.norm(ridge.points[[0, -1]], axis=1) == pytest.approx(1.0, abs=1e-6)
    assert sum(forecast.ends) == pytest.approx(ridge.s[0] + ridge.s[-1], abs=1e-6)


@pytest.mark.parametrize("level", [0, 3])
@pytest.mark.parametrize(
    "text",
    [
        "where(abs(y) <= 0.5, x**2/0.05, 1)",
        "where(abs(0.8*x + 0.6*y) <= 0.5, (0.8*y - 0.6*x)**2/0.05, 1)",
        "(x - 0.3)**2/0.05",
        "10*x**2 + 0.025*y**2",
        "(x - 3)**2/0.05",
        "(x - 2.999)**2/0.05",
    ],
)
def test_panels_fill_the_face_once(text, level):
    chart, ridge, forecast = expected(text)
    mesh = box_mesh(BOX, lambda part: 2.0, 1, 1.0)
    made = banded(mesh, "top", (chart, band_of(ridge, forecast), level))
    nodes = made.nodes_of("top")
    assert made.weight[nodes].sum() == pytest.approx(36.0, rel=1e-12)
    x, weight = made.x[nodes], made.weight[nodes]
    assert weight @ x[:, 0] ** 2 == pytest.approx(36.0 * 3.0, rel=1e-9)
    assert np.all(made.normal[nodes, 2] == 1.0)
    longer = banded(mesh, "top", (chart, band_of(ridge, forecast), level))
    assert longer.n_elements == made.n_elements


def test_where_a_plane_of_symmetry_ends_a_band_it_is_not_graded():
    """Contact goes on beyond it, with a pressure that is smooth."""
    chart, ridge, forecast = expected("(x - 0.3)**2/0.05")
    band, mesh = band_of(ridge, forecast), box_mesh(BOX, lambda part: 2.0, 1, 1.0)
    mirrored = replace(band, mirrored=(True, False))
    assert band.infinite == (True, True) and mirrored.infinite == (False, True)
    ends = []
    for each in (band, mirrored, replace(band, mirrored=(True, True))):
        made = banded(mesh, "top", (chart, each, 0))
        ends.append(made.weight[made.nodes_of("top")].min())
        assert made.weight[made.nodes_of("top")].sum() == pytest.approx(36.0, rel=1e-12)
    assert ends[0] == pytest.approx(ends[1], rel=1e-9) and ends[2] > 1.9 * ends[1]


def test_panels_of_a_cylinder_lie_on_it():
    surface = CylinderSurface(np.array([-5.0, 0, 5]), np.array([5.0, 0, 5]), 5.0)
    low = np.array([0.0, 0.0, 0.0])
    chart, plate = (
        chart_of(surface, "side", low),
        chart_of(BoxSurface(np.array([-8.0, -6, -6]), np.array([8.0, 6, 0])), "top"),
    )
    ridge = ridge_of(face_gap(chart, None, np.array([0.0, 0.0, -1.0]), plate), chart)
    forecast = forecast_of(ridge, Line(chart.at(ridge.points)), 500.0, 1e5)
    assert ridge.curvature == pytest.approx(0.2, rel=1e-3)
    assert forecast.sharp == (True, True)
    assert forecast.ends[1] - forecast.ends[0] == pytest.approx(10.0)
    made = banded(round_mesh(surface, 3.0, 1), "side", (chart, band_of(ridge, forecast), 1))
    nodes = made.nodes_of("side")
    radius = np.hypot(made.x[nodes, 1], made.x[nodes, 2] - 5.0)
    assert np.abs(radius - 5.0).max() < 5.0 * 2e-3
    assert made.weight[nodes].sum() == pytest.approx(100.0 * np.pi, rel=1e-3)
    # generators are straight: panels away from a sharp end need not be as short as those at it
    low, high = (corner[made.elements_of("side")] for corner in made.boxes)
    assert np.ptp([low[:, 0], high[:, 0]], axis=0)[low[:, 2] > 5.0].min() > 1.0


def test_the_upper_half_of_an_o_ring_is_unrolled_as_one():
    """It is turned from two arcs, and its ridge is their joint; a corner between sides has no chart."""
    sides = [
        {"part": "upper", "to": [27.65, 0.0], "radius": -2.65},
        {"part": "lower", "to": [22.35, 0.0], "radius": -2.65},
    ]
    surface = Revolved(shape="revolved", angle=30.0, loops=[sides]).outline()
    chart = chart_of(surface, "upper")
    ridge = ridge_of(face_gap(chart, as_given("2.65 - z", "gap"), None, None), chart)
    assert ridge.curvature == pytest.approx(1.0 / 2.65, rel=1e-4)
    assert np.abs(np.hypot(*chart.at(ridge.points)[:, :2].T) - 25.0).max() < 1e-5
    place = np.array([[1.0, 0.5], [2.0, 4.0], [9.0, 4.5], [12.0, 8.0]])
    assert chart.local(chart.at(place)) == pytest.approx(place)
    # a panel may lie on both quarters: on one of them it would have no width
    panel = chart.at(np.array([[3.0, 4.12], [5.0, 4.12], [5.0, 4.26], [3.0, 4.26]]))
    there = surface.onto(np.array([surface.parts.index("upper")]), panel[None])[0]
    assert there == pytest.approx(panel)
    whole = Revolved(
        shape="revolved", angle=30.0, loops=[[side | {"part": "skin"} for side in sides]]
    )
    assert chart_of(whole.outline(), "skin") is not None
    bent = [
        {"part": "skin", "to": [5.0 + x, y]}
        for x, y in ((1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0))
    ]
    assert chart_of(Revolved(shape="revolved", angle=30.0, loops=[bent]).outline(), "skin") is None


def test_panels_below_the_end_of_a_band_are_as_narrow():
    """A plate ends under a roller: the side of the plate bulges there, and p falls by a third."""
    chart, ridge, forecast = expected("x**2/0.05")
    mesh, band = box_mesh(BOX, lambda part: 2.0, 1, 1.0), band_of(ridge, forecast)
    mesh, marked = banded(mesh, "top", (chart, band, 0)), np.ones(1, dtype=bool)
    while marked.any():
        marked = too_large(mesh, mesh.part == mesh.part_names.index("top"))
        mesh = cut(mesh, marked)
    for end in (-3.0, 3.0):
        nearest = np.linalg.norm(mesh.x - [0.0, end, -0.5 * band.widest], axis=1)
        nearest[mesh.nodes_of("top")] = np.inf
        panel = mesh.corners[mesh.element[nearest.argmin()]]
        assert np.ptp(panel, axis=0).max() < 3.0 * band.widest


@pytest.mark.parametrize("narrower", [1.0, 0.25])
def test_the_ridge_of_a_whole_o_ring_goes_round(narrower):
    """It is cut at the rim of the chart, beyond which contact goes on; panels turn by 45° at most,
    though the normals at its top do not turn. Each ends where its neighbours end: parabolas through
    other points of the same arc would leave slits."""
    sides = [
        {"part": "upper", "to": [27.65, 0.0], "radius": -2.65},
        {"part": "lower", "to": [22.35, 0.0], "radius": -2.65},
    ]
    surface = Revolved(shape="revolved", loops=[sides]).outline()
    chart = chart_of(surface, "upper")
    ridge = ridge_of(face_gap(chart, as_given("2.65 - z", "gap"), None, None), chart)
    forecast = forecast_of(ridge, Line(chart.at(ridge.points)), 46.87, 10.0 / (1.0 - 0.49**2))
    assert ridge.closed
    assert sorted(ridge.points[[0, -1], 0]) == pytest.approx([0.0, 50.0 * np.pi], abs=1e-6)
    assert forecast.half == pytest.approx(0.2764, rel=2e-3)  # of the axial problem
    band = band_of(ridge, forecast)
    band = replace(band, half=narrower * band.half, mirrored=(True, True))
    made = banded(round_mesh(surface, 3.0, 1), "upper", (chart, band, 0))
    nodes = made.nodes_of("upper")
    assert made.weight[nodes].sum() == pytest.approx(50.0 * np.pi * 2.65 * np.pi, rel=1e-3)
    corners = made.corners[made.part == made.part_names.index("upper")]
    angle = np.sort(np.arctan2(corners[..., 1], corners[..., 0]), axis=1)
    turn = np.minimum(np.ptp(angle, axis=1), 2.0 * np.pi - np.ptp(angle, axis=1))
    assert turn.max() < 0.25 * np.pi + 1e-6
    lines = np.sort(np.arctan2(corners[..., 1], corners[..., 0]) % (2.0 * np.pi), axis=None)
    inner = np.abs(np.linalg.norm(corners[..., :2], axis=2) - 25.0) < 1.5 * band.half.max()
    near = np.unique((np.sort(angle[inner.all(axis=1)], axis=None) % (2.0 * np.pi)).round(6))
    assert np.abs(lines[:, None] - near).min(axis=1).max() < 1e-5


@pytest.mark.parametrize(
    ("approach", "force", "angle"),
    [(0.01, 2.019, 360.0), (0.1, 31.38, 360.0), (0.1, 31.38, 90.0), (0.1, 31.38, 30.0)],
)
def test_an_o_ring_between_plates_has_the_force_of_its_squeeze(approach, force, angle):
    """As configs/axial_o_ring.toml without friction, at a squeeze of 1 and 10 %: half spaces would
    yield twice as much, since they are moved far from the ring, too. A piece between planes of
    symmetry feels the whole ring, and contact is as wide at its ends."""
    sides = [
        {"part": "upper", "to": [11.0, 0.0], "radius": -1.0},
        {"part": "lower", "to": [9.0, 0.0], "radius": -1.0},
    ]
    ring = Revolved(shape="revolved", loops=[sides], angle=angle).outline()
    chart = chart_of(ring, "upper")
    ridge = ridge_of(face_gap(chart, as_given("1 - z", "gap"), None, None), chart)
    ends = chart.at(ridge.points)[[0, -1]] * [1.0, 1.0, 0.0]
    planes = [] if angle == 360.0 else [(end, np.cross([0.0, 0.0, 1.0], end)) for end in ends]
    line, modulus = Line(chart.at(ridge.points), planes), 6.0 / (1.0 - 0.48**2)
    found = force_at(ridge, line, approach, modulus, 1.0)
    assert found == pytest.approx(force * angle / 360.0, rel=0.02)
    half = forecast_of(ridge, line, found, modulus).half
    assert np.ptp(half) < 0.01 * half.max()


def test_a_band_lies_where_a_solution_has_its_contact():
    """Hertz' line beside the ridge, as under an O-ring that turns on elastic plates."""
    chart, ridge, forecast = expected("where(abs(y) < 2, x**2/3, 1)")
    long = ZonedContact(SimpleNamespace(name="c"), [chart], band_of(ridge, forecast))
    across, along = np.meshgrid(np.linspace(-0.08, 0.12, 2001), np.linspace(-1.9, 1.9, 39))
    x = np.column_stack([across.ravel(), along.ravel(), np.zeros(across.size)])
    pressure = np.sqrt(np.maximum(1.0 - ((x[:, 0] - 0.02) / 0.1) ** 2, 0.0))
    pair = SimpleNamespace(x=x, weight=np.ones(len(x)), pressure=pressure)
    step = SimpleNamespace(pairs={"c": pair}, load=1.0, step=1)
    (long,) = followed([long], SimpleNamespace(steps=[step], tried=[step]), "c", False)
    band = long.zone
    assert band.at(np.array([1.0]))[0][0, 0] == pytest.approx(0.02, abs=1e-6)
    assert band.half == pytest.approx(0.104, rel=1e-3)


def test_a_pin_in_a_bore_touches_where_it_moves():
    """The clearance c is the same all around: after the motion the gap is c (1 - cos φ)."""
    sides = [
        {"part": "end", "to": [25.0, -10.0]},
        {"part": "outer", "to": [25.0, 10.0]},
        {"part": "top", "to": [10.0, 10.0]},
        {"part": "bore", "to": [10.0, -10.0]},
    ]
    chart = chart_of(Revolved(shape="revolved", loops=[sides]).outline(), "bore")
    way = np.array([0.6, -0.8, 0.0])
    gap = touching(face_gap(chart, as_given("0.02 + 0*x", "gap"), None, None), chart, way)
    ridge = ridge_of(gap, chart)
    assert ridge.curvature == pytest.approx(2e-4, rel=1e-3)
    assert chart.at(ridge.points)[:, :2] == pytest.approx(
        np.broadcast_to(-10.0 * way[:2], (len(ridge.s), 2)), abs=1e-2
    )
    # slices of a short contact that are shorter than wide would have loads with alternating signs
    forecast = forecast_of(ridge, Line(chart.at(ridge.points)), 2000.0, 230_769.0)
    middle = forecast.load[np.abs(forecast.s - 10.0) < 5.0]
    assert middle.min() > 0.95 * middle.max()


def test_two_bands_on_one_roller_have_half_of_its_side_each():
    """Between two plates: each half is filled once, with the same panels as the other one."""
    surface = CylinderSurface(np.array([-5.0, 0, 0]), np.array([5.0, 0, 0]), 5.0)
    laid = []
    for way, low in ((-1.0, -11.0), (1.0, 5.0)):
        plate = BoxSurface(np.array([-8.0, -6.0, low]), np.array([8.0, 6.0, low + 6.0]))
        chart = chart_of(surface, "side", np.array([0.0, 0.0, 5.0 * way]))
        other = chart_of(plate, "top" if way < 0.0 else "bottom")
        ridge = ridge_of(face_gap(chart, None, np.array([0.0, 0.0, way]), other), chart)
        forecast = forecast_of(ridge, Line(chart.at(ridge.points)), 500.0, 1e5)
        laid.append((chart, band_of(ridge, forecast), 0))
    mesh = round_mesh(surface, 3.0, 1)
    alone, both = (banded(mesh, "side", *some) for some in (laid[:1], laid))
    nodes = both.nodes_of("side")
    assert both.weight[nodes].sum() == pytest.approx(100.0 * np.pi, rel=1e-3)
    above = both.x[nodes, 2] > 0.0
    assert both.weight[nodes][above].sum() == pytest.approx(50.0 * np.pi, rel=1e-3)
    assert np.count_nonzero(above) == np.count_nonzero(~above)
    assert np.sort(both.weight[nodes])[0] == pytest.approx(
        alone.weight[alone.nodes_of("side")].min(), rel=1e-6
    )
    assert banded(mesh, "side", laid[0], laid[0]) is None  # bands that meet


def test_parts_of_a_sphere_are_unrolled_by_angles():
    surface = SphereSurface(np.array([1.0, 0.0, 2.0]), 2.0)
    place = np.array([[0.0, 0.0], [0.5, -1.0], [-1.5, 1.5]])
    for part in surface.parts:
        chart = chart_of(surface, part)
        x = chart.at(place)
        assert np.linalg.norm(x - surface.centre, axis=1) == pytest.approx(2.0)
        assert chart.local(x) == pytest.approx(place)
        assert chart.normal(place) == pytest.approx((x - surface.centre) / 2.0, abs=1e-6)
    rim = chart.at(np.array([chart.high]))
    assert np.abs(rim - surface.centre) == pytest.approx(2.0 / np.sqrt(3.0))


def test_frames_have_no_panels_without_width():
    """A rim that lies on that of the face but for 5e-12, whose lines end beside those of the face:
    the short diagonal of such a panel is no measure of it."""
    low, high = [0.0, 0.0], [1.0, 1.0]
    corners = np.array([low, [1.0, 0.0], high, [0.0, 1.0]])
    inside = np.array([[5e-12, 0.1], [1.0 - 5e-12, 0.1], [1.0 - 5e-12, 0.9], [5e-12, 0.9]])
    share = np.array([0.0, 0.3, 0.5, 0.9, 1.0])[:, None]
    rim = [a + share * (b - a) for a, b in zip(inside, np.roll(inside, -1, axis=0), strict=True)]
    cells, _ = one_frame(rim, corners, 0.0, [True] * 4)
    sides = np.diff(cells[:, :3], axis=1)
    assert len(cells) == 8 and np.abs(np.cross(sides[:, 0], sides[:, 1])).min() > 1e-4


@pytest.mark.parametrize("angle", [0.3, 1.0, 1.88, 2.7])
def test_the_last_frame_around_a_turned_band_does_not_fold(angle):
    """Its sides meet those sides of the face that are turned by less than 45 degrees to them."""
    chart = chart_of(BoxSurface(np.array([-12.0, -12, -6]), np.array([12.0, 12, 0])), "top")
    across, along = (
        np.array([np.cos(angle), np.sin(angle)]),
        np.array([-np.sin(angle), np.cos(angle)]),
    )
    face, _ = outermost(chart, (np.zeros(2), np.array([across, along])), np.array([-1, -3, 1, 3]))
    assert face is not None and face[1, 0] - face[0, 0] > 24.0 * np.cos(0.25 * np.pi)


@pytest.mark.parametrize("sides", [((0, 0),), ((1, 1),), ((1, 0), (0, 1))])
def test_a_chart_goes_on_beyond_planes_of_symmetry(sides):
    """Images of a part of the side of a roller lie on the same cylinder."""
    quarter, mirrored = CylinderSurface(np.zeros(3), np.array([0, 0, 2.0]), 5.0), np.zeros((2, 2))
    chart = chart_of(quarter, "side", np.array([5.0, 0.0, 1.0]))
    chart = replace(chart, low=np.array([20.0, 0.0]), wraps=False)
    mirrored[tuple(np.transpose(sides))] = 1
    whole = chart.unfolded(mirrored > 0)
    assert whole.copies == 2 ** len(sides)
    assert np.array_equal(whole.mirrored, mirrored > 0)
    place = whole.low + np.random.default_rng(3).random((50, 2)) * (whole.high - whole.low)
    x = whole.at(place)
    assert whole.local(x) == pytest.approx(place, abs=1e-9)
    assert np.hypot(x[:, 0], x[:, 1]) == pytest.approx(np.full(50, 5.0))
    assert whole.normal(place)[:, :2] * 5.0 == pytest.approx(x[:, :2], abs=1e-6)
    assert len(whole.images(place)) == 50 * whole.copies
    assert np.all(whole.itself.holds(whole.folded(place), 0.0))


def test_frames_on_a_slight_crown_have_as_few_panels_as_on_a_cylinder():
    """Any parabola along its side lies on it to 1e-6 of its length, so that panels need not end
    where those at the end of the band do."""
    counts = []
    for drop in (0.0, 0.01):
        arc = {"through": [10.0, 10.0]} if drop else {}
        sides = [
            {"part": "low", "to": [10.0 - drop, 0.0]},
            {"part": "crown", "to": [10.0 - drop, 20.0]} | arc,
            {"part": "high", "to": [0.0, 20.0]},
            {"part": "axis", "to": [0.0, 0.0]},
        ]
        surface = Revolved(shape="revolved", loops=[sides]).outline()
        chart = chart_of(surface, "crown", np.array([10.0, 0.0, 10.0]))
        gap = face_gap(chart, as_given("10 - x + (z - 10)**2/1e4", "gap"), None, None)
        ridge = ridge_of(gap, chart)
        forecast = forecast_of(ridge, Line(chart.at(ridge.points)), 2000.0, 1e5)
        made = banded(round_mesh(surface, 3.0, 1), "crown", (chart, band_of(ridge, forecast), 0))
        counts.append(len(made.elements_of("crown")))
        assert np.abs(vector_area(made)).max() < 1e-5 * made.weight.sum()
    assert counts[1] <= counts[0]


def test_a_gap_that_jumps_across_its_ridge_keeps_the_forecast_of_its_curvature():
    """No parabola through its edges leads to a contact with these edges."""
    chart, ridge, forecast = expected("where(abs(x) <= 0.004, x**2, 0.1)")
    gap = face_gap(chart, as_given("where(abs(x) <= 0.004, x**2, 0.1)", "gap"), None, None)
    found = forecast_across(gap, ridge, Line(chart.at(ridge.points)), 0.1, 1000.0)
    assert found.half == pytest.approx(forecast.half)


@pytest.mark.parametrize("power", [2, 4, 6])
def test_slices_are_as_wide_as_those_of_gaps_that_are_not_parabolic(power):
    """A gap A x^2n is closed by q = π E* A n a^2n (2n - 1)!!/(2n)!! (Johnson 1985, 5.3). The parabola
    through the ridge and the edges makes contact wider, by at most a fifth up to x⁶."""
    chart, ridge, _ = expected(f"20*x**{power}")
    found = forecast_across(
        face_gap(chart, as_given(f"20*x**{power}", "gap"), None, None),
        ridge,
        Line(chart.at(ridge.points)),
        0.1,
        1000.0,
    )
    middle = len(found.s) // 2
    n, share = power // 2, {2: 1.0 / 2.0, 4: 3.0 / 8.0, 6: 15.0 / 48.0}[power]
    exact = (found.load[middle] / (np.pi * 1000.0 * 20.0 * n * share)) ** (1.0 / power)
    assert 0.99 * exact < found.half[middle] < 1.2 * exact


@pytest.mark.parametrize("number", [2, 3, 4])
def test_zones_on_a_disc_have_a_piece_each(number):
    """All pieces fill the disc once, and equal zones at equal angles have as many panels."""
    surface = CylinderSurface(np.array([0.0, 0, -5.0]), np.zeros(3), 10.0)
    chart, turn = disc_of(surface, "top"), 0.1 + 2.0 * np.pi * np.arange(number) / number
    zones = [ContactEllipse(6.0 * np.array([np.cos(k), np.sin(k)]), 0.25 * np.eye(2)) for k in turn]
    mesh = round_mesh(surface, 3.0, 1)
    made = banded(mesh, "top", *((chart, zone, 0) for zone in zones))
    nodes = made.nodes_of("top")
    x, weight = made.x[nodes], made.weight[nodes]
    assert weight.sum() == pytest.approx(100.0 * np.pi, rel=2e-3)
    assert weight @ x[:, 0] ** 2 == pytest.approx(2500.0 * np.pi, rel=4e-3)
    owner = np.argmin([np.linalg.norm(chart.local(x) - zone.centre, axis=1) for zone in zones], 0)
    assert len({*np.bincount(owner).tolist()}) == 1
    assert np.linalg.norm(vector_area(made)) < 1e-3 * weight.sum()  # parabolas at the rim
    near = ContactEllipse(zones[0].centre + 0.4, 0.25 * np.eye(2))
    assert banded(mesh, "top", (chart, zones[0], 0), (chart, near, 0)) is None  # zones that meet


@pytest.mark.parametrize("planes", [1, 2])
def test_panels_that_cross_a_plane_of_symmetry_are_their_own_images(planes):
    """A band in one plane of symmetry is not one in another plane, beyond which its chart goes on:
    halves of panels there would not end in that plane."""
    surface = BoxSurface(np.zeros(3), np.full(3, 2.0))
    chart, sides = chart_of(surface, "top"), np.zeros((2, 2), dtype=bool)
    sides[1, 1], sides[0, 1] = True, planes == 2
    whole = chart.unfolded(sides)
    ridge = ridge_of(lambda place: (place[:, 1] - 2.0) ** 2, whole, np.array([1.0, 2.0]))
    forecast = forecast_of(ridge, Line(whole.at(ridge.points)), 0.01, 1.0)
    mesh = box_mesh(surface, lambda part: 1.0, 1, 1.0)
    made = banded(mesh, "top", (whole, band_of(ridge, forecast), 0))
    assert (made is None) == (planes == 2)
    if made is not None:
        assert made.weight[made.nodes_of("top")].sum() == pytest.approx(4.0)
