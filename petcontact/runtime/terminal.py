"""The line that shows how far a program is, and whether a user looks at standard error, also through mpiexec."""

from __future__ import annotations

import os
import sys
from pathlib import Path

LAUNCHERS = {"mpiexec", "mpirun", "orterun", "prterun", "prun", "mpiexec.hydra", "srun"}
LAUNCHERS |= {"mpiexec.openmpi", "mpirun.openmpi", "mpiexec.mpich", "mpirun.mpich"}  # Debian's names
RANK_VARIABLES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK", "SLURM_PROCID")


class StatusLine:
    """One line on standard error that is overwritten, for a terminal; nothing where it is not enabled."""

    def __init__(self, enabled: bool) -> None:
        self.enabled = enabled

    def show(self, text: str) -> None:
        """Write over what stands there."""
        if self.enabled:
            print(f"\r{text:<79.79}", end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Wipe the line."""
        if self.enabled:
            print(f"\r{'':<79}\r", end="", file=sys.stderr, flush=True)


def on_terminal() -> bool:
    """Whether standard error ends on a terminal.

    Launchers of MPI put a pipe or a terminal of their own between a rank and the user; then the launcher's standard
    error counts, if it runs on this machine.
    """
    launcher = _launcher(os.getppid()) if any(name in os.environ for name in RANK_VARIABLES) else None
    if launcher is None:
        return sys.stderr.isatty()
    try:
        return os.readlink(f"/proc/{launcher}/fd/2").startswith(("/dev/pts/", "/dev/tty", "/dev/console"))
    except OSError:
        return False


def _launcher(process: int) -> int | None:
    """The nearest launcher among the ancestors of a process."""
    while process > 1:
        try:
            # the name is in parentheses and may contain any character; the parent's id is the second field after it
            name, _, rest = Path(f"/proc/{process}/stat").read_text().partition("(")[2].rpartition(")")
        except OSError:
            return None
        if name in LAUNCHERS:
            return process
        process = int(rest.split()[1])
    return None
