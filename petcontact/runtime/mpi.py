"""What ranks do together: hand on what one of them has, and meet."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from ..errors import PetcontactError
from ..untyped import Comm

T = TypeVar("T")


def shared(world: Comm, produce: Callable[[], T]) -> T:
    """What rank 0 produces, on every rank; its error, or its end, is raised on every rank."""
    outcome: object = None
    if world.Get_rank() == 0:
        try:
            outcome = (produce(), None)
        except (PetcontactError, SystemExit) as error:
            outcome = (None, error)
    result, refusal = world.bcast(outcome)
    if refusal is not None:
        raise refusal
    return result  # type: ignore[no-any-return]


def all_meet(world: Comm, patience: float | None = None) -> bool:
    """A barrier that sleeps, so that a rank that waits takes no core from those that work.

    Returns
    -------
    bool
        Whether all ranks came within `patience` seconds (no limit by default). After False the
        communicator is not fit for another use.
    """
    request, since = world.Ibarrier(), time.monotonic()
    while not request.Test():
        if patience is not None and time.monotonic() - since > patience:
            return False
        time.sleep(5e-4)
    return True
