"""Ranks that solve together: they begin with the same call, and no rank is left alone.

A solve over ranks has a communicator of its own. Before each collective operation the ranks meet:
one reduction says whether one of them has failed, and whether all are about to do the same. A rank
that leaves the solve by an exception tells it at its next meeting. So all ranks end at the same
meeting, with the reason, and no message of this solve reaches the next one.
"""

from __future__ import annotations

import array
import contextlib
import functools
import sys
import zlib
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar, cast

from ..errors import InputError, RanksError
from ..untyped import Comm
from .petsc import given_options, is_launched, load_mpi, petsc
from .rendezvous import Call, begin, demand_same_on
from .world import world

T = TypeVar("T")
_solves: list[SharedSolve] = []


class SharedSolve:
    """One solve over several ranks.

    Attributes
    ----------
    comm : PETSc.Comm
        The communicator of this solve alone.
    over : bool
        Whether the ranks know that it has failed.
    """

    def __init__(self, comm: Comm) -> None:
        self._own, self._meetings, self.over = comm.Dup(), comm.Dup(), False
        self.comm = petsc().Comm(self._own)

    def meet(self, where: str, failure: str = "", reason: str = "") -> str:
        """Return the first reason that a rank has to end the solve, "" if there is none.

        Parameters
        ----------
        where : str
            What the ranks do next.
        failure : str
            Why this rank has left the solve.
        reason : str
            Why this rank wants the solve to end here.

        Raises
        ------
        RanksError
            If a rank has failed, or another rank does something else next.
        """
        place = zlib.crc32(where.encode())
        mine = array.array("q", [bool(failure), bool(reason), place, -place])
        most = array.array("q", mine)
        self._meetings.Allreduce(mine, most, op=load_mpi().MAX)
        if not most[0] and most[2] == -most[3]:
            return "" if not most[1] else next(filter(None, self._meetings.allgather(reason)))
        self.over = True
        told = self._meetings.allgather((failure, where))
        failed = [f"rank {k}: {text}" for k, (text, _) in enumerate(told) if text]
        apart = [f"rank {k} is at {place!r}" for k, (_, place) in enumerate(told)]
        raise RanksError("; ".join(failed) or f"the ranks do not do the same: {', '.join(apart)}")

    def close(self) -> None:
        """Free both communicators."""
        self._meetings.Free()
        self._own.Free()


@contextlib.contextmanager
def shared_solve(comm: Comm, call: Call) -> Iterator[Comm]:
    """A block that all ranks of a communicator do together, and leave together.

    Parameters
    ----------
    comm : PETSc.Comm, mpi4py.MPI.Comm or None
        None is all ranks.
    call : callable
        It is called at once. Where there are several ranks, the function that it returns tells
        what the block depends on, by names: this must be the same on all ranks.

    Yields
    ------
    PETSc.Comm
        For this block alone.

    Raises
    ------
    InputError
        If the ranks differ in what the block depends on, or `comm` is no communicator.
    RanksError
        If not all ranks begin, or another rank fails.
    """
    if _solves and comm is _solves[-1].comm:
        yield comm
        return
    ranks = communicator(comm)
    if ranks is None or ranks.Get_size() == 1:
        call()
        yield petsc().Comm(ranks) if ranks is not None else comm or world()
        return
    begin(ranks, call)
    solve = SharedSolve(ranks)
    _solves.append(solve)
    try:
        demand_same("PETSc option", given_options())
        yield solve.comm
        solve.meet("the end of the solve")
    except BaseException as error:
        if not solve.over:
            with contextlib.suppress(RanksError):
                solve.meet("", f"{type(error).__name__}: {error}")
        raise
    finally:
        _solves.remove(solve)
        solve.close()


def begin_together(comm: Comm, call: Call) -> None:
    """Wait until all ranks of a communicator are here for the same, as `shared_solve` does at its
    begin: for what outlives a block, or has its own way to share ranks."""
    ranks = communicator(comm)
    if ranks is None or ranks.Get_size() == 1 or _solves:
        call()
    else:
        begin(ranks, call)


def communicator(comm: Comm) -> Comm | None:
    """Return the communicator of mpi4py, of PETSc or of all ranks as one of mpi4py; None where no
    launcher has started this process, or PETSc's has one rank, which needs no mpi4py.

    Raises
    ------
    InputError
        If it is none.
    """
    if comm is None:
        loaded = not sys.modules.keys().isdisjoint(("petsc4py.PETSc", "mpi4py.MPI"))
        return load_mpi().COMM_WORLD if loaded or is_launched() else None
    if hasattr(comm, "tompi4py"):
        return comm.tompi4py() if comm.getSize() > 1 else None
    if not isinstance(comm, load_mpi().Intracomm):
        raise InputError(
            f"comm: a communicator of mpi4py or petsc4py, or None; got {type(comm).__name__}"
        )
    return comm


def is_shared() -> bool:
    """Whether several ranks do the solve that is under way."""
    return bool(_solves)


def meet(where: str, comm: Comm) -> None:
    """Meet the other ranks of the solve that is under way, if there is one, before a collective
    operation on a communicator."""
    if _solves and comm.getSize() > 1:
        _solves[-1].meet(where)


def agreed_reason(reason: str | None) -> str | None:
    """Return why the solve is to end here: of the first rank that has a reason."""
    return _solves[-1].meet("the end of an iteration", reason=reason or "") if _solves else reason


def answered(function: Callable[..., T]) -> Callable[..., T]:
    """Return a function whose answer is that of the first rank on all ranks of a solve.

    If it raises on one rank, all ranks end.
    """

    @functools.wraps(function)
    def first(*arguments: object, **keywords: object) -> T:
        answer = function(*arguments, **keywords)
        if not _solves:
            return answer
        return cast(T, mpi(_solves[-1].comm).bcast(answer))

    return first


def alone(function: Callable[..., T] | None) -> Callable[..., T] | None:
    """Return a function that not all ranks call: within it no rank meets the others."""
    if function is None:
        return None

    @functools.wraps(function)
    def by_itself(*arguments: object) -> T:
        others = _solves[:]
        _solves.clear()
        try:
            return function(*arguments)
        finally:
            _solves[:] = others

    return by_itself


def mpi(comm: Comm) -> Any:
    """Return mpi4py's communicator of a PETSc one, whose ranks meet before they exchange anything;
    None for one rank."""
    return _meeting_kind()(comm.tompi4py()) if comm.getSize() > 1 else None


@functools.cache
def _meeting_kind() -> type:
    base = load_mpi().Intracomm

    def meeting(name: str) -> object:
        exchange = getattr(base, name)

        def method(self: object, *arguments: object, **keywords: object) -> object:
            if _solves:
                _solves[-1].meet(name)
            return exchange(self, *arguments, **keywords)

        return method

    names = ("allgather", "Allgatherv", "Allreduce", "Alltoallv", "bcast", "Bcast", "Reduce")
    return type("MeetingComm", (base,), {name: meeting(name) for name in names})


def demand_same(name: str, table: Mapping[str, object]) -> None:
    """Compare something of the ranks of the solve that is under way.

    Raises
    ------
    InputError
        If it differs.
    """
    if _solves:
        demand_same_on(
            mpi(_solves[-1].comm), {f"{name} {key}": value for key, value in table.items()}
        )
