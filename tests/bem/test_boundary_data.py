"""Boundary data at nodes: frames, rollers, pressure, several contact parts, and every ill-posed
input refused."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import closing, drawn, elastic, moved, outline, problem, rectangle

from petcontact import InputError
from petcontact.pipeline.pose.discretise import discretise


def contact(part, g=1.0):
    return closing(part, friction_bound=g)


def free(*parts):
    return [drawn(part, [0.0, 0.0]) for part in parts]


def data(*boundary, body=None, **mesh):
    body = problem(
        material=elastic(1.0, 0.3),
        geometry=body or rectangle([0.0, 0.0], [2.0, 1.0]),
        mesh=mesh or {"element_size": 0.25},
        boundary=list(boundary),
    )
    discrete = discretise(body)
    return discrete.meshes[0], discrete.data[0], discrete.law


def test_expressions_are_evaluated_at_the_nodes_of_their_part():
    m, d, law = data(
        contact("bottom", "1 + s"),
        moved("top", ["x*y", "sin(x)"]),
        drawn("right", ["10*y", "nx + 2*ny"]),
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
    assert np.allclose(d.contact_frame[:, 0], [1.0, 0.0])  # the normal turned by 90 degrees
    assert d.states == 2 and not d.value[0].any()
    assert not d.traction_known[top].any() and d.traction_known[right].all()


def test_pressure_acts_against_the_normal():
    pressed = {"part": "arc", "condition": "traction", "pressure": "2 + x"}
    body = outline(arc=[0, 1, 1.0], left=[0, 0], bottom=[1, 0])
    m, d, _ = data(pressed, contact("left", 0.0), contact("bottom", 0.0), body=body)
    arc = m.nodes_of("arc")
    assert np.allclose(d.value[1, arc], -(2.0 + m.x[arc, :1]) * m.normal[arc], atol=0.02)
    # the integral of the load is that of the function, on few elements, too
    assert np.allclose(m.weight[arc] @ d.value[1, arc], [-2.0 - np.pi / 4.0, -2.5], rtol=1e-6)
    assert np.allclose(m.normal[arc], m.x[arc], atol=1e-14)


SIDES = free("left", "right")
LOGARITHM = {"part": "left", "condition": "traction", "pressure": "log(-1)"}


@pytest.mark.parametrize(
    ("boundary", "message"),
    [
        ((contact("left"), *free("right")), "part 'bottom' has no condition; if it is free write"),
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
            (contact("bottom"), moved("left", ["q", 0.0]), *free("right")),
            r"\[2\] \(left\)\.value\[0\]: unknown name 'q'",
        ),
        (
            (contact("bottom"), LOGARITHM, *free("right")),
            r"\(left\)\.pressure: expression .* is not finite",
        ),
    ],
)
def test_ill_posed_problems_are_refused_in_one_line(boundary, message):
    with pytest.raises(InputError, match=message) as caught:
        data(moved("top", [0.0, 0.0]), *boundary)
    assert "\n" not in str(caught.value)
