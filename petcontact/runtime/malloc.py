"""Memory that nobody uses, and that Python and glibc keep."""

from __future__ import annotations

import ctypes
import gc
import sys


def trim_heap() -> None:
    """Return to the system what is free inside of glibc's heaps: a quarter of all, after many blocks came and went."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None
    if trim is not None:
        trim(0)


def release_memory() -> None:
    """Free what only refers to itself, as operators and the solvers that call them do, and return it to the system."""
    gc.collect()
    trim_heap()
