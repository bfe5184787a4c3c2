"""Sets from which semismooth Newton starts."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...arrays import Array
from ..active_set.pivots import LinearSolver, pivots
from ..law_protocol import OPEN, ContactLaw
from ..laws import SignoriniCoulomb
from ..system import ContactSystem

Guess = tuple[Array, Array, Array]
"""τ, σ and v."""


def tau_of(law: ContactLaw, v: Array, sigma: Array) -> Array:
    """Return ρv - σ with a ρ for which both terms count."""
    size = math.sqrt(np.vdot(v, v)), math.sqrt(np.vdot(sigma, sigma))
    return (size[1] / size[0] if min(size) > 0.0 else 1.0) * v - sigma


def everywhere(like: Array, law: ContactLaw, slip: float) -> Array:
    """Return τ of contact everywhere: stick, or slip one way along the first tangent."""
    tau = np.zeros(like.shape)
    if len(law.groups) > 1:
        tau[:, law.groups[1]] = 1.0
    # outside of every ball
    tau[:, 0] = slip * 1e150
    return tau


def frictionless(
    solver: LinearSolver, law: ContactLaw, system: ContactSystem, stuck: Array
) -> Iterator[Guess]:
    """Yield the solution without friction, with all closed nodes set to stick.

    It is a minimum. Nothing is yielded if there is none, as where friction alone holds a body.
    """
    if not isinstance(law, SignoriniCoulomb) or not (law.coefficient.any() and law.bound.any()):
        return
    smooth = replace(
        law, coefficient=np.zeros_like(law.coefficient), bound=np.zeros_like(law.bound)
    )
    fewest, best = len(stuck) + 1, 0
    # 100 exchanges are enough without friction
    for number, step in enumerate(
        itertools.islice(pivots(solver, smooth, system.u_0, system.modes, stuck), 100)
    ):
        if step.wrong < fewest:
            fewest, best = step.wrong, number
        elif number - best > 10:  # as where nothing but friction holds a body
            return
        if step.wrong == 0:
            if not step.push.any():
                yield (
                    np.where((smooth.states(step.tau) == OPEN)[:, None], step.tau, stuck),
                    step.sigma,
                    step.v,
                )
            return
