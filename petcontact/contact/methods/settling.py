"""The end of an iteration whose stopping criterion is met: tractions within the law's limits, and
in equilibrium."""

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
    """The end of another method whose criterion is met; None if it is to go on, its tractions being
    beyond the law's limits.

    They are put back within the limits; where that would cost a body that only contact holds its
    equilibrium, Newton steps from there find both.
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
    steps, state.history = state.history, recorder.history
    recorder.history.extend(steps)
    state.reason = f"{reason}; Newton steps to equilibrium: {state.reason}"
    return state
