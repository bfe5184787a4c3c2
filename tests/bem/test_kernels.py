"""A new kernel is a class and one line: the operators and the solution ask nothing else of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from examples import example
from prepared import operators

from petcontact import MeshOptions, solve
from petcontact.bem.kelvin2d.kernel import Kelvin2D
from petcontact.bem.kernels import KERNELS, kernel_for
from petcontact.mesh.curve_mesh import CurveMesh


@dataclass(frozen=True)
class OtherUnit(Kelvin2D):
    """Kelvin's solution with tractions in units four times as large: other numbers, the same
    solution."""

    @property
    def traction_scale(self):
        return 4.0 * super().traction_scale

    def integrals(self, targets, elements, **wanted):
        kernel_g, kernel_h = super().integrals(targets, elements, **wanted)
        return None if kernel_g is None else 4.0 * kernel_g, kernel_h


@pytest.mark.parametrize("mat_type", ["dense", "hodlr"])
def test_a_new_kernel_is_one_registration(monkeypatch, comm, mat_type):
    case = example(2, mesh=MeshOptions(element_size=0.25)).model_copy(deep=True)
    case = case.model_copy(update={"bem": case.bem.model_copy(update={"mat_type": mat_type})})
    usual = solve(case, comm=comm)
    monkeypatch.setitem(KERNELS, CurveMesh, OtherUnit)
    assert isinstance(operators(case).kernel, OtherUnit)
    other = solve(case, comm=comm)
    assert other.status == "converged" and len(other.history) == len(usual.history)
    assert np.allclose(other.u, usual.u, atol=1e-8 * np.abs(usual.u).max())
    assert np.allclose(other.traction, usual.traction, atol=1e-8 * np.abs(usual.traction).max())


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
        pairs.append(
            [
                *kernel.integrals(targets, batch.elements),
                *kernel.stress_integrals(inside, batch.elements),
            ]
        )
        assert kernel.traction_scale == pytest.approx(
            case.material.shear_modulus * 2.0 * stress / length
        )
    for one, other in zip(*pairs, strict=True):
        assert np.allclose(one, other, rtol=1e-9, atol=1e-11)
