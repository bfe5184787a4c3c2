"""The ranks that solve a case together: most often one, with `--ranks-per-case K` K of them."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from typing import TypeVar

from ...errors import InputError, PetcontactError
from ...runtime.mpi import all_meet
from ...runtime.petsc import petsc
from ...untyped import Comm

T = TypeVar("T")


class TeamError(PetcontactError):
    """An error on some ranks of a team while the others wait for them: only the end of the job
    helps."""


class Team:
    """Ranks `number * size ... ` of the world, with a communicator of their own.

    Parameters
    ----------
    world : mpi4py communicator
    size : int
        Ranks a team.

    Raises
    ------
    InputError
        If the world cannot be split evenly.
    """

    def __init__(self, world: Comm, size: int) -> None:
        ranks = world.Get_size()
        if ranks % size:
            raise InputError(
                f"--ranks-per-case {size}: {ranks} ranks cannot be split into teams of {size}"
            )
        self.size, self.count, self.number = size, ranks // size, world.Get_rank() // size
        self._mpi = world.Split(self.number) if size > 1 else None
        self.comm = petsc().COMM_SELF if self._mpi is None else petsc().Comm(self._mpi)
        self.leads = self._mpi is None or self._mpi.Get_rank() == 0

    def close(self) -> None:
        """Free the communicator."""
        if self._mpi is not None:
            self._mpi.Free()

    def decide(self, choose: Callable[[], T]) -> T:
        """What the leader chooses, on every rank of the team."""
        if self._mpi is None:
            return choose()
        return self._mpi.bcast(choose() if self.leads else None)  # type: ignore[no-any-return]

    def attempt(self, work: Callable[[], T]) -> tuple[T | None, str]:
        """The result of collective work, or the reason why it failed on all ranks of the team.

        Raises
        ------
        TeamError
            If some ranks failed and others did not, so that they wait for each other.
        """
        result, reason = None, ""
        try:
            result = work()
        except Exception as error:
            reason = describe_error(error)
        if self._mpi is None:
            return result, reason
        # the other ranks may meet the same error within five seconds
        if not all_meet(self._mpi, 5.0 if reason else None):
            raise TeamError(f"one rank of a team failed alone: {reason}")
        reasons = [text for text in self._mpi.allgather(reason) if text]
        if 0 < len(reasons) < self.size:
            raise TeamError(f"one rank of a team failed alone: {reasons[0]}")
        return result, reasons[0] if reasons else ""


def describe_error(error: Exception) -> str:
    """One line; an error that is not one of petcontact's own comes with its traceback on standard
    error."""
    if isinstance(error, PetcontactError):
        return str(error)
    traceback.print_exception(error, file=sys.stderr)
    return f"{type(error).__name__}: {error}".splitlines()[0]
