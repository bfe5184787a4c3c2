"""What rays and perpendiculars meet: sorted out beforehand, where curves are many, the same as of
all."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from petcontact.mesh.pairs import curves
from petcontact.mesh.pairs.curves import Curves


def closed(rng, count):
    """A closed outline of lines and arcs around the origin, corners and ends that touch among
    it."""
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    corner = rng.uniform(0.7, 1.3, count)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    start, end = corner, np.roll(corner, -1, axis=0)
    bend = (
        rng.choice([0.0, 0.0, 1.0, -1.0], count)
        * rng.uniform(0.0, 1.8, count)
        / np.hypot(*(end - start).T)
    )
    return Curves(start, end, bend)


@pytest.mark.slow
@settings(max_examples=6, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(["along normals", "one direction", "any"]))
def test_curves_sorted_out_beforehand_are_not_met(seed, kind):
    rng = np.random.default_rng(seed)
    part, other = closed(rng, 60), closed(rng, 40)
    shift = rng.normal(size=2)
    other = Curves(1.5 * other.start + shift, 1.5 * other.end + shift, other.curvature / 1.5)
    x, normal = other.at(np.repeat(np.arange(40), 3), np.tile([0.0, 0.37, 1.0], 40))
    x = np.concatenate([x, part.start])
    normal = np.concatenate([normal, -part.at(np.arange(60), np.zeros(60))[1]])
    direction = {
        "along normals": normal,
        "one direction": np.tile(rng.normal(size=2), (len(x), 1)),
        "any": rng.normal(size=x.shape),
    }[kind]
    direction /= np.hypot(*direction.T)[:, None]
    given_ = direction[0] if kind == "one direction" else None

    def found():
        segments = part.segments(other, np.zeros(60, dtype=int), np.zeros(40, dtype=int), given_)
        return [part.cast(x, direction), part.comes_from(x, normal, given_), segments]

    whole = found()
    with patch.object(curves, "FEW", 0), patch.object(curves, "BLOCK", 7):
        for one, some in zip(whole, found(), strict=True):
            for name in one.__dataclass_fields__:
                np.testing.assert_array_equal(getattr(some, name), getattr(one, name))


@pytest.mark.parametrize("count", [600, 2400])
def test_few_curves_are_looked_at_where_they_are_many(count):
    """Rays between two straight parts of equal elements: some hundred curves for each 64 points,
    however many there are."""
    ends = np.column_stack([np.linspace(0.0, 1.0, count + 1), np.zeros(count + 1)])
    part = Curves(ends[:-1], ends[1:], np.zeros(count))
    looked_at = []
    x = np.column_stack([np.linspace(0.0, 1.0, count), np.full(count, 0.1)])
    for _, number, _, _ in part._met(curves._crossings, x, np.tile([0.0, -1.0], (count, 1))):
        looked_at.append(len(number))
    assert max(looked_at) < 200
