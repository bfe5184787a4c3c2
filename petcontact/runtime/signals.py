"""SIGINT and SIGTERM: they end a solve between two steps, never in the middle of a write."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupted(BaseException):
    """A signal that asks the program to end; not an `Exception`, so that no handler of errors swallows it.

    Parameters
    ----------
    number : int
        The signal's number.
    saved : str
        What has been saved, in words.
    """

    def __init__(self, number: int, saved: str = "nothing was written") -> None:
        super().__init__(f"{signal.Signals(number).name}; {saved}")
        self.number = number
        self.name = signal.Signals(number).name
        self.exit_status = 128 + number


_installed = False
_deferring = 0
_pending: list[int] = []


def _handle(number: int, frame: FrameType | None) -> None:
    if _deferring:
        _pending.append(number)
    else:
        raise Interrupted(number)


def install() -> None:
    """Turn SIGINT and SIGTERM into `Interrupted`; for the command line, in the main thread."""
    global _installed
    if threading.current_thread() is threading.main_thread():
        _installed = True
        for number in SIGNALS:
            signal.signal(number, _handle)


def reinstall() -> None:
    """Again, if it was done before: PETSc takes SIGTERM for itself when it starts (3.2x does, 3.18 does not)."""
    if _installed:
        install()


@contextlib.contextmanager
def deferred() -> Iterator[None]:
    """Hold signals back until the block is over."""
    global _deferring
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    _deferring += 1
    try:
        yield
    finally:
        _deferring -= 1
        if not _deferring and _pending:
            number = _pending.pop()
            _pending.clear()
            raise Interrupted(number)


@contextlib.contextmanager
def held(wanted: bool) -> Iterator[list[int]]:
    """Hold signals back, if wanted, and tell them after the block instead of raising: their numbers are in the list."""
    late: list[int] = []
    if not wanted:
        yield late
        return
    try:
        with deferred():
            yield late
    except Interrupted as error:
        late.append(error.number)


@contextlib.contextmanager
def agreed(comm: Any) -> Iterator[Callable[[], int]]:
    """Hold signals back on a communicator of several ranks, where one rank alone must not leave the others waiting.

    They are raised by `check`, on all ranks at once; what comes after the last check is what the function given to the
    block returns (collective): the number of a signal, or 0.
    """
    if comm.getSize() == 1:
        yield lambda: 0
        return
    with deferred():
        yield lambda: _pending_anywhere(comm)


def check(comm: Any) -> None:
    """Raise `Interrupted` on every rank if one of them has a signal pending (collective)."""
    if comm.getSize() > 1 and (number := _pending_anywhere(comm)):
        raise Interrupted(number)


def _pending_anywhere(comm: Any) -> int:
    number: int = max(comm.tompi4py().allgather(_pending[-1] if _pending else 0))
    if number:
        _pending.clear()
    return number
