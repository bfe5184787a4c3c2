"""The compiled kernels against numpy's, which are the oracle and serve where nothing was compiled."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import example
from petcontact.pipeline.prepare import discretise

from petcontact import Displacement, MeshOptions, native
from petcontact.bem import operators
from petcontact.bem.kelvin2d import integrals as module
from petcontact.bem.kelvin2d.integrals import Elements, Targets, integrals

compiled = pytest.mark.skipif(not native.describe().startswith("compiled"), reason="nothing was compiled here")


def loop_of(points):
    """Straight elements through the vertices of a closed polygon, each on a line of its own but the first three."""
    n = len(points)
    line = np.arange(n)
    line[:3] = 0
    return Elements(points, np.roll(points, -1, axis=0), np.zeros(n), 0, line, np.arange(n))


def elements_and_targets(unit):
    """A polygon with long and short elements, two of them in one line with the first; its nodes, points near and far."""
    rng = np.random.default_rng(7)
    angle = np.sort(rng.uniform(0.3, 2 * np.pi, 37))
    straight = np.array([[4.0, -1.0], [4.0, -0.3], [4.0, 0.5], [4.0, 0.501]])
    points = unit * np.concatenate([straight, np.stack([3 * np.cos(angle), 2 * np.sin(angle)], axis=1)])
    elements = loop_of(points)
    middle = 0.5 * (elements.start + elements.end)
    near = middle + 1e-3 * unit * rng.standard_normal(middle.shape)
    away = unit * 10.0 ** rng.uniform(-1, 6, (300, 1)) * rng.standard_normal((300, 2))
    ends = elements.start + 1e-6 * unit * rng.standard_normal(middle.shape)
    point = np.concatenate([middle, near, ends, away])
    none = np.full(len(point) - len(middle), -1)
    return elements, Targets(
        point, np.concatenate([elements.line, none]), np.concatenate([elements.index, none]), np.zeros(len(point))
    )


@compiled
@pytest.mark.parametrize("unit", [1.0, 1e-4, 1e5])
@pytest.mark.parametrize("wanted", [(True, True), (True, False), (False, True)])
def test_constant_elements_agree_with_numpy(monkeypatch, unit, wanted):
    elements, targets = elements_and_targets(unit)
    options = {"displacement": wanted[0], "traction": wanted[1]}
    ours = integrals(targets, elements, 0.3, 2.0 * unit, **options)
    monkeypatch.setattr(module, "_constant_compiled", None)
    theirs = integrals(targets, elements, 0.3, 2.0 * unit, **options)
    for one, other, asked in zip(ours, theirs, wanted, strict=True):
        assert (one is not None) == (other is not None) == asked
        if one is not None:
            size = np.abs(other).max(axis=(0, 1))
            # within 1e-6 of an end point numpy's distances carry the round-off of coordinates, in both alike
            assert np.all(np.abs(one - other) <= 2e-13 * size)


@compiled
def test_nodes_off_the_middle_of_their_element(monkeypatch):
    elements, targets = elements_and_targets(1.0)
    xi = np.where(targets.element >= 0, 0.6, 0.0)
    own = elements.start + 0.8 * (elements.end - elements.start)
    point = np.concatenate([own, targets.point[len(own) :]])
    targets = Targets(point, targets.line, targets.element, xi)
    ours = integrals(targets, elements, 0.2, 1.0)
    monkeypatch.setattr(module, "_constant_compiled", None)
    for one, other in zip(ours, integrals(targets, elements, 0.2, 1.0), strict=True):
        assert np.abs(one - other).max() <= 1e-13 * np.abs(other).max()


@compiled
def test_can_be_switched_off():
    program = "from petcontact import native; print(native.describe())"
    environment = {**os.environ, native.VARIABLE: "0"}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "numpy (PETCONTACT_NATIVE=0)\n"


@compiled
@pytest.mark.parametrize(("number", "lift"), [(1, (0.0, 0.0)), (2, (0.01, -0.03))])
def test_columns_agree_with_numpy(monkeypatch, number, lift):
    """Whole blocks of A_0 and of the right-hand sides, rows and columns in pieces as a compression asks for them."""
    case = example(number, mesh=MeshOptions(element_size=0.25))
    top = tuple(Displacement(part="top", value=lift) if b.part == "top" else b for b in case.boundary)
    quick, slow = (discretise(case.model_copy(update={"boundary": top})) for _ in range(2))
    monkeypatch.setattr(operators, "column_filler", lambda *_: None)
    assert slow._filler is None
    monkeypatch.undo()
    assert quick._filler is not None
    every, rng = np.arange(quick.mesh.n_nodes), np.random.default_rng(3)
    pieces = [(every, every), *((np.sort(rng.permutation(every)[:k]), every[a::3]) for k, a in ((5, 0), (40, 1)))]
    for rows, columns in pieces:
        for ours, theirs in zip(quick.all_entries(rows, columns), slow.all_entries(rows, columns), strict=True):
            assert ours.shape == theirs.shape
            assert np.abs(ours - theirs).max() <= 1e-13 * np.abs(theirs).max()
        assert np.array_equal(quick.system_entries(rows, columns), quick.all_entries(rows, columns)[0])
        assert np.array_equal(quick.outer_entries(rows, columns), quick.all_entries(rows, columns)[1])
