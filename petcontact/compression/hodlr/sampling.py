"""Graded samples of an outline. They are the nodes through which a cluster interacts with the nodes
outside of it."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index, Mask, Rows, ranked, scattered
from ...record import record, replace
from .clusters import Boxes, NodeCurves, halved

FEW = 2  # a cell that gives no more nodes than this is not probed for certain


@record
class ProxySample:
    """Increasing nodes outside a cluster, each with the square root of the number of nodes that it
    stands for.

    As one of the sample (`weights`) and as one of the random probes (`probes`); zero where it is
    not. A complete sample has all the nodes there are.
    """

    nodes: Index
    weights: Array
    probes: Array
    complete: bool


@record
class _Cells(Rows):
    """Places first..last of cells outside clusters `owner`, and the number of nodes that each cell
    needs for one digit."""

    owner: Index
    first: Index
    last: Index
    nodes: Array


class Sampler:
    """Samples of the nodes of an outline that carry degrees of freedom.

    Parameters
    ----------
    curves : NodeCurves
    carriers : (m,) increasing array
        The nodes to choose from.
    breaks : (b,) increasing array
        Nodes at which the kernel may jump: a new side, part or kind of unknown.
    """

    def __init__(self, curves: NodeCurves, carriers: Index, breaks: Index) -> None:
        self.carriers = carriers
        self._breaks = np.unique(np.searchsorted(carriers, breaks))
        self._points = curves.points[carriers]
        steps = np.hypot(*np.diff(self._points, axis=0).T)
        self._path = np.concatenate([[0.0], np.cumsum(steps)])
        self._length = np.concatenate([[0.0], np.cumsum(curves.spacing[carriers])])
        self._levels: list[tuple[Index, Array, Array]] = []
        # 8 nodes of the finest cell: next to a cluster all of them are taken
        finest = halved(0, len(carriers), 8)
        stride = len(finest) - 1 if len(carriers) else 0
        while stride:
            bounds = finest[::stride]
            low, high = (
                f.reduceat(self._points, bounds[:-1], axis=0) for f in (np.minimum, np.maximum)
            )
            self._levels.append((bounds, low, high))
            stride //= 2

    def sample(
        self,
        start: Index,
        stop: Index,
        boxes: Boxes,
        density: float,
        probes: int,
        rng: np.random.Generator,
    ) -> list[ProxySample]:
        """Return the samples of several clusters in one pass.

        Parameters
        ----------
        start, stop : (c,) arrays
            Node ranges of the clusters.
        boxes : Boxes
            What NodeCurves.boxes gives for them.
        density : float
            Nodes to take from a cell for every one that a digit needs.
        probes : int
            Remote nodes to draw at random, to judge the result by; besides one in every near cell.
        rng : numpy.random.Generator
        """
        if len(self.carriers) == 0:
            return [
                ProxySample(np.empty(0, np.int64), np.empty(0), np.empty(0), True) for _ in start
            ]
        cells = self._cut(self._cells(start, stop, boxes))
        cells = cells.take(np.argsort(cells.owner, kind="stable"))
        length = cells.last - cells.first
        uneven = 1.0 + 2.0 * np.max(
            [np.abs(self._uneven(cells.first, cells.last, k)) for k in (1, 2, 3)], axis=0
        )
        wanted = np.maximum(
            1, np.rint(density * cells.nodes * np.minimum(uneven, 2.0)).astype(np.int64)
        )
        # a cell of not many more nodes than are wanted from it is taken whole
        whole = length < 1.5 * wanted
        position, weight, source = self._spread(cells, np.where(whole, length, wanted), whole)
        probe, untouched = _between(cells, position, np.where(whole, length, wanted), rng)
        cells_of = np.searchsorted(cells.owner, np.arange(len(start) + 1))
        samples_of = np.searchsorted(source, cells_of)
        result = []
        for i in range(len(start)):
            s, c = slice(*samples_of[i : i + 2]), np.arange(*cells_of[i : i + 2])
            some = c[untouched[c]]
            some, stands_for = _choose(some, wanted[some] > FEW, probes, rng)
            result.append(
                self._merged(
                    position[s],
                    weight[s],
                    probe[some],
                    np.sqrt(stands_for * length[some]),
                    bool(whole[c].all()),
                )
            )
        return result

    def _merged(
        self, position: Index, weight: Array, probe: Index, drawn: Array, whole: bool
    ) -> ProxySample:
        """Return a sample of nodes at positions and of probes, with the weights of both."""
        positions = np.unique(np.concatenate([position, probe]))
        weights, at_random = (
            scattered(values, np.searchsorted(positions, some), len(positions))
            for values, some in ((weight, position), (drawn, probe))
        )
        return ProxySample(self.carriers[positions], weights, at_random, whole)

    def _cells(self, start: Index, stop: Index, boxes: Boxes) -> _Cells:
        """Return the cells outside each cluster. They are small near the cluster and large far
        away."""
        parts: list[_Cells] = []
        own = np.searchsorted(self.carriers, [start, stop])
        owner = np.arange(len(start))
        cell = np.zeros(len(start), dtype=np.int64)
        for depth, (bounds, *box) in enumerate(self._levels):
            first, last = bounds[cell], bounds[cell + 1]
            outside = (first >= own[1, owner]) | (last <= own[0, owner])
            inside = (first >= own[0, owner]) & (last <= own[1, owner])
            straight, focal = self._seen(first, last, owner, boxes)
            # sampled, not split, where the kernel is analytic on the cell inside this Bernstein
            # ellipse
            done = outside & straight & (_ellipse(focal) >= 3.0)
            if depth == len(self._levels) - 1:
                done = ~inside
            chosen = owner[done]
            away = boxes.least(chosen, (box[0][cell[done]], box[1][cell[done]]))
            nodes = _enough(focal[done], 2.0 * away / boxes.diameter[chosen])
            parts += _outside(_Cells(chosen, first[done], last[done], nodes), own[:, chosen])
            deeper = ~(done | inside)
            owner = np.repeat(owner[deeper], 2)
            cell = np.repeat(2 * cell[deeper], 2)
            cell[1::2] += 1
        cells = _Cells.joined(parts)
        return cells.take(cells.last > cells.first)

    def _seen(self, first: Index, last: Index, owner: Index, boxes: Boxes) -> tuple[Mask, Array]:
        """Return whether cells are straight, and half the sum of the distances from their ends to
        the cluster, over half their length."""
        ends = self._points[first], self._points[last - 1]
        chord, path = np.hypot(*(ends[1] - ends[0]).T), self._path[last - 1] - self._path[first]
        focal = boxes.least(owner, *((end, end) for end in ends)) / np.maximum(path, _TINY)
        # straight: at most so much longer than the chord, or as far away as four lengths
        return (path <= 1.15 * chord) | (focal >= 4.0), focal

    def _cut(self, cells: _Cells) -> _Cells:
        """Return the cells, cut at the breaks inside them, so that each piece between two breaks
        gets samples."""
        begin = np.searchsorted(self._breaks, cells.first, "right")
        pieces = np.searchsorted(self._breaks, cells.last) - begin + 1
        # a cell that breaks cut into more pieces is sampled without regard to them
        pieces[pieces > 8] = 1
        source, rank = ranked(pieces)
        padded = np.concatenate([[0], self._breaks, [0]])
        index = begin[source] + rank
        first = np.where(rank == 0, cells.first[source], padded[index])
        last = np.where(
            rank == pieces[source] - 1,
            cells.last[source],
            padded[np.minimum(index + 1, len(padded) - 1)],
        )
        return _Cells(cells.owner[source], first, last, cells.nodes[source])

    def _spread(self, cells: _Cells, count: Index, whole: Mask) -> tuple[Index, Array, Index]:
        """Return places that are spread over cells, the square root of the number of nodes that
        each stands for, and its cell.

        They are Chebyshev's in a coordinate that grows with the number of nodes and with the
        length, half and half: numbers alone pass over long elements between short ones, and length
        over the many short ones.
        """
        source, rank = ranked(count)
        first, last = cells.first[source], cells.last[source]
        wanted = 0.5 - 0.5 * np.cos(np.pi * (rank + 0.5) / count[source])
        position, above = first.copy(), last.copy()
        while np.any(above - position > 1):
            middle = (position + above) // 2
            beyond = self._coordinate(first, last, middle) > wanted
            position, above = np.where(beyond, position, middle), np.where(beyond, middle, above)
        position = np.where(whole[source], first + rank, position)
        ends = (np.arccos(1.0 - 2.0 * self._coordinate(first, last, position + k)) for k in (0, 1))
        share = -np.subtract(*ends) / np.pi * count[source]
        return (
            position,
            1.0 / np.sqrt(np.where(whole[source], 1.0, np.clip(share, _TINY, 1.0))),
            source,
        )

    def _uneven(self, first: Index, last: Index, quarters: int) -> Array:
        """Return the share of length minus the share of nodes, at some quarter of the nodes of
        cells [-]."""
        middle = first + (last - first) * quarters // 4
        along = (self._length[middle] - self._length[first]) / (
            self._length[last] - self._length[first]
        )
        return np.asarray(along - (middle - first) / (last - first))

    def _coordinate(self, first: Index, last: Index, position: Index) -> Array:
        along = (self._length[position] - self._length[first]) / (
            self._length[last] - self._length[first]
        )
        return np.asarray(
            np.clip(0.5 * along + 0.5 * (position - first) / (last - first), 0.0, 1.0)
        )


_TINY = np.finfo(np.float64).tiny


def _ellipse(focal: Array) -> Array:
    """Return the sum of the half axes of an ellipse with foci ±1. The distances of its points from
    the foci add up to 2·focal."""
    bounded = np.clip(focal, 1.0, 1e8)
    return np.asarray(bounded + np.sqrt(bounded * bounded - 1.0))


def _nodes(ellipse: Array) -> Array:
    """Return how many Chebyshev nodes one digit needs for a function that is analytic inside a
    Bernstein ellipse."""
    return np.asarray(1.0 / np.log10(np.maximum(ellipse, 1.1)))


def _outside(cells: _Cells, own: Index) -> list[_Cells]:
    """Return what of each cell lies before and after the nodes `own` (2, k) of its cluster."""
    return [
        replace(cells, last=np.minimum(cells.last, own[0])),
        replace(cells, first=np.maximum(cells.first, own[1])),
    ]


def _enough(focal: Array, aside: Array) -> Array:
    """Return how many Chebyshev nodes one digit needs on cells: from their own ellipses, and from
    distances over half the diameter of the cluster that sees them.

    0.7 is the part that one distant cell gives of the nodes by which a cluster sees what is far.
    """
    seen = _nodes(aside + np.sqrt(1.0 + aside * aside))
    return np.asarray(np.minimum(_nodes(_ellipse(focal)), 0.7 * seen))


def _between(
    cells: _Cells, position: Index, count: Index, rng: np.random.Generator
) -> tuple[Index, Mask]:
    """Return a place of each cell half-way between two neighbouring samples, and whether that place
    is free."""
    end = np.cumsum(count)
    gap = rng.integers(0, count + 1)
    padded = np.append(position, 0)
    below = np.where(gap == 0, cells.first - 1, padded[end - count + gap - 1])
    above = np.where(gap == count, cells.last, padded[end - count + np.minimum(gap, count - 1)])
    middle = (below + above) // 2
    return middle, (middle > below) & (middle < above)


def _choose(cells: Index, near: Mask, count: int, rng: np.random.Generator) -> tuple[Index, Array]:
    """Return the near cells and a few of the others, and how many cells each stands for."""
    chosen_near, others = cells[near], cells[~near]
    few = rng.permutation(others)[:count]
    chosen = np.concatenate([chosen_near, few])
    share = np.concatenate(
        [np.ones(len(chosen_near)), np.full(len(few), len(others) / max(1, len(few)))]
    )
    return chosen, share
