"""Loads, gaps and volume loads that are narrower than what the points of a given mesh see."""

from __future__ import annotations

import re

import numpy as np
import pytest
from shapes import closing, cuboid, drawn, elastic, moved, problem, rectangle

from petcontact import solve
from petcontact.errors import InputError

pytestmark = pytest.mark.usefixtures("unsampled")

STRIP = "where(abs({0} - 0.513) < {1:g}, {2:g}, 0)"
BUMP = "{2:g}*exp(-(({0} - 0.513)/{1:g})**2)"
SIDES = {2: ("top", "left"), 3: ("top", "left", "front", "back")}


def block(d, *boundary, **more):
    box = rectangle([0.0, 0.0], [1.0, 1.0]) if d == 2 else cuboid([0.0] * 3, [1.0] * 3)
    body = {
        "material": elastic(100.0, 0.3),
        "geometry": box,
        "boundary": [*boundary, moved("bottom", [0.0] * d)],
        "mesh": {"element_size": 0.25 if d == 2 else 0.5, "order": 1},
    }
    return problem(**body | more)


def applied(solution, part="right"):
    mesh = solution.mesh
    rows = mesh.nodes_of(part)
    return mesh.weight[rows] @ solution.last.bodies["body"].traction[rows]


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize(
    ("text", "width"), [(STRIP, 2.0), (BUMP, np.sqrt(np.pi))], ids=["strip", "bump"]
)
@pytest.mark.parametrize("half", [3e-4, 2e-6])
def test_a_narrow_traction_keeps_its_total(d, text, width, half):
    load = text.format("xyz"[d - 1], half, 0.3 / (width * half))
    others = [drawn(part, [0.0] * d) for part in SIDES[d]]
    solution = solve(block(d, drawn("right", [load, *[0.0] * (d - 1)]), *others))
    assert np.allclose(applied(solution), [0.3, *[0.0] * (d - 1)], atol=3e-7 * 10.0 ** (2 * d - 4))
    assert "misses" in str(solution.warnings)
    held = solution.reactions()["bottom"]
    force = next(number for number in solution.numbers if number.name == "force on bottom")
    assert abs(held[0] + 0.3) <= (np.inf if np.isnan(force.error) else force.error)


def test_a_function_of_python_keeps_its_total():
    """Its jumps are found between samples."""

    def load(y):
        return np.where(np.abs(y - 0.513) < 2e-3, 75.0, 0.0)

    solution = solve(
        block(2, drawn("right", [load, 0.0]), drawn("top", [0, 0]), drawn("left", [0, 0]))
    )
    assert np.allclose(applied(solution), [0.3, 0.0], atol=1e-8)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("text", [STRIP, BUMP])
def test_a_narrow_gap_is_not_lost(d, text):
    """The rise of 0.012 in a gap of 0.01 presses, and no node sees it."""
    law = {"normal": "unilateral", "gap": "0.01 - " + text.format("x", 1e-5, 0.012)}
    free = [drawn(part, [0.0] * d) for part in ("right", *SIDES[d][1:])]
    solution = solve(block(d, closing("top", **law), *free))
    assert not solution.converged
    assert re.search(r"surfaces overlap between nodes.*\(0\.51(3|299)", solution.reason)


@pytest.mark.parametrize("d", [2, 3])
def test_a_narrow_load_in_the_volume_is_refused_with_its_width(d):
    axis = "xyz"[d - 1]
    free = [drawn(part, [0.0] * d) for part in ("right", *SIDES[d])]
    hot = elastic(100.0, 0.3) | {"thermal_expansion": 1e-3}
    for key, loads in (
        ("temperature", {"temperature": STRIP.format(axis, 1e-4, 50.0)}),
        ("force", {"force": [*[0.0] * (d - 1), BUMP.format(axis, 1e-4, 50.0)]}),
    ):
        refused = rf"loads\.{key}.*is narrower .* on [12]\.\de-04 only"
        with pytest.raises(InputError, match=refused):
            solve(block(d, *free, material=hot, loads=loads))
