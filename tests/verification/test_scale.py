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
    Polygon,
    Problem,
    Rectangle,
    SideBySide,
)
from petcontact.bem.kernels import kernel_for
from petcontact.bem.operators import BoundaryOperators
from petcontact.mesh.grading import mesh_outline
from petcontact.pipeline.eliminate import operators_of
from petcontact.pipeline.pose.discretise import discretise
from petcontact.pipeline.pose.load_states import boundary_data

pytestmark = pytest.mark.usefixtures("unestimated")


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
        mesh, boundary_data(problem.loaded[0], mesh, []), kernel_for(mesh, problem.material)
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


@pytest.mark.parametrize("name", BODIES)
def test_no_body_of_any_size_meets_the_degenerate_scale(name):
    for size, nu in ((1e-6, 0.0), (1.0, 0.49), (2.4, 0.3)):
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
