"""A sweep on a simulated clock: the scheduling of a real one, for more ranks and cases than there are to try it on.

Chunks are cut and dealt out by the code that a sweep runs; only time is simulated. A claim travels to the counter, waits for
the claims before it, and travels back; a chunk takes the seconds of its cases, of the preparation of its groups where the
team has them not yet, and of the journal, which is written once a second and at the end.
"""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Index
from ..store.recorder import LONGEST_WAIT
from .chunks import claimed, make_chunks


@dataclass(frozen=True)
class Latency:
    """Seconds that sharing takes.

    Attributes
    ----------
    travel : float
        Of a claim to the counter, and as long back.
    service : float
        That one claim keeps the counter from the next one.
    flush : float
        Of writing a journal to the disk.
    open, row : float
        Of opening a journal, and of reading a row of it, by rank 0 at the end.
    """

    travel: float
    service: float
    flush: float
    open: float
    row: float


@dataclass(frozen=True)
class Simulated:
    """What a simulated sweep took.

    Attributes
    ----------
    makespan : float
        Until the last journal is on the disk [s].
    ideal : float
        max(work / teams, longest case): nothing can end before [s].
    claims, flushes : int
        Operations on the counter and on journals.
    collect : float
        Until rank 0 has read all journals, after that [s].
    """

    makespan: float
    ideal: float
    claims: int
    flushes: int
    collect: float


def simulate(
    seconds: Array, group: Index, case_cost: Array, prepare_cost: Array, teams: int, latency: Latency
) -> Simulated:
    """Run a sweep.

    Parameters
    ----------
    seconds : (n,) array
        What each case takes; the scheduling does not know it.
    group : (n,) array
        The group of each case.
    case_cost, prepare_cost : (G,) arrays
        What the scheduling expects, by group [s]; the preparation takes what is expected.
    teams : int
    latency : Latency
    """
    chunks = make_chunks(np.arange(len(seconds)), group, case_cost, prepare_cost, teams)
    done = np.concatenate([[0.0], np.cumsum(seconds[chunks.order])])
    of_case = group[chunks.order]
    firsts = np.flatnonzero(np.diff(of_case, prepend=-1))
    prepared = np.concatenate([[0.0], np.cumsum(prepare_cost[of_case[firsts]])])
    counter = itertools.count()
    dealt = [claimed(len(chunks), team, teams, counter.__next__) for team in range(teams)]
    holds = np.full(teams, -1)
    free, ends, flushes = 0.0, np.zeros(teams), 0
    queue = [(0.0, team) for team in range(teams)]
    started = np.zeros(teams, bool)
    while queue:
        now, team = heapq.heappop(queue)
        if started[team]:                                   # the first chunk of a team is its own
            free = max(now + latency.travel, free) + latency.service
            now = free + latency.travel
        started[team] = True
        number = next(dealt[team], None)
        if number is None:
            ends[team] = now
            continue
        a, b = chunks.bounds[number], chunks.bounds[number + 1]
        first, last = np.searchsorted(firsts, [a, b - 1], side="right")
        work = done[b] - done[a] + prepared[last] - prepared[first]
        if of_case[a] != holds[team]:
            work += prepare_cost[of_case[a]]
        holds[team] = of_case[b - 1]
        written = math.floor(work / LONGEST_WAIT)
        flushes += written
        heapq.heappush(queue, (now + work + written * latency.flush, team))
    busy = int(min(teams, len(chunks)))
    ideal = max((done[-1] + prepared[-1]) / teams, float(seconds.max(initial=0.0)))
    claims = len(chunks) - busy + teams
    collect = busy * latency.open + len(seconds) * latency.row
    return Simulated(float(ends.max()) + latency.flush, ideal, claims, flushes + busy, collect)
