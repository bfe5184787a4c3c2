"""Gaps and loads with kinks, jumps and narrow features: right values, wherever the body lies."""

from __future__ import annotations

import math

import pytest
from shapes import (
    closing,
    drawn,
    elastic,
    moved,
    problem,
    rectangle,
    solid,
    touching,
)

from petcontact import adapt

STILL = [drawn("left", [0.0, 0.0]), drawn("right", [0.0, 0.0])]


def pressed(lower, upper, modulus, gap, **motion):
    """A block whose bottom is held under a rigid die of some shape."""
    return adapt(
        problem(
            material=elastic(modulus, 0.3),
            geometry=rectangle(lower, upper),
            boundary=[moved("bottom", [0.0, 0.0]), *STILL],
            obstacle=[{"name": "die", **motion}],
            contact=[touching("surface", "top", "die", gap=gap)],
        )
    )


@pytest.mark.parametrize(
    ("at", "gap"),
    [
        (0.0, "max(0, 3 - sqrt(max(9 - {x}**2, 0)))"),
        (1000.0, "where(abs({x}) < 3, 3 - sqrt(max(9 - {x}**2, 0)), 3)"),
    ],
)
def test_a_guarded_circle_is_a_circle_at_any_place(at, gap):
    """A disc of radius 3 pressed .1 deep: the pressure of Hertz for the force that it carries, but for the depth of the block; elements
    between false kinks had 400 times as much."""
    gap = gap.format(x=f"(x - {at + 4.0})")
    found = pressed([at, -4.0], [at + 12.0, 0.0], 10.0, gap, displacement=[0.0, -0.1])
    pair = found.pairs["surface"]
    closed = float(pair.weight[pair.state != 2].sum())
    assert found.status == "converged"
    assert pair.force[1] == pytest.approx(-0.6020434, rel=1e-5)
    assert pair.pressure.max() == pytest.approx(
        2.0 * abs(pair.force[1]) / (math.pi * 0.5 * closed), rel=5e-3
    )
    assert found.boundary_state()[1].von_mises.max() == pytest.approx(0.4465, rel=1e-2)


def test_a_joint_that_a_tangential_ray_carries_over_is_one_with_that_of_the_other_body():
    """A circle under a flat as wide: the ray at its end is off by the root of the round-off."""
    circles = [
        {"part": part, "center": [0.0, 1.0], "radius": radius}
        for part, radius in (("rim", 1.0), ("bore", 0.3))
    ]
    disc = solid("disc", {"shape": "outline", "loops": circles}, moved("bore", [0.0, 0.0]))
    block = solid("block", rectangle([-1.0, 2.0], [1.0, 3.0]), moved("top", [0.0, -0.02]))
    pair = touching("c", "block.bottom", "disc.rim")
    found = adapt(problem(body=[disc, block], contact=[pair]))
    assert found.status == "converged"
    for name in found.meshes:
        assert found.boundary_state(body=name)[1].von_mises.max() == pytest.approx(0.013, rel=2e-2)


def test_where_a_gap_jumps_a_part_ends():
    """A block that hangs over the edge of a rigid table: all its weight rests on what is left."""
    table = closing("bottom", normal="unilateral", gap="where(x <= 0, 0, 1)")
    found = adapt(
        problem(
            material={**elastic(1e8, 0.2), "density": 1000.0},
            geometry=rectangle([-2.0, 0.0], [1.0, 1.0]),
            loads={"acceleration": [0.0, -10.0]},
            boundary=[table, *STILL, drawn("top", [0.0, 0.0])],
        )
    )
    (pair,) = found.pairs.values()
    assert found.status == "converged"
    assert pair.force[1] == pytest.approx(3e4, rel=1e-6)
    assert float(pair.weight[pair.state != 2].sum()) == pytest.approx(2.0, rel=1e-6)
