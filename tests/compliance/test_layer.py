"""The layer operator T: how near it is to S on any mesh, and its operations."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from prepared import Posed, layer_of, operators, strips_of

import petcontact.compliance.layer.strips
from petcontact import Displacement, MeshOptions

GRADED = MeshOptions(order=3)


@pytest.mark.parametrize(
    ("number", "mesh"),
    [
        (1, MeshOptions(element_size=0.1)),
        (2, MeshOptions(element_size=0.2, order=1)),
        (1, GRADED),
        (2, MeshOptions(order=5, levels=14)),
    ],
    ids=["h=0.1", "order 1", "graded 3", "graded 5"],
)
def test_spectrum_of_s_against_t_knows_no_mesh(number, mesh, comm):
    prepared = Posed(example(number, mesh=mesh), comm)
    compliance = prepared.system.compliance()
    values = np.linalg.eigvals(np.linalg.solve(layer_of(prepared.operators).matrix(), compliance))
    prepared.close()
    assert values.real.min() > 0.8 and values.real.max() < 1.8 and np.abs(values.imag).max() < 0.05


def test_compressed_strip_is_the_dense_one(monkeypatch):
    """To the tolerance of the compression; its own products and solves belong together to
    round-off."""
    ops = operators(example(1, mesh=MeshOptions(order=3, element_size=0.2, grading=0.35)))
    dense = layer_of(ops)
    monkeypatch.setattr(petcontact.compliance.layer.strips, "LONG_SIZE", 100)
    compressed = layer_of(ops)
    rng = np.random.default_rng(11)
    x, stick = rng.standard_normal((dense.size, 1)), rng.random((dense.size, 1)) < 0.7
    reference = dense.apply(np.ones((dense.size, 1)))
    assert np.allclose(compressed.apply(np.ones((dense.size, 1))), reference, rtol=0.03)
    assert np.allclose(compressed.apply(compressed.solve(x)), x, atol=1e-7)
    assert np.allclose(compressed.solve(x + 1e4 * compressed.apply(x), 1e4), x, atol=1e-4)
    found = compressed.stick_solve(stick, reference)
    assert np.allclose(
        compressed.apply(found)[stick], reference[stick], atol=1e-8 * np.abs(reference).max()
    )
    assert not found[~stick].any() and not compressed.fast
    # of few nodes the block has a factor, without iterations; of many it is the block of T⁻¹
    few = stick & (np.arange(dense.size) < 100)[:, None]
    assert np.allclose(
        compressed.stick_solve(few, reference, 1.0), dense.stick_solve(few, reference)
    )
    near = np.where(stick, compressed.solve(np.where(stick, reference, 0.0)), 0.0)
    assert np.array_equal(compressed.stick_solve(stick, reference, 1.0), near)


@pytest.mark.parametrize("held", [("left",), ("right",), ("left", "right"), ()])
def test_held_neighbours_turn_the_reflection(held, comm):
    """Beside a roller that holds u_t the strip goes on oddly: T⁻¹S stays as good as beside free
    sides."""
    # a mesh of each kind
    mesh = MeshOptions(element_size=0.2) if len(held) == 1 else MeshOptions(levels=8)
    base = example(1, mesh=mesh)
    boundary = [
        Displacement(part=c.part, value=(0.0, "free")) if c.part in held else c
        for c in base.boundary
    ]
    prepared = Posed(base.model_copy(update={"boundary": tuple(boundary)}), comm)
    (strip,) = strips_of(prepared.operators)
    assert strip.ends == tuple(-1.0 if side in held else 1.0 for side in ("left", "right"))
    values = np.linalg.eigvals(
        np.linalg.solve(layer_of(prepared.operators).matrix(), prepared.system.compliance())
    )
    prepared.close()
    assert values.real.min() > 0.6 and values.real.max() < 2.0
