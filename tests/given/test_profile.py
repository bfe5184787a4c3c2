"""Where rays meet polygons with rounded corners, and curves: against shapely's intersections."""

from __future__ import annotations

import doctest

import numpy as np
import pytest
import shapely

from petcontact.errors import InputError
from petcontact.geometry.smooth_curve import SmoothCurve
from petcontact.given import profile, rounded_box
from petcontact.given.features import kinks
from petcontact.given.profile import CurveProfile, Extruded, RoundedPolygon
from petcontact.given.shapes import Aimed, Ball, Distance
from petcontact.given.sites import Sites

L_SHAPE = ((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0))
R = 0.2


def opened(vertices, r):
    """What a ball of radius r sweeps inside, then outside: all corners are round."""
    polygon = shapely.Polygon(vertices).buffer(-r, quad_segs=800).buffer(2.0 * r, quad_segs=800)
    return polygon.buffer(-r, quad_segs=800)


def star(seed):
    rng = np.random.default_rng(seed)
    angle = 2.0 * np.pi * (np.arange(9) + rng.uniform(-0.2, 0.2, 9)) / 9.0
    size = rng.uniform(1.0, 2.5, 9)
    return tuple(zip(size * np.cos(angle), size * np.sin(angle), strict=True))


def rays(count, seed=5):
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    return rng.uniform(-3.0, 3.0, (count, 2)), np.column_stack([np.cos(angle), np.sin(angle)])


def interval(body, x, ray, hollow):
    """The interval of a line that counts, by shapely."""
    line = shapely.LineString([x - 20.0 * ray, x + 20.0 * ray])
    cut = body.intersection(line)
    pieces = [p for p in getattr(cut, "geoms", [cut]) if p.geom_type == "LineString"]
    ends = sorted(
        sorted((np.array(p.coords) - x) @ ray)[:: len(p.coords) - 1]
        for p in pieces
        if not p.is_empty
    )
    if hollow:
        return next((e for e in reversed(ends) if e[0] <= 0.0), None)
    return next((e for e in ends if e[1] >= 0.0), None)


def test_examples():
    assert doctest.testmod(profile).failed == 0
    assert doctest.testmod(rounded_box).failed == 0


@pytest.mark.parametrize("hollow", [False, True])
@pytest.mark.parametrize("vertices", [L_SHAPE, star(1), star(2)])
def test_a_ray_meets_a_polygon_where_shapely_does(vertices, hollow):
    for r in (0.0, 0.05):
        tool = RoundedPolygon(vertices, r, is_bore=hollow)
        points = [side.point(np.linspace(0.0, 1.0, 200))[:-1] for side in tool.sides]
        body = shapely.Polygon(np.vstack(points))
        x, ray = rays(150)
        distance = Distance("gap", Aimed("tool", "polygon", tool, None, hollow)).at(Sites(x, ray))
        for k in range(len(x)):
            ends = interval(body, x[k], ray[k], hollow)
            assert (ends is None) == np.isinf(distance[k])
            if ends is not None:
                assert np.isclose(distance[k], ends[1 if hollow else 0], atol=1e-4)


@pytest.mark.parametrize("hollow", [False, True])
def test_a_ray_meets_a_closed_curve_where_shapely_does(hollow):
    angle = np.linspace(0.0, 2.0 * np.pi, 121)
    size = 1.5 + 0.4 * np.cos(3.0 * angle)
    rows = tuple(zip(size * np.cos(angle), size * np.sin(angle), strict=True))
    curve = SmoothCurve((*rows[:-1], rows[0]), closed=True)
    body = shapely.Polygon(curve.at(np.linspace(*curve.reach, 8001))[:-1])
    tool = CurveProfile(curve, is_bore=hollow)
    x, ray = rays(150)
    distance = Distance("gap", Aimed("tool", "points", tool, None, hollow)).at(Sites(x, ray))
    for k in range(len(x)):
        ends = interval(body, x[k], ray[k], hollow)
        assert (ends is None) == np.isinf(distance[k])
        if ends is not None:
            assert np.isclose(distance[k], ends[1 if hollow else 0], atol=1e-4)


def test_an_open_curve_is_met_where_it_is_nearest():
    x = np.linspace(-1.0, 1.0, 41)
    tool = CurveProfile(SmoothCurve(tuple(zip(x, x**2 / 2.0, strict=True))))
    places = np.array([[0.3, -0.2], [0.3, 0.4], [1.0, 0.0], [-1.0, 0.0], [1.2, 0.0]])
    gap = Distance("gap", Aimed("rail", "points", tool, (0.0, 1.0))).at(Sites(places))
    assert np.allclose(gap[:4], [0.245, -0.355, 0.5, 0.5], atol=1e-9) and np.isinf(gap[4])


def test_a_polygon_in_space_is_the_same_along_its_direction():
    flat = RoundedPolygon(L_SHAPE, 0.1)
    tool = Extruded(flat, ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    x, ray = rays(50)
    in_space = np.column_stack([x[:, 0], np.arange(50.0), x[:, 1]])
    tilted = np.column_stack([0.8 * ray[:, 0], np.full(50, 0.6), 0.8 * ray[:, 1]])
    for here, there in zip(flat.crossing(x, ray), tool.crossing(in_space, tilted), strict=True):
        assert np.allclose(here, 0.8 * there)
    along = np.tile([0.0, 1.0, 0.0], (50, 1))
    assert np.all(np.isinf(tool.crossing(in_space, along)[0]))


def test_corners_are_found_however_narrow():
    """The kinks of the distance to a tool with a tip of 1e-5 lie at its corners."""
    tool = RoundedPolygon(((0.2, 0.0), (0.20001, 0.0), (0.3, 0.1), (0.1, 0.1)))
    gap = Distance("gap", Aimed("tip", "polygon", tool, (0.0, 1.0)))
    centres, samples = gap.features(lambda t: Sites(np.column_stack([t, np.zeros_like(t)])))
    assert np.allclose(np.sort(centres), [0.1, 0.2, 0.20001, 0.3], atol=1e-12)
    assert np.abs(samples[:, None] - centres).min(axis=0).max() < 1e-12


def test_a_bore_that_is_touched_from_inside_has_no_kinks():
    """The gap is the small difference of two radii."""
    gap = Distance("gap", Aimed("bore", "circle", Ball((0.0, 0.05), 10.05), hollow=True))

    def way(fractions):
        turn = np.pi * (fractions - 0.75)  # from beside the lowest point on, around it
        outward = np.column_stack([np.cos(turn), np.sin(turn)])
        return Sites(10.0 * outward, outward)

    samples = gap.features(way)[1]
    values = gap.near(way(samples))
    assert not len(kinks(lambda t: gap.near(way(t)), samples, values)[0])


def test_dimensions_must_fit():
    gap = Distance("gap", Aimed("tool", "polygon", RoundedPolygon(L_SHAPE), (0.0, 0.0, 1.0)))
    with pytest.raises(InputError, match="2 dimensions; the body has 3; along says in"):
        gap.at(Sites(np.zeros((1, 3))))
