"""Compiled kernels of space: their digits do not depend on the company or the unit, and whole
columns are what their integrals make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from prepared import operators

from petcontact.bem import kernels as bem_kernels
from petcontact.bem.column_fillers import CompiledFiller, PlainFiller
from petcontact.bem.kelvin3d.integrals import integrals
from petcontact.mesh.panels import make_panels
from petcontact.model.case import load

CONFIGS = Path(__file__).parents[2] / "configs"


def panels_and_points(corners: int, order: int, unit: float):
    """Three crooked panels in planes of their own; their nodes, points beside these, in their
    planes, near and far."""
    rng = np.random.default_rng(10 * corners + order)
    angle = (
        np.sort(rng.uniform(0.0, 0.5, (3, corners)), axis=1)
        + 2.0 * np.pi * np.arange(corners) / corners
    )
    flat = np.stack(
        [np.cos(angle), rng.uniform(0.3, 1.0, (3, 1)) * np.sin(angle), np.zeros_like(angle)],
        axis=-1,
    )
    turn = np.linalg.qr(rng.normal(size=(3, 3, 3)))[0]
    panels, x, _ = make_panels(
        unit * (flat @ turn + rng.normal(size=(3, 1, 3))), order, np.arange(3)
    )
    nodes = x.reshape(-1, 3)
    away = 10.0 ** rng.uniform(-1.0, 4.0, (150, 1)) * rng.normal(size=(150, 3))
    flat = rng.normal(size=(20, 2)) @ panels.frame[0, :2]
    beside = nodes + 1e-6 * unit * rng.normal(size=nodes.shape)
    return panels, np.vstack([nodes, beside, panels.centre[0] + unit * flat, unit * away])


@pytest.mark.parametrize("corners", [3, 4])
@pytest.mark.parametrize("order", [0, 2])
def test_a_power_of_two_as_unit_of_length_changes_no_bit(corners: int, order: int) -> None:
    (one, x), (other, y) = (panels_and_points(corners, order, unit) for unit in (1.0, 2.0**-13))
    (g, h), (scaled_g, scaled_h) = integrals(x, one, 0.3), integrals(y, other, 0.3)
    assert np.array_equal(scaled_g, 2.0**-13 * g) and np.array_equal(scaled_h, h)


@pytest.mark.parametrize("order", [0, 2, 3])
def test_digits_do_not_depend_on_the_company(order: int) -> None:
    """One target or many, one panel or many: the same bits."""
    panels, points = panels_and_points(4, order, 1.0)
    whole = integrals(points, panels, 0.3)
    for rows in (slice(0, 1), slice(3, 5), slice(40, 110), slice(7, None, 9)):
        for one, all_ in zip(integrals(points[rows], panels, 0.3), whole, strict=True):
            assert np.array_equal(one, all_[..., rows])
    k = panels.n_nodes
    last = integrals(points, panels.take(slice(2, 3)), 0.3)
    for part, all_ in zip(last, whole, strict=True):
        assert np.array_equal(part, all_[:, :, 2 * k :])


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("space_b", {"mesh.element_size": 2.0, "mesh.order": 1}),
        ("space_b", {"boundary.1.value": [0.0, 0.01, -0.02]}),
        ("space_bracket", {"mesh": {"order": 1}}),
    ],
)
def test_columns_are_what_the_integrals_make(
    monkeypatch: pytest.MonkeyPatch, name: str, keys: dict[str, object]
) -> None:
    """Whole blocks of A_0 and of the right-hand sides, rows and columns in pieces as a compression
    asks for them."""
    case = load(CONFIGS / f"{name}.toml", keys)
    quick, slow = (operators(case) for _ in range(2))
    monkeypatch.setattr(bem_kernels, "COLUMN_FILLERS", {})
    assert isinstance(slow._filler, PlainFiller)
    monkeypatch.undo()
    assert isinstance(quick._filler, CompiledFiller)
    every, rng = np.arange(quick.mesh.n_nodes), np.random.default_rng(3)
    some = np.sort(rng.permutation(every)[:70])
    for rows, columns in ((some, some), (some[::20], every[1::7]), (every[::5], some[:9])):
        for ours, theirs in zip(
            quick.all_entries(rows, columns), slow.all_entries(rows, columns), strict=True
        ):
            assert ours.shape == theirs.shape
            assert np.abs(ours - theirs).max() <= 1e-12 * np.abs(theirs).max()
        assert np.array_equal(
            quick.system_entries(rows, columns), quick.all_entries(rows, columns)[0]
        )
        assert np.array_equal(
            quick.outer_entries(rows, columns), quick.all_entries(rows, columns)[1]
        )
