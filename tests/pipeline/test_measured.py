"""Measured profiles in contact: gaps, tools and sides through points against Hertz, and their
noise."""

from __future__ import annotations

import json

import numpy as np
import pytest
from problems import block, posed

from petcontact import solve
from petcontact.errors import InputError
from petcontact.model.shapes.plane import SideBySide
from petcontact.pipeline.pose.discretise import discretise

E, NU, FORCE, R = 210_000.0, 0.3, 1000.0, 300.0
HERTZ = np.sqrt(FORCE * E / (1.0 - NU**2) / (np.pi * R))
"""Largest pressure of an elastic body under a rigid one, relative radius R."""
X = np.linspace(-20.0, 20.0, 401)
ARC = R - np.sqrt(R**2 - X**2)
CROWN = np.where(
    np.abs(X) < 8.0,
    ARC,
    R
    - 0.2 * np.sqrt(R**2 - 64.0) * 4.0
    - np.sqrt(60.0**2 - np.minimum(np.abs(X) - 6.4, 60.0) ** 2),
)
"""An arc of radius R with shoulders of radius 60, whose centre lies 4/5 on the way to the middle of
the arc from where they meet."""
NOISE = np.random.default_rng(0).normal(0.0, 2e-3, len(X))
DRIVEN = f'displacement = [0.0, "free"]\nforce = [0.0, {-FORCE}]\n'


def rows(*columns):
    return json.dumps(np.column_stack(columns).tolist())


def plate(tool="", contact=""):
    """A plate that a rail presses; its gap or its shape is given."""
    mesh = "element_size = 2.0, element_sizes = { top = 0.1 }, order = 1"
    text = block("plate", [-15.0, -15.0], [15.0, 0.0], E, NU, mesh, bottom=[0.0, 0.0])
    text += f'[[obstacle]]\nname = "rail"\n{DRIVEN}{tool}\n'
    text += '[[contact]]\nname = "pair"\nsecondary = "plate.top"\nprimary = "rail"\n'
    return text + f"direction = [0.0, 1.0]\n{contact}\n"


def rail(head, low=-ARC[0]):
    """A rail with a head through points, that a flat plate presses."""
    mesh = "element_size = 2.0, element_sizes = { head = 0.1 }, order = 1"
    return f"""
[[body]]
name = "rail"
material = {{ young_modulus = {E}, poisson_ratio = {NU} }}
geometry = {{ shape = "outline", loops = [[ {head}, {{ part = "right", to = [20.0, -30.0] }},
    {{ part = "bottom", to = [-20.0, -30.0] }}, {{ part = "left", to = [-20.0, {low}] }} ]] }}
mesh = {{ {mesh} }}
boundary = [{{ part = "bottom", condition = "displacement", value = [0.0, 0.0] }}]
[[obstacle]]
name = "plate"
shape = "plane"
normal = [0.0, -1.0]
{DRIVEN}
[[contact]]
name = "pair"
secondary = "rail.head"
primary = "plate"
direction = [0.0, 1.0]
"""


def gap(noise=0.0, smooth=0.0, arc=ARC):
    return plate("", f"gap = {{ points = {rows(X, arc + noise)}, smooth = {smooth} }}")


def tool(noise=0.0, smooth=0.0, arc=ARC):
    return plate(f'shape = "points"\npoints = {rows(X, arc + noise)}\nsmooth = {smooth}')


def head(noise=0.0, smooth=0.0, arc=ARC):
    given = f"points = {rows(X, -arc - noise)}, smooth = {smooth}"
    return rail(f'{{ part = "head", {given} }}', -arc[0])


def found(text):
    solution = solve(posed(text))
    assert solution.converged, solution.reason
    return float(solution.last.pairs["pair"].pressure.max()), solution


@pytest.mark.parametrize("kind", [gap, tool, head])
def test_a_profile_through_points_of_an_arc_is_the_arc(kind):
    largest, solution = found(kind())
    assert largest == pytest.approx(HERTZ, rel=0.02)
    assert not any("noise" in warning for warning in solution.warnings)


def test_a_side_through_points_is_the_side_with_arcs():
    by_arc = f'{{ part = "head", to = [20.0, {-ARC[0]}], radius = {-R} }}'
    (arc, _), (points, _) = found(rail(by_arc)), found(head())
    assert points == pytest.approx(arc, rel=2e-3)


@pytest.mark.parametrize("kind", [gap, tool, head])
def test_noise_is_told_by_what_it_does_to_the_pressure(kind):
    largest, solution = found(kind(NOISE, 8e-3, CROWN))
    (told,) = [warning for warning in solution.warnings if "noise" in warning]
    share = float(told.split("largest pressure to ")[1].split("%")[0]) / 100.0
    assert abs(largest / HERTZ - 1.0) < 3.0 * share < 0.3


@pytest.mark.parametrize("kind", [tool, head])
def test_a_curve_that_follows_noise_is_told(kind):
    text = kind(NOISE, 2e-3)
    solution = solve(posed(text))
    assert any("which their spline follows; give smooth = " in w for w in solution.warnings)


