"""What must come out exactly: constant stress on irregular bodies, with slip, and rigid
rotation."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import closing, drawn, moved, problem
from smooth_field import pull

from petcontact import Material, SideBySide, solve
from petcontact.fields.interior import field_at

pytestmark = pytest.mark.usefixtures("unestimated")

POINTS = ((1.0, 0.0), (6.0, 0.0), (7.0, 2.5), (4.0, 2.0), (3.0, 4.5), (0.5, 3.0))
NAMES = ("foot", "right", "notch", "roof", "top", "left")
INSIDE = np.array([[1.5, 0.1], [6.4, 2.2], [3.9, 1.95], [3.0, 4.3], [4.4, 0.7], [0.75, 2.9]])


def body(hole):
    """An irregular hexagon with a reentrant corner, with a triangular hole or without."""
    ends = (*POINTS[1:], POINTS[0])
    loop = tuple({"part": name, "to": to} for name, to in zip(NAMES, ends, strict=True))
    cavity = tuple({"part": "hole", "to": to} for to in ((2.0, 1.0), (2.5, 2.5), (3.2, 1.2)))
    return SideBySide(loops=(loop, cavity) if hole else (loop,))


def slipping(material, *, order, hole, size=0.6):
    """Constant strain with u_y = 0 and u_x > 0 on the foot, and the shear stress that slip asks
    for: σ_xy = g."""
    along, upwards, shear = 2e-3, -1e-3, 3e-3
    u = (f"1e-3 + {along}*x + {shear}*y", f"{upwards}*y")
    mu, nu = material.shear_modulus, material.plane_strain_ratio
    trace = 2.0 * mu * nu / (1.0 - 2.0 * nu) * (along + upwards)
    xx, yy, xy = 2.0 * mu * along + trace, 2.0 * mu * upwards + trace, mu * shear
    pull = (f"{xx!r}*nx + {xy!r}*ny", f"{xy!r}*nx + {yy!r}*ny")
    parts = [*NAMES[1:], *(["hole"] if hole else [])]
    case = problem(
        material=material,
        geometry=body(hole),
        mesh={"element_size": size, "order": order},
        boundary=[
            closing("foot", friction_bound=xy),
            moved("right", u),
            *(drawn(part, pull) for part in parts if part != "right"),
        ],
        method={"name": "projection", "rule": "modified", "rho": mu, "tolerance": 1e-13}
        | {"max_iterations": 2000},
    )
    solution = solve(case)
    exact = lambda x: np.column_stack([1e-3 + along * x[:, 0] + shear * x[:, 1], upwards * x[:, 1]])  # noqa: E731
    return solution, exact, np.array([xx, yy, xy])


@pytest.mark.parametrize(("order", "plane", "hole"), [(1, "strain", False), (3, "stress", True)])
def test_constant_stress_with_slip_is_exact(order, plane, hole):
    material = Material(young_modulus=1000.0, poisson_ratio=0.3, plane=plane)
    solution, exact, stress = slipping(material, order=order, hole=hole)
    mesh = solution.mesh
    assert np.all(solution.contact.state == 1)
    assert np.abs(solution.u - exact(mesh.x)).max() < 1e-9 * np.abs(solution.u).max()
    traction = pull(np.tile(stress, (mesh.n_nodes, 1)), mesh.normal)
    assert np.abs(solution.traction - traction).max() < 1e-8 * np.abs(stress).max()
    u, inside = field_at(mesh, solution.u, solution.traction, material, INSIDE)
    assert np.abs(u - exact(INSIDE)).max() < 1e-9 * np.abs(u).max()
    assert np.abs(inside - stress).max() < 1e-8 * np.abs(stress).max()
