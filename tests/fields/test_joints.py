"""Fields next to the joints of elements: bounded at every distance, and convergent."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import drawn, moved
from smooth_field import STEEL, boundary_data, exact, meshed

from petcontact import MeshOptions, Problem, Rectangle, field_at, solve
from petcontact.geometry.arcs import end_tangents

DISTANCES = (1e-2, 1e-3, 1e-10)


def next_to_joints(mesh, corners):
    """Ends of elements at corners, or on straight sides and arcs, and the direction into the body
    there."""
    _, after = mesh.neighbours()
    first, last = end_tangents(mesh.start, mesh.end, mesh.half_angle)
    chosen = np.flatnonzero((np.sum(last * first[after], axis=1) < 0.9) == corners)
    inwards = np.stack([-last[chosen] - first[after[chosen]], last[chosen] + first[after[chosen]]])[
        [0, 1], :, [1, 0]
    ].T
    return mesh.end[chosen], inwards / np.hypot(*inwards.T)[:, None]


def worst(mesh, corners=False):
    """Largest errors of u and σ, relative to their maxima, at each distance from joints."""
    x, inwards = next_to_joints(mesh, corners)
    assert len(x) >= 3
    errors = []
    for distance in DISTANCES:
        points = x + distance * inwards
        found, wanted = field_at(mesh, *boundary_data(mesh), STEEL, points), exact(points)
        errors.append(
            [np.abs(a - b).max() / np.abs(b).max() for a, b in zip(found, wanted, strict=True)]
        )
    return np.array(errors).T


@pytest.mark.parametrize(
    ("order", "size", "bound"), [(0, 0.1, 6e-3), (1, 0.2, 3e-2), (4, 0.2, 3e-4)]
)
def test_stress_is_bounded_next_to_joints(order, size, bound):
    """The same at 1e-3 and at 1e-10; without care it is 3e8 times the largest stress at 1e-12 (order
    1). Toe and bottom are different parts."""
    errors = worst(meshed(element_size=size, order=order))[1]
    assert errors.max() < bound and errors.max() < 3.0 * errors[1] + 1e-3 * bound


@pytest.mark.parametrize("order", [1, 4])
def test_at_corners_only_a_logarithm_is_left(order):
    errors = worst(meshed(element_size=0.2, order=order), corners=True)[1]
    assert errors[-1] < 8.0 * errors[1] + 3e-4 and errors[-1] < 0.15


def test_a_traction_that_jumps_in_truth_still_jumps():
    """A load on half of a side: its edge is the end of an element."""
    problem = Problem(
        material=STEEL,
        geometry=Rectangle(lower_left=(0, 0), upper_right=(4, 2)),
        mesh=MeshOptions(element_size=0.25, order=2),
        boundary=[
            {"part": "bottom", "condition": "contact", "friction_bound": 0.1},
            moved("left", (0, 0)),
            drawn("right", (0, 0)),
            drawn("top", (0, "where(x < 2, -1.0, 0.0)")),
        ],
    )
    solution = solve(problem)
    points = np.array([[x, 2.0 - 1e-7] for x in (1.9, 1.99, 1.999, 2.001, 2.01, 2.1)])
    _, vertical, shear = field_at(solution.mesh, solution.u, solution.traction, STEEL, points)[1].T
    # u has a logarithmic slope there, which no polynomial has: -4.5 and 3.5 beside the edge before,
    # ±0.25 off now
    assert np.abs(vertical - [-1.0, -1.0, -1.0, 0.0, 0.0, 0.0]).max() < 0.3
    assert np.abs(shear).max() < 0.05
    assert vertical[2] < vertical[3] - 0.4
