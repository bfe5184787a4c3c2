"""Roots between two places."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from petcontact.linalg.root import root_between


@given(st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=8, unique=True), st.floats(0.01, 0.99))
def test_the_root_of_a_line_with_kinks_is_found(places, share):
    """Unbalanced loads are such lines along a motion; the places may be given in any order."""
    x = np.sort(places)
    if np.diff(x).min() < 1e-6:
        return
    values = np.cumsum(np.diff(x, prepend=x[0] - 1.0) * (1.0 + np.arange(len(x)) % 3))
    values -= values[0] + share * (values[-1] - values[0])
    for ends in ((x[0], x[-1]), (x[-1], x[0])):
        root = root_between(lambda at: float(np.interp(at, x, values)), *map(float, ends))
        assert abs(np.interp(root, x, values)) < 1e-13 * np.ptp(values)


def test_ends_and_jumps_are_roots_and_equal_signs_are_refused():
    assert root_between(lambda x: x, 0.0, 1.0) == 0.0
    assert root_between(lambda x: x - 1.0, 0.0, 1.0) == 1.0
    assert root_between(lambda x: math.copysign(1.0, x - 0.2), 0.0, 1.0) == pytest.approx(0.2)
    with pytest.raises(ValueError, match="one sign"):
        root_between(lambda x: x + 1.0, 0.0, 1.0)
