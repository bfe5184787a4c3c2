"""What is converged is right: light contact, contact between nodes, thin bodies, bodies of very
different stiffness."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys

import numpy as np
import pytest
from marks import slow
from shapes import cuboid, drawn, elastic, moved, problem, rectangle

from petcontact import InputError, solve
from petcontact.contact.methods.registry import LAW_MEMBERS, method_of
from petcontact.pipeline.judge.thickness import compactness

SOFT = elastic(1.0, 0.3)
CLOSING = {"part": "bottom", "condition": "contact", "normal": "unilateral"}
PUSHES = (1e-4, 1e-6, 1e-8, 1e-10)
UNIFORM = {"element_size": 0.1, "order": 2}


def light(push, mesh=None, gap="0.5*(x - 0.1234567)**2", **more):
    """A block of size 2 pressed onto a parabola whose lowest point is no node, but of a mesh that is
    graded to it."""
    graded = {"order": 3, "grading": 0.35, "graded_points": [[0.1234567, 0.0]]}
    sides = [drawn("left", [0.0, 0.0]), moved("right", [0.0, "free"])]
    return problem(
        material=SOFT,
        geometry=rectangle([-1.0, 0.0], [1.0, 2.0]),
        mesh=graded if mesh is None else mesh,
        boundary=[{**CLOSING, "gap": gap}, moved("top", ["free", -push]), *sides],
        **more,
    )


def loaded(width, height, size, order):
    """A block under uniform pressure: p = 1 everywhere."""
    sides = [moved("left", [0.0, "free"]), drawn("right", [0.0, 0.0])]
    return problem(
        material=SOFT,
        geometry=rectangle([0.0, 0.0], [width, height]),
        mesh={"element_size": size, "order": order},
        boundary=[CLOSING, drawn("top", [0.0, -1.0]), *sides],
    )


def test_light_contact_carries_its_load():
    """Contact is like Hertz's: the force falls a little faster than the push, whatever the push is
    next to the gaps."""
    found = [solve(light(push)) for push in PUSHES]
    assert all(solution.converged for solution in found)
    pair = [solution.last.pairs["bottom"] for solution in found]
    stiffness = np.array([p.force[1] for p in pair]) / PUSHES
    assert np.all(np.diff(stiffness) < 0.0) and np.all(stiffness > 0.1)
    # half the squared half-width of Hertz's contact is 4 (1 - ν²) F R / (π E) / 2
    closed = pair[1].weight[pair[1].state != 2].sum()
    assert closed == pytest.approx(2.0 * np.sqrt(4.0 * 0.91 * pair[1].force[1] / np.pi), rel=0.2)
    assert all(p.gap.min() > -1e-6 * push for p, push in zip(pair, PUSHES, strict=True))


def test_contact_that_no_digit_sees_is_not_converged():
    """A push of 1e-12 next to gaps of .6: the force is there, or the overlap is reported."""
    solution = solve(light(1e-12))
    assert solution.last.pairs["bottom"].force[1] > 1e-14 or "surfaces overlap" in solution.reason


def test_overlap_between_nodes_is_found():
    """Uniform elements of size .1 have no node where surfaces would touch, which overlap by the
    whole push there."""
    solution = solve(light(1e-8, UNIFORM))
    assert not solution.converged
    assert "overlap between nodes: pair 'bottom' by 1e-08 at (0.123457, 0)" in solution.reason
    assert solution.reason.count("refine") == 1


@pytest.mark.parametrize(("increments", "warned"), [(20, True), ("auto", False)])
def test_overlap_between_nodes_counts_at_the_end_of_a_step(increments, warned):
    """Where a contact begins to grow from a point no mesh has its nodes, however its increments are
    chosen."""
    solution = solve(light(0.0014, UNIFORM, step=[{"name": "press", "increments": increments}]))
    assert solution.converged and "overlap" not in solution.reason
    assert any("in some increments" in warning for warning in solution.warnings) == warned


@pytest.mark.parametrize(("most", "accepted"), [(0.01, True), (1e-5, False)])
def test_a_step_that_only_begins_a_contact_is_judged_beside_the_others(most, accepted):
    """An overlap at the end of a step is accepted where another step displaces ten times as much,
    and told."""
    steps = [
        {"name": name, "boundary": [{"body": "body", "part": "top", "value": [0.0, -push]}]}
        for name, push in (("touch", 1e-5), ("press", most), ("away", 0.0))
    ]
    solution = solve(light(1.0, UNIFORM, step=steps))
    assert solution.converged == accepted
    told = [text for text in solution.warnings if "overlap" in text]
    if accepted:
        assert len(told) == 1 and "'touch': surfaces overlap" in told[0]
    else:
        assert solution.failed.name == "touch"
        assert "by 1e-05 at (0.123457, 0)" in solution.reason
        assert solution.reason.count("refine") == 1


def test_overlap_between_nodes_is_found_in_space():
    """A sphere whose lowest point is no node, pushed by less than what lies between it and the
    nodes around it."""
    gap = "0.5*(x - 0.1234567)**2 + 0.5*(y - 0.05)**2"
    sides = [drawn(part, [0.0] * 3) for part in ("left", "right", "front", "back")]
    sphere = problem(
        material=SOFT,
        geometry=cuboid([-1, -1, 0], [1, 1, 1]),
        mesh={"element_size": 0.5, "order": 1},
        boundary=[{**CLOSING, "gap": gap}, moved("top", [0.0, 0.0, -1e-5]), *sides],
    )
    solution = solve(sphere)
    place = re.search(r"by 1e-05 at \((.*?)\)", " ".join(solution.reason.split()))[1].split(", ")
    assert not solution.converged
    assert [float(word) for word in place] == pytest.approx([0.1234567, 0.05, 0.0], abs=1e-4)


class Own:
    """Of a law, what the protocol asks for and no more."""

    def __init__(self, law):
        for key in LAW_MEMBERS:
            setattr(self, key, getattr(law, key))


def test_overlap_is_found_whatever_the_law():
    """A method that ends with nine tenths of the tractions, and so with an overlap, and says that
    it converged."""
    posed = light(1e-2)
    newton = method_of(posed.method)

    def lazy(system, law, iteration):
        state = newton(system, law, iteration)
        return dataclasses.replace(
            state, sigma=0.9 * state.sigma, v=system.u_0 + system.apply(0.9 * state.sigma)
        )

    for law in (None, lambda nodes: Own(nodes.law)):
        assert solve(posed, law=law).converged
        assert "surfaces overlap by" in solve(posed, law=law, method=lazy).reason


@pytest.mark.parametrize(("width", "height"), [(1e6, 1.0), (1.0, 1e6)])
def test_thin_bodies_are_refused(width, height):
    with pytest.raises(InputError, match=r"times as large as the body is thick|has no length"):
        solve(loaded(width, height, max(width, height) / 40.0, 1))


@pytest.mark.parametrize(("size", "order"), [slow(1e4, 2), (1e6, 1), slow(1e6, 2)])
def test_an_elimination_without_digits_is_not_converged(monkeypatch, size, order):
    """The same without the look at the mesh: the elastic residual is small where p is off by its
    own size."""
    monkeypatch.setattr("petcontact.pipeline.pose.discretise.check_meshes", lambda *bodies: [])
    solution = solve(loaded(size, 1.0, size / 40.0, order))
    off = np.abs(solution.tried[-1].pairs["bottom"].pressure - 1.0).max()
    assert not solution.converged or off < 1e-3


@pytest.mark.parametrize(("order", "few"), [(2, 13), (4, 6)])
def test_bending_that_is_a_tenth_off_is_warned_of(order, few):
    """A cantilever, 20 times as long as thick: where no warning is given its end moves by .89 and
    more."""
    free = [drawn(part, [0.0, 0.0]) for part in ("top", "bottom")]
    ends = [moved("left", [0.0, 0.0]), drawn("right", [0.0, 1e-6])]

    def bent(count, order):
        beam = rectangle([0.0, 0.0], [20.0, 1.0])
        mesh = {"element_size": 20.0 / count, "order": order}
        solution = solve(problem(material=SOFT, geometry=beam, mesh=mesh, boundary=[*ends, *free]))
        warned = any("bending comes out wrong" in warning for warning in solution.warnings)
        return solution.last.bodies["body"].u[:, 1].max(), warned

    exact, (shorter, early), (_, warned) = bent(40, 5)[0], bent(few + 1, order), bent(few, order)
    assert warned and not early and abs(shorter / exact - 1.0) < 0.11


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
    bottom = {**CLOSING, "friction_coefficient": 0.3}
    sides = [drawn(part, [0.0, 0.0]) for part in ("left", "right")]
    block = problem(
        material=elastic(100.0, 0.3),
        geometry=rectangle([0.0, 0.0], [2.0, 1.0]),
        mesh={"element_size": 0.006, "order": 1},
        boundary=[bottom, drawn("top", [0.0, -1.0]), *sides],
        bem={"mat_type": "dense"},
    )
    case = tmp_path / "case.toml"
    case.write_text(block.toml())
    words = [sys.executable, "-c", PEAK, case]
    # 1.03 again and again; 1.20 was seen once, with much else on the machine, whose pages it may be
    done = subprocess.run(words, capture_output=True, text=True, timeout=300, check=True)
    converged, ratio = done.stdout.split()
    assert converged == "True" and 0.8 < float(ratio) < 1.3


def test_what_bends_moves_farther_than_its_tractions_move_a_compact_body(unestimated):
    """A square of edge 2 that is pulled: u = x σ/E, |t|/|u| = (4/(4 + 4/3))^½ E. A beam with
    tractions yσ/h at its ends: u_y = x² σ/(2 E h), off its mean by (1/80 - 1/144)^½ (2a)² σ/(2 E h).
    Its ends and u_x are left out, about h/a."""

    def pulled(height, way):
        ends = {"left": f"-({way})", "right": way, "top": 0.0, "bottom": 0.0}
        return solve(
            problem(
                material=elastic(2.0, 0.0),
                geometry=rectangle([-1, -height], [1, height]),
                mesh=UNIFORM,
                boundary=[drawn(part, [value, 0.0]) for part, value in ends.items()],
            )
        )

    square = pulled(1.0, "1.0")
    for solution in (square, dataclasses.replace(square, steps=[], failed=square.last)):
        assert compactness(solution) == pytest.approx(0.75**0.5, rel=1e-6)
    slender = (0.05**3 / 3.0 / (1.0 / 80.0 - 1.0 / 144.0)) ** 0.5 / 2.0
    assert compactness(pulled(0.05, "y")) == pytest.approx(slender, rel=0.15)
