"""How ranks begin together: rank 0 answers each greeting, and lets all go when all are here.

All messages are between two ranks, with a time limit: a collective operation would wait for ever
for a rank that does not come, and would disturb those of the user.
"""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Callable, Mapping
from typing import Any

from ..errors import InputError, RanksError
from ..untyped import Comm, Keyed
from .petsc import expect_failures, load_mpi

PATIENCE = "PETCONTACT_PATIENCE"
"""Variable of the environment: seconds for which a rank waits until all ranks begin a solve."""
SECONDS = 60.0
"""Default of `PATIENCE` [s]: ranks of one job start within some seconds of each other, and within
half a minute where all read Python from one busy file server."""
TAG = 16_381
"""Tag of the messages before a solve, so that they are not taken for the user's own."""
Call = Callable[[], Callable[[], Mapping[str, object]]]


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
        demand_same_on(comm, table)
    if failed is not None:
        raise failed


def demand_same_on(comm: Comm, table: Mapping[str, object]) -> None:
    """Compare something of the ranks of a communicator of mpi4py.

    Raises
    ------
    InputError
        If it differs.
    """
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
    status, pause, any_rank = load_mpi().Status(), 1e-5, load_mpi().ANY_SOURCE
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
