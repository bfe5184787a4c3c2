"""Rigid tools with a shape: the distance to it is the gap that an expression gives."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest
import scipy
from problems import block, obstacle, posed
from scipy.spatial.transform import Rotation
from shapes import cuboid, drawn, moved, problem, rectangle, solid, touching

from petcontact import Obstacle, solve
from petcontact.errors import InputError
from petcontact.given.rounded_box import RoundedBox
from petcontact.given.shapes import Aimed, Ball, Distance, HalfSpace, Rod
from petcontact.given.sites import Sites
from petcontact.model.tools import aimed, shape_of
from petcontact.pipeline.judge.remainders import gap_remainders

R, DEPTH = 2.0, 0.01
AXIAL = 'symmetry = "axial"\n'
ROD = 'shape = "cylinder"\nradius = 1.0\n'
BALL = f"centre = {{}}\nradius = {R}"
ROUND = f"{R - DEPTH} - sqrt({R**2} - x**2{{}})"
"""The gap below a circle, a sphere or a cylinder whose lowest point lies DEPTH below the top."""
SLOPE = 0.004
ROUNDED = f"where(abs(x) < 0.3, 0, where(abs(x) < 0.6, 0.3 - sqrt(abs(0.09 - (abs(x) - 0.3)**2)), 9)) - {DEPTH}"
"""The gap below a punch with a flat of 0.6 and corners of radius 0.3."""
PARABOLA = [[x / 20.0, (x / 20.0) ** 2 / 4.0] for x in range(-24, 25)]
CASES = {
    "circle": (2, "", 'shape = "circle"\n' + BALL.format([0.0, R - DEPTH]), ROUND.format("")),
    "slanted plane": (
        2,
        "",
        f'shape = "plane"\npoint = [0.0, {-DEPTH}]\nnormal = [{SLOPE}, -1.0]',
        f"{SLOPE}*x - {DEPTH}",
    ),
    "sphere, axial": (
        2,
        AXIAL,
        'shape = "sphere"\n' + BALL.format([0.0, R - DEPTH]),
        ROUND.format(""),
    ),
    "circle, axial": (
        2,
        AXIAL,
        'shape = "circle"\n' + BALL.format([0.0, R - DEPTH]),
        ROUND.format(""),
    ),
    "plane, axial": (
        2,
        AXIAL,
        f'shape = "plane"\ncentre = [0.0, {-DEPTH}]\nnormal = [0.0, -1.0]',
        f"{-DEPTH}",
    ),
    "sphere": (
        3,
        "",
        'shape = "sphere"\n' + BALL.format([0.0, 0.0, R - DEPTH]),
        ROUND.format(" - y**2"),
    ),
    "cylinder": (
        3,
        "",
        f'shape = "cylinder"\nfrom = [0.0, -3.0, {R - DEPTH}]\nto = [0.0, 3.0, {R - DEPTH}]\n'
        f"radius = {R}",
        ROUND.format(""),
    ),
    "rounded polygon": (
        2,
        "",
        f'shape = "polygon"\nfillet = 0.3\nvertices = [[-0.6, {-DEPTH}], [0.6, {-DEPTH}], [0.6, 1.0], '
        "[-0.6, 1.0]]",
        ROUNDED,
    ),
    "turned box": (
        2,
        "",
        f'shape = "box"\nfillet = 0.3\nlower = [{-DEPTH}, -0.6]\nupper = [1.0, 0.6]\nangle = 90.0',
        ROUNDED,
    ),
    "points": (
        2,
        "",
        f'shape = "points"\ncentre = [0.0, {-DEPTH}]\npoints = {PARABOLA}',
        f"x**2/4 - {DEPTH}",
    ),
    "polygon, axial": (
        2,
        AXIAL,
        f'shape = "polygon"\nfillet = 0.3\nvertices = [[0.0, {-DEPTH}], [0.6, {-DEPTH}], [0.6, 1.0], '
        "[0.0, 1.0]]",
        ROUNDED,
    ),
    "box, axial": (
        2,
        AXIAL,
        f'shape = "box"\nfillet = 0.3\nlower = [0.0, {-DEPTH}]\nupper = [0.6, 1.0]',
        ROUNDED,
    ),
    "box": (
        3,
        "",
        f'shape = "box"\nfillet = 0.3\nlower = [-0.6, -2.0, {-DEPTH}]\nupper = [0.6, 2.0, 1.0]',
        ROUNDED,
    ),
    "points, along y": (
        3,
        "",
        f'shape = "points"\nalong = [0, 1, 0]\ncentre = [0.0, 0.0, {-DEPTH}]\npoints = {PARABOLA}',
        f"x**2/4 - {DEPTH}",
    ),
    "plane": (
        3,
        "",
        f'shape = "plane"\npoint = [0.0, 0.0, {-DEPTH}]\nnormal = [0.0, {SLOPE}, -1.0]',
        f"{SLOPE}*y - {DEPTH}",
    ),
}


def pressed(d: int, head: str, tool: str, gap: str = "", mesh: str = "", contact: str = "") -> str:
    """A block of height 1 whose top a tool presses."""
    low = [0.0 if head else -1.0] + [-1.0] * (d - 1)
    mesh = mesh or ("element_size = 0.2" if d == 2 else "element_size = 0.5")
    text = head + block("block", low, [1.0] * (d - 1) + [0.0], 100.0, 0.3, mesh, bottom=[0.0] * d)
    text += obstacle("tool", [0.0] * d, tool)
    up = [0.0] * (d - 1) + [1.0]
    text += f'[[contact]]\nname = "pair"\nsecondary = "block.top"\nprimary = "tool"\n{contact}'
    return text + f"direction = {up}\n" + (f'gap = "{gap}"\n' if gap else "")


def last(text: str):
    solution = solve(posed(text))
    assert solution.converged, solution.reason
    return solution.last.pairs["pair"]


@pytest.mark.usefixtures("unestimated", "unsampled")
@pytest.mark.parametrize("case", CASES)
def test_a_shape_presses_as_its_expression(case):
    d, head, tool, gap = CASES[case]
    with_shape, by_hand = last(pressed(d, head, tool)), last(pressed(d, head, "", gap))
    largest = by_hand.pressure.max()
    assert largest > 0.0
    met = np.isfinite(with_shape.gap)
    assert np.allclose(with_shape.gap[met], by_hand.gap[met], atol=1e-9)
    assert np.all(by_hand.gap[~met] > 0.3)
    assert np.allclose(with_shape.pressure, by_hand.pressure, atol=1e-7 * largest)


def test_meshes_and_estimates_see_a_shape_as_its_expression():
    """The mesh by default resolves the edge of contact; the judge looks between the nodes."""
    d, head, tool, gap = CASES["circle"]
    found = [
        solve(posed(pressed(d, head, *given, mesh="order = 2")))
        for given in ((tool, ""), ("", gap))
    ]
    assert len(found[0].last.pairs["pair"].x) == len(found[1].last.pairs["pair"].x)
    forces = [solution.last.pairs["pair"].force for solution in found]
    assert np.allclose(*forces, rtol=1e-6)


def test_nodes_that_the_rays_miss_stay_open():
    tool = f'shape = "circle"\ncentre = [0.0, {0.5 - DEPTH}]\nradius = 0.5'
    gap = f"where(abs(x) < 0.5, {0.5 - DEPTH} - sqrt(abs(0.25 - x**2)), 1.0)"
    mesh = "element_size = 0.04, order = 2"
    found, wanted = last(pressed(2, "", tool, mesh=mesh)), last(pressed(2, "", "", gap, mesh))
    missed = np.abs(found.x[:, 0]) > 0.5
    assert missed.any() and np.all(np.isinf(found.gap[missed]))
    assert np.allclose(found.pressure, wanted.pressure, atol=1e-7 * wanted.pressure.max())


def test_a_tool_that_no_ray_meets_is_told():
    tool = 'shape = "circle"\ncentre = [9.0, 1.0]\nradius = 0.5'
    solution = solve(posed(pressed(2, "", tool)))
    assert "never touch" in solution.verdict()
    assert solution.last.pairs["pair"].pressure.max() == 0.0


PIN = """
[[body]]
name = "pin"
material = {{ young_modulus = 1000.0, poisson_ratio = 0.3 }}
geometry = {{ shape = "outline", loops = [[
    {{ part = "face", to = [0.0, -1.0], radius = 1.0 }},
    {{ part = "face", to = [1.0, 0.0], radius = 1.0 }},
    {{ part = "top", to = [-1.0, 0.0] }} ]] }}
