"""Elements of order 0 to 5 through one code path: rates on smooth problems, exponential
convergence, every method."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example

from petcontact import (
    Contact,
    Displacement,
    Material,
    MeshOptions,
    Method,
    OutlineSide,
    Problem,
    Rectangle,
    SideBySide,
    Traction,
    adapt,
    solve,
)

pytestmark = pytest.mark.usefixtures("unestimated")

TRANSITION = 2.4115453362464914, 8.435704696178437
"""Of Example 2, from shared/reference."""
SQUARE = Rectangle(lower_left=(0.0, 0.0), upper_right=(1.0, 1.0))
BARREL = SideBySide(
    loops=(
        (
            OutlineSide(part="bottom", to=(1.0, 0.0)),
            OutlineSide(part="right", to=(1.0, 1.0), radius=0.8),
            OutlineSide(part="top", to=(0.0, 1.0)),
            OutlineSide(part="left", to=(0.0, 0.0), radius=0.8),
        ),
    )
)


def error_of(order: int, size: float, geometry, formulation: str = "condensed") -> float:
    """Relative L2 error of u_t where the solution is u = (exp(ax) cos(ay), -exp(ax) sin(ay)), a =
    1.4.

    u is the gradient of a harmonic function, so it has neither divergence nor rotation and solves
    Lamé's equations with σ = 2µ grad u. On y = 0 both u_n and σ_t vanish: frictionless contact.
    """
    a, two_mu = 1.4, 1000.0 / 1.3
    grow = "exp(1.4*x)"
    xx = f"{a * two_mu}*exp(1.4*x)*cos(1.4*y)"
    xy = f"(-{a * two_mu})*exp(1.4*x)*sin(1.4*y)"
    case = Problem(
        material=Material(young_modulus=1000.0, poisson_ratio=0.3),
        geometry=geometry,
        mesh=MeshOptions(element_size=size, order=order),
        boundary=(
            Contact(part="bottom", friction_bound=0.0),
            Displacement(part="top", value=(f"{grow}*cos(1.4*y)", f"-{grow}*sin(1.4*y)")),
            Traction(part="left", value=(f"{xx}*nx + {xy}*ny", f"{xy}*nx - {xx}*ny")),
            Traction(part="right", value=(f"{xx}*nx + {xy}*ny", f"{xy}*nx - {xx}*ny")),
        ),
        method=Method(name="semismooth-newton", formulation=formulation),
    )
    solution = solve(case)
    assert solution.converged
    contact = solution.contact
    exact = np.exp(a * contact.x[:, 0])
    return float(
        np.sqrt(contact.weight @ (contact.u_t[:, 0] - exact) ** 2 / (contact.weight @ exact**2))
    )


RATES = [
    pytest.param(order, shape, id=f"{name}-{order}", marks=[pytest.mark.slow] * (order % 2 != odd))
    for odd, (name, shape) in enumerate({"square": SQUARE, "barrel": BARREL}.items())
    for order in range(6)
]
"""Every order on one shape; on the other one they are slow."""


@pytest.mark.parametrize(("order", "geometry"), RATES)
def test_rate_on_a_smooth_problem(order, geometry):
    """p + 1 at least."""
    sizes = (0.0625, 0.03125) if order < 2 else (0.5, 0.25)
    coarse, fine = (error_of(order, size, geometry) for size in sizes)
    assert np.log2(coarse / fine) > order + 0.9
    assert fine < 10.0 ** -(order + 1.5)


@pytest.mark.slow
def test_convergence_is_exponential_when_order_and_levels_grow(comm):
    """The logarithm of the error falls like the square root of the number of unknowns at least, as
    theory has it."""
    best = adapt(example(2, name="semismooth-newton", rule=None), 2e-8, comm=comm).contact
    norm = np.sqrt(best.weight @ best.u_t[:, 0] ** 2)
    roots, errors = [], []
    for order, levels in ((1, 3), (2, 5), (3, 7), (4, 9), (5, 11)):
        points = tuple((x, 0.0) for x in TRANSITION)
        mesh = MeshOptions(order=order, grading=0.3, levels=levels, graded_points=points)
        contact = solve(
            example(2, mesh=mesh, name="semismooth-newton", rule=None), comm=comm
        ).contact
        errors.append(abs(np.sqrt(contact.weight @ contact.u_t[:, 0] ** 2) / norm - 1.0))
        roots.append(np.sqrt(2.0 * contact.weight.size))
    slope = np.polyfit(roots, np.log(errors), 1)[0]
    assert slope < -0.5
    assert errors[-1] < 1e-7
