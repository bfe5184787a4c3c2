"""Bodies of revolution: area and volume to the order of quadratic panels, and closed surfaces."""

from __future__ import annotations

import numpy as np
import pytest
from curved_bodies import vector_area

from petcontact import Circle, InputError, Revolved
from petcontact import OutlineSide as Side
from petcontact.mesh.panelling import round_mesh

PI = np.pi
BALL = [Side("ball", (1, 0), radius=1.0), Side("ball", (0, 1), radius=1.0), Side("axis", (0, -1))]
RING = [Side("below", (2, 0)), Side("outer", (2, 1)), Side("above", (1, 1)), Side("inner", (1, 0))]
SHELL = [
    Side("outer", (2, 0), radius=2.0),
    Side("outer", (0, 2), radius=2.0),
    Side("axis", (0, 1)),
    Side("inner", (1, 0), radius=-1.0),
    Side("inner", (0, -1), radius=-1.0),
    Side("axis", (0, -2)),
]
ROD = [Side("b", (1, 0)), Side("s", (1, 2)), Side("t", (0, 2)), Side("axis", (0, 0))]
TIP = [Side("b", (1, 0)), Side("s", (0, 2)), Side("axis", (0, 0))]
HOLED = PI / 6 * (6 + 0.6 * PI) + 2 * (1 - 0.04 * PI), PI / 6 * 1.5 * (1 - 0.04 * PI)
CONE = Revolved([TIP], centre=(1, 2, 3), axis=(1, 0, 0))
CASES = {
    "ball": (Revolved([BALL]), 4 * PI, 4 * PI / 3),
    "cylinder": (Revolved([ROD], axis=(1, 1, 0)), 6 * PI, 2 * PI),
    "cone": (CONE, PI * (1 + 5**0.5), 2 * PI / 3),
    "torus": (Revolved([Circle("t", (2, 0), 1)]), 8 * PI**2, 4 * PI**2),
    "half torus": (Revolved([Circle("t", (2, 0), 1)], angle=180.0), 4 * PI**2 + 2 * PI, 2 * PI**2),
    "slice of a ball": (Revolved([BALL], angle=90.0), 2 * PI, PI / 3),
    "ring with a hole": (Revolved([RING, Circle("hole", (1.5, 0.5), 0.2)], angle=30.0), *HOLED),
    "shell": (Revolved([SHELL]), 20 * PI, 28 * PI / 3),
}
"""Bodies, their areas and volumes."""


def measures(body, size):
    mesh = round_mesh(body.outline(), size, 2)
    volume = float(np.sum(mesh.x * mesh.normal * mesh.weight[:, None]) / 3.0)
    return mesh, np.array([mesh.weight.sum(), volume])


@pytest.mark.parametrize("name", CASES)
def test_area_and_volume_are_those_of_quadratic_panels(name):
    body, *exact = CASES[name]
    coarse, fine = (np.abs(measures(body, h)[1] / exact - 1.0).max() for h in (0.8, 0.2))
    order = np.log(coarse / fine) / np.log(4.0)
    assert fine < 3e-4 and (
        order > (1.5 if name == "cone" else 2.0) or coarse < 2e-4
    )  # a tip has eight panels
    assert body.outline().area == pytest.approx(exact[0], rel=2e-3)
    # closed, and of panels that are not folded
    mesh = measures(body, 0.5)[0]
    assert np.abs(vector_area(mesh)).max() < 1e-13 * mesh.weight.sum()
    assert max(batch.elements.distortion.max() for batch in mesh.batches()) < 2.0


def corners(*ends):
    """Sides with names of their own."""
    return [Side(name, end) for name, end in zip("abc", ends, strict=True)]


BENT = [Side("a", (2, 0)), Side("b", (2, 1), radius=0.1), Side("c", (1, 0))]
NAMED = [Side("start", (2, 0)), Side("b", (2, 1)), Side("c", (1, 0))]


@pytest.mark.parametrize(
    ("loop", "angle", "line"),
    [
        (corners((1, 0), (1, 1), (-1, 0)), 360.0, "passes the axis at .* = \\(-1, 0\\)"),
        (Circle("c", (1, 0), 2.0), 360.0, "passes the axis"),
        (Circle("c", (1, 0), 1.0), 360.0, "touches the axis in the point"),
        (corners((1, 0), (1, 2), (0, 1)), 90.0, "touches the axis in the point .* = \\(0, 1\\)"),
        (BENT, 360.0, "half the distance"),
        (NAMED, 90.0, "the part 'start' is a plane face"),
        (RING, 0.0, "angle: must be greater than 0"),
        (RING, 400.0, "angle: must be less than or equal to 360"),
    ],
)
def test_sections_that_make_no_body_are_refused(loop, angle, line):
    with pytest.raises(InputError, match=line):
        Revolved([loop], angle=angle).outline()
