"""Standard streams: what may be printed, the line that shows how far a program is, whether a user
looks at it."""

from __future__ import annotations

import io
import math
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.status import Status

LAUNCHERS = {"mpiexec", "mpirun", "orterun", "prterun", "prun", "mpiexec.hydra", "srun"}
LAUNCHERS |= {
    "mpiexec.openmpi",
    "mpirun.openmpi",
    "mpiexec.mpich",
    "mpirun.mpich",
}  # Debian's names
RANK_VARIABLES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK", "SLURM_PROCID")


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


class StatusLine:
    """One line on standard error that is overwritten, for a terminal. Where that is not enabled a
    line after 3 s of processor time, and then each time ten times as long, if `elsewhere`."""

    def __init__(self, enabled: bool, elsewhere: bool = False) -> None:
        self.enabled, self._began = enabled, time.process_time()
        self._next = 3.0 if elsewhere else math.inf
        self._status: Status | None = None

    def show(self, text: str) -> None:
        """Write over what stands there."""
        if not self.enabled:
            if (spent := time.process_time() - self._began) > self._next:
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

    def clear(self) -> None:
        """Clear the status line."""
        if self._status is not None:
            self._status.stop()
            self._status = None


def on_terminal() -> bool:
    """Whether standard error ends on a terminal.

    Launchers of MPI put a pipe or a terminal of their own between a rank and the user; then the
    launcher's standard error counts, if it runs on this machine.
    """
    launcher = (
        _launcher(os.getppid()) if any(name in os.environ for name in RANK_VARIABLES) else None
    )
    if launcher is None:
        return sys.stderr.isatty()
    try:
        return os.readlink(f"/proc/{launcher}/fd/2").startswith(
            ("/dev/pts/", "/dev/tty", "/dev/console")
        )
    except OSError:
        return False


def _launcher(process: int) -> int | None:
    """The nearest launcher among the ancestors of a process."""
    while process > 1:
        try:
            # the name is in parentheses and may contain any character; the parent's id is the
            # second field after it
            name, _, rest = (
                Path(f"/proc/{process}/stat").read_text().partition("(")[2].rpartition(")")
            )
        except OSError:
            return None
        if name in LAUNCHERS:
            return process
        process = int(rest.split()[1])
    return None
