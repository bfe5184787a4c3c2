"""Displacement and stress inside, on points, grids, and next to the joints of elements."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from examples import example
from prepared import operators
from shapes import closing, cuboid, drawn, elastic, moved, problem, rectangle, solid
from smooth_field import BODY, STEEL, boundary_data, exact, meshed

import petcontact.fields.interior
from petcontact import InputError, Material, MeshOptions, solve
from petcontact.fields.interior import field_at, field_on_grid
from petcontact.fields.interior_grid import triangulate
from petcontact.fields.stress_state import StressState
from petcontact.geometry.arcs import end_tangents

POINTS = np.array(
    [[2.5, 0.5], [1.0, 0.3], [3.9, 1.99], [0.31, 0.31], [2.0, 0.55], [0.001, 1.5], [3.3, 1e-4]]
)


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize(
    ("options", "errors"),
    [
        ({"element_size": 0.1}, (3e-6, 2e-4)),
        ({"element_size": 0.05}, (1e-7, 2e-5)),
        ({"element_size": 0.2, "order": 2}, (5e-6, 5e-4)),
        ({"element_size": 0.1, "order": 4}, (1e-9, 1e-6)),
    ],
)
def test_field_of_exact_boundary_data_up_to_the_boundary(options, errors, plane):
    """Points in the middle, and at 1e-4 to a few hundredths from straight sides and arcs."""
    material = Material(young_modulus=200.0, poisson_ratio=0.3, plane=plane)
    mesh = meshed(**options)
    u, stress = field_at(mesh, *boundary_data(mesh, material), material, POINTS)
    wanted_u, wanted_stress = exact(POINTS, material)
    assert np.abs(u - wanted_u).max() < errors[0] * np.abs(wanted_u).max()
    assert np.abs(stress - wanted_stress).max() < errors[1] * np.abs(wanted_stress).max()


@pytest.mark.parametrize(
    ("point", "message"),
    [
        ((2.0, 1.0), r"\(2, 1\) does not lie inside"),
        ((5.0, 1.0), "does not lie inside"),
        ((0.2, 0.2), "does not lie inside"),
        ((np.nan, 1.0), "finite"),
        ((1.0, 1.0, 0.0), "finite coordinates"),
    ],
)
def test_points_outside_the_body_are_refused(point, message):
    """In the hole, beside the body, and cut off by the toe (which a chord would not cut off)."""
    mesh = meshed(element_size=0.4)
    with pytest.raises(InputError, match=message):
        field_at(mesh, *boundary_data(mesh), STEEL, np.array([point]))


@pytest.mark.parametrize("d", [2, 3])
def test_stress_goes_on_from_the_inside_to_the_boundary_beside_a_point_force(d):
    shape = rectangle([0, 0], [1, 1]) if d == 2 else cuboid([0, 0, 0], [1, 1, 1])
    more = {
        "mesh": {"element_size": (0.1, 0.5)[d - 2], "order": 3},
        "material": elastic(200.0, 0.3),
    }
    point = {"at": [0.45, 0.5, 0.6][:d], "force": [0.3, 0.2, 1.0][:d]}
    held = moved("bottom", [0.0] * d)
    solution = solve(problem(body=[solid("block", shape, held, point_force=[point], **more)]))
    inward, foot = np.array([-1.0, 0.0, 0.0])[:d], np.array([1.0, 0.53, 0.57])[:d]
    stress = solution.stress_at(foot + np.outer([0.0, 1e-4, 1e-3, 5e-3, 1e-2], inward))
    size = np.abs(stress[0]).max()
    assert np.abs(stress[1] - stress[0]).max() < 2e-3 * size
    assert np.abs(np.diff(stress, axis=0)).max() < 0.1 * size


def test_grid_fills_the_body_and_keeps_inside():
    mesh = meshed(element_size=0.1)
    field = field_on_grid(mesh, *boundary_data(mesh), STEEL, (60, 30))
    points, cells, (_, stress) = field.x, field.cells, exact(field.x)
    assert np.abs(field.stress - stress).max() < 2e-2 * np.abs(stress).max()
    assert np.allclose(field.sigma_zz, 0.3 * (field.stress[:, 0] + field.stress[:, 1]))
    body = BODY.outline().polygon(400)
    assert len(mesh.loops()) == 2
    assert np.all(shapely.contains_xy(body, *points.T))
    a, b, c = (points[cells[:, k]] for k in range(3))
    area = 0.5 * (
        (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    )
    assert np.all(area > 0.0) and area.sum() == pytest.approx(body.area, rel=5e-3)
    assert set(np.unique(cells)) == set(range(len(points)))
    with pytest.raises(InputError, match="at least 2 x 2 cells"):
        triangulate(mesh, (1, 30))


@pytest.mark.parametrize("window", [None, (np.array([0.0, 0.9]), np.array([0.2, 1.1]))])
def test_a_grid_reaches_to_the_axis(window):
    """The axis carries no elements: without points on it, triangles span it from end to end."""
    held, mesh = moved("bottom", ["free", 0.0]), {"element_size": 0.5}
    shaft = problem(
        symmetry="axial", body=[solid("shaft", rectangle([0, 0], [1, 2]), held, mesh=mesh)]
    )
    points, cells = triangulate(solve(shaft).mesh, (20, 20), window)
    corners = points[cells]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    assert area.sum() == pytest.approx(2.0 if window is None else 0.04, rel=2e-2)
    assert np.ptp(corners, axis=1).max() < (0.3 if window is None else 0.03)


def test_von_mises_and_principal_stresses():
    stress = np.array([[100.0, 0.0, 0.0], [0.0, 0.0, 50.0], [80.0, 80.0, 0.0], [30.0, -10.0, 25.0]])
    zz = np.array([0.0, 0.0, 80.0, 6.0])
    full = np.array(
        [[[s[0], s[2], 0], [s[2], s[1], 0], [0, 0, z]] for s, z in zip(stress, zz, strict=True)]
    )
    deviator = full - np.einsum("nii->n", full)[:, None, None] / 3.0 * np.eye(3)
    state = StressState(stress[:, :2], stress[:, :2], stress, zz)
    assert np.allclose(state.tensor, full)
    assert np.allclose(state.von_mises, np.sqrt(1.5 * np.sum(deviator**2, axis=(1, 2))))
    assert np.allclose(state.principal_in_plane, np.linalg.eigvalsh(full[:, :2, :2])[:, ::-1])


@pytest.mark.parametrize("body", [BODY, None], ids=["arcs", "straight"])
def test_groups_seen_from_afar_are_the_sum_of_their_elements(monkeypatch, body):
    """The series of the potentials against the integrals, at points from well inside to almost on
    the boundary."""
    mesh = (
        meshed(body, element_size=0.02)
        if body
        else operators(example(2, mesh=MeshOptions(element_size=0.02))).mesh
    )
    x = mesh.x
    u = np.stack([np.sin(x[:, 0]) * x[:, 1], np.cos(2 * x[:, 1])], axis=1)
    traction = 1e4 * np.stack([mesh.normal[:, 0] * x[:, 1], np.cos(x[:, 0])], axis=1)
    depth = np.tile([1e-4, 0.02, 0.1, 0.3], len(x) // 4 + 1)[: len(x)]
    points = (x - depth[:, None] * mesh.normal)[:: max(1, len(x) // 300)]
    ours = field_at(mesh, u, traction, STEEL, points)
    assert (
        mesh.n_nodes * len(points) > petcontact.fields.interior.ENTRIES // 3
    )  # three nodes an element when smoothed
    monkeypatch.setattr(petcontact.fields.interior, "EXPANSIONS", {})
    for one, other in zip(ours, field_at(mesh, u, traction, STEEL, points), strict=True):
        assert np.abs(one - other).max() <= 1e-12 * np.abs(other).max()


def stress_errors(mesh, corners):
    """Largest errors of σ over its maximum, at each distance into the body from the ends of
    elements: at corners, or else on straight sides and arcs."""
    _, after = mesh.neighbours()
    first, last = end_tangents(mesh.start, mesh.end, mesh.half_angle)
    chosen = np.flatnonzero((np.sum(last * first[after], axis=1) < 0.9) == corners)
    assert len(chosen) >= 3
    along = last[chosen] + first[after[chosen]]
    inwards = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    errors = []
    for distance in (1e-2, 1e-3, 1e-10):
        points = mesh.end[chosen] + distance * inwards
        _, found = field_at(mesh, *boundary_data(mesh), STEEL, points)
        _, wanted = exact(points)
        errors.append(np.abs(found - wanted).max() / np.abs(wanted).max())
    return errors


@pytest.mark.parametrize(
    ("order", "size", "bound"), [(0, 0.1, 6e-3), (1, 0.2, 3e-2), (4, 0.2, 3e-4)]
)
def test_stress_is_bounded_next_to_joints(order, size, bound):
    """The same at 1e-3 and at 1e-10; without care it is 3e8 times the largest stress at 1e-12 (order
    1). Toe and bottom are different parts. At corners only a logarithm is left."""
    mesh = meshed(element_size=size, order=order)
    errors = stress_errors(mesh, corners=False)
    assert max(errors) < bound and max(errors) < 3.0 * errors[1] + 1e-3 * bound
    if order > 0:
        errors = stress_errors(mesh, corners=True)
        assert errors[-1] < 8.0 * errors[1] + 3e-4 and errors[-1] < 0.15


def test_a_traction_that_jumps_in_truth_still_jumps():
    """A load on half of a side: its edge is the end of an element. u has a logarithmic slope there,
    which no polynomial has."""
    sides = closing("bottom", friction_bound=0.1), moved("left", [0, 0]), drawn("right", [0, 0])
    load = drawn("top", [0, "where(x < 2, -1.0, 0.0)"])
    more = {"material": elastic(200.0, 0.3), "mesh": {"element_size": 0.25, "order": 2}}
    body = solid("block", rectangle([0, 0], [4, 2]), *sides, load, **more)
    points = np.array([[x, 2.0 - 1e-7] for x in (1.9, 1.99, 1.999, 2.001, 2.01, 2.1)])
    _, vertical, shear = solve(problem(body=[body])).stress_at(points).T
    assert np.abs(vertical - [-1.0, -1.0, -1.0, 0.0, 0.0, 0.0]).max() < 0.3
    assert np.abs(shear).max() < 0.05
    assert vertical[2] < vertical[3] - 0.4
