"""Clusters of an operator and their skeletons: the few rows and columns through which they interact
with the rest."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import numpy as np

from ...arrays import Array, Index
from ...record import record
from .block_batches import Block
from .clusters import NodeCurves
from .interpolative import PivotedQR, pivoted_qr
from .sampling import ProxySample, Sampler
from .translations import Basis, Cluster, Translations, adjacent, follow, noted

Entries = Callable[[Index, Index], Array]
ManyEntries = Callable[[Index, Index], list[Array]]

# share of Chebyshev's number that a sample has of rows or columns: neighbouring cells help one
# another
DENSITY = 0.7
AMPLE = (2, 16)  # least number of rows or columns in a sample: first times the rank, plus second
ATTEMPTS = 6


class Freedoms:
    """The rows or the columns of an operator: the degrees of freedom of each node, and the samples
    of the nodes.

    Parameters
    ----------
    offsets : (n+1,) int array
        Node i has degrees of freedom offsets[i]..offsets[i+1].
    curves : NodeCurves
    breaks : int array
    """

    def __init__(self, offsets: Index, curves: NodeCurves, breaks: Index) -> None:
        self.offsets = np.asarray(offsets, dtype=np.int64)
        counts = np.diff(self.offsets)
        self.node = np.repeat(np.arange(len(counts)), counts)
        carriers = np.flatnonzero(counts)
        self.per_node = max(len(self.node), 1) / max(len(carriers), 1)
        changes = np.flatnonzero(np.diff(carriers) > 1)
        self.sampler = Sampler(curves, carriers, np.union1d(breaks, carriers[changes + 1]))

    def span(self, start: int, stop: int) -> Index:
        """Return the degrees of freedom of nodes start..stop."""
        return np.arange(int(self.offsets[start]), int(self.offsets[stop]))

    def freedoms(self, nodes: Index) -> Index:
        """Return the degrees of freedom of some nodes."""
        spans = [self.span(int(node), int(node) + 1) for node in nodes]
        return np.concatenate([np.empty(0, dtype=np.int64), *spans])

    def nodes_of(self, dofs: Index) -> Index:
        """Return the nodes of some increasing degrees of freedom, each once."""
        nodes = self.node[dofs]
        first = np.ones(len(nodes), dtype=bool)
        np.not_equal(nodes[1:], nodes[:-1], out=first[1:])
        return np.asarray(nodes[first])

    def count(self, nodes: Index) -> int:
        """Return the number of degrees of freedom of some nodes."""
        return int((self.offsets[nodes + 1] - self.offsets[nodes]).sum())

    def places(self, nodes: Index, dofs: Index) -> Index:
        """Return the places of degrees of freedom among all those of some increasing nodes."""
        counts = self.offsets[nodes + 1] - self.offsets[nodes]
        first = np.cumsum(counts) - counts
        node = self.node[dofs]
        return np.asarray(first[np.searchsorted(nodes, node)] + dofs - self.offsets[node])

    def spread(self, nodes: Index, values: Array) -> Array:
        """Return values of nodes, repeated for each of their degrees of freedom."""
        return np.repeat(values, self.offsets[nodes + 1] - self.offsets[nodes])


class Operator:
    """Exact entries by degrees of freedom, and the compression of clusters from samples of these
    entries.

    Parameters
    ----------
    entries : callable
        entries(row_nodes, column_nodes) for increasing node arrays: all their rows and columns as a
        dense array.
    points : (n, 2) array
    row_offsets, column_offsets : (n+1,) int arrays
    breaks : int array
        Nodes at which the kernel may jump.
    tolerance : float
    served : entries and (n+1,) int arrays, or None
        Columns that the bases of rows are to serve: entries gives a list of arrays, one for each of
        the offsets.
    """

    def __init__(
        self,
        entries: Entries,
        points: Array,
        row_offsets: Index,
        column_offsets: Index,
        breaks: Index,
        tolerance: float,
        translations: Translations,
        served: tuple[ManyEntries, list[Index]] | None = None,
    ) -> None:
        self.entries = entries
        self.tolerance = tolerance
        self.breaks = breaks
        self.translations = translations
        self.curves = NodeCurves(points)
        self.square = bool(np.array_equal(row_offsets, column_offsets))
        self.row_axis = Freedoms(row_offsets, self.curves, breaks)
        self.column_axis = (
            self.row_axis if self.square else Freedoms(column_offsets, self.curves, breaks)
        )
        self._served_entries: ManyEntries = lambda rows, columns: [
            self.exact_entries(rows, columns)
        ]
        self._served = [self.column_axis]
        if served is not None:
            self._served_entries = served[0]
            self._served = [Freedoms(offsets, self.curves, breaks) for offsets in served[1]]

    def with_columns(self, entries: Entries, column_offsets: Index) -> Operator:
        """Return another operator with the same rows."""
        return Operator(
            entries,
            self.curves.points,
            self.row_axis.offsets,
            column_offsets,
            self.breaks,
            self.tolerance,
            self.translations.shared(),
        )

    def block(self, rows: Index, columns: Index) -> Array:
        """Return the entries of some rows and columns."""
        row_nodes, column_nodes = self.row_axis.nodes_of(rows), self.column_axis.nodes_of(columns)
        values = self.exact_entries(row_nodes, column_nodes)
        # columns first: entries lie column by column
        picked = values[:, self.column_axis.places(column_nodes, columns)]
        return np.asarray(picked[self.row_axis.places(row_nodes, rows)])

    def leaf(self, start: int, stop: int, by_key: dict[Hashable, Cluster]) -> Cluster:
        """Return a cluster with all rows and columns active and with its dense diagonal block. The
        block is that of a known translate, if there is one."""
        rows, columns = self.row_axis.span(start, stop), self.column_axis.span(start, stop)
        key = self.translations.key(start, stop)
        if key in by_key:
            return Cluster(start, stop, rows, columns, by_key[key].near, key=key)
        values = self.exact_entries(
            self.row_axis.nodes_of(rows), self.column_axis.nodes_of(columns)
        )
        near = Block(np.arange(len(rows)), np.arange(len(columns)), values)
        return noted(Cluster(start, stop, rows, columns, [near], key=key), by_key)

    def merge(self, children: list[Cluster], by_key: dict[Hashable, Cluster]) -> Cluster:
        """Return the union of one or two compressed neighbours: the rows and columns that they
        kept, and the blocks between them."""
        key = (
            tuple(id(c.leader) for c in children)
            if all(c.leader is not None for c in children)
            else None
        )
        rows = [c.rows[c.row_basis.kept] for c in children if c.row_basis]
        columns = [c.columns[c.column_basis.kept] for c in children if c.column_basis]
        i = np.split(np.arange(sum(map(len, rows))), [len(rows[0])])
        j = np.split(np.arange(sum(map(len, columns))), [len(columns[0])])
        pairs = [(0, 1), (1, 0)] if len(children) == 2 else []
        near = (
            by_key[key].near
            if key in by_key
            else [Block(i[a], j[b], self.block(rows[a], columns[b])) for a, b in pairs]
        )
        merged = Cluster(
            children[0].start,
            children[-1].stop,
            np.concatenate(rows),
            np.concatenate(columns),
            near,
            key=key,
        )
        return noted(merged, by_key)

    def compress(self, clusters: list[Cluster], usual: int = 0) -> int:
        """Find the bases of adjacent clusters of one level.

        Of a square operator both bases of a cluster get one rank, so that its factorisation can
        eliminate as many rows as columns.

        Returns
        -------
        int
            How often samples had to be enlarged, usually: where the next level begins.
        """
        for cluster, leader in zip(clusters, self.translations.leaders(clusters), strict=True):
            cluster.leader = None if leader is None else clusters[leader]
        guess = 32, 32
        for group in adjacent([cluster for cluster in clusters if not cluster.follows]):
            needed = []
            for cluster, outer in zip(group, self._samples(group, usual), strict=True):
                attempt, fits = usual, self._fits(cluster, outer, guess)
                while attempt < ATTEMPTS and not (fits[0].holds and fits[1].holds):
                    attempt += 1
                    outer = self._samples([cluster], attempt)[0]
                    fits = self._fits(cluster, outer, guess)
                needed.append(attempt)
                guess = len(fits[0].kept), len(fits[1].kept)
                cluster.row_basis = Basis(
                    fits[0].kept, fits[0].rest, np.ascontiguousarray(fits[0].z.T)
                )
                cluster.column_basis = Basis(fits[1].kept, fits[1].rest, fits[1].z)
                cluster.felt_by = outer[0]
            # neighbours are alike: what most of a group needed is where the next one begins
            usual = sorted(needed)[len(needed) // 2]
        follow(clusters)
        return usual

    def compress_columns(self, clusters: list[Cluster], alike: list[Cluster]) -> None:
        """Find the bases of the columns of a level's clusters. The bases of their rows are those of
        another operator."""
        of = {id(like): cluster for cluster, like in zip(clusters, alike, strict=True)}
        for cluster, like in zip(clusters, alike, strict=True):
            cluster.leader = (
                of[id(like.leader)] if like.leader is not None and cluster.key is not None else None
            )
            if not cluster.follows:
                self._compress_columns(cluster, like)
        follow(clusters)

    def _compress_columns(self, cluster: Cluster, like: Cluster) -> None:
        """Find the basis of one cluster's columns. It is judged by the probes of the other
        operator, whose columns are no easier to fit."""
        assert like.row_basis is not None
        # of a follower none was drawn
        sample, guess = like.felt_by or self._samples([cluster], 0)[0][0], len(like.row_basis.kept)
        attempt, fit = 0, self._fit_columns(cluster, sample, guess)
        while attempt < ATTEMPTS and not fit.holds:
            attempt += 1
            fit = self._fit_columns(cluster, self._samples([cluster], attempt)[0][0], guess)
        cluster.row_basis, cluster.column_basis = like.row_basis, Basis(fit.kept, fit.rest, fit.z)

    def _fit_columns(self, cluster: Cluster, sample: ProxySample, guess: int) -> _Fit:
        values, axes = self._felt(cluster, sample), [self.row_axis]
        qr = self._factored(values, axes, sample, guess)
        return self._judged(qr, qr.rank, values, axes, sample)

    def _felt(self, cluster: Cluster, sample: ProxySample) -> Array:
        """Return a cluster's active columns at the rows of a sample."""
        nodes = self.column_axis.nodes_of(cluster.columns)
        return np.asarray(
            self.exact_entries(sample.nodes, nodes)[
                :, self.column_axis.places(nodes, cluster.columns)
            ]
        )

    def _seen(self, cluster: Cluster, sample: ProxySample) -> Array:
        """Return the columns of a sample at a cluster's active rows, transposed."""
        nodes = self.row_axis.nodes_of(cluster.rows)
        if not len(nodes) or not len(sample.nodes):
            return np.zeros(
                (sum(axis.count(sample.nodes) for axis in self._served), len(cluster.rows))
            )
        rows = self.row_axis.places(nodes, cluster.rows)
        return np.concatenate(
            [block[rows].T for block in self._served_entries(nodes, sample.nodes)]
        )

    def _factored(
        self, values: Array, axes: list[Freedoms], sample: ProxySample, guess: int
    ) -> PivotedQR:
        """Return the pivoted QR of values (k, n) at the degrees of freedom of a sample, one axis
        after another."""
        weights = np.concatenate([axis.spread(sample.nodes, sample.weights) for axis in axes])
        # pivots are cut at a tenth of the tolerance: errors of many levels and clusters add up
        return pivoted_qr(values, weights, 0.1 * self.tolerance, guess)

    def _judged(
        self, qr: PivotedQR, rank: int, values: Array, axes: list[Freedoms], sample: ProxySample
    ) -> _Fit:
        """Return a factorisation that is cut to a rank, with the probes that it has to fit."""
        probes = np.concatenate([axis.spread(sample.nodes, sample.probes) for axis in axes])
        probed = np.flatnonzero(probes)
        weighted = np.count_nonzero(sample.weights) * len(values) / max(1, len(sample.nodes))
        ample = sample.complete or AMPLE[0] * qr.rank + AMPLE[1] <= weighted
        probe = values[probed] * probes[probed, None]
        # a probe may miss the tolerance by a factor 2 before the sample is enlarged
        return _Fit(*qr.interpolation(rank), 2.0 * self.tolerance * qr.scale, probe, ample)

    def _samples(
        self, clusters: list[Cluster], attempt: int
    ) -> list[tuple[ProxySample, ProxySample]]:
        """Return the outer nodes with rows and the outer nodes with columns, for each of some
        adjacent clusters."""
        start, stop = (np.array([getattr(c, name) for c in clusters]) for name in ("start", "stop"))
        density = DENSITY * (1.0 - np.log10(self.tolerance)) * 1.5**attempt
        rng = np.random.default_rng([start[0], stop[-1], len(start), attempt])
        boxes = self.curves.boxes(start, stop)

        def sample(axis: Freedoms) -> list[ProxySample]:
            return axis.sampler.sample(start, stop, boxes, density / axis.per_node, 4, rng)

        with_columns = sample(self.column_axis)
        with_rows = with_columns if self.square else sample(self.row_axis)
        return list(zip(with_rows, with_columns, strict=True))

    def _fits(
        self, cluster: Cluster, outer: tuple[ProxySample, ProxySample], guess: tuple[int, int]
    ) -> tuple[_Fit, _Fit]:
        """Return the fit of the cluster's rows on outer columns, and the fit of its columns on
        outer rows."""
        rows, columns = outer
        looks = (
            (self._seen(cluster, columns), self._served, columns, guess[0]),
            (self._felt(cluster, rows), [self.row_axis], rows, guess[1]),
        )
        qrs = [self._factored(*look) for look in looks]
        ranks = [qr.rank for qr in qrs]
        if self.square:
            ranks = [max(ranks)] * 2
        fits = [
            self._judged(qr, rank, values, axes, sample)
            for (values, axes, sample, _), qr, rank in zip(looks, qrs, ranks, strict=True)
        ]
        return fits[0], fits[1]

    def exact_entries(self, row_nodes: Index, column_nodes: Index) -> Array:
        """Return the entries of all rows of some nodes and all columns of others."""
        if len(row_nodes) and len(column_nodes):
            return self.entries(row_nodes, column_nodes)
        return np.zeros((self.row_axis.count(row_nodes), self.column_axis.count(column_nodes)))


@record
class _Fit:
    kept: Index
    rest: Index
    z: Array
    allowed: float
    probes: Array
    ample: bool

    @property
    def holds(self) -> bool:
        """Whether the probes are fitted as well as the sample."""
        error = self.probes[:, self.rest] - self.probes[:, self.kept] @ self.z
        return self.ample and bool((error * error).sum(axis=0).max(initial=0.0) <= self.allowed**2)
