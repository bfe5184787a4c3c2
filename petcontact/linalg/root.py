"""The root of a function between two places."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

from ..round_off import EPS


def root_between(function: Callable[[float], float], low: float, high: float) -> float:
    """Return a root of a continuous function that has different signs at two places, to round-off.

    scipy's `brentq` does the same. Loading `scipy.optimize` takes 0.1 s, as long as a small solve.
    Source: C. J. F. Ridders, A new algorithm for computing a single root of a real continuous
    function, IEEE Transactions on Circuits and Systems 26 (1979) 979-980.

    Raises
    ------
    ValueError
        If the signs are equal.

    Examples
    --------
    >>> round(root_between(lambda x: x**3 - 2.0, 0.0, 2.0), 12)
    1.259921049895
    """
    ends, last = [(low, function(low)), (high, function(high))], math.inf
    if ends[0][1] * ends[1][1] > 0.0:
        raise ValueError(f"the function has one sign at {low} and {high}")
    while True:
        (a, f_a), (b, f_b) = ends
        middle = 0.5 * (a + b)
        f_m = function(middle)
        slope = math.copysign(math.hypot(f_m, math.sqrt(abs(f_a)) * math.sqrt(abs(f_b))), f_a - f_b)
        x = middle + (middle - a) * (f_m / slope if slope else 0.0)
        known = sorted([*ends, (middle, f_m), (x, f_x := function(x))])
        if f_x == 0.0 or abs(x - last) <= 4.0 * EPS * max(abs(a), abs(b)):
            return x
        last = x
        ends = next([one, two] for one, two in itertools.pairwise(known) if one[1] * two[1] <= 0.0)
