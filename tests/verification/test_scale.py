"""Results do not depend on the units of length and stress, nor on the size of the body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from prepared import operators

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

pytestmark = pytest.mark.usefixtures("unestimated")


ELL = ((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0))
BODIES = {
    "paper": lambda s: Rectangle(lower_left=(0.0, 0.0), upper_right=(8.0 * s, 4.0 * s)),
    "thin": lambda s: Rectangle(lower_left=(0.0, 0.0), upper_right=(50.0 * s, s)),
    "ell": lambda s: Polygon(vertices=[(x * s, y * s) for x, y in ELL], parts=list("abcdef")),
    "disc": lambda s: SideBySide(
        loops=(
            (
                {"part": "low", "to": (s, 0.0), "through": (0.0, -s)},
                {"part": "high", "to": (-s, 0.0), "through": (0.0, s)},
            ),
        )
    ),
    "ring": lambda s: SideBySide(
        loops=(
            Circle(part="rim", center=(0.0, 0.0), radius=s),
            Circle(part="hole", center=(0.2 * s, 0.0), radius=0.5 * s),
        )
    ),
}


def held(body, nu):
    """The operators with all sides held, the first one in contact."""
    outline = body.outline()
    first, *others = outline.parts
    return operators(
        Problem(
            material=Material(young_modulus=1.0, poisson_ratio=nu),
            geometry=body,
            mesh=MeshOptions(element_size=sum(side.length for side in outline.sides) / 120.0),
            boundary=(
                Contact(part=first, friction_bound=1.0),
                *(Displacement(part=part, value=(0.0, 0.0)) for part in others),
            ),
        )
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
        assert gap(held(BODIES[name](size), nu)) > 0.2


def test_the_degenerate_scale_exists():
    """With the unit of length R·exp(-1/(2(3-4ν))) a constant traction on a disc's rim displaces
    nothing: the test above would see it."""
    nu = 0.3
    ops = held(BODIES["disc"](2.0), nu)
    degenerate = 2.0 * np.exp(-0.5 / (3.0 - 4.0 * nu))
    assert (
        gap(replace(ops, kernel=replace(ops.kernel, unit_length=degenerate)))
        < 0.01
        < 0.2
        < gap(ops)
    )
    assert ops.kernel.unit_length < 0.4 * degenerate
