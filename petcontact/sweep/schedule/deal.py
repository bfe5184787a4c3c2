"""Who computes what: a team begins the dearest part that nobody has; when none is left it helps
where most is left.

A part is a group of cases that share their preparation, or several groups so cheap that a claim for
each would cost more than they do. All that the ranks share are lengths of files opened to append:
no lock, no server, no one-sided MPI, which some transports lack. (On NFS two clients may be given
one number: then cases are computed twice, to the same bits, and never left out.)
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...arrays import Index
from ...record import record
from .cost import Cost


class Counters:
    """Numbers that all ranks of a run share, by name; the folder is the run's own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def add(self, name: str, number: int = 1) -> int:
        """Add to a number; what it was before."""
        descriptor = os.open(self.folder / name, os.O_CREAT | os.O_WRONLY | os.O_APPEND, 0o666)
        try:
            os.write(descriptor, b"." * number)
            return os.lseek(descriptor, 0, os.SEEK_CUR) - number
        finally:
            os.close(descriptor)  # network file systems show to others what was closed

    def count(self, numbers: Mapping[str, int]) -> None:
        """Add to several counters at once."""
        for name, number in numbers.items():
            if number:
                self.add(name, number)

    def look(self, name: str) -> int:
        """The present value of a counter."""
        try:
            return (self.folder / name).stat().st_size
        except FileNotFoundError:
            return 0


@record
class WorkShare:
    """The cases that one team of ranks takes.

    Attributes
    ----------
    places : (n,) array
        Cases, group after group.
    prepare, case : float
        Estimated seconds of the preparation that a team which helps would repeat, and of each case.
    size : int
        Cases that are claimed at once.
    """

    places: Index
    prepare: float
    case: float
    size: int

    @property
    def batches(self) -> int:
        """Number of batches of the share."""
        return -(-len(self.places) // self.size)


def make_parts(places: Index, of_case: Index, costs: Sequence[Cost], teams: int) -> list[WorkShare]:
    """The parts of some cases, the dearest first; the same on every rank.

    Parameters
    ----------
    places : (n,) array
        Cases to compute.
    of_case : array
        By place, the group of a case.
    costs : sequence of Cost
        By group.
    teams : int
    """
    numbers, counts = np.unique(of_case[places], return_counts=True)
    members = np.split(places[np.argsort(of_case[places], kind="stable")], np.cumsum(counts)[:-1])
    group_costs = [costs[g] for g in numbers]
    worths = [
        cost.prepare + len(some) * cost.case
        for cost, some in zip(group_costs, members, strict=False)
    ]
    parts, cheap, worth = list[tuple[float, WorkShare]](), list[Index](), 0.0
    # one of about 32 claims a team, or a single case
    share = sum(worths) / (32 * teams)
    for k in sorted(range(len(group_costs)), key=lambda k: -worths[k]):
        if worths[k] >= share:
            size = min(len(members[k]), max(1, int(share / group_costs[k].case)))
            parts.append(
                (
                    worths[k],
                    WorkShare(members[k], group_costs[k].prepare, group_costs[k].case, size),
                )
            )
            continue
        cheap.append(members[k])
        worth += worths[k]
        if worth >= share:
            parts, cheap, worth = [*parts, (worth, _bundle(cheap))], [], 0.0
    if cheap:
        parts.append((worth, _bundle(cheap)))
    return [part for _, part in sorted(parts, key=lambda pair: -pair[0])]


def _bundle(groups: list[Index]) -> WorkShare:
    places = np.concatenate(groups)
    return WorkShare(places, 0.0, 0.0, len(places))


def dealt(parts: list[WorkShare], counters: Counters) -> Iterator[Index]:
    """Batches of one team, one after the other, until nothing is left."""

    def batches(number: int) -> Iterator[Index]:
        part = parts[number]
        if part.batches == 1:
            yield part.places
            return
        while (batch := counters.add(f"part-{number}")) < part.batches:
            yield part.places[batch * part.size : (batch + 1) * part.size]

    while (number := counters.add("parts")) < len(parts):
        yield from batches(number)
    shared = {number for number, part in enumerate(parts) if part.batches > 1}
    while shared:
        left = {
            number: (parts[number].batches - counters.look(f"part-{number}"))
            * parts[number].size
            * parts[number].case
            for number in shared
        }
        most = max(shared, key=left.__getitem__)
        shared = {number for number in shared - {most} if left[number] > parts[number].prepare}
        if left[most] > parts[most].prepare:
            yield from batches(most)