mesh = {{ element_size = 0.1, order = 2 }}
boundary = [{{ part = "top", condition = "displacement", value = [0.0, -0.02] }}]
[[obstacle]]
name = "hole"
{}
[[contact]]
name = "pair"
secondary = "pin.face"
primary = "hole"
{}
"""


@pytest.mark.usefixtures("unestimated", "unsampled")
def test_a_hollow_circle_holds_a_pin():
    """Along the normals the bore is y n_y + sqrt(1.05² - y² (1 - n_y²)) away from the middle."""
    tool = 'shape = "circle"\ncentre = [0.0, 0.05]\nradius = 1.05\nhollow = true'
    gap = 'gap = "0.05*ny + sqrt(1.05**2 - 0.05**2*(1 - ny**2)) - 1"'
    found, wanted = (last(PIN.format(*given)) for given in ((tool, ""), ("", gap)))
    assert wanted.pressure.max() > 1.0
    assert np.allclose(found.gap, wanted.gap, atol=1e-9)
    assert np.allclose(found.pressure, wanted.pressure, atol=1e-7 * wanted.pressure.max())


@pytest.mark.parametrize("hollow", [False, True])
@pytest.mark.parametrize(
    "shape",
    [
        Ball((0.1, -0.2, 0.3), 0.9),
        HalfSpace((0.1, 0.2, 0.3), (1.0, 2.0, -0.5)),
        Rod((-0.5, 0.0, -0.2), (0.4, 0.3, 0.6), 0.5),
        RoundedBox((-0.7, -0.5, -0.4), (0.6, 0.8, 0.5), 0.3),
        RoundedBox((-0.7, -0.5, -0.4), (0.6, 0.8, 0.5), 0.3, (0.3, -0.2, 0.1), (0.3, -0.5, 1.1)),
    ],
)
def test_a_ray_ends_on_the_surface(shape, hollow):
    """Between entry and exit a line is inside; before and after it, outside."""
    rng = np.random.default_rng(7)
    x, ray = rng.uniform(-2.0, 2.0, (400, 3)), rng.normal(size=(400, 3))
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    enter, leave, _ = shape.crossing(x, ray)
    line = np.linspace(-6.0, 6.0, 2001)
    points = x[:, None] + line[:, None] * ray[:, None]
    shown = _inside(shape, points)
    told = (line > enter[:, None]) & (line < leave[:, None])
    clear = np.minimum(abs(line - enter[:, None]), abs(line - leave[:, None])) > 1e-9
    # a line that meets only the back of a half space never enters it
    counts = clear & ((enter <= leave)[:, None] | (not isinstance(shape, HalfSpace)))
    assert np.array_equal(told[counts], shown[counts])
    assert told.any(axis=1).mean() > 0.05
    distance = Distance("gap", Aimed("tool", "shape", shape, None, hollow)).at(Sites(x, ray))
    met = np.isfinite(distance)
    assert np.array_equal(distance[met], (leave if hollow else enter)[met])


def _inside(shape, points):
    if isinstance(shape, Ball):
        return np.linalg.norm(points - shape.centre, axis=-1) < shape.radius
    if isinstance(shape, HalfSpace):
        return (points - np.array(shape.point)) @ np.array(shape.normal) < 0.0
    if isinstance(shape, RoundedBox):
        away = (points - shape.centre).reshape(-1, 3)  # turned back
        points = Rotation.from_rotvec(shape.turn).apply(away, inverse=True).reshape(points.shape)
        points = points + shape.centre
        low, high = np.add(shape.lower, shape.fillet), np.subtract(shape.upper, shape.fillet)
        return np.linalg.norm(points - np.clip(points, low, high), axis=-1) < shape.fillet
    axis = np.subtract(shape.end, shape.start)
    height = (points - np.array(shape.start)) @ axis / (axis @ axis)
    off = np.linalg.norm(points - shape.start - height[..., None] * axis, axis=-1)
    return (height > 0.0) & (height < 1.0) & (off < shape.radius)


@pytest.mark.usefixtures("unestimated", "unsampled")
def test_a_box_in_space_is_turned_as_a_polygon_along_the_axis_is():
    """By 90 degrees it is the box that stands the other way, by others the prism."""
    tool = 'shape = "{}"\ncentre = [0.1, 0.0, 0.0]\nangle = {}\n{}'
    box = "lower = [-0.4, 0.0, -0.3]\nupper = [0.6, 0.4, 0.3]"
    prism = "vertices = [[-0.4, 0.0], [0.6, 0.0], [0.6, 0.4], [-0.4, 0.4]]\nalong = [0, 0, 1]"
    shapes = [
        tools_of(tool.format(shape, angle, keys))
        for angle in (90.0, 25.0)
        for shape, keys in (("box", box), ("polygon", prism))
    ]
    rng = np.random.default_rng(3)
    x, ray = rng.uniform(-1.0, 1.0, (200, 3)), np.zeros((200, 3))
    x[:, 2], ray[:, :2] = 0.0, rng.normal(size=(200, 2))
    ray /= np.linalg.norm(ray, axis=1)[:, None]
    for turned, wanted in (shapes[:2], shapes[2:]):
        ends = zip(turned.crossing(x, ray)[:2], wanted.crossing(x, ray)[:2], strict=True)
        for found, right in ends:
            met = np.isfinite(right)
            assert np.allclose(found[met], right[met], atol=1e-12)
            assert met.mean() > 0.2


def tools_of(keys):
    return shape_of(Obstacle(name="tool", **tomllib.loads(keys)), axial=False)


def test_a_bore_is_open_at_its_ends():
    bore = Rod((0.0, 0.0, 0.0), (0.0, 0.0, 2.0), 1.0, is_bore=True)
    seen = Distance("gap", Aimed("bore", "cylinder", bore, None, hollow=True))
    x = np.array([[0.5, 0.0, 1.0], [0.5, 0.0, 1.0], [0.0, 0.0, 3.0], [1.1, 0.0, 1.0]])
    ray = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert np.allclose(seen.at(Sites(x, ray)), [0.5, np.inf, np.inf, -0.1])


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ('shape = "circle"', "obstacle[0]: radius: this key is required of a circle"),
        ("radius = 1.0", "radius: belongs to a shape"),
        ('shape = "plane"\nnormal = [0, 1]\nhollow = true', "hollow: a plane has none"),
        ('shape = "sphere"\nradius = -1.0', "obstacle[0].radius: must be greater than 0"),
        ('shape = "cone"', "obstacle[0].shape: must be 'circle', 'plane', 'sphere', 'cylinder'"),
        ('shape = "polygon"', "vertices: this key is required of a polygon"),
        (
            'shape = "cylinder"\nfrom = [0, 0, 1]\nto = [0, 0, 1]\nradius = 1.0',
            "from and to are the same point",
        ),
        ('shape = "circle"\nradius = 1.0\ncentre = [0, 0, 1]', "centre: needs 2 components"),
        (
            'shape = "sphere"\nradius = 1.0\ncentre = [0, 1]',
            'axial problems (in the plane "circle")',
        ),
        ('shape = "plane"\nnormal = [0.0, 0.0]', "must be a vector other than zero"),
    ],
)
def test_a_shape_that_is_none_is_refused(given, told):
    with pytest.raises(InputError) as error:
        posed(pressed(2, "", given))
    assert told in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("head", "given", "told"),
    [
        ("", 'shape = "sphere"\nradius = 1.0', "has the shape 'sphere' in 3 dimensions; the body"),
        (AXIAL, 'shape = "sphere"\ncentre = [1.0, 1.0]\nradius = 1.0', "must lie on the axis"),
        (AXIAL, 'shape = "plane"\nnormal = [1.0, -1.0]', "must be along the axis"),
        (AXIAL, f"{ROD}from = [1.0, 0.0]\nto = [1.0, 2.0]", "lies on the axis x = 0"),
        (AXIAL, f"{ROD}from = [0.0, 0.0, 0.0]\nto = [0.0, 0.0, 2.0]", "2 components, of cyl"),
        ("", f"{ROD}from = [0.0, 0.0]\nto = [0.0, 2.0]", "3 components, of cylinders in space"),
    ],
)
def test_a_shape_of_other_problems_is_refused(head, given, told):
    with pytest.raises(InputError, match=told):
        solve(posed(pressed(2, head, given)))


def test_a_cylinder_on_the_axis_of_revolution_is_a_shaft():
    """In either direction; a ray along the radius and one along the axis meet it."""
    for ends in ((-1.0, 2.0), (2.0, -1.0)):
        first, last = ((0.0, z) for z in ends)
        tool = Obstacle("shaft", shape="cylinder", from_=first, to=last, radius=0.5)
        shaft = Distance("gap", aimed(tool, None, axial=True))
        x, ray = np.array([[0.75, 0.0], [0.25, 3.0]]), np.array([[-1.0, 0.0], [0.0, -1.0]])
        assert np.allclose(shaft.at(Sites(x, ray)), [0.25, 1.0])


def test_python_has_the_same_keys():
    tool = Obstacle("axle", shape="cylinder", from_=(0, 0, 0), to=(0, 0, 2), radius=1.0)
    assert aimed(tool, None, axial=False).shape == Rod((0.0, 0.0, 0.0), (0.0, 0.0, 2.0), 1.0)


def test_rays_along_and_across_the_axis_of_a_cylinder():
    rod = Distance("gap", Aimed("rod", "cylinder", Rod((0.0, 0.0, 0.0), (0.0, 0.0, 2.0), 1.0)))
    x = np.array([[0.5, 0.0, 3.0], [1.5, 0.0, 3.0], [2.0, 0.0, 1.0], [2.0, 0.0, 3.0]])
    ray = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    assert np.allclose(rod.at(Sites(x, ray)), [1.0, np.inf, 1.0, np.inf])


@pytest.mark.parametrize(("shape", "centre"), [("circle", [0.1, 0.3]), ("sphere", [0.1, 0.2, 0.3])])
def test_a_tool_smaller_than_a_face_leaves_what_its_expression_leaves(shape, centre):
    """Where the tool is not above the face the surfaces are open; the expression goes on beside
    it."""
    d, radius = len(centre), 0.3
    distance = "+".join(f"({c} - {at})**2" for c, at in zip("xyz", centre[:-1], strict=False))
    box = rectangle([-1.0, -1.0], [1.0, 0.0]) if d == 2 else cuboid([-1.0] * 3, [1.0, 1.0, 0.0])
    sides = ("left", "right", "front", "back")[: 2 * d - 2]
    free = [drawn(part, [0.0] * d) for part in sides]
    mesh = {"element_size": 0.25}
    body = solid("block", box, moved("bottom", [0.0] * d), *free, mesh=mesh)
    tool = {"name": "tool", "displacement": [0.0] * (d - 1) + [-0.05]}
    shapes = {"shape": shape, "centre": centre, "radius": radius}
    up = [0.0] * (d - 1) + [1.0]
    gap = f"{radius} - sqrt(max({radius}**2 - ({distance}), 0))"
    left = []
    for own, law in ((shapes, {}), ({}, {"gap": gap, "direction": up})):
        pair = touching("c", "block.top", "tool", **law)
        solution = solve(problem(body=[body], obstacle=[tool | own], contact=[pair]))
        mesh, pair = solution.meshes["block"], solution.last.pairs["c"]
        (remainder,) = gap_remainders(solution.posed, [mesh], [solution.nodes["c"]])
        assert np.isinf(pair.gap).any() == (own is shapes)
        left.append(remainder.squares(pair).sum())
    assert left[0] == pytest.approx(left[1], rel=0.2)


def half_space(head, tool):
    """A large block, which a tool presses with a force of 10."""
    low = [0.0 if head else -50.0, -50.0]
    text = head + block(
        "block", low, [50.0, 0.0], 1000.0, 0.3, "accuracy = 0.05", bottom=[0.0, 0.0]
    )
    text += obstacle("tool", [0.0, "free"], f"force = [0.0, -10.0]\n{tool}")
    text += '[[contact]]\nname = "pair"\nsecondary = "block.top"\nprimary = "tool"\n'
    return text + "direction = [0.0, 1.0]\n"


STIFF = 1000.0 / (1.0 - 0.3**2)


def test_a_punch_with_rounded_corners_touches_as_far_as_ciavarella_says():
    """A flat of half width a and radius R under P: with sin φ = a/b, P R / (a² E*) = (π - 2φ) / (2
    sin² φ) - cot φ (M. Ciavarella, D. A. Hills and G. Monno, The influence of rounded edges on
    indentation by a flat punch, Proc. Inst. Mech. Eng. C 212, 1998)."""

    def load(phi):
        return 0.5 * STIFF * ((np.pi - 2.0 * phi) / (2.0 * np.sin(phi) ** 2) - 1.0 / np.tan(phi))

    phi = scipy.optimize.brentq(lambda phi: load(phi) - 10.0, 1e-2, 0.5 * np.pi - 1e-9)
    tool = 'shape = "box"\nlower = [-2.0, 0.0]\nupper = [2.0, 3.0]\nfillet = 1.0'
    assert np.isclose(last(half_space("", tool)).area, 2.0 / np.sin(phi), rtol=1e-3)


def test_a_cone_of_a_polygon_touches_as_far_as_sneddon_says():
    """Under P a cone of slope m touches up to a: P = π E* a² m / 2."""
    tool = 'shape = "polygon"\nvertices = [[0.0, 0.0], [10.0, 0.2], [0.0, 0.2]]'
    radius = np.sqrt(10.0 / (0.5 * np.pi * STIFF * 0.02))
    pair = last(half_space(AXIAL, tool))
    assert np.isclose(pair.area, np.pi * radius**2, rtol=2e-3)
