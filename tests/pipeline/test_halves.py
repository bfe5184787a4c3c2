"""Increments = "auto": a contact that grows from a point, where slip depends on the path."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from shapes import drawn, elastic, moved, rectangle, touching

from petcontact import Problem, solve
from petcontact.model.base import parse
from petcontact.pipeline.steps import halves


@functools.cache
def pressed(increments):
    """A rigid cylinder on a block, µ = 0.3: p, q and the stick zone grow alike from the first
    contact on."""
    free = [drawn(part, [0.0, 0.0]) for part in ("left", "right")]
    data = {
        "material": elastic(1.0, 0.3),
        "mesh": {"element_size": 0.6, "element_sizes": {"top": 0.03}},
        "geometry": rectangle([-3.0, -3.0], [3.0, 0.0]),
        "boundary": [moved("bottom", [0.0, 0.0]), *free],
        "obstacle": [{"name": "cylinder", "displacement": [0.0, -0.06]}],
        "step": [{"increments": increments}],
        "contact": [touching("pair", "top", "cylinder", gap="x**2/8", friction_coefficient=0.3)],
    }
    return solve(parse(Problem, data, "pressed"))


@pytest.mark.slow
def test_a_contact_that_grows_from_a_point_takes_few_increments_none_solved_twice(monkeypatch):
    """Its halves differ by the same share of the tractions at all loads: these are not what they
    are compared with."""
    tried, solved = [], halves.with_wear

    def counted(increment, *others):
        tried.append(increment)
        return solved(increment, *others)

    exact = pressed(100)  # which does not halve
    pressed.cache_clear()
    monkeypatch.setattr(halves, "with_wear", counted)
    found = pressed("auto")
    q, other = (solution.pairs["pair"].sigma_t[:, 0] for solution in (found, exact))
    assert found.converged and 16 <= len(found.steps) <= 40
    assert np.linalg.norm(q - other) == pytest.approx(0.0, abs=0.03 * np.linalg.norm(other))
    known = {(each.target, id(each.before)) for each in tried}
    assert len(known) == len(tried) < 2.5 * len(found.steps) + 1
