"""Where gaps are least: to round-off of the gap, in few evaluations, the lowest ones first."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from petcontact.refinement.gap_minima import MOST_MINIMA, gap_minima
from petcontact.round_off import HALF

GAPS = {
    "parabola": (lambda x: (x - 0.3141) ** 2, [0.3141], 1e-7),
    "kink": (lambda x: np.abs(x - 0.3141), [0.3141], HALF),
    "two": (lambda x: np.minimum((x - 0.21) ** 2, np.abs(x - 0.83) + 1e-3), [0.21, 0.83], 1e-7),
    "quartic": (lambda x: (x - 0.7) ** 4, [0.7], 1e-3),
    "an end": (lambda x: x, [0.0], HALF),
    "none": (lambda x: np.full_like(x, 0.1), [], 0.0),
    "ends of a flat stretch": (
        lambda x: np.maximum(np.abs(x - 0.5) - 0.2, 0.0),
        [0.3, 0.7],
        0.011,  # two samples
    ),
}


def looked_at(gap, samples=201):
    calls = []

    def values(at):
        calls.append(len(at))
        return np.asarray(gap(at), dtype=float)[:, None]

    at = np.linspace(0.0, 1.0, samples)
    return SimpleNamespace(samples=at, sampled=values(at), values=values), calls


@pytest.mark.parametrize("name", GAPS)
def test_minima_are_found_to_the_round_off_of_the_gap(name):
    gap, places, digits = GAPS[name]
    field, calls = looked_at(gap)
    found = gap_minima(field, 0.0)
    assert len(found) == len(places) and np.allclose(found, places, rtol=0.0, atol=digits)
    assert len(calls) <= 1 + 2


def test_only_the_lowest_ones_are_kept():
    field, _ = looked_at(lambda x: np.cos(40.0 * x) + x)
    assert len(gap_minima(field, 0.0)) == MOST_MINIMA
