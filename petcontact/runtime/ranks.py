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
import hashlib
import os
import sys
import time
import zlib
from collections.abc import Callable, Iterator, Mapping
from types import ModuleType
from typing import Any, TypeVar

from ..errors import InputError, RanksError
from ..untyped import Comm, Keyed
from .petsc import expect_failures, given_options, is_launched, load_mpi, petsc
from .world import world

T = TypeVar("T")
PATIENCE = "PETCONTACT_PATIENCE"
"""Variable of the environment: seconds for which a rank waits until all ranks begin a solve."""
SECONDS = 60.0
"""Default of `PATIENCE` [s]: ranks of one job start within some seconds of each other, and within
half a minute where all read Python from one busy file server."""
TAG = 16_381
"""Tag of the messages before a solve, so that they are not taken for the user's own."""
Call = Callable[[], Callable[[], Mapping[str, object]]]
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
        self._meetings.Allreduce(mine, most, op=_mpi4py().MAX)
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
        result: T = mpi(_solves[-1].comm).bcast(answer)
        return result

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
    base = _mpi4py().Intracomm

    def meeting(name: str) -> object:
        exchange = getattr(base, name)

        def method(self: object, *arguments: object, **keywords: object) -> object:
            if _solves:
                _solves[-1].meet(name)
            return exchange(self, *arguments, **keywords)

        return method

    names = ("allgather", "Allgatherv", "Allreduce", "Alltoallv", "bcast", "Bcast", "Reduce")
    return type("MeetingComm", (base,), {name: meeting(name) for name in names})


def _mpi4py() -> ModuleType:
    from mpi4py import MPI

    return MPI


def begin(comm: Comm, call: Call) -> None:
    """Wait until all ranks of a communicator of mpi4py are here, and compare what they do.

    Rank 0 answers each greeting. When all ranks have thanked for the answer, it lets them go. Each
    greeting has a number of its own: what is left from a beginning that failed is no part of this
    one. All messages are between two ranks, and disturb no collective operation of the user.

    Raises
    ------
    InputError
        If the calls differ.
    RanksError
        If a rank does not come.
    Exception
        That of `call`, if it is the same on all ranks.
    """
    failed, table = None, {"outcome": "none yet"}
    try:
        table |= _flat(call()())
    except Exception as error:
        failed, table = error, {"outcome": f"{type(error).__name__}: {error}"}
    own = hashlib.sha256(repr(table).encode()).digest(), os.urandom(8)
    end, patience = time.monotonic(), _patience()
    same = (_lead if comm.Get_rank() == 0 else _follow)(comm, own, end + patience)
    if same is None:
        raise RanksError(
            f"not all {comm.Get_size()} ranks have begun within {patience:g} s ({PATIENCE}): each "
            f"rank of the communicator has to do so; comm=MPI.COMM_SELF is one rank alone"
        )
    if comm.Get_size() == load_mpi().COMM_WORLD.Get_size():
        expect_failures(comm)
    if not same:
        _demand_same(comm, table)
    if failed is not None:
        raise failed


def demand_same(name: str, table: Mapping[str, object]) -> None:
    """Compare something of the ranks of the solve that is under way.

    Raises
    ------
    InputError
        If it differs.
    """
    if _solves:
        _demand_same(
            mpi(_solves[-1].comm), {f"{name} {key}": value for key, value in table.items()}
        )


def _demand_same(comm: Comm, table: Mapping[str, object]) -> None:
    texts = comm.allgather(_apart(comm.Get_rank(), table, comm.bcast(table)))
    if any(texts):
        raise InputError(next(filter(None, texts)))


def _lead(comm: Comm, own: tuple[bytes, bytes], end: float) -> bool | None:
    """Return on rank 0 whether all ranks do the same; None if not all came in time."""
    size, said, thanked = comm.Get_size(), dict[int, tuple[bytes, bytes]](), set[int]()
    while len(thanked) < size - 1:
        source, word, what = _received(comm, end)
        if word == "":
            return None
        if word == "greeting":
            said[source] = what
            thanked.discard(source)
            comm.send(("answer", what), dest=source, tag=TAG)
        elif said.get(source) == what:
            thanked.add(source)
    same = all(digest == own[0] for digest, _ in said.values())
    for rank, what in said.items():
        comm.send(("go", (what, same)), dest=rank, tag=TAG)
    return same


def _follow(comm: Comm, own: tuple[bytes, bytes], end: float) -> bool | None:
    """Return on the other ranks what `_lead` does on rank 0."""
    comm.send(("greeting", own), dest=0, tag=TAG)
    while True:
        _, word, what = _received(comm, end)
        if word == "":
            return None
        if word == "answer" and what == own:
            comm.send(("thanks", own), dest=0, tag=TAG)
        elif word == "go" and what[0] == own:
            return bool(what[1])


def _received(comm: Comm, end: float) -> tuple[int, str, Any]:
    """Return the rank, the word and the content of the next message; nothing after the end."""
    status, pause, any_rank = _mpi4py().Status(), 1e-5, _mpi4py().ANY_SOURCE
    while not comm.iprobe(source=any_rank, tag=TAG, status=status):
        if time.monotonic() > end:
            return -1, "", None
        time.sleep(pause)
        pause = min(2.0 * pause, 1e-3)
    source = status.Get_source()
    return source, *comm.recv(source=source, tag=TAG)


def _patience() -> float:
    given = os.environ.get(PATIENCE, "")
    try:
        seconds = float(given) if given else SECONDS
    except ValueError:
        seconds = -1.0
    if not 0.0 < seconds < 1e9:
        raise InputError(f"{PATIENCE}={given}: must be a positive number of seconds")
    return seconds


def _apart(rank: int, theirs: Mapping[str, object], ours: Mapping[str, object]) -> str:
    """Return in words what one rank was called with, and rank 0 otherwise; "" if it is the
    same."""
    for key in [*ours, *sorted(theirs.keys() - ours.keys())]:
        one, other = (str(table.get(key, "nothing"))[:80] for table in (theirs, ours))
        if theirs.get(key) != ours.get(key):
            return f"rank {rank} has another {key}: {one}, where rank 0 has {other}"
    return ""


def _flat(value: object, key: str = "") -> Keyed:
    """Return the values of nested tables and lists by dotted keys."""
    if isinstance(value, Mapping):
        pairs = [(f"{key}.{name}" if key else str(name), item) for name, item in value.items()]
    elif isinstance(value, list):
        pairs = [(f"{key}.{place}", item) for place, item in enumerate(value)]
    else:
        return {key: value}
    return {name: leaf for name, item in pairs for name, leaf in _flat(item, name).items()}
