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
from petcontact.mesh.curved.panels import make_curved_panels
from petcontact.mesh.pairs.panel_faces import PanelFaces
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


@pytest.mark.parametrize("corners", [3, 4])
def test_lines_meet_curved_panels_from_outside_only(corners: int) -> None:
    """Lines that end on a cap meet it there, and turned round not at all; what lines of any direction
    are said to meet they do."""
    random, n = np.random.default_rng(corners), 400
    reference = np.array(
        [(-1, -1), (1, -1), (1, 1), (-1, 1)] if corners == 4 else [(0, 0), (1, 0), (0, 1)],
        dtype=float,
    )
    middles = 0.5 * (reference + np.roll(reference, -1, axis=0))
    points = np.concatenate(
        [reference, middles, *([reference.mean(axis=0, keepdims=True)] if corners == 4 else [])]
    )
    caps = np.column_stack([points, 1.0 - 0.3 * np.sum(points**2, axis=1)]) + 0.03 * random.normal(
        size=(8, len(points), 3)
    )
    curved = make_curved_panels(caps, 1, np.arange(8))[0]
    faces, number = PanelFaces.from_groups([curved], np.arange(8)), random.integers(0, 8, n)
    share = random.random((n, 2)) * (1.0 if corners == 4 else [1.0, 0.5])
    place = faces.spread(number, share)
    y, normal = faces.at(number, place)
    way = -normal + 0.3 * random.uniform(-1.0, 1.0, (n, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    away = random.uniform(0.1, 0.5, n)
    x = y - away[:, None] * way
    found, distance = faces._pierced(number, x, way)
    assert np.allclose(found, place, rtol=0.0, atol=1e-11)
    assert np.allclose(distance, away, rtol=0.0, atol=1e-11)
    assert np.isinf(faces._pierced(number, x, -way)[1]).all()
    x, way = random.uniform(-1.2, 1.2, (n, 3)), random.normal(size=(n, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    found, distance = faces._pierced(number, x, way)
    met = np.isfinite(distance)
    assert 0.1 < met.mean() < 0.8 and np.array_equal(met, np.isfinite(found).all(axis=1))
    y, normal = faces.at(number[met], found[met])
    assert np.allclose(y, x[met] + distance[met, None] * way[met], rtol=0.0, atol=1e-8)
    assert np.all(np.sum(normal * way[met], axis=1) < 0.0)
