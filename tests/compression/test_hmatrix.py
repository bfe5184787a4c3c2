"""H-matrices of Kelvin's point kernels on clouds in space against dense matrices."""

from __future__ import annotations

import gc
import weakref
from contextlib import nullcontext

import numpy as np
import pytest
from marks import slow

from petcontact.compression.hmatrix import construction
from petcontact.compression.hmatrix.block_tree import block_tree, cluster
from petcontact.compression.hmatrix.entries import block
from petcontact.compression.hmatrix.matrix import HMatrix


class PointKernel:
    """T of point sources with normals, columns of U beside for some; in a plane T is
    antisymmetric."""

    components, compiled = 3, None

    def __init__(self, x, normal, beside):
        self.x, self.normal = x, normal
        self.beside = np.concatenate([[0], np.cumsum(beside)])

    def fill(self, rows, columns, system, beside):
        r = self.x[columns][:, None] - self.x[rows]
        d = np.linalg.norm(r, axis=2)[..., None, None]
        d[d == 0.0] = np.inf
        n = self.normal[columns][:, None]
        w, dyad = np.sum(r * n, axis=2)[..., None, None], r[..., :, None] * r[..., None, :]
        skew = r[..., :, None] * n[..., None, :]
        if system is not None:
            system[:] = (
                w * (0.4 * np.eye(3) / d**3 + 3.0 * dyad / d**5)
                - 0.4 * (skew - skew.swapaxes(2, 3)) / d**3
            ).transpose(0, 3, 1, 2)
        if beside is not None:
            u = (1.8 * np.eye(3) / d + dyad / d**3).transpose(0, 3, 1, 2)
            counts = np.diff(self.beside)[columns]
            beside[:] = np.concatenate(
                [each[:count] for each, count in zip(u, counts, strict=True)]
            )


N = 240


def cloud(shape, n=N, seed=3):
    """Points and normals on a block, on a plate as thin as the points are apart, on one plane, or
    anywhere."""
    rng = np.random.default_rng(seed)
    if shape == "anywhere":
        normal = rng.standard_normal((n, 3))
        return rng.random((n, 3)) * np.array([12.0, 1.0, 1.0]), normal / np.linalg.norm(
            normal, axis=1
        )[:, None]
    x, normal = rng.random((n, 3)), np.zeros((n, 3))
    axis, side = rng.integers(3, size=n), rng.integers(2, size=n)
    if shape != "block":
        axis[:] = 2
    x[np.arange(n), axis] = side if shape != "plane" else 0.0
    normal[np.arange(n), axis] = 2.0 * side - 1.0
    return x * np.array([2.0, 1.0, 0.02 if shape == "plate" else 1.0]), normal


def prepared(shape, n=N):
    x, normal = cloud(shape, n)
    tree = cluster(x, x, np.ones(n, dtype=np.int64), 16)
    return PointKernel(
        x[tree.order], normal[tree.order], np.where(np.arange(n) % 5 == 0, 2, 0)
    ), tree


def all_of(kernel):
    nodes = np.arange(len(kernel.x))
    return block(kernel, nodes, nodes).T


def columns_of(compressed):
    """The matrix itself, every group a column."""
    rows, columns = (np.arange(count) for count in compressed.shape)
    return compressed.coarse(rows, columns, compressed.shape)


@pytest.mark.parametrize(
    ("shape", "tolerance"),
    [slow("block", 1e-3), slow("plate", 1e-7), ("plane", 1e-3), ("anywhere", 1e-7)],
)
def test_each_block_holds_the_tolerance(shape, tolerance):
    kernel, tree = prepared(shape)
    blocks = block_tree(tree)
    compressed = HMatrix(kernel, tree, blocks, tolerance, (0, N))
    exact, found = all_of(kernel), columns_of(compressed)
    d, worst = 3, 0.0
    for row, column in zip(blocks.row, blocks.column, strict=True):
        rows = slice(d * tree.first[row], d * tree.last[row])
        columns = np.concatenate(
            [
                np.arange(d * tree.first[column], d * tree.last[column]),
                d * N + np.arange(*kernel.beside[[tree.first[column], tree.last[column]]]),
            ]
        )
        error = np.linalg.norm((found - exact)[rows, columns])
        worst = max(worst, error / np.linalg.norm(exact[rows, columns]))
    assert blocks.far.any() and worst < 3.0 * tolerance
    x = np.random.default_rng(1).standard_normal(exact.shape[1])
    assert np.linalg.norm(compressed @ x - found @ x) < 1e-12 * np.linalg.norm(found @ x)
    assert compressed.error_estimate(np.random.default_rng(0)) < tolerance
    width = 8 if tolerance < 1e-6 else 2
    assert compressed.nbytes == width * sum(chunk.values.size for chunk in compressed._chunks)


