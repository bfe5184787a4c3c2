"""Compiled kernels: their digits do not depend on the company or the unit, and whole columns are
what their integrals make."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from kernel_oracle import free, outline
from prepared import operators

from petcontact.bem import kernels as bem_kernels
from petcontact.bem.column_fillers import CompiledFiller, PlainFiller
from petcontact.bem.kelvin2d import integrals as plane
from petcontact.bem.kelvin3d import integrals as space
from petcontact.mesh.panels import make_panels
from petcontact.model.case import load

CONFIGS = Path(__file__).parents[2] / "configs"


def of_the_plane(order):
    """The integrals of some elements at some targets, and how many elements there are: a polygon of
    long and short ones; its nodes, points near and far."""
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
    every = [np.concatenate(pair) for pair in pairs]

    def made(rows, some):
        targets = plane.Targets(*(values[rows] for values in every))
        return plane.integrals(targets, elements.take(some), 0.3, 1.0)

    return made, len(elements.start)


def panels_and_points(corners, order, unit):
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


def of_space(order):
    panels, points = panels_and_points(4, order, 1.0)
    return lambda rows, some: space.integrals(points[rows], panels.take(some), 0.3), 3


@pytest.mark.parametrize(
    ("kernel", "order"),
    [*((of_the_plane, order) for order in range(6)), *((of_space, order) for order in (0, 2, 3))],
)
def test_digits_do_not_depend_on_the_company(kernel, order):
    """One target or many, one element or many: the same bits."""
    made, count = kernel(order)
    every, all_rows = np.arange(count), slice(None)
    whole = made(all_rows, every)
    for rows in (slice(0, 1), slice(3, 5), slice(40, 110), slice(7, None, 9)):
        for one, all_ in zip(made(rows, every), whole, strict=True):
            assert np.array_equal(one, all_[..., rows])
    for one, all_ in zip(made(all_rows, every[2:3]), whole, strict=True):
        nodes = all_.shape[2] // count
        assert np.array_equal(one, all_[:, :, 2 * nodes : 3 * nodes])


@pytest.mark.parametrize("corners", [3, 4])
@pytest.mark.parametrize("order", [0, 2])
def test_a_power_of_two_as_unit_of_length_changes_no_bit(corners, order):
    (one, x), (other, y) = (panels_and_points(corners, order, unit) for unit in (1.0, 2.0**-13))
    (g, h), (scaled_g, scaled_h) = space.integrals(x, one, 0.3), space.integrals(y, other, 0.3)
    assert np.array_equal(scaled_g, 2.0**-13 * g) and np.array_equal(scaled_h, h)


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
