"""The ranks that share the work: those of PETSc's world, or this process alone as long as nothing
asks for PETSc."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .memory import check_address_space
from .petsc import initialise, is_asked_for, petsc


class OneRank:
    """What is asked of a PETSc communicator, of a process that is alone and has not started PETSc.

    Examples
    --------
    >>> OneRank().getRank(), OneRank().getSize()
    (0, 1)
    """

    def getRank(self) -> int:
        """Number of this rank."""
        return 0

    def getSize(self) -> int:
        """Number of ranks."""
        return 1

    def tompi4py(self) -> Any:
        """The communicator of mpi4py; it starts MPI."""
        return petsc().COMM_SELF.tompi4py()


def world(argv: Sequence[str] = ()) -> Any:
    """The communicator of all ranks; PETSc starts only where its options, files of options, or a
    launcher ask for it.

    Parameters
    ----------
    argv : sequence of str
        As in `petsc.initialise`.

    Raises
    ------
    MissingPetscError, InputError, SolverError
        As `petsc.initialise`.
    """
    if argv or is_asked_for():
        initialise(argv)
        return petsc().COMM_WORLD
    check_address_space()
    return OneRank()


def of_petsc(comm: Any) -> Any:
    """A communicator that PETSc's objects can be created on."""
    return petsc().COMM_SELF if isinstance(comm, OneRank) else comm
