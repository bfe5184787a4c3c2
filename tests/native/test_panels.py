"""Compiled kernels of space: their digits do not depend on the company or the unit, and whole
columns are what their integrals make."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.bem.kelvin3d.integrals import integrals
from petcontact.mesh.panels import make_panels


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
