"""Samples of functions on parts of meshes."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact import Displacement, Material, MeshOptions, Problem, Sphere
from petcontact.mesh import approximation
from petcontact.mesh.approximation import sampled
from petcontact.pipeline.pose.discretise import discretise


def test_samples_look_at_few_points_at_once_and_do_not_depend_on_how_many(monkeypatch):
    """A point takes a copy of its curved panel, ten times what its sample takes."""
    ball = Problem(
        material=Material(1000.0, 0.3),
        geometry=Sphere((0.0, 0.0, 0.0), 1.0),
        mesh=MeshOptions(element_size=1.0, order=2),
        boundary=[
            Displacement(part, (0.0, 0.0, 0.0))
            for part in ("bottom", "top", "left", "right", "front", "back")
        ],
    )
    seen = list[int]()

    def step(element, place, x, normal):
        seen.append(len(x))
        return np.where(x[:, :1] + 0.3 * x[:, 1:2] > 0.1, 1.0, x[:, 2:])

    def on_top(at_once):
        monkeypatch.setattr(approximation, "AT_ONCE", at_once)
        (mesh,) = discretise(ball).meshes
        samples = sampled(mesh, "top", step, [], "step")
        return samples, samples.basis @ mesh.x

    few, x_of_few = on_top(200)
    assert max(seen) <= 200
    many, x_of_many = on_top(10**6)
    assert max(seen) > 10_000
    assert few.weight.sum() == pytest.approx(many.weight.sum(), rel=1e-13)
    assert np.array_equal(few.element, many.element) and np.array_equal(few.values, many.values)
    assert np.allclose(x_of_few, x_of_many, rtol=0.0, atol=1e-13)