def test_a_closed_curve_of_points_is_a_disc():
    """A ring pressed on the ground, adaptively: Hertz, and periodic where it begins."""
    turn = np.linspace(0.0, 2.0 * np.pi, 129)[:-1]
    rim = rows(10.0 * np.sin(turn), 10.0 - 10.0 * np.cos(turn))
    text = f"""
[[body]]
name = "ring"
material = {{ young_modulus = {E}, poisson_ratio = {NU} }}
geometry = {{ shape = "outline", loops = [
    [{{ part = "rim", points = {rim} }}], {{ part = "hole", center = [0.0, 10.0], radius = 4.0 }}] }}
boundary = [{{ part = "hole", condition = "displacement", value = [0.0, 0.0] }}]
[[obstacle]]
name = "ground"
shape = "plane"
normal = [0.0, 1.0]
displacement = [0.0, "free"]
force = [0.0, {FORCE}]
[[contact]]
name = "pair"
secondary = "ring.rim"
primary = "ground"
direction = [0.0, -1.0]
"""
    largest, _ = found(text)
    assert largest == pytest.approx(HERTZ * np.sqrt(R / 10.0), rel=3e-3)


SIDE = '{{ part = "head", {} }}'


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (f"points = {rows(X[:3], ARC[:3])}", "points: needs at least 4 rows, got 3"),
        (f"points = {rows(X[::-1], -ARC)}, columns = [0, 2]", "columns: must be 2 columns (x, y)"),
        (f"points = {rows(X, -ARC)}, radius = 3.0", "radius does not go with points"),
        ("to = [20.0, -1.0], smooth = 0.1", "smooth does not go with to"),
        ("radius = 2.0", "needs its end, to, or the points"),
        ("points = [[0, 0], [1, 1], [1, 1], [2, 0]]", "row 3 repeats the one before, [1.0, 1.0]"),
        ("points = [[0, 0], [2, 1], [1, 1], [1, -1], [3, 2]]", "the curve crosses itself; rows"),
        ("points = [[0, 0], [1, nan], [2, 1], [3, 1]]", "must be finite numbers, row 2"),
        ('points = "nothing.csv"', "nothing.csv: cannot be read"),
    ],
)
def test_a_mistake_is_one_line(given, told):
    with pytest.raises(InputError) as error:
        problem = posed(rail(SIDE.format(given)))
        problem.outline(0)
    assert told in str(error.value) and "\n" not in str(error.value)


HEAD = {"part": "head", "points": np.column_stack([X[::-1], -ARC[::-1]])}
FOOT = {"part": "foot", "to": (0.0, -40.0)}


@pytest.mark.parametrize("loop", [[HEAD, FOOT], [FOOT, HEAD]])
def test_the_side_before_goes_on_straight_to_the_first_point(loop):
    sides = SideBySide(loops=[loop]).outline().sides
    straight = [(*s.start, *s.end) for s in sides if s.part == "foot"]
    ends = (-20.0, -ARC[0]), (0.0, -40.0), (20.0, -ARC[0])
    assert np.allclose(straight, [(*ends[0], *ends[1]), (*ends[1], *ends[2])])


def test_a_side_may_begin_one_point_before_its_points():
    head = {"part": "head", "points": HEAD["points"][1:]}
    right = {"part": "right", "to": tuple(HEAD["points"][0])}
    sides = SideBySide(loops=[[head, FOOT, right]]).outline().sides
    assert np.array_equal(sides[0].start, HEAD["points"][0])
    assert [s.part for s in sides if s.curvature == 0.0] == ["foot", "right"]


def test_noise_of_a_side_that_is_turned_about_an_axis_is_told():
    """A barrel between a half space and nothing: its side follows the noise of its points."""
    z = np.linspace(-1.0, 1.0, 41)
    noise = np.random.default_rng(1).normal(0.0, 2e-3, 41) * (np.abs(z) < 0.99)
    told = []
    for r in (2.0 - 0.2 * z**2, 2.0 - 0.2 * z**2 + noise):
        text = f"""
[[body]]
name = "barrel"
material = {{ young_modulus = 1000.0, poisson_ratio = 0.3 }}
mesh = {{ element_size = 1.5 }}
boundary = [{{ part = "bottom", condition = "displacement", value = [0.0, 0.0, 0.0] }}]
[body.geometry]
shape = "revolved"
loops = [[ {{ part = "bottom", to = [{r[0]}, -1.0] }}, {{ part = "side", points = {rows(r, z)} }},
    {{ part = "top", to = [0.0, 1.0] }}, {{ part = "axis", to = [0.0, -1.0] }} ]]
[[obstacle]]
name = "wall"
shape = "plane"
point = [2.0, 0.0, 0.0]
normal = [-1.0, 0.0, 0.0]
displacement = [-0.01, 0.0, 0.0]
[[contact]]
name = "pair"
secondary = "barrel.side"
primary = "wall"
direction = [1.0, 0.0, 0.0]
"""
        discrete = discretise(posed(text))
        told.append([f.text for f in discrete.findings if "have a noise" in f.text])
    assert told[0] == [] and len(told[1]) == 1
