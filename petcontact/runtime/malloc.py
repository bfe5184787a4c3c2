"""Freed memory stays with the process: assembly allocates the same few hundred kilobytes again and again.

glibc gives blocks of more than 128 KiB back to the system at once, and the page faults of the next allocation cost
several times the arithmetic done in it (3.5 ns a number where a product costs 0.25 ns).
"""

from __future__ import annotations

import ctypes
import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # malloc.h


def keep_freed_memory() -> None:
    """Let glibc's malloc keep up to 256 MiB of freed memory, blocks of up to 32 MiB among it; elsewhere do nothing."""
    if sys.platform != "linux":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_MMAP_THRESHOLD, 32 << 20)
        mallopt(_TRIM_THRESHOLD, 256 << 20)


keep_freed_memory()
