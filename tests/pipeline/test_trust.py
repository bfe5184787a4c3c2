"""What is converged is right: light contact, contact between nodes, thin bodies, bodies of very
different stiffness."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys

import facets
import numpy as np
import pytest
from marks import slow
from shapes import cuboid, drawn, elastic, moved, problem, rectangle, solid, touching

import petcontact as pc
from petcontact import InputError, Problem, adapt, solve
from petcontact.contact.methods.registry import LAW_MEMBERS, method_of
from petcontact.pipeline.judge.thickness import compactness, slenderness

CYLINDER = """
[material]
young_modulus = {modulus}
poisson_ratio = 0.3
[geometry]
shape = "rectangle"
lower_left = [{left}, 0.0]
upper_right = [{right}, {height}]
{mesh}
[[boundary]]
part = "bottom"
condition = "contact"
normal = "unilateral"
gap = "{gap}"
[[boundary]]
part = "top"
condition = "displacement"
value = ["free", {push}]
[[boundary]]
part = "left"
condition = "traction"
value = [0.0, 0.0]
[[boundary]]
part = "right"
condition = "displacement"
value = [0.0, "free"]
"""
GRADED = "[mesh]\norder = 3\ngrading = 0.35\ngraded_points = [[{0}, 0.0]]"
LOAD = """
[material]
young_modulus = 1.0
poisson_ratio = 0.3
[geometry]
shape = "rectangle"
upper_right = [{width}, {height}]
lower_left = [0.0, 0.0]
[mesh]
element_size = {size}
order = {order}
[[boundary]]
part = "bottom"
condition = "contact"
normal = "unilateral"
[[boundary]]
part = "top"
condition = "traction"
value = [0.0, -1.0]
[[boundary]]
part = "left"
condition = "displacement"
value = [0.0, "free"]
[[boundary]]
part = "right"
condition = "traction"
value = [0.0, 0.0]
"""

SPHERE = """
material = {{ young_modulus = 1.0, poisson_ratio = 0.3 }}
geometry = {{ shape = "box", lower = [-1, -1, 0], upper = [1, 1, 1] }}
mesh = {{ element_size = 0.5, order = 1 }}
[[boundary]]
part = "bottom"
condition = "contact"
normal = "unilateral"
gap = "0.5*(x - 0.1234567)**2 + 0.5*(y - 0.05)**2"
[[boundary]]
part = "top"
condition = "displacement"
value = [0.0, 0.0, -1e-5]
""" + "".join(
    f"""[[boundary]]
part = "{part}"
condition = "traction"
value = [0.0, 0.0, 0.0]
"""
    for part in ("left", "right", "front", "back")
)


@pytest.fixture
def loaded(tmp_path):
    """An assembly from a template."""

    def load(template, **values):
        path = tmp_path / "case.toml"
        path.write_text(template.format(**values))
        return pc.load(path)

    return load


PUSHES = (1e-4, 1e-6, 1e-8, 1e-10)


def light(load, push, *, unit=1.0, modulus=1.0, mesh=None):
    """A block of size 2 pressed onto a parabola whose lowest point is no node, in a unit of
    length."""
    lowest = 0.1234567 * unit
    return load(
        CYLINDER,
        modulus=modulus,
        left=-unit,
        right=unit,
        height=2.0 * unit,
        push=-push * unit,
        gap=f"0.5*(x - {lowest!r})**2/{unit!r}",
        mesh=GRADED.format(lowest) if mesh is None else mesh,
    )


def test_light_contact_carries_its_load(loaded):
    """Contact is like Hertz's: the force falls a little faster than the push, whatever the push is
    next to the gaps."""
    force = [solve(light(loaded, push)) for push in PUSHES]
    assert all(solution.converged for solution in force)
    pair = [solution.last.pairs["bottom"] for solution in force]
    stiffness = np.array([p.force[1] for p in pair]) / PUSHES
    assert np.all(np.diff(stiffness) < 0.0) and np.all(stiffness > 0.1)
    # half the squared half-width of Hertz's contact is 4 (1 - ν²) F R / (π E) / 2
    closed = pair[1].weight[pair[1].state != 2].sum()
    assert closed == pytest.approx(2.0 * np.sqrt(4.0 * 0.91 * pair[1].force[1] / np.pi), rel=0.2)
    assert all(p.gap.min() > -1e-6 * push for p, push in zip(pair, PUSHES, strict=True))


def test_contact_that_no_digit_sees_is_not_converged(loaded):
    """A push of 1e-12 next to gaps of .6: the force is there, or the overlap is reported."""
    solution = solve(light(loaded, 1e-12))
    assert solution.last.pairs["bottom"].force[1] > 1e-14 or "surfaces overlap" in solution.reason


def test_overlap_between_nodes_is_found(loaded):
    """Uniform elements of size .1 have no node where surfaces would touch, which overlap by the
    whole push there."""
    solution = solve(light(loaded, 1e-8, mesh="[mesh]\nelement_size = 0.1\norder = 2"))
    assert not solution.converged
    assert "overlap between nodes: pair 'bottom' by 1e-08 at (0.123457, 0)" in solution.reason
    assert solution.reason.count("refine") == 1


@pytest.mark.parametrize(("increments", "warned"), [("20", True), ('"auto"', False)])
def test_overlap_between_nodes_counts_at_the_end_of_a_step(loaded, increments, warned):
    """Where a contact begins to grow from a point no mesh has its nodes, however its increments are
    chosen."""
    mesh = (
        f'[mesh]\nelement_size = 0.1\norder = 2\n[[step]]\nname = "press"\nincrements = '
        f"{increments}"
    )
    solution = solve(light(loaded, 0.0014, mesh=mesh))
    assert solution.converged and "overlap" not in solution.reason
    assert any("before its end" in warning for warning in solution.warnings) == warned


def test_a_step_that_only_begins_a_contact_is_judged_beside_the_others(loaded):
    """An overlap at the end of a step is accepted where another step displaces ten times as much,
    and told."""
    steps = "".join(
        f"""[[step]]
