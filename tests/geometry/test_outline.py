"""Outlines: sides and arcs, loops, orientation, holes, and what is refused."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from smooth_field import BODY

from petcontact import Circle, InputError, Polygon, Rectangle, SideBySide
from petcontact.geometry.arcs import turn_through
from petcontact.geometry.outline import Outline, Side, arc, oriented

angles = st.floats(-math.pi, math.pi)


def outline(*loops, **more):
    return SideBySide(loops=loops, **more).outline()


def straight(part, *to):
    return {"part": part, "to": to}


SQUARE = (
    straight("bottom", 4, 0),
    straight("right", 4, 4),
    straight("top", 0, 4),
    straight("left", 0, 0),
)


@given(
    first=angles,
    sweep=st.floats(0.02, 6.2),
    share=st.floats(0.05, 0.95),
    sign=st.sampled_from([-1.0, 1.0]),
)
def test_arc_through_three_points(first, sweep, share, sign):
    """Any arc, also beyond half a circle, is cut into pieces of at most a quarter on the same
    circle."""
    centre, radius = np.array([3.0, -2.0]), 2.5
    on = lambda angle: centre + radius * np.array([math.cos(angle), math.sin(angle)])  # noqa: E731
    start, end = on(first), on(first + sign * sweep)
    sides = arc(start, end, turn_through(start, on(first + sign * share * sweep), end), "arc")
    assert len(sides) == max(1, math.ceil(sweep / (0.5 * math.pi) - 1e-9))
    assert sum(side.length for side in sides) == pytest.approx(radius * sweep, rel=1e-9)
    for side in sides:
        points = side.point(np.linspace(0.0, 1.0, 9))
        assert np.allclose(np.hypot(*(points - centre).T), radius, rtol=1e-8)
        assert np.sign(side.curvature) == sign


def test_arc_through_points_of_a_line():
    assert turn_through(np.zeros(2), np.array([1.0, 1.0]), np.array([3.0, 3.0])) == 0.0
    with pytest.raises(InputError, match="makes no arc"):
        turn_through(np.zeros(2), np.array([4.0, 4.0]), np.array([3.0, 3.0]))


def polygon(*vertices):
    return Polygon(vertices=vertices, parts=tuple("abcd"[: len(vertices)])).outline()


def closed(*sides):
    """A side of length 1 along x, and what comes after it."""
    return outline((straight("a", 1, 0), *sides))


BENT = (
    straight("a", 4, 0),
    straight("b", 4, 1),
    {"part": "c", "to": (0, 1), "through": (2, -0.5)},
    straight("d", 0, 0),
)
BACK = {"part": "b", "to": (0, 0)}
CUSP = (
    {"part": "cup", "to": (2, -2), "radius": 2.0},
    straight("base", -2, -2),
    straight("side", 0, 0),
)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: polygon((0, 0), (2, 2), (2, 0), (0, 2)), "crosses or touches"),
        (lambda: polygon((0, 0), (2, 0), (2, 0), (0, 2)), "has no length"),
        (
            lambda: Rectangle(lower_left=(0, 0), upper_right=(4, 1e-9)).outline(),
            "side 'right' at .* has no length: 1e-09, and places of the body are one within 2.4e-0",
        ),
        (lambda: polygon((0, 0), (1, 0), (2, 0)), "crosses or touches"),
        (lambda: outline(BENT), "crosses or touches itself"),
        (lambda: polygon((0, 0), (math.nan, 0), (0, 2)), "finite"),
        (lambda: Rectangle(lower_left=(0, 0), upper_right=(0, 2)), "upper_right must lie"),
        (lambda: outline(SQUARE, Circle("h", (4, 4), 1.0)), "loops cross or touch"),
        (lambda: outline(SQUARE, Circle("h", (9, 9), 1.0)), "two separate pieces"),
        (lambda: closed(straight("a", 1, 0), straight("b", 0, 0)), "has no length"),
        (lambda: closed(), "at least two sides"),
        (lambda: closed(BACK), "a loop of two straight sides at .* encloses nothing"),
        (lambda: outline(CUSP), r"sides 'base' and 'cup' meet at \(2, -2\) in a cusp"),
        (lambda: closed({**BACK, "radius": 0.4}), "less than half the distance"),
        (lambda: closed({**BACK, "radius": 0.0}), "must not be 0"),
        (lambda: closed({**BACK, "radius": 1.0, "through": (1, 1)}), "not by both"),
        (lambda: Circle("c", (0, 0), -1.0), "greater than 0"),
        (lambda: Outline(((Side(np.zeros(2), np.ones(2), "a"),),)), "open after side 'a'"),
    ],
)
def test_what_is_no_outline_is_refused_in_one_line(make, message):
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("body", "capacity"),
    [
        # Γ(1/4)²/(4π^(3/2)), a square of side 1; a disc; a needle: a quarter of its length
        (Rectangle(lower_left=(0, 0), upper_right=(1, 1)), 0.59017),
        (SideBySide(loops=(Circle(part="rim", center=(0, 0), radius=1.0),)), 1.0),
        (Rectangle(lower_left=(0, 0), upper_right=(1, 1e-3)), 0.25),
    ],
)
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.499])
def test_log_length_stays_below_the_degenerate_scale(body, capacity, nu):
    """The single layer is singular for a unit of length between c·exp(-1/(3-4ν)) and c, c being the
    capacity.

    For a constant traction the two ends are those of a needle, along and across it, and r r/r² adds
    between 0 and 1 to -(3-4ν) ln r.
    """
    lowest = capacity * math.exp(-1.0 / (3.0 - 4.0 * nu))
    assert body.outline().log_length < 0.91 * lowest


def cut(outline, count):
    """The same boundary with `count` sides in the place of each."""
    loops = []
    for loop in outline.loops:
        points = [side.point(np.linspace(0.0, 1.0, count + 1)) for side in loop]
        loops.append(
            tuple(
                Side(a, b, side.part, side.curvature)
                for side, p in zip(loop, points, strict=True)
                for a, b in itertools.pairwise(p)
            )
        )
    return Outline(tuple(loops))


@pytest.mark.parametrize("count", [2, 7, 40])
def test_sides_that_go_on_are_joined(count):
    body = BODY.outline()
    joined = cut(body, count).joined
    assert [side.part for side in joined.sides] == [side.part for side in body.sides]
    for side, whole in zip(joined.sides, body.sides, strict=True):
        assert np.allclose([side.start, side.end], [whole.start, whole.end], atol=1e-12)
        assert side.curvature == pytest.approx(whole.curvature, rel=1e-9)
        assert side.length == pytest.approx(whole.length)


@pytest.mark.parametrize("exterior", [False, True])
def test_sizes_are_those_of_the_polygon(exterior):
    """Convex outlines are measured without shapely, all others with it."""
    loops = {
        "square": [[0, 0], [4, 0], [4, 2], [0, 2]],
        "notched": [[0, 0], [4, 0], [2, 1], [4, 2], [0, 2]],
        "collinear": [[0, 0], [2, 0], [4, 0], [3, 2]],
    }
    for name, corners in loops.items():
        points = np.array(corners, dtype=float)
        sides = [
            Side(a, b, "side") for a, b in zip(points, np.roll(points, -1, axis=0), strict=True)
        ]
        outline = Outline(oriented([sides], exterior=exterior), exterior)
        polygon = outline.polygon()
        assert outline.thickness == pytest.approx(2.0 * polygon.area / polygon.length, rel=1e-14), (
            name
        )
        hull = shapely.MultiPoint(points).convex_hull
        assert outline.log_length == pytest.approx(hull.length / 24.0, rel=1e-14), name
        assert outline._is_convex == (name != "notched" and not exterior)


def test_an_outline_of_some_thickness_has_nothing_of_another_one():
    """One shape is one outline, checked once; with a thickness it is another one."""
    plain = outline(Circle("rim", (0.0, 0.0), 1.0))
    assert plain is outline(Circle("rim", (0.0, 0.0), 1.0)) and plain.joined.depth == 0.0
    for thickness in (2.0, 3.0):
        thick = plain.of_thickness(thickness)
        assert thick.depth == thick.joined.depth == thickness
        assert thick is plain.of_thickness(thickness) and thick.sides == plain.sides
    assert plain.depth == 0.0
