"""Many small dense blocks of one sparse pattern. They are stored and multiplied in stacks of nearly
equal shape."""

from __future__ import annotations

import functools

import numpy as np

from ... import native
from ...arrays import Array, Index
from ...record import record

_multiply = native.function("petcontact_multiply", "iNDDdD")


@record
class Block:
    """A dense block (p, q), and the places of its p rows and q columns in the vectors that it
    connects."""

    rows: Index
    columns: Index
    values: Array


@record
class _Stack:
    """A stack of c blocks: places of rows (c, p) and of columns (c, q), and values (c, p, q). Equal
    values are stored once, as (1, p, q)."""

    rows: Index
    columns: Index
    values: Array

    @property
    def is_shared(self) -> bool:
        return len(self.values) < len(self.rows)


class Batches:
    """Blocks in stacks. Two blocks of one stack share no row and no column.

    A vector here has one slot more than it has entries. It is zero and takes the padding.

    Parameters
    ----------
    n_rows, n_columns : int
        Lengths of the vectors, without the slot.
    """

    def __init__(self, n_rows: int, n_columns: int) -> None:
        self.shape = (n_rows, n_columns)
        self._taken: list[list[_Stack]] = []
        self._released = False

    def take(self, blocks: list[Block]) -> list[Array]:
        """Store blocks, those of nearly equal shape in one stack, and equal values once. Return
        their values as views of the stacks."""
        views, stacks = [block.values for block in blocks], []
        groups: dict[tuple[int, int], list[int]] = {}
        same: dict[int, list[int]] = {}
        for i, block in enumerate(blocks):
            if block.values.size:
                same.setdefault(id(block.values), []).append(i)
        for first, *others in same.values():
            if others:
                shared = [blocks[i] for i in (first, *others)]
                values = np.ascontiguousarray(views[first])[None]
                stacks.append(
                    _Stack(
                        np.stack([b.rows for b in shared]),
                        np.stack([b.columns for b in shared]),
                        values,
                    )
                )
            else:
                p, q = blocks[first].values.shape
                groups.setdefault((_grade(p), _grade(q)), []).append(first)
        for members in groups.values():
            p, q = (max(blocks[i].values.shape[axis] for i in members) for axis in (0, 1))
            stack = _Stack(
                np.full((len(members), p), self.shape[0], dtype=np.int64),
                np.full((len(members), q), self.shape[1], dtype=np.int64),
                np.zeros((len(members), p, q)),
            )
            for k, i in enumerate(members):
                height, width = views[i].shape
                stack.rows[k, :height], stack.columns[k, :width] = blocks[i].rows, blocks[i].columns
                stack.values[k, :height, :width] = views[i]
                views[i] = stack.values[k, :height, :width]
            stacks.append(stack)
        self._taken.append(stacks)
        return views

    def release(self, group: int) -> None:
        """Free the blocks of one `take`. After that no product is possible."""
        self._taken[group], self._released = [], True
        for cached in ("_entries", "_sorted"):
            self.__dict__.pop(cached, None)

    @property
    def _stacks(self) -> list[_Stack]:
        return [stack for stacks in self._taken for stack in stacks]

    @functools.cached_property
    def _sorted(self) -> tuple[list[_Stack], list[_Stack]]:
        """Stacks of one block that several places share, and all other stacks."""
        return [s for s in self._stacks if s.is_shared], [
            s for s in self._stacks if not s.is_shared
        ]

    @functools.cached_property
    def _entries(self) -> Index:
        """Counts and array addresses of the other stacks, for the compiled products."""
        return np.array(
            [
                [*s.values.shape, *(native.pointer(a) for a in (s.values, s.rows, s.columns))]
                for s in self._sorted[1]
            ],
            dtype=np.int64,
        ).reshape(-1, 6)

    def __getstate__(self) -> dict[str, object]:
        return {
            name: value
            for name, value in self.__dict__.items()
            if name not in ("_entries", "_sorted")
        }

    def add(self, x: Array, y: Array, sign: float = 1.0) -> None:
        """Add sign · blocks @ x to y; x is (n_columns+1, s), y is (n_rows+1, s). Several columns at
        once use BLAS."""
        assert not self._released, "a matrix that its factorisation has used up"
        shared, others = self._sorted
        if x.shape[1] > 1 or not (x.flags.c_contiguous and y.flags.c_contiguous):
            for stack in self._stacks:
                _gather(y, stack.rows, stack.values @ x[stack.columns], sign)
            return
        if others:
            work = np.empty(self._entries[:, 2].max())
            _multiply(len(self._entries), self._entries, x, y, sign, work)
        x_flat, y_flat = x.ravel(), y.ravel()
        for stack in shared:
            # the same block times many vectors is one product
            _gather(y_flat, stack.rows, x_flat[stack.columns] @ stack.values[0].T, sign)


def _gather(y: Array, rows: Index, product: Array, sign: float) -> None:
    if sign < 0.0:
        y[rows] -= product
    else:
        y[rows] += product


def _grade(size: int) -> int:
    # blocks of one stack differ by less than this factor in rows and in columns
    return int(np.log(size) / np.log(1.12)) if size > 1 else 0
