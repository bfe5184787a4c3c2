"""Chunks that shrink (guided self-scheduling): large ones while much is left, single cases at the end.

All chunks are cut before the sweep starts, the same on every rank, and claimed in their order; so one atomic counter is all
that the ranks share. A chunk is worth 1/(2R) of the work that is left for R teams, but never less than the preparation of
its group, and it takes in the rest of a group that is worth less than the preparation which another team would repeat.
Groups whose preparation and single case are longest come first: what cannot be divided is not left for the end.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Index


@dataclass(frozen=True)
class Chunks:
    """Cases in the order in which they are computed, cut into chunks.

    Attributes
    ----------
    order : (n,) array
        Places of the cases; groups one after another, those whose preparation and single case are longest first.
    bounds : (K+1,) array
        Chunk k is `order[bounds[k]:bounds[k+1]]`.
    """

    order: Index
    bounds: Index

    def __len__(self) -> int:
        return len(self.bounds) - 1

    def __getitem__(self, number: int) -> list[int]:
        if not 0 <= number < len(self):
            raise IndexError(number)
        places: list[int] = self.order[self.bounds[number] : self.bounds[number + 1]].tolist()
        return places


def claimed(chunks: int, team: int, teams: int, claim: Callable[[], int]) -> Iterator[int]:
    """Numbers of the chunks that one team computes, one after the other.

    The first chunk of each team is its own, so that nobody queues for the counter at the start.

    Parameters
    ----------
    chunks : int
        How many there are.
    team, teams : int
    claim : callable
        Adds one to the counter that all teams share; what it was before.
    """
    number = team
    while number < chunks:
        yield number
        number = teams + claim()


def make_chunks(places: Index, group: Index, case_cost: Array, prepare_cost: Array, teams: int) -> Chunks:
    """Order cases and cut them.

    Parameters
    ----------
    places : (n,) array
        Cases to compute.
    group : (n,) array
        The group of each of them.
    case_cost, prepare_cost : (G,) arrays
        By group [s].
    teams : int
    """
    if not len(places):
        return Chunks(np.zeros(0, np.int64), np.zeros(1, np.int64))
    here = np.unique(group)
    unit = prepare_cost[here] + case_cost[here]
    by_unit = here[np.argsort(-unit, kind="stable")]
    rank = np.empty(int(here.max()) + 1, np.int64)
    rank[by_unit] = np.arange(len(by_unit))
    order = np.argsort(rank[group], kind="stable")
    places, group = places[order], group[order]
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    ends = np.append(starts[1:], len(places))
    cost = case_cost[group].astype(float)
    cost[starts] += prepare_cost[group[starts]]
    return Chunks(places, _cut(np.concatenate([[0.0], np.cumsum(cost)]), starts, ends, prepare_cost[group[starts]], teams))


def _cut(done: Array, starts: Index, ends: Index, prepare: Array, teams: int) -> Index:
    """Bounds of the chunks; `done` (n+1,) is the work before each case, groups run from `starts` to `ends`."""
    bounds = [0]
    at, last = 0, len(done) - 1
    while at < last:
        left = done[-1] - done[at]
        own = int(np.searchsorted(ends, at, side="right"))
        # what a group costs to prepare is paid again by a team that begins in its middle
        least = done[at] + prepare[own] * (2.0 if at == starts[own] else 1.0)
        wanted = max(done[at] + left / (2 * teams), min(least, done[ends[own]]))
        cut = min(last, max(at + 1, int(np.searchsorted(done, wanted))))
        group = int(np.searchsorted(ends, cut - 1, side="right"))
        rest = done[ends[group]] - done[cut]
        closes = done[ends[group]] - done[at] <= left / teams
        if rest < prepare[group] * (2.0 if closes else 1.0):
            cut = int(ends[group])
        elif starts[group] > at and done[cut] - done[starts[group]] - prepare[group] < prepare[group]:
            cut = int(starts[group])
        bounds.append(cut)
        at = cut
    return np.array(bounds, np.int64)
