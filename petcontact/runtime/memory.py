"""How much memory a run took, how much there is, and the return of what nobody uses."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import gc
import math
import mmap
import os
import re
import resource
import sys
from typing import TYPE_CHECKING

from ..errors import SolverError
from ..untyped import Comm

if TYPE_CHECKING:  # the limit of the address space is asked for before NumPy is loaded
    from ..arrays import Array

TO_START = 450_000_000
"""Address space that PETSc, SciPy and one buffer of BLAS take before the first matrix [bytes]."""


def peak_memory(comm: Comm) -> int:
    """Largest resident memory so far, the sum over the ranks of a PETSc communicator [bytes].
    Collective."""
    own = _peak()
    return own if comm.getSize() == 1 else int(sum(comm.tompi4py().allgather(own)))


def resident_memory() -> float:
    """Memory that this process holds now, where /proc tells it, else 0 [bytes]."""
    with contextlib.suppress(OSError), open("/proc/self/statm", "rb") as pages:
        return float(int(pages.read().split()[1]) * mmap.PAGESIZE)
    return 0.0


def physical_memory() -> float:
    """Memory of this machine [bytes], infinite where it is not known."""
    try:
        return float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return math.inf


def check_address_space() -> None:
    """Refuse to start under a limit of the address space (`ulimit -v`) that the libraries alone
    exceed.

    OpenBLAS tries for ever to get a buffer that the system does not give.

    Raises
    ------
    SolverError
        If there is too little.
    """
    limits = [resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA)]
    if all(limit == resource.RLIM_INFINITY for limit in limits):
        return
    try:
        mmap.mmap(-1, TO_START).close()
    except OSError:
        needed = f"it takes {TO_START / 1e6:.0f} MB of address space (ulimit -v)"
        raise SolverError("start", "out of memory", needed) from None


@functools.cache
def _of_c() -> ctypes.CDLL:
    """Return the C library."""
    return ctypes.CDLL(None)


def trim_heap() -> None:
    """Return to the system what is free inside of glibc's heaps: a quarter of all, after many
    blocks came and went."""
    trim = getattr(_of_c(), "malloc_trim", None) if sys.platform == "linux" else None
    if trim is not None:
        trim(0)


def release_memory() -> None:
    """Free what only refers to itself, as operators and the solvers that call them do, and return
    it to the system."""
    gc.collect()
    trim_heap()


def give_back(array: Array) -> None:
    """Return the memory of an array, whose numbers nobody reads again, to the system, whoever still
    refers to it.

    Its whole pages are read as zeros from then on, and take memory again where they are written.
    """
    size, first, last = mmap.PAGESIZE, array.ctypes.data, array.ctypes.data + array.nbytes
    first, last = -(-first // size) * size, last // size * size
    if sys.platform == "linux" and array.flags.c_contiguous and first < last:
        pages = ctypes.c_void_p(first), ctypes.c_size_t(last - first)
        _of_c().madvise(*pages, mmap.MADV_DONTNEED)


def _peak() -> int:
    """Return the peak memory of this process [bytes]. Linux's getrusage also counts what a parent
    held when it started this one; /proc does not."""
    with contextlib.suppress(OSError), open("/proc/self/status", "rb") as status:
        match = re.search(rb"VmHWM:\s*(\d+)", status.read())
        if match:
            return 1024 * int(match[1])
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used if sys.platform == "darwin" else 1024 * used
