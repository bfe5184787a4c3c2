"""Whole columns that compiled kernels fill are what their integrals make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from prepared import operators

from petcontact.bem import kernels as bem_kernels
from petcontact.bem.column_fillers import CompiledFiller, PlainFiller
from petcontact.model.case import load

CONFIGS = Path(__file__).parents[2] / "configs"


LIFTED = {"boundary.1.value": [0.01, -0.03]}


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("example1", {"mesh": {"element_size": 0.25}}),
        ("example2", {"mesh": {"element_size": 0.25}, **LIFTED}),
        ("example1", {"mesh": {"element_size": 1.0, "order": 3}}),
        ("example2", {"mesh": {"element_size": 1.5, "order": 5}, **LIFTED}),
        ("space_b", {"mesh": {"element_size": 2.0, "order": 1}}),
        ("space_b", {"boundary.1.value": [0.0, 0.01, -0.02]}),
        ("space_bracket", {"mesh": {"order": 1}}),
    ],
)
def test_columns_are_what_the_integrals_make(monkeypatch, name, keys):
    """Blocks of A_0 and of the right-hand sides, rows and columns in pieces as a compression asks
    for them."""
    case = load(CONFIGS / f"{name}.toml", keys)
    bound = 1e-12 if name.startswith("space") else 1e-13
    quick, slow = (operators(case) for _ in range(2))
    monkeypatch.setattr(bem_kernels, "COLUMN_FILLERS", {})
    assert isinstance(slow._filler, PlainFiller)
    monkeypatch.undo()
    assert isinstance(quick._filler, CompiledFiller)
    every, rng = np.arange(quick.mesh.n_nodes), np.random.default_rng(3)
    some = np.sort(rng.permutation(every)[:70])
    for rows, columns in ((some, some), (some[::20], every[1::7]), (every[::5], some[:9])):
        pairs = quick.all_entries(rows, columns), slow.all_entries(rows, columns)
        for ours, theirs in zip(*pairs, strict=True):
            assert ours.shape == theirs.shape
            assert np.abs(ours - theirs).max() <= bound * np.abs(theirs).max()
        system, outer, *_ = pairs[0]
        assert np.array_equal(quick.system_entries(rows, columns), system)
        assert np.array_equal(quick.outer_entries(rows, columns), outer)
