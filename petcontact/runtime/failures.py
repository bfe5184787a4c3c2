"""What the command line does with every exception: one line, an exit status, and no rank left
waiting for another."""

from __future__ import annotations

import errno
import os
import re
import sys
import traceback
from collections.abc import Callable
from pathlib import Path

from ..errors import PetcontactError
from .mpi import all_meet
from .petsc import failure_comm, is_petsc_error, solver_error
from .signals import Interrupted, install, watched
from .terminal import mend_streams, printable, silence_output

NO_MORE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF}
"""What a write to a stream fails with; errors of files have a name."""

LONGEST = 400
"""Characters of a word that are shown: more than a folder and the longest name of a file have."""
UNLOADED = re.compile("failed to map segment|cannot allocate memory", re.IGNORECASE)
"""What the loader says of a library for which there is no memory."""


def guarded(program: Callable[[], int]) -> int:
    """Run a program; the exit status.

    An exception is reported in one line (PETCONTACT_TRACEBACK=1 shows where it comes from). Under
    mpiexec a rank that fails alone ends the whole job after a few seconds: the others would wait
    for it for ever.
    """
    mend_streams()
    install()
    try:
        with watched():
            status = program()
            sys.stdout.flush()
        return status
    except BrokenPipeError:
        silence_output()  # whoever read it has gone
        return 1
    except (Exception, KeyboardInterrupt, Interrupted) as error:
        if os.environ.get("PETCONTACT_TRACEBACK"):
            traceback.print_exc()
        message, status = _described(error)
    world = failure_comm()
    if world is None:
        print(f"petcontact: {message}", file=sys.stderr)
        return status
    # the others may fail likewise within three seconds; else the job ends
    if all_meet(world, 3.0):
        # then all saw the same mistake, and each can end by itself
        if world.Get_rank() == 0:
            print(f"petcontact: {message}", file=sys.stderr)
        return status
    print(f"petcontact: rank {world.Get_rank()}: {message}", file=sys.stderr, flush=True)
    world.Abort(status)
    return status


def _brief(word: str) -> str:
    """A word as a line can hold it: the name of a file may have thousands of characters."""
    return word if len(word) <= LONGEST else f"{word[: LONGEST // 2]}...{word[-LONGEST // 4 :]}"


def _described(error: BaseException) -> tuple[str, int]:
    """One line that can be printed, and the exit status."""
    if isinstance(error, MemoryError) or (
        isinstance(error, ImportError) and UNLOADED.search(str(error))
    ):
        return "out of memory: use a coarser mesh or -bem_mat_type hodlr", 1
    if isinstance(error, PetcontactError):
        return printable(" ".join(map(_brief, str(error).split()))), error.exit_status
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return printable(f"{error.filename}: {error.strerror}"), 1
    if isinstance(error, OSError) and error.errno in NO_MORE:
        silence_output()
        return f"standard output: cannot be written ({error.strerror})", 1
    if isinstance(error, Interrupted):
        return f"interrupted by {error}", error.exit_status
    if isinstance(error, KeyboardInterrupt):
        return "interrupted by SIGINT; nothing was written", 130
    if is_petsc_error(error):
        return str(solver_error("PETSc", error)), 1
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    text = " ".join(str(error).split())
    return (
        f"{type(error).__name__}: {text}{place}; an error of petcontact's own, "
        f"PETCONTACT_TRACEBACK=1 shows where",
        1,
    )
