"""Compiled kernels of the plane: their digits do not depend on the company, and whole columns are
what their integrals make."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_oracle import free, outline

from petcontact.bem.kelvin2d.integrals import Targets, integrals


def elements_and_targets(order):
    """A polygon of long and short elements; its nodes, points near and far."""
    rng = np.random.default_rng(7)
    angle = np.sort(rng.uniform(0.3, 2 * np.pi, 37))
    straight = np.array([[4.0, -1.0], [4.0, -0.3], [4.0, 0.5], [4.0, 0.501]])
    bent = np.stack([3 * np.cos(angle), 2 * np.sin(angle)], axis=1)
    elements, nodes = outline(np.concatenate([straight, bent]), [0.0, 1.0], order)
    near = nodes.point + 1e-3 * rng.standard_normal(nodes.point.shape)
    ends = elements.start + 1e-6 * rng.standard_normal(elements.start.shape)
    away = 10.0 ** rng.uniform(-1, 6, (300, 1)) * rng.standard_normal((300, 2))
    beside = free(np.concatenate([near, ends, away]))
    fields = ("point", "line", "element", "xi")
    pairs = ([getattr(each, name) for each in (nodes, beside)] for name in fields)
    return elements, Targets(*map(np.concatenate, pairs))


@pytest.mark.parametrize("order", range(6))
def test_digits_do_not_depend_on_the_company(order):
    """One target or many, one element or many: the same bits."""
    elements, targets = elements_and_targets(order)
    whole = integrals(targets, elements, 0.3, 1.0)
    for rows in (slice(0, 1), slice(3, 5), slice(40, 110), slice(7, None, 9)):
        some = Targets(
            targets.point[rows], targets.line[rows], targets.element[rows], targets.xi[rows]
        )
        for one, all_ in zip(integrals(some, elements, 0.3, 1.0), whole, strict=True):
            assert np.array_equal(one, all_[..., rows])
    for one, all_ in zip(
        integrals(targets, elements.take(np.array([12, 3])), 0.3, 1.0), whole, strict=True
    ):
        blocks = all_.reshape(2, 2, -1, order + 1, len(targets.line))[:, :, [12, 3]]
        assert np.array_equal(one, blocks.reshape(one.shape))
