"""Outlines drawn at random, most of them impossible: each is refused in one line or meshed as it
should be."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact import InputError, MeshOptions, SideBySide
from petcontact.errors import PetcontactError
from petcontact.mesh.grading import mesh_outline


def number(rng):
    drawn = 10.0 ** rng.integers(-20, 20), rng.normal(), rng.integers(-5, 6)
    special = (0.0, 1.0, -1.0, 1e-9, 1e60, *map(float, drawn))
    return special[rng.integers(len(special))]


def loop(rng):
    part = lambda: str(rng.choice(["a", "b", "c"]))  # noqa: E731
    if rng.random() < 0.3:
        centre, radius = (number(rng), number(rng)), abs(number(rng)) or 1.0
        return {"part": part(), "center": centre, "radius": radius}
    radius, sides = rng.uniform(0.5, 3.0), []
    for angle in np.sort(rng.uniform(0.0, 2.0 * np.pi, rng.integers(1, 7))):
        on_circle = (float(radius * np.cos(angle)), float(radius * np.sin(angle)))
        end = on_circle if rng.random() < 0.85 else (number(rng), number(rng))
        side = {"part": part(), "to": end}
        kind = rng.random()
        if kind < 0.2:
            bent = float(rng.uniform(0.5, 20.0) * rng.choice([-1, 1]))
            side["radius"] = number(rng) if rng.random() < 0.5 else bent
        elif kind < 0.4:
            near = tuple(map(float, radius * rng.normal(size=2)))
            side["through"] = (number(rng), number(rng)) if rng.random() < 0.4 else near
        sides.append(side)
    return sides


@pytest.mark.slow
def test_random_outlines():
    """Two straight sides, arcs whose ends meet, circles lost in round-off ended as defects
    before."""
    rng = np.random.default_rng(20261121)
    outcomes = {"refused": 0, "meshed": 0}
    for k in range(300):
        try:
            outline = SideBySide(loops=[loop(rng) for _ in range(rng.integers(1, 4))]).outline()
            graded = MeshOptions(order=2, grading=0.3, levels=8)
            even = MeshOptions(element_size=outline.diameter / 20.0, order=k % 3)
            mesh = mesh_outline(outline, graded if k % 2 else even)
        except PetcontactError as error:
            assert isinstance(error, InputError) and "\n" not in str(error)
            assert len(str(error)) < 400
            outcomes["refused"] += 1
            continue
        assert np.all(np.isfinite(mesh.x)) and np.all(mesh.length > 0.0)
        assert np.all(mesh.weight > 0.0)
        before, after = mesh.neighbours()
        assert np.array_equal(mesh.end, mesh.start[after])
        assert np.array_equal(before[after], np.arange(mesh.n_elements))
        # Gauss: the area is half the integral of x·n
        area = 0.5 * mesh.weight @ np.sum((mesh.x - mesh.x[0]) * mesh.normal, axis=1)
        assert area == pytest.approx(outline.polygon(400).area, rel=1e-2)
        outcomes["meshed"] += 1
    assert min(outcomes.values()) > 20, outcomes
