"""Boundary data at nodes: frames, rollers, pressure, several contact parts, and every ill-posed
input refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from petcontact import (
    Contact,
    Displacement,
    InputError,
    Material,
    MeshOptions,
    Polygon,
    Problem,
    Rectangle,
    SideBySide,
    Traction,
)
from petcontact.bem.boundary_data import free_motions
from petcontact.pipeline.pose.discretise import discretise

BOX = Rectangle(lower_left=(0.0, 0.0), upper_right=(2.0, 1.0))
STEEL = Material(young_modulus=1.0, poisson_ratio=0.3)
NAMES = ("bottom", "right", "top", "left")
DOVETAIL = Polygon(vertices=((0, 0), (4, 0), (3, 2), (1, 2)), parts=NAMES)


def contact(part, g=1.0):
    return Contact(part=part, friction_bound=g)


def free(*parts):
    return tuple(Traction(part=part, value=(0.0, 0.0)) for part in parts)


def clamped(part):
    return Displacement(part=part, value=(0.0, 0.0))


def data(*boundary, body=BOX, **mesh):
    problem = Problem(
        material=STEEL,
        geometry=body,
        mesh=MeshOptions(**(mesh or {"element_size": 0.25})),
        boundary=boundary,
    )
    discrete = discretise(problem)
    return discrete.meshes[0], discrete.data[0], discrete.law


def motions(*boundary, **given):
    """How many rigid motions are found by contact or are free; it is all or none of a body."""
    mesh, known, _ = data(*boundary, **given)
    return free_motions(known, mesh).shape[2]


def test_expressions_are_evaluated_at_the_nodes_of_their_part():
    m, d, law = data(
        contact("bottom", "1 + s"),
        Displacement(part="top", value=("x*y", "sin(x)")),
        Traction(part="right", value=("10*y", "nx + 2*ny")),
        *free("left"),
        order=2,
        element_size=0.5,
    )
    top, right, bottom = (m.nodes_of(part) for part in ("top", "right", "bottom"))
    assert np.allclose(d.value[1, top], np.column_stack([m.x[top, 0] * 1.0, np.sin(m.x[top, 0])]))
    assert np.allclose(
        d.value[1, right], np.column_stack([10.0 * m.x[right, 1], np.ones(len(right))])
    )
    assert np.allclose(law.bound, 1.0 + m.x[bottom, 0]) and np.array_equal(d.contact_nodes, bottom)
    assert d.states == 2 and not d.value[0].any()
    assert not d.traction_known[top].any() and d.traction_known[right].all()


def test_pressure_acts_against_the_normal():
    body = SideBySide(
        loops=(
            (
                {"part": "arc", "to": (0, 1), "radius": 1.0},
                {"part": "left", "to": (0, 0)},
                {"part": "bottom", "to": (1, 0)},
            ),
        )
    )
    m, d, _ = data(
        Traction(part="arc", pressure="2 + x"),
        contact("left", 0.0),
        contact("bottom", 0.0),
        body=body,
    )
    arc = m.nodes_of("arc")
    assert np.allclose(d.value[1, arc], -(2.0 + m.x[arc, :1]) * m.normal[arc], atol=0.02)
    # the integral of the load is that of the function, on few elements, too
    assert np.allclose(m.weight[arc] @ d.value[1, arc], [-2.0 - np.pi / 4.0, -2.5], rtol=1e-6)
    assert np.allclose(m.normal[arc], m.x[arc], atol=1e-14)


def test_roller_knows_one_displacement_and_no_traction_along_the_other():
    m, d, _ = data(
        contact("bottom"), Displacement(part="left", value=(0.5, "free")), *free("top", "right")
    )
    left = m.nodes_of("left")
    assert np.array_equal(d.traction_known[left], [[False, True]] * len(left))
    assert np.array_equal(d.value[1, left], [[0.5, 0.0]] * len(left))


def test_tangent_is_the_normal_turned_by_90_degrees_and_frames_are_orthonormal():
    m, d, law = data(
        contact("bottom"), contact("left", 2.0), contact("right", "3"), *free("top"), body=DOVETAIL
    )
    nodes = d.contact_nodes
    normal = m.normal[nodes]
    tangent, along = d.contact_frame[:, 0], d.contact_directions[:, 0]
    assert np.allclose(tangent, np.column_stack([-normal[:, 1], normal[:, 0]]))
    assert np.allclose(np.einsum("nci,ndi->ncd", d.frame, d.frame), np.eye(2), atol=1e-14)
    bottom = m.node_part[nodes] == 0
    assert np.allclose(tangent[bottom], [1.0, 0.0])
    assert {float(g) for g in law.bound} == {1.0, 2.0, 3.0}
    # the direction nearer to the x axis comes first, so that equations belong to their unknowns
    assert np.all(np.abs(d.frame[:, 0, 0]) >= math.sqrt(0.5) - 1e-12)
    assert np.array_equal(d.frame[nodes, along], tangent)
    assert d.traction_known[nodes, along].all() and not d.traction_known[nodes, 1 - along].any()
    assert np.array_equal(d.contact_unknowns, 2 * nodes + along)


SIDES = free("left", "right")


@pytest.mark.parametrize(
    ("boundary", "message"),
    [
        ((contact("left"), *free("right")), "part 'bottom' has no condition; each of bottom,"),
        (
            (contact("bottm"), *SIDES),
            r"boundary\[1\]\.part: no part 'bottm', did you mean 'bottom'",
        ),
        ((contact("top"),), r"boundary\[1\]\.part: 'top' has a condition already"),
        (
            (contact("bottom", -1.0), *SIDES),
            r"\[1\] \(bottom\)\.friction_bound: must be >= 0, is -1",
        ),
        ((contact("bottom", "1 - x"), *SIDES), "must be >= 0, is -0.875 at x = 1.875, y = 0"),
        ((contact("bottom", "1/(x-x)"), *SIDES), "friction_bound: expression .* is not finite"),
        (
            (contact("bottom"), Displacement(part="left", value=("q", 0.0)), *free("right")),
            r"body 'body': left\.value\[0\]: unknown name 'q'",
        ),
        (
            (contact("bottom"), Traction(part="left", pressure="log(-1)"), *free("right")),
            r"body 'body': left\.pressure: expression .* is not finite",
        ),
    ],
)
def test_ill_posed_problems_are_refused_in_one_line(boundary, message):
    with pytest.raises(InputError, match=message) as caught:
        data(clamped("top"), *boundary)
    assert "\n" not in str(caught.value)


def test_bodies_of_any_size_are_judged_alike():
    """Whether a body is held depends on its shape only: 1e-6 of a unit, 1e6 units, far off the
    origin."""
    for size, offset in ((1e-6, 0.0), (1e6, 0.0), (1.0, 1e5)):
        body = Rectangle(
            lower_left=(offset, offset), upper_right=(offset + 2.0 * size, offset + size)
        )
        held = (
            contact("bottom"),
            Displacement(part="left", value=(0.0, "free")),
            *free("top", "right"),
        )
        given = {"body": body, "element_size": 0.25 * size}
        assert motions(*held, **given) == 0
        assert motions(contact("bottom", 0.0), *free("left", "top", "right"), **given) == 3
