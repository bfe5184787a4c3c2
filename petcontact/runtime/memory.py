"""How much memory a run took, and how much there is."""

from __future__ import annotations

import math
import os
import re
import resource
import sys
from pathlib import Path
from typing import Any


def peak_memory(comm: Any) -> int:
    """Largest resident memory so far, the sum over the ranks of a PETSc communicator [bytes]. Collective."""
    own = _peak()
    return own if comm.getSize() == 1 else int(sum(comm.tompi4py().allgather(own)))


def physical_memory() -> float:
    """Memory of this machine [bytes], infinite where it cannot be told."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return math.inf


def _peak() -> int:
    """Of this process. Linux's getrusage also counts what a parent held when it started this one; /proc does not."""
    status = Path("/proc/self/status")
    found = re.search(r"VmHWM:\s*(\d+)", status.read_text()) if status.exists() else None
    if found:
        return 1024 * int(found[1])
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used if sys.platform == "darwin" else 1024 * used
