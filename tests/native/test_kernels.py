"""The compiled kernels against numpy's, which are the oracle and serve where nothing was
compiled."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import example
from prepared import operators

from petcontact import Displacement, MeshOptions
from petcontact.bem import kernels as bem_kernels
from petcontact.bem.column_fillers import CompiledFiller, PlainFiller
from petcontact.bem.kelvin2d import integrals as module
from petcontact.bem.kelvin2d.integrals import Elements, Targets, integrals
from petcontact.geometry.arcs import half_angles, on_arcs
from petcontact.mesh.basis import gauss


def loop_of(points, order):
    """Straight elements through the vertices of a closed polygon, each on a line of its own but the
    first three."""
    n = len(points)
    line = np.arange(n)
    line[:3] = 0
    return Elements(points, np.roll(points, -1, axis=0), np.zeros(n), order, line, np.arange(n))


def elements_and_targets(unit, order=0):
    """A polygon with long and short elements, two of them in one line with the first; its nodes,
    points near and far."""
    rng = np.random.default_rng(7)
    angle = np.sort(rng.uniform(0.3, 2 * np.pi, 37))
    straight = np.array([[4.0, -1.0], [4.0, -0.3], [4.0, 0.5], [4.0, 0.501]])
    points = unit * np.concatenate(
        [straight, np.stack([3 * np.cos(angle), 2 * np.sin(angle)], axis=1)]
    )
    elements = loop_of(points, order)
    xi = gauss(order)[0]
    share = 0.5 * (1.0 + xi)[:, None]
    nodes = (elements.start[:, None] + share * (elements.end - elements.start)[:, None]).reshape(
        -1, 2
    )
    near = nodes + 1e-3 * unit * rng.standard_normal(nodes.shape)
    away = unit * 10.0 ** rng.uniform(-1, 6, (300, 1)) * rng.standard_normal((300, 2))
    ends = elements.start + 1e-6 * unit * rng.standard_normal(elements.start.shape)
    point = np.concatenate([nodes, near, ends, away])
    own = np.full(len(point), -1)
    own[: len(nodes)] = np.repeat(elements.index, order + 1)
    place = np.zeros(len(point))
    place[: len(nodes)] = np.tile(xi, len(elements.index))
    return elements, Targets(point, np.where(own < 0, -1, elements.line[own]), own, place)


@pytest.mark.parametrize("unit", [1.0, 1e-4, 1e5])
def test_constant_elements_agree_with_numpy(monkeypatch, unit):
    elements, targets = elements_and_targets(unit)
    ours = integrals(targets, elements, 0.3, 2.0 * unit)
    monkeypatch.setattr(module, "available", lambda: False)
    theirs = integrals(targets, elements, 0.3, 2.0 * unit)
    for one, other in zip(ours, theirs, strict=True):
        # within 1e-6 of an end point numpy's distances carry the round-off of coordinates, in both
        # alike
        assert np.all(np.abs(one - other) <= 2e-13 * np.abs(other).max(axis=(0, 1)))


@pytest.mark.parametrize("unit", [1.0, 1e-4])
@pytest.mark.parametrize("order", range(1, 6))
def test_elements_of_higher_order_agree_with_numpy(monkeypatch, order, unit):
    elements, targets = elements_and_targets(unit, order)
    ours = integrals(targets, elements, 0.3, 2.0 * unit)
    monkeypatch.setattr(module, "available", lambda: False)
    for one, other, scale in zip(
        ours, integrals(targets, elements, 0.3, 2.0 * unit), (unit, 1.0), strict=True
    ):
        size = np.abs(other).max(axis=(0, 1))
        # numpy's rules hold 1e-13 of a pair; of what the operators take, nodes against elements,
        # 2e-14 of the largest remain
        nodes = np.count_nonzero(targets.element >= 0)
        assert np.all(np.abs(one - other) <= 4e-13 * size + 3e-16 * scale)
        assert np.abs(one - other)[..., :nodes].max() <= 2e-14 * size[:, :nodes].max()


@pytest.mark.parametrize("bulge", [0.02, -0.7, 1.99])
@pytest.mark.parametrize("order", range(6))
def test_arcs_agree_with_numpy(monkeypatch, order, bulge):
    """Arcs round a polygon, flat ones to half circles, some of them straight; with neighbours as
    constant ones have them."""
    elements, targets = elements_and_targets(1.0, order)
    size = np.linalg.norm(elements.end - elements.start, axis=1)
    curvature = np.where(elements.index % 5 == 0, 0.0, bulge / size)
    elements = replace(
        elements, curvature=curvature, line=np.where(curvature == 0.0, elements.line, -1)
    )
    own, place = targets.element, targets.xi
    x, _ = on_arcs(
        elements.start[own],
        elements.end[own],
        half_angles(size, curvature)[own],
        place,
        ((elements.end - elements.start) / size[:, None])[own],
    )
    count = len(elements.index)
    targets = Targets(
        np.where(own[:, None] < 0, targets.point, x),
        np.where(own < 0, -1, elements.line[own]),
        own,
        place,
        np.where(own < 0, -2, (own - 1) % count),
        np.where(own < 0, -2, (own + 1) % count),
    )
    ours = integrals(targets, elements, 0.3, 2.0)
    monkeypatch.setattr(module, "available", lambda: False)
    for one, other in zip(ours, integrals(targets, elements, 0.3, 2.0), strict=True):
        nodes = np.count_nonzero(own >= 0)
        # at points off the nodes beside tiny half circles both lose digits of high orders
        assert np.all(
            np.abs(one - other).max(axis=(0, 1, 2)) <= 5e-12 * np.abs(other).max(axis=(0, 1, 2))
        )
        assert np.abs(one - other)[..., :nodes].max() <= 2e-14 * np.abs(other)[..., :nodes].max()


@pytest.mark.parametrize("order", range(6))
def test_digits_do_not_depend_on_the_company(order):
    """One target or many, one element or many: the same bits."""
    elements, targets = elements_and_targets(1.0, order)
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


def test_nodes_off_the_middle_of_their_element(monkeypatch):
    elements, targets = elements_and_targets(1.0)
    xi = np.where(targets.element >= 0, 0.6, 0.0)
    own = elements.start + 0.8 * (elements.end - elements.start)
    point = np.concatenate([own, targets.point[len(own) :]])
    targets = Targets(point, targets.line, targets.element, xi)
    ours = integrals(targets, elements, 0.2, 1.0)
    monkeypatch.setattr(module, "available", lambda: False)
    for one, other in zip(ours, integrals(targets, elements, 0.2, 1.0), strict=True):
        assert np.abs(one - other).max() <= 1e-13 * np.abs(other).max()


@pytest.mark.parametrize(
    ("number", "lift", "order"),
    [(1, (0.0, 0.0), 0), (2, (0.01, -0.03), 0), (1, (0.0, 0.0), 3), (2, (0.01, -0.03), 5)],
)
def test_columns_agree_with_numpy(monkeypatch, number, lift, order):
    """Whole blocks of A_0 and of the right-hand sides, rows and columns in pieces as a compression
    asks for them."""
    case = example(number, mesh=MeshOptions(element_size=0.25 * (order + 1), order=order))
    top = tuple(
        Displacement(part="top", value=lift) if b.part == "top" else b for b in case.boundary
    )
    quick, slow = (operators(case.model_copy(update={"boundary": top})) for _ in range(2))
    monkeypatch.setattr(bem_kernels, "COLUMN_FILLERS", {})
    assert isinstance(slow._filler, PlainFiller)
    monkeypatch.undo()
    assert isinstance(quick._filler, CompiledFiller)
    every, rng = np.arange(quick.mesh.n_nodes), np.random.default_rng(3)
    monkeypatch.setattr(module, "available", lambda: False)
    pieces = [
        (every, every),
        *((np.sort(rng.permutation(every)[:k]), every[a::3]) for k, a in ((5, 0), (40, 1))),
    ]
    for rows, columns in pieces:
        for ours, theirs in zip(
            quick.all_entries(rows, columns), slow.all_entries(rows, columns), strict=True
        ):
            assert ours.shape == theirs.shape
            assert np.abs(ours - theirs).max() <= 1e-13 * np.abs(theirs).max()
        assert np.array_equal(
            quick.system_entries(rows, columns), quick.all_entries(rows, columns)[0]
        )
        assert np.array_equal(
            quick.outer_entries(rows, columns), quick.all_entries(rows, columns)[1]
        )
