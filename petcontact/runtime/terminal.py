"""Standard streams: what may be printed, the line that shows how far a program is, whether a user
looks at it."""

from __future__ import annotations

import io
import math
import os
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.status import Status

SOON = 5.0
"""Seconds of work that need no announcement."""


def mend_streams() -> None:
    """Make standard streams that can take whatever is said: closed ones lead nowhere, what an
    encoding lacks is escaped.

    A closed standard error would otherwise be the number of the next file that is opened, a result
    for example.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free, this one
        if getattr(sys, name) is None:
            # open as long as the process
            setattr(sys, name, open(number, "w" if number else "r", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def printable(text: str) -> str:
    """A text on one line that moves no cursor: whatever is not printable is escaped."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def say(text: str) -> None:
    """Print what is good to know; nobody being there to read it, or no room, is no failure of the
    program."""
    try:
        print("\n".join(map(printable, text.split("\n"))), flush=True)
    except OSError as error:
        silence_output()
        if not isinstance(error, BrokenPipeError):
            print(
                f"petcontact: standard output: cannot be written ({error.strerror})",
                file=sys.stderr,
            )


def silence_output() -> None:
    """Let standard output lead nowhere from now on: what is left in its buffer must not fail at
    exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def processor_time() -> float:
    """Return the processor time of this process [s], to a hundredth.

    The clock of `time.process_time` costs 40 µs to 1 ms while the timer of `signals.limited`
    runs, and this 1 µs: what is asked at each iteration takes this one.
    """
    used = os.times()
    return used.user + used.system


class StatusLine:
    """One line on standard error that is overwritten, for a terminal. Where that is not enabled a
    line after 3 s of processor time, and then each time ten times as long, if `elsewhere`."""

    def __init__(self, enabled: bool, elsewhere: bool = False) -> None:
        self.enabled, self._began = enabled, processor_time()
        self._next = 3.0 if elsewhere else math.inf
        self._status: Status | None = None

    def show(self, text: str) -> None:
        """Replace the status line by another text."""
        if not self.enabled:
            if (spent := processor_time() - self._began) > self._next:
                self._next *= 10.0
                print(f"petcontact: {text}, {spent:.0f} s", file=sys.stderr, flush=True)
            return
        if self._status is None:
            from rich.console import Console

            self._status = Console(stderr=True, force_terminal=True).status(
                "", refresh_per_second=4
            )
            self._status.start()
        self._status.update(text.replace("[", r"\["))

    def close(self) -> None:
        """Clear the status line."""
        if self._status is not None:
            self._status.stop()
            self._status = None
