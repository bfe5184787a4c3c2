"""Joints of facing parts that agree, and curves that are looked at where they are many."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import problem, solid

from petcontact.mesh.pairs import intersections
from petcontact.mesh.pairs.intersections import Curves
from petcontact.pipeline.judge.thickness import slenderness
from petcontact.pipeline.pose.discretise import discretise


@pytest.mark.parametrize("thin", ["primary", "secondary"])
def test_a_thin_ring_keeps_elements_that_bend_whichever_side_is_collocated(thin):
    """On a massive core, whose elements alone are 8 times as long as the ring is thick."""

    def body(name, size, **radii):
        circles = [{"part": k, "center": [0.0, 0.0], "radius": r} for k, r in radii.items()]
        shape = {"shape": "outline", "loops": circles}
        return solid(name, shape, mesh={"element_size": size, "order": 2})

    bodies = [body("ring", 0.12, outside=1.0, inside=0.88), body("core", 0.9, rim=0.88)]
    sides = {thin: "ring.inside", {"primary": "secondary"}.get(thin, "primary"): "core.rim"}
    ring, core = discretise(problem(body=bodies, contact=[{"name": "fit", **sides}])).meshes
    assert slenderness(ring).max() < 1.5
    on = [
        np.sort(mesh.corners[mesh.part == part][:, 0, 0]) for mesh, part in ((ring, 1), (core, 0))
    ]
    assert on[0] == pytest.approx(on[1], abs=1e-12)


@pytest.mark.parametrize("count", [600, 2400])
def test_few_curves_are_looked_at_where_they_are_many(count):
    """Rays between two straight parts of equal elements: some hundred curves for each 64 points,
    however many there are."""
    ends = np.column_stack([np.linspace(0.0, 1.0, count + 1), np.zeros(count + 1)])
    part = Curves(ends[:-1], ends[1:], np.zeros(count))
    looked_at = []
    x = np.column_stack([np.linspace(0.0, 1.0, count), np.full(count, 0.1)])
    for _, number, _, _ in part._met(intersections._crossings, x, np.tile([0.0, -1.0], (count, 1))):
        looked_at.append(len(number))
    assert max(looked_at) < 200
