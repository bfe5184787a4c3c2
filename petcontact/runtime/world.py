"""The ranks that share the work: those of PETSc's world."""

from __future__ import annotations

from collections.abc import Sequence

from ..untyped import Comm
from .petsc import initialise, petsc


def world(argv: Sequence[str] = ()) -> Comm:
    """The communicator of all ranks; PETSc starts with its part of a command line.

    Parameters
    ----------
    argv : sequence of str
        As in `petsc.initialise`.

    Raises
    ------
    MissingPetscError, InputError, SolverError
        As `petsc.initialise`.
    """
    initialise(argv)
    return petsc().COMM_WORLD