name = "{name}"
[[step.boundary]]
body = "body"
part = "top"
value = [0.0, {-push!r}]
"""
        for name, push in (("touch", 1e-5), ("press", 0.01), ("away", 0.0))
    )
    mesh = "[mesh]\nelement_size = 0.1\norder = 2\n"
    pressed, lifted = (
        solve(light(loaded, 1.0, mesh=mesh + part))
        for part in (steps, steps.replace("0.01]", "1e-05]"))
    )
    assert pressed.converged and [step.name for step in pressed.steps] == ["touch", "press", "away"]
    assert [
        "'touch': surfaces overlap" in warning
        for warning in pressed.warnings
        if "overlap" in warning
    ] == [True]
    assert lifted.failed.name == "touch" and "by 1e-05 at (0.123457, 0)" in lifted.reason
    assert lifted.reason.count("refine") == 1


def test_overlap_between_nodes_is_found_in_space(loaded):
    """A sphere whose lowest point is no node, pushed by less than what lies between it and the
    nodes around it."""
    solution = solve(loaded(SPHERE))
    place = [
        float(word)
        for word in re.search(r"by 1e-05 at \((.*?)\)", " ".join(solution.reason.split()))[1].split(
            ", "
        )
    ]
    assert not solution.converged and place == pytest.approx([0.1234567, 0.05, 0.0], abs=1e-4)


class Own:
    """Of a law, what the protocol asks for and no more."""

    def __init__(self, law):
        for key in LAW_MEMBERS:
            setattr(self, key, getattr(law, key))


def test_overlap_is_found_whatever_the_law(loaded):
    """A method that ends with nine tenths of the tractions, and so with an overlap, and says that
    it converged."""
    problem = light(loaded, 1e-2)
    newton = method_of(problem.method)

    def lazy(system, law, iteration):
        state = newton(system, law, iteration)
        return dataclasses.replace(
            state, sigma=0.9 * state.sigma, v=system.u_0 + system.apply(0.9 * state.sigma)
        )

    for law in (None, lambda nodes: Own(nodes.law)):
        assert solve(problem, law=law).converged
        assert "surfaces overlap by" in solve(problem, law=law, method=lazy).reason


@pytest.mark.parametrize(("width", "height"), [(1e6, 1.0), (1.0, 1e10)])
def test_thin_bodies_are_refused(loaded, width, height):
    problem = loaded(LOAD, width=width, height=height, size=max(width, height) / 40.0, order=1)
    with pytest.raises(InputError, match="times as large as the body is thick"):
        solve(problem)


@pytest.mark.parametrize(
    ("height", "advice"),
    [
        (0.05, "mesh the file anew with cells of about 0.05 there$"),
        (0.11, "mesh the file anew with cells of about 0.11 there, or order 2$"),
    ],
)
def test_what_a_thin_body_of_a_file_can_do(tmp_path, height, advice):
    """Its panels are those of the file: there is no element_size to choose. Order 2 helps where it
    allows as much."""
    file = facets.box(
        tmp_path / "plate.msh", (0.0, 0.0, 0.0), (1.0, 1.0, height), (2, 2, 1), triangles=False
    )
    held = moved("bottom", [0.0, 0.0, 0.0])
    plate = solid("plate", {"shape": "gmsh", "file": file}, held, mesh={"order": 1})
    with pytest.raises(InputError, match=advice):
        solve(problem(body=[plate]))


@pytest.mark.parametrize(
    ("size", "order"),
    [
        slow(1e4, 2),
        (1e6, 1),
        slow(1e6, 2),
    ],
)
def test_an_elimination_without_digits_is_not_converged(loaded, monkeypatch, size, order):
    """The same without the look at the mesh: the elastic residual is small where p is off by its
    own size."""
    monkeypatch.setattr("petcontact.pipeline.pose.discretise.check_meshes", lambda *bodies: [])
    solution = solve(loaded(LOAD, width=size, height=1.0, size=size / 40.0, order=order))
    off = np.abs(solution.tried[-1].pairs["bottom"].pressure - 1.0).max()
    assert not solution.converged or off < 1e-3


def test_size_over_thickness(loaded):
    """Squares have none that counts, strips have that of their long sides, and next to a corner of
    9° it is no matter."""
    strip = solve(loaded(LOAD, width=10.0, height=1.0, size=1.0, order=2))
    ratio = slenderness(strip.meshes["body"])
    assert strip.converged and ratio.max() == pytest.approx(1.0) and np.count_nonzero(ratio) == 20
    square = solve(loaded(LOAD, width=1.0, height=1.0, size=0.25, order=2))
    assert slenderness(square.meshes["body"]).max() == 0.0


@pytest.mark.parametrize(("order", "few"), [(2, 13), (4, 5)])
def test_bending_that_is_a_tenth_off_is_warned_of(order, few):
    """A cantilever, 20 times as long as thick: where no warning is given its end moves by .89 and
    more."""
    free = [drawn(part, [0.0, 0.0]) for part in ("top", "bottom")]
    ends = [moved("left", [0.0, 0.0]), drawn("right", [0.0, 1e-6])]

    def bent(count, order):
        beam, mesh = rectangle([0.0, 0.0], [20.0, 1.0]), {"element_size": 20.0 / count}
        solution = solve(
            problem(
                material=elastic(1.0, 0.3),
                boundary=[*ends, *free],
                geometry=beam,
                mesh={**mesh, "order": order},
            )
        )
        warned = any("bending comes out wrong" in warning for warning in solution.warnings)
        return solution.last.bodies["body"].u[:, 1].max(), warned

    exact, (shorter, early), (_, warned) = bent(40, 5)[0], bent(few + 1, order), bent(few, order)
    assert warned and not early and abs(shorter / exact - 1.0) < 0.11


def test_adaptive_solve_without_contact_tells_no_error(loaded):
    """Nothing is closed: there is no pressure whose error could be 0."""
    apart = adapt(
        loaded(
            CYLINDER,
            modulus=1.0,
            left=-1.0,
            right=1.0,
            height=1.0,
            push=0.0,
            mesh="",
            gap="1e-3 + x**2",
        ),
        1e-3,
    )
    assert apart.converged
    assert "error of p and q not known: contact carries nothing" in apart.verdict()


PRESSED = """
[material]
young_modulus = 100.0
poisson_ratio = 0.3
[geometry]
shape = "rectangle"
lower_left = [0.0, 0.0]
upper_right = [2.0, 1.0]
[mesh]
element_size = 0.25
order = 1
[[boundary]]
part = "bottom"
condition = "contact"
normal = "unilateral"
friction_coefficient = 0.3
[[boundary]]
part = "top"
condition = "traction"
value = [0.0, -1.0]
[[boundary]]
part = "left"
condition = "traction"
value = [0.0, 0.0]
[[boundary]]
part = "right"
condition = "traction"
value = [0.0, 0.0]
[[step]]
increments = {increments}
"""


def test_energy_dissipated_does_not_depend_on_increments(loaded):
    """Where all loads grow together p and slip do, and half of the work of the final tractions on
    the slip is dissipated."""
    spent = []
    for increments in (1, 3, '"auto"'):
        solution = solve(loaded(PRESSED, increments=increments))
        pairs = [step.pairs["bottom"] for step in solution.steps]
        spent.append(sum(pair.dissipated for pair in pairs))
        assert solution.converged
        assert sum(pair.dissipated_error for pair in pairs) == pytest.approx(spent[0] / len(pairs))
    last = pairs[-1]
    work = -float(last.weight @ np.sum(last.sigma_t * last.slip, axis=1))
    assert spent == pytest.approx([0.5 * work] * 3, rel=1e-6)


PEAK = """
import re, sys
from pathlib import Path
import petcontact as pc
from petcontact.pipeline.choice import dense_memory
from petcontact.runtime.petsc import petsc
petsc()  # the newest libraries take 30 MB
status = lambda key: 1024 * int(re.search(key + r":\\s*(\\d+)", Path("/proc/self/status").read_text())[1])
problem = pc.load(sys.argv[1])
before = status("VmRSS")
solution = pc.solve(problem)
(mesh,), m = solution.meshes.values(), sum(len(nodes) for nodes in solution.nodes.values())
print(solution.converged, (status("VmHWM") - before) / dense_memory([2 * mesh.n_nodes], [2 * m], 2 * m))
"""


@pytest.mark.slow
def test_memory_is_predicted(tmp_path):
    """The peak of a solve with a third of 2000 nodes in contact is within a fifth of what is said
    before."""
    case = tmp_path / "case.toml"
    case.write_text(
        PRESSED.format(increments=1).replace("element_size = 0.25", "element_size = 0.006")
        + '\n[bem]\nmat_type = "dense"\n'
    )
    words = [sys.executable, "-c", PEAK, case]
    # 1.03 again and again; 1.20 was seen once, with much else on the machine, whose pages it may be
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, check=True)
    converged, ratio = done.stdout.split()
    assert converged == "True" and 0.8 < float(ratio) < 1.3


@pytest.mark.parametrize(("size", "told"), [(1.0, True), slow(0.125, False)])
def test_what_overlaps_between_nodes_in_contact_is_told_and_in_the_estimate(size, told):
    """A rigid ball on panels wider than the contact: only nodes beside the middle are pressed."""
    shape, held = cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, 0.0]), moved("bottom", [0.0, 0.0, 0.0])
    mesh = {"element_size": 0.5, "element_sizes": {"top": size}, "order": 1, "exponent": 1.0}
    solution = solve(
        problem(
            body=[solid("block", shape, held, mesh=mesh)],
            obstacle=[{"name": "ball", "displacement": [0.0, 0.0, -0.1]}],
            contact=[touching("pair", "block.top", "ball", gap="(x**2 + y**2)/1.2")],
        )
    )
    warned = [
        text
        for text in solution.warnings
        if "overlap between nodes in contact: pair 'pair' by" in text
    ]
    assert solution.converged and bool(warned) == told
    worst = solution.accuracy.error, solution.accuracy.resultants
    assert min(worst) > 0.5 if told else worst[0] < 0.3 and worst[1] < 0.1


def test_what_bends_moves_farther_than_its_tractions_move_a_compact_body(unestimated):
    """A square of edge 2 that is pulled: u = x σ/E, |t|/|u| = (4/(4 + 4/3))^½ E. A beam with
    tractions yσ/h at its ends: u_y = x² σ/(2 E h), off its mean by (1/80 - 1/144)^½ (2a)² σ/(2 E h).
    Its ends and u_x are left out, about h/a."""

    def pulled(height, way):
        ends = (("left", f"-({way})"), ("right", way), ("top", 0.0), ("bottom", 0.0))
        conditions = [
            {"part": part, "condition": "traction", "value": [value, 0.0]} for part, value in ends
        ]
        shape = {"shape": "rectangle", "lower_left": [-1, -height], "upper_right": [1, height]}
        return solve(
            Problem(
                material={"young_modulus": 2.0, "poisson_ratio": 0.0},
                geometry=shape,
                mesh={"element_size": 0.1, "order": 2},
                boundary=conditions,
            )
        )

    square = pulled(1.0, "1.0")
    for solution in (square, dataclasses.replace(square, steps=[], failed=square.last)):
        assert compactness(solution) == pytest.approx(0.75**0.5, rel=1e-6)
    slender = (0.05**3 / 3.0 / (1.0 / 80.0 - 1.0 / 144.0)) ** 0.5 / 2.0
    assert compactness(pulled(0.05, "y")) == pytest.approx(slender, rel=0.15)
