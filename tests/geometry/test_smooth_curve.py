"""Curves through points against circles, ellipses and rounded polygons, and as sides of outlines."""

from __future__ import annotations

import doctest

import numpy as np
import pytest
import shapely

from petcontact.errors import InputError
from petcontact.geometry import fillets, smooth_curve
from petcontact.geometry.fillets import rounded
from petcontact.geometry.smooth_curve import SmoothCurve


def rows(*columns):
    return tuple(zip(*(column.tolist() for column in columns), strict=True))


def circle(count, turn=2.0 * np.pi, radius=10.0):
    angle = np.linspace(0.0, turn, count)
    return rows(radius * np.cos(angle), radius * np.sin(angle))


def test_examples():
    assert doctest.testmod(smooth_curve).failed == 0
    assert doctest.testmod(fillets).failed == 0


@pytest.mark.parametrize("closed", [False, True])
def test_points_of_a_circle_give_the_circle(closed):
    curve = SmoothCurve(circle(129, 2.0 * np.pi if closed else np.pi), closed=closed)
    sides = curve.sides("rim")
    t = np.linspace(0.0, 1.0, 33)
    x = np.vstack([side.point(t) for side in sides])
    along = np.vstack([side.tangents(t) for side in sides])
    assert np.abs(np.hypot(*x.T) - 10.0).max() < 1e-6
    assert np.abs(np.einsum("ij,ij->i", x, along)).max() < 1e-3
    assert np.isclose(sum(side.length for side in sides), (1 + closed) * np.pi * 10.0, rtol=1e-6)
    bends = np.concatenate([side.arcs(t)[1] for side in sides])
    assert np.abs(10.0 * bends - 1.0).max() < 3e-3


def test_elements_of_any_size_are_arcs_of_the_curve():
    """From a whole side to one of 1e-9 of it, the curvature is that of the curve."""
    x = np.linspace(-2.0, 2.0, 81)
    side = SmoothCurve(rows(x, np.cosh(x))).sides("chain")[2]
    for size in 10.0 ** -np.arange(0.0, 10.0):
        breaks = 0.5 + size * np.array([-0.5, 0.5])
        along, bend = side.arcs(breaks)
        (px, _), (tx, ty) = side.point(np.array([0.5]))[0], along[0]
        assert np.isclose(bend[0], 1.0 / np.cosh(px) ** 2, rtol=1e-3 if size < 0.2 else 0.05)
        assert np.isclose(ty / tx, np.sinh(px), rtol=1e-3 if size < 0.2 else 0.05)


def test_a_side_turned_round_is_the_same_side():
    for side in SmoothCurve(circle(65, np.pi)).sides("rim"):
        back, t = side.reversed(), np.linspace(0.0, 1.0, 9)
        assert np.allclose(back.point(t[::-1]), side.point(t), atol=1e-13)
        assert np.allclose(back.tangents(t[::-1]), -side.tangents(t))
        assert np.allclose(back.arcs(t)[1][::-1], -side.arcs(t)[1])
        assert np.allclose(side.nearest(side.point(t)), t, atol=1e-9)


def test_a_curve_is_smooth_within_its_distance():
    """Noise of 1e-3 makes curvatures of 0.5; within 4e-3 they are those of the parabola again."""
    x = np.linspace(-1.0, 1.0, 401)
    noise = np.random.default_rng(3).normal(0.0, 1e-3, len(x))
    given = rows(x, 0.5 * x**2 + noise)
    curve = SmoothCurve(given, 4e-3)
    u = np.linspace(*curve.reach, 4001)
    away = [np.hypot(*(curve.at(u) - point).T).min() for point in given]
    assert max(away) <= 4e-3
    middle = np.abs(curve.at(u)[:, 0]) < 0.5
    assert np.abs(curve.bends(u)[middle]).max() < 2.0 < np.abs(SmoothCurve(given).bends(u)).max()
    assert np.array_equal(curve.sides("")[0].start, given[0])
    assert np.array_equal(curve.sides("")[-1].end, given[-1])


def test_a_curve_that_begins_on_the_axis_is_level_there():
    x = np.linspace(0.0, 1.0, 21)
    for mirrored in (False, True):
        curve = SmoothCurve(rows(x, np.sqrt(4.0 - x**2)), mirrored=(mirrored, False))
        slope = abs(curve.sides("cap")[0].tangents(np.zeros(1))[0, 1])
        assert (slope < 1e-12) == mirrored


def area(sides):
    points = np.vstack([side.point(np.linspace(0.0, 1.0, 400))[:-1] for side in sides])
    return shapely.Polygon(points).area


@pytest.mark.parametrize("seed", range(8))
def test_a_rounded_polygon_is_the_opened_one(seed):
    """A convex polygon with corners of radius r: shrunk by r, and grown again."""
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, 7))
    vertices = np.column_stack([3.0 * np.cos(angle), 2.0 * np.sin(angle)])
    sharp, r = shapely.Polygon(vertices), 1e-2
    sides = rounded(vertices[:: (-1) ** seed], r)
    expected = sharp.buffer(-r, join_style="mitre").buffer(r, quad_segs=400)
    assert np.isclose(area(sides), expected.area, rtol=1e-7)
    for before, after in zip(sides, [*sides[1:], sides[0]], strict=True):
        assert np.allclose(before.end, after.start)
        assert np.allclose(before.tangents(np.ones(1)), after.tangents(np.zeros(1)))


def test_what_cannot_be_rounded_is_refused():
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    assert np.isclose(area(rounded(square, 0.5)), np.pi / 4.0, rtol=1e-4)
    with pytest.raises(InputError, match=r"fillet: must be at most 0.5 for the side from"):
        rounded(square, 0.6)
    with pytest.raises(InputError, match="crosses or touches itself"):
        rounded(square[[0, 2, 1, 3]])