def test_sums_over_groups_are_those_of_the_entries():
    kernel, tree = prepared("block")
    compressed = HMatrix(kernel, tree, block_tree(tree), 1e-7, (100, N))
    rng, exact = np.random.default_rng(1), all_of(kernel)[300:]
    rows, columns = rng.integers(-1, 5, exact.shape[0]), rng.integers(-1, 4, exact.shape[1])
    expected = (np.arange(5)[:, None] == rows) @ exact @ (columns[:, None] == np.arange(4))
    found = compressed.coarse(rows, columns, (5, 4))
    assert np.abs(found - expected).max() < 1e-6 * np.abs(expected).max()


def test_blocks_that_are_not_of_low_rank_are_divided_and_at_last_kept_whole(monkeypatch):
    kernel, tree = prepared("block")
    monkeypatch.setattr(construction, "MOST_CROSSES", 6)
    monkeypatch.setattr(construction, "KNOWN", 3000)
    compressed = HMatrix(kernel, tree, block_tree(tree), 1e-5, (0, N))
    assert compressed.largest_rank <= 6
    exact = all_of(kernel)
    assert np.linalg.norm(columns_of(compressed) - exact) < 1e-5 * np.linalg.norm(exact)


def test_the_probe_sees_a_wrong_block():
    kernel, tree = prepared("block")
    compressed = HMatrix(kernel, tree, block_tree(tree), 1e-4, (0, N))
    for chunk in compressed._chunks:
        chunk.values[chunk.values.size // 2 :] = 0.0
    assert compressed.error_estimate(np.random.default_rng(0), probes=100) > 1e-2


@pytest.mark.parametrize("fails", [False, True])
def test_zeros_are_of_rank_zero_and_errors_of_the_entries_come_through(fails):
    class Zero(PointKernel):
        def fill(self, rows, columns, system, beside):
            if fails:
                raise ZeroDivisionError("entries")
            for part in (system, beside):
                if part is not None:
                    part[:] = 0.0

    kernel, tree = prepared("block")
    zero = Zero(kernel.x, kernel.normal, np.zeros(N, dtype=np.int64))
    with pytest.raises(ZeroDivisionError, match="entries") if fails else nullcontext():
        compressed = HMatrix(zero, tree, block_tree(tree), 1e-4, (0, N))
        assert compressed.largest_rank == 0 and not (compressed @ np.ones(3 * N)).any()


def test_a_build_that_is_broken_off_ends_soon(monkeypatch):
    """Each thread ends the piece of memory that it is at, none begins another."""
    made = []

    class Slow:
        def __init__(self, *arguments):
            pass

        def __call__(self, tiles):
            made.append(1)
            return construction.Chunk(tiles[:1], np.zeros(1, dtype=np.int64), np.zeros(1))

    def broken(share):
        raise KeyboardInterrupt

    kernel, tree = prepared("block")
    monkeypatch.setattr(kernel, "compiled", (0, 0), raising=False)
    monkeypatch.setattr(construction, "_Builder", Slow)
    with pytest.raises(KeyboardInterrupt):
        construction.build_blocks(
            kernel, tree, block_tree(tree), (0, N), 1e-3, construction.Layout(np.float32), 2, broken
        )
    # each of the 16 pieces would make one before it finds out; those that wait make none
    assert len(made) <= 16 < len(block_tree(tree).row)


def test_threads_keep_what_their_addresses_point_to():
    """They may outlive whoever made the entries: a second signal ends the wait for them."""
    kernel, _ = prepared("block")
    kernel.compiled, owner = (0, 0), weakref.ref(kernel)
    work = construction._Builder(kernel, 1e-3, construction.Layout(np.float32))
    del kernel
    gc.collect()
    assert owner() is not None and work.addresses == owner().compiled
