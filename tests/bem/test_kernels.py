"""Integrals are pure numbers: material and size of a body are the business of its kernel."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from prepared import operators

from petcontact import MeshOptions
from petcontact.bem.kernels import kernel_for


def test_integrals_are_pure_numbers():
    """A body a thousand times as large, of another stiffness: the same G and H, whole and in space
    the same stress."""
    pairs = []
    for length, stress in ((1.0, 1.0), (1e3, 1e-4)):
        case = example(1, mesh=MeshOptions(element_size=0.5 * length))
        block = case.geometry.model_copy(update={"upper_right": (8.0 * length, 4.0 * length)})
        material = case.material.model_copy(update={"young_modulus": 1e4 * stress})
        ops = operators(case.model_copy(update={"geometry": block, "material": material}))
        kernel, targets = kernel_for(ops.mesh, material), ops.mesh.targets(slice(0, 9))
        inside = ops.mesh.points(length * np.array([[4.0, 2.0], [1.0, 3.9]]))
        (batch,) = ops.mesh.batches()
        ones = np.eye(2 * ops.mesh.n_nodes).reshape(-1, 2, 2 * ops.mesh.n_nodes)
        pairs.append(
            [
                *kernel.integrals(targets, batch.elements),
                *kernel.field(inside, batch.elements, ones, ones)[:2],
            ]
        )
        assert kernel.traction_scale == pytest.approx(
            case.material.shear_modulus * 2.0 * stress / length
        )
    for one, other in zip(*pairs, strict=True):
        assert np.allclose(one, other, rtol=1e-9, atol=1e-11)
