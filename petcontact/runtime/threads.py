"""BLAS threads capped to cores / ranks."""

from __future__ import annotations

import contextlib
import functools
import os
import sys
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import threadpoolctl

VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
SOON_ASLEEP = ("OPENBLAS_THREAD_TIMEOUT", "4")
"""OpenBLAS lets threads that have nothing to do spin for 2^26 ticks of the clock after every
product, unless set to 2^4."""
_LOCAL_SIZE = (
    "OMPI_COMM_WORLD_LOCAL_SIZE",
    "MPI_LOCALNRANKS",
    "SLURM_NTASKS_PER_NODE",
    "PMI_LOCAL_SIZE",
)


def available_cores() -> int:
    """Cores this process may run on (its affinity mask under a batch system, not the machine's)."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def local_ranks() -> int:
    """MPI ranks on this node as the launcher announces them; 1 outside mpiexec."""
    for name in (*_LOCAL_SIZE, "PMI_SIZE"):
        if (value := os.environ.get(name, "")).isdigit():
            return max(1, int(value))
    return 1


def threads_per_rank() -> int:
    """Threads that one rank may use without oversubscribing the node."""
    return max(1, available_cores() // local_ranks())


@functools.cache
def _controller() -> threadpoolctl.ThreadpoolController:
    import threadpoolctl

    return threadpoolctl.ThreadpoolController()


def suited_to(size: int) -> AbstractContextManager[object]:
    """Return a block with one BLAS thread where matrices are small, else with all of the rank's.

    Threads gain nothing on matrices of up to 2500 rows.
    """
    many = size > 2500 or threads_per_rank() == 1
    return contextlib.nullcontext() if many else one_blas_thread()


def one_blas_thread() -> AbstractContextManager[object]:
    """Return a block with one BLAS thread."""
    # to look at all loaded libraries takes 8 ms
    alone = os.environ.get(VARIABLES[0]) == "1" or all(
        library.num_threads == 1
        for library in _controller().lib_controllers
        if library.user_api == "blas"
    )
    return contextlib.nullcontext() if alone else _controller().limit(limits=1, user_api="blas")


def cap_blas_threads() -> None:
    """Let BLAS use no more threads than the rank may, unless the user has said how many.

    Libraries that are loaded later read the variables of the environment; those that are there
    already are set by a call.
    """
    os.environ.setdefault(*SOON_ASLEEP)
    given = [name for name in VARIABLES if name in os.environ]
    for name in VARIABLES:
        os.environ.setdefault(name, str(threads_per_rank()))
    if not given and "numpy" in sys.modules:
        import threadpoolctl

        threadpoolctl.threadpool_limits(threads_per_rank(), user_api="blas")
