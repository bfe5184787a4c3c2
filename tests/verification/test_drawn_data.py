"""Gaps and loads in space that vary as no panels do: errors are within the reported ones."""

from __future__ import annotations

import numpy as np
import pytest
from cosine_blocks import Block
from drawn_data import compared, drawn

from petcontact import Box, Displacement, Material, MeshOptions, Obstacle, Pair, Problem, solve
from petcontact.pipeline.pose.body_parts import body_alone
from petcontact.refinement.body_meshes import mesh_of
from petcontact.refinement.panels.data_lines import data_lines, with_data_lines


def test_the_sums_of_cosines_are_those_of_westergaard():
    """Waves of length λ and amplitude a on a high block: they close under π E* a/λ; under a share
    of it the largest p is twice its root, and 2/π of its arc sine are closed (Johnson, 13.2)."""
    block, share = Block(2.0, 2.0, 128, held=True), 0.25
    full = 1.5 * np.pi / (1.0 - 0.3**2) / 600.0
    p = block.pressure((1.0 - np.cos(3.0 * np.pi * block.x)) / 600.0, 4.0 * share * full)
    assert p.max() == pytest.approx(2.0 * np.sqrt(share) * full, rel=1e-2)
    assert (p > 0.0).mean() == pytest.approx(2.0 / np.pi * np.arcsin(np.sqrt(share)), abs=0.02)


@pytest.mark.parametrize("number", [3, 9])
def test_errors_of_drawn_data_are_within_the_reported_ones(number):
    one = drawn(7, number)
    solution = solve(one.problem(mesh=MeshOptions(0.4, order=1, exponent=1.0)))
    if not solution.converged:
        assert " at (" in solution.reason
        return
    p, force, own, of_force = compared(one, solution, 64)
    told = solution.accuracy
    assert one.jumps or told.error >= 1.0 or p <= told.error + own
    assert told.resultants >= 1.0 or force <= told.resultants + of_force


@pytest.mark.parametrize(
    ("gap", "lines"),
    [
        ("where(abs(y - 1) <= 0.5, x**2/20, 1.0)", {"top": ([], [0.25, 0.75])}),
        ("max(0, x - 0.3)", {"top": ([0.15], [])}),
        ("abs(x - 0.5)*abs(y - 1.2)", {"top": ([0.25], [0.6])}),
        ("where((x - 1)**2 + (y - 1)**2 < 0.25, 0, 1)", {}),
        ("min(x**2 + y**2, 0.4)", {}),
        ("exp(-((x - 1)/0.001)**2) + (x - 1)**3", {}),
        (0.1, {}),
    ],
)
def test_panels_of_boxes_end_where_data_jump_or_have_a_kink_along_a_line(gap, lines):
    problem = Problem(
        material=Material(1.0, 0.3),
        geometry=Box((0.0, 0.0, -1.0), (2.0, 2.0, 0.0)),
        mesh=MeshOptions(0.5, order=1, exponent=1.0),
        boundary=[Displacement("bottom", (0.0, 0.0, 0.0))],
        obstacle=[Obstacle("punch", displacement=(0.0, 0.0, -0.01))],
        contact=[Pair("c", "top", "punch", gap=gap)],
    )
    (box,) = problem.boundaries
    one = body_alone(problem.posed, 0, box)
    found = data_lines(one, box)
    expected = [line for part in box.parts for line in lines.get(part, ([], []))]
    assert len(found) == len(expected) == 12
    for line, places in zip(found, expected, strict=True):
        assert line == pytest.approx(places, abs=1e-8)
    mesh = with_data_lines(box, one, mesh_of(one, box))
    corners = mesh.corners[mesh.elements_of("top")][:, :, :2]
    for axis, places in enumerate(lines.get("top", ([], []))):
        assert np.all(np.isin(np.round(2.0 * np.array(places), 9), corners[..., axis].round(9)))
