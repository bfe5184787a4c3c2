"""End of an iteration that meets its criterion: tractions within limits and in equilibrium."""

from __future__ import annotations

from dataclasses import replace

from ...arrays import Array
from ..criterion import SLACK
from ..iteration import Recorder
from ..law_protocol import WITHIN, bound_excess
from ..state import ContactState
from .newton import SemismoothNewton


def settled(
    recorder: Recorder, v: Array, sigma: Array, rho: float | Array, reason: str
) -> ContactState | None:
    """Return the final state of another method that meets its criterion, or None if it must go on.

    It must go on if tractions exceed the law's limits by too much. Otherwise they are projected
    onto the limits. If a body that only contact holds would lose its equilibrium, Newton steps
    follow.
    """
    law, system, iteration = recorder.law, recorder.system, recorder.iteration
    put_back = system.modes is None or bound_excess(law, sigma) <= WITHIN
    within = (
        recorder.within_limits(v, sigma, rho, SLACK * iteration.criterion.tolerance)
        if put_back
        else None
    )
    if within is not None:
        return ContactState(*within, rho, True, reason, recorder.history, law=law)
    if system.modes is None or recorder.exhausted:
        return None
    limit = iteration.max_iterations - len(recorder.history)
    state = SemismoothNewton(predict=False)(
        system, law, replace(iteration, max_iterations=limit, start=(v, sigma))
    )
    steps, state.history, state.rho = state.history, recorder.history, rho
    recorder.history.extend(steps)
    state.reason = f"{reason}; Newton steps to equilibrium: {state.reason}"
    return state
