"""Signals that ask a program to end: they end a solve between two steps, never in the middle of a
write."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType

from ..errors import PetcontactError
from ..untyped import Comm

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGXCPU)
"""Ctrl-C, the batch system, the terminal that is closed, the limit of processor time (a soft one:
there is time to save)."""


class Interrupted(BaseException):
    """A signal that asks the program to end; not an `Exception`, so that no handler of errors
    swallows it.

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


LATEST = 3.0
"""Seconds after which a signal ends what does not answer it [s]: batch systems kill later, and Open
MPI 4 s after its own signal."""
_installed = False
_deferring = 0
_pending: list[int] = []
_together = False
_rescue: Callable[[], str] | None = None


def _handle(number: int, frame: FrameType | None) -> None:
    if _deferring:
        _pending.append(number)
    else:
        raise Interrupted(number)


def _swallowed(unraisable: sys.UnraisableHookArgs) -> None:
    """What a library or the garbage collector could not pass on: a signal waits for the next block
    that holds them back."""
    if isinstance(unraisable.exc_value, Interrupted):
        _pending.append(unraisable.exc_value.number)
    else:
        sys.__unraisablehook__(unraisable)


def install() -> None:
    """Turn the signals into `Interrupted`; for the command line, in the main thread. What nohup
    ignores stays ignored."""
    global _installed
    if threading.current_thread() is threading.main_thread():
        _installed, sys.unraisablehook = True, _swallowed
        for number in SIGNALS:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, _handle)


def reinstall() -> None:
    """Install again, if it was done before: PETSc takes SIGTERM for itself when it starts (3.2x
    does, 3.18 does not)."""
    if _installed:
        install()


@contextlib.contextmanager
def watched() -> Iterator[None]:
    """A block that a signal ends, with the process, also where the main thread does not come to it:
    in a call of LAPACK, or as it waits for threads in one."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    over, (reader, writer) = threading.Event(), os.pipe()
    os.set_blocking(writer, False)
    before = signal.set_wakeup_fd(writer)
    threading.Thread(target=_watch, args=(reader, over), daemon=True).start()
    try:
        yield
    finally:
        over.set()
        signal.set_wakeup_fd(before)
        os.close(writer)


def _watch(reader: int, over: threading.Event) -> None:
    """End the process `LATEST` after a signal, but while signals are held back and until the block
    is over."""
    while (number := os.read(reader, 1)) == bytes([signal.SIGPROF]):  # of `limited`
        pass  # nothing is read where the block ends without a signal
    late = time.monotonic() + LATEST
    while number and not over.wait(0.1):
        if time.monotonic() > late and not _deferring:
            try:
                saved = _rescue() if _rescue else "what was under way is lost"
                end = Interrupted(number[0], saved)
                print(f"petcontact: interrupted by {end}", file=sys.stderr, flush=True)
            finally:
                os._exit(128 + number[0])
    os.close(reader)


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


class BrokenOff(PetcontactError):
    """A block of `answering` that a signal broke off."""


@contextlib.contextmanager
def answering(comm: Comm) -> Iterator[None]:
    """Within the block no signal that is held back waits, where one rank runs alone: nothing there
    is to be kept.

    Raises
    ------
    BrokenOff
        Where a signal did so, which whoever holds signals back is asked for next.
    """
    global _deferring
    if (
        comm.getSize() > 1
        or not _deferring
        or threading.current_thread() is not threading.main_thread()
    ):
        yield
        return
    held, _deferring = _deferring, 0
    try:
        if _pending:
            raise Interrupted(_pending.pop())
        yield
    except Interrupted as interrupted:
        _pending.append(interrupted.number)
        raise BrokenOff(f"interrupted by {interrupted.name}") from None
    finally:
        _deferring = held


@contextlib.contextmanager
def limited(comm: Comm) -> Iterator[Callable[[float, str], None]]:
    """A block that ends after as much processor time as what it yields is called with, for the
    reason that is given there, where one rank runs alone.

    Raises
    ------
    BrokenOff
        When the time is over.
    """

    def limit(seconds: float, reason: str) -> None:
        def over(number: int, frame: FrameType | None) -> None:
            raise BrokenOff(reason)

        if comm.getSize() == 1 and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGPROF, over)
            signal.setitimer(signal.ITIMER_PROF, seconds)

    before = signal.getsignal(signal.SIGPROF)
    try:
        yield limit
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        if signal.getsignal(signal.SIGPROF) is not before:
            signal.signal(signal.SIGPROF, before)


@contextlib.contextmanager
def together(ranks: Comm) -> Iterator[None]:
    """A block that a signal breaks off on all ranks of a communicator of mpi4py, at the next
    `breaking_point` of those that it reached. None is one rank.

    What is collective in the block comes before its first breaking point. One rank alone is broken
    off by `answering`.

    Raises
    ------
    BrokenOff
        On every rank, where a signal did so on one; each holds the signal back from then on.
    """
    global _together
    if ranks is None:
        yield
        return
    own, _together = 0, True
    try:
        yield
    except BrokenOff:
        own = _pending[-1]
    finally:
        _together = False
    number: int = max(ranks.allgather(own))
    if number:
        if not own:
            _pending.append(number)
        raise BrokenOff(f"interrupted by {signal.Signals(number).name}")


def breaking_point() -> None:
    """Where a signal that is held back ends a block of `together`.

    Raises
    ------
    BrokenOff
        If there is one.
    """
    if _together and _pending:
        raise BrokenOff(f"interrupted by {signal.Signals(_pending[-1]).name}")


class Stop:
    """Asked after each iterate: the number of a signal that wants the work to end, or 0
    (collective).

    From the first question on, signals wait for the next one; before it they are raised at once, on
    one rank.
    """

    def __init__(self, comm: Comm, held: contextlib.ExitStack) -> None:
        self.number, self._comm, self._held = 0, comm, held
        # one rank alone must not leave the others waiting
        self._waiting = comm.getSize() > 1
        if self._waiting:
            held.enter_context(deferred())

    def _hold(self) -> None:
        if not self._waiting:
            self._waiting = True
            self._held.enter_context(deferred())

    def __call__(self) -> int:
        self._hold()
        later = _pending_anywhere(self._comm)
        self.number = self.number or later
        return self.number

    @property
    def reason(self) -> str:
        """What the monitor of this rank says to end a solve, on which the ranks agree; "" without a
        signal."""
        self._hold()
        number = self.number or (_pending[-1] if _pending else 0)
        return f"interrupted by {signal.Signals(number).name}" if number else ""


@contextlib.contextmanager
def rescuing(rescue: Callable[[], str]) -> Iterator[None]:
    """A block in which `rescue` saves what there is, and says so, where a signal ends a phase that
    does not answer it."""
    global _rescue
    before, _rescue = _rescue, rescue
    try:
        yield
    finally:
        _rescue = before


@contextlib.contextmanager
def stopping(comm: Comm) -> Iterator[Stop]:
    """A `Stop` that holds signals until the block is over."""
    with contextlib.ExitStack() as held:
        yield Stop(comm, held)


def _pending_anywhere(comm: Comm) -> int:
    own = _pending[-1] if _pending else 0
    number: int = own if comm.getSize() == 1 else max(comm.tompi4py().allgather(own))
    if number:
        _pending.clear()
    return number
