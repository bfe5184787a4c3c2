"""Results do not depend on the units of length and stress, nor on the size of the body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from petcontact import (
    Circle,
    Contact,
    Displacement,
    Material,
    MeshOptions,
    Method,
    Polygon,
    Problem,
    Rectangle,
    SideBySide,
    Traction,
    solve,
)
from petcontact.bem.kernels import kernel_for
from petcontact.bem.operators import BoundaryOperators
from petcontact.fields.interior import field_at
from petcontact.mesh.grading import mesh_outline
from petcontact.pipeline.eliminate import operators_of
from petcontact.pipeline.pose.discretise import discretise
from petcontact.pipeline.pose.load_states import boundary_data

pytestmark = pytest.mark.usefixtures("unestimated")


def toe(length, stress, **mesh):
    """A block with a rounded toe, its data in units of which one is `length` of ours, one of stress
    `stress` of ours."""
    side = lambda part, x, y, **more: {"part": part, "to": (x * length, y * length), **more}  # noqa: E731
    loop = (
        side("foot", 6, 0),
        side("toe", 8, 2, radius=2.0 * length),
        side("front", 8, 4),
        side("top", 0, 4),
        side("back", 0, 0),
    )
    free = (Traction(part=part, value=(0.0, 0.0)) for part in ("toe", "front"))
    return Problem(
        material=Material(young_modulus=1e10 * stress, poisson_ratio=0.3),
        geometry=SideBySide(loops=(loop,)),
        mesh=MeshOptions(
            **{
                key: value * length if key == "element_size" else value
                for key, value in mesh.items()
            }
        ),
        boundary=(
            Contact(part="foot", friction_bound=f"{1.5e8 * stress!r}*(1 + x/{8.0 * length!r})"),
            Displacement(part="top", value=(0.0, 0.0)),
            Traction(part="back", pressure=4e8 * stress),
            *free,
        ),
        method=Method(name="projection", rule="modified", rho=1e9 * stress / length),
    )


@pytest.mark.parametrize(
    "mesh", [{"element_size": 0.1}, {"order": 3, "levels": 5}], ids=["uniform", "graded"]
)
def test_metres_and_pascals_or_millimetres_and_megapascals(mesh):
    one, other = (solve(toe(*units, **mesh)) for units in ((1.0, 1.0), (1e3, 1e-6)))
    assert one.converged and one.iterations == other.iterations
    close = lambda a, b: np.abs(a - b).max() < 1e-10 * np.abs(a).max()  # noqa: E731
    assert close(one.u, other.u * 1e-3) and close(one.traction, other.traction * 1e6)
    assert close(one.contact.u_t, other.contact.u_t * 1e-3)
    assert close(one.contact.sigma_t, other.contact.sigma_t * 1e6)
    assert other.rho * 1e9 == pytest.approx(one.rho, rel=1e-9)
    assert np.array_equal(one.contact.state, other.contact.state)
    points = np.array([[3.0, 0.05], [7.9, 3.9], [4.0, 2.0]])
    (u, stress), (v, pressure) = (
        field_at(s.mesh, s.u, s.traction, s.problem.material, points * length)
        for s, length in ((one, 1.0), (other, 1e3))
    )
    assert close(u, v * 1e-3) and close(stress, pressure * 1e6)


THIN = ((0.0, 0.0), (50.0, 0.0), (50.0, 1.0), (0.0, 1.0))
ELL = ((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0))
BODIES = {
    "square": lambda s: Rectangle(lower_left=(0.0, 0.0), upper_right=(s, s)),
    "paper": lambda s: Rectangle(lower_left=(0.0, 0.0), upper_right=(8.0 * s, 4.0 * s)),
    "thin": lambda s: Polygon(vertices=[(x * s, y * s) for x, y in THIN], parts=list("abcd")),
    "ell": lambda s: Polygon(vertices=[(x * s, y * s) for x, y in ELL], parts=list("abcdef")),
    "disc": lambda s: SideBySide(loops=(Circle(part="rim", center=(0.0, 0.0), radius=s),)),
    "ring": lambda s: SideBySide(
        loops=(
            Circle(part="rim", center=(0.0, 0.0), radius=s),
            Circle(part="hole", center=(0.2 * s, 0.0), radius=0.5 * s),
        )
    ),
}


def operators(body, nu):
    """All sides held, the first one in contact where there are several."""
    outline = body.outline()
    first, *others = outline.parts
    held = [Displacement(part=part, value=(0.0, 0.0)) for part in others]
    contact = (
        [Contact(part=first, friction_bound=1.0)]
        if others
        else [Displacement(part=first, value=(0.0, 0.0))]
    )
    problem = Problem(
        material=Material(young_modulus=1.0, poisson_ratio=nu),
        geometry=body,
        mesh=MeshOptions(element_size=sum(side.length for side in outline.sides) / 120.0),
        boundary=(*contact, *held),
    )
    if others:
        return operators_of(discretise(problem), 0)[0]
    mesh = mesh_outline(outline, problem.mesh)
    return BoundaryOperators(
        mesh, boundary_data(problem, 0, mesh, []), kernel_for(mesh, problem.material)
    )


def gap(ops):
    """Smallest singular value of A_0 over the fourth smallest, with lengths in units of the
    element: about 1 where nothing is degenerate, since the smallest ones belong to oscillating
    tractions; two vanish at once on a disc."""
    nodes = np.arange(ops.mesh.n_nodes)
    matrix = ops.system_entries(nodes, nodes).copy()
    matrix[:, ~ops.data.traction_known.ravel()] /= ops.mesh.length.mean()
    values = np.linalg.svd(matrix, compute_uv=False)
    return values[-1] / values[-4]


@pytest.mark.parametrize("size", [1e-6, 1.0, 2.4])
@pytest.mark.parametrize("name", BODIES)
def test_no_body_of_any_size_meets_the_degenerate_scale(name, size):
    for nu in (0.0, 0.49):
        assert gap(operators(BODIES[name](size), nu)) > 0.2


def test_the_degenerate_scale_exists():
    """With the unit of length R·exp(-1/(2(3-4ν))) a constant traction on a disc's rim displaces
    nothing: the test above would see it."""
    nu = 0.3
    ops = operators(BODIES["disc"](2.0), nu)
    degenerate = 2.0 * np.exp(-0.5 / (3.0 - 4.0 * nu))
    assert (
        gap(replace(ops, kernel=replace(ops.kernel, unit_length=degenerate)))
        < 0.01
        < 0.2
        < gap(ops)
    )
    assert ops.kernel.unit_length < 0.4 * degenerate
