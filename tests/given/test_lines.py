"""Given data along sides: their integrals are exact, wherever the data are narrow."""

from __future__ import annotations

import doctest
import math

import numpy as np
import pytest

from petcontact.geometry.outline import Side
from petcontact.given import features, lines, sites, values
from petcontact.given.lines import Line
from petcontact.given.sites import Sites
from petcontact.given.values import as_given

STRAIGHT = Line(Side(np.array([0.0, 1.0]), np.array([8.0, 1.0]), "bottom"), 0.0)
ARC = Line(Side(np.array([1.0, 0.0]), np.array([0.0, 1.0]), "rim", 1.0), 2.0)


@pytest.mark.parametrize(
    ("line", "load", "wanted"),
    [
        (STRAIGHT, 3.0, 24.0),
        (STRAIGHT, "x**7 - y", 8.0**8 / 8.0 - 8.0),
        (STRAIGHT, "abs(x - 2.1)", 0.5 * (2.1**2 + 5.9**2)),
        (STRAIGHT, "where((x > 1) * (x < 1.0001), 1e4, 0)", 1.0),
        (STRAIGHT, "exp(-((x - 3)/1e-6)**2)", 1e-6 * math.sqrt(math.pi)),
        (STRAIGHT, lambda s: np.sin(s), 1.0 - math.cos(8.0)),
        (ARC, "x*y", 0.5),
        (ARC, "s", 2.0 * 0.5 * math.pi + math.pi**2 / 8.0),
    ],
)
def test_integrals_are_exact_over_each_element(line, load, wanted):
    """The sum over elements, none of whose ends is a place where the load changes."""
    datum, ends = as_given(load, "load"), np.array([0.0, 0.217, 0.3, 0.77, 1.0])
    at, weight = line.quadrature([datum], ends)
    assert weight @ datum.at(line.sites(at)) == pytest.approx(wanted, rel=1e-7)
    inside = np.bincount(np.searchsorted(ends, at) - 1, weight)
    assert np.allclose(inside, line.side.length * np.diff(ends), rtol=1e-12)


def test_data_are_equal_where_their_sources_are():
    """A mesh stores samples by the datum, and a load that a step repeats is solved for once."""
    assert as_given("x", "gap") == as_given("x", "step[0].gap") != as_given("y", "gap")
    assert hash(as_given(2, "gap")) == hash(as_given(2.0, "gap"))
    assert as_given(2.0, "gap") != as_given("2.0", "gap")


def test_nodal_values_belong_to_one_mesh():
    nodal = as_given((1.0, 2.0), "gap")
    assert not nodal.everywhere and STRAIGHT.switches(nodal)[0].size == 0
    assert nodal.at(Sites(np.zeros((2, 2)))).tolist() == [1.0, 2.0]


@pytest.mark.parametrize("module", [values, lines, features, sites])
def test_examples_of_docstrings_hold(module):
    ran = doctest.testmod(module)
    assert ran.attempted > 0 and ran.failed == 0
