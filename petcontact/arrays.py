"""Types of numpy arrays by what they hold, the range of coordinates, and how things are shared out
evenly."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, Self, TypeVar

import numpy as np

# numpy.typing's NDArray, whose import takes as long as that of a tenth of numpy
Array = np.ndarray[Any, np.dtype[np.float64]]
Complex = np.ndarray[Any, np.dtype[np.complex128]]
Index = np.ndarray[Any, np.dtype[np.int64]]
Mask = np.ndarray[Any, np.dtype[np.bool_]]
AnyArray = np.ndarray[Any, np.dtype[Any]]
States = np.ndarray[Any, np.dtype[np.int8]]
"""Numbers for the states of contact nodes, stick, slip and open, or for the way of their slip."""
Names = np.ndarray[Any, np.dtype[np.str_]]

LONGEST_NAME = 255
"""Characters of a name of a part or an array, and bytes of that of a file."""
LARGEST_COORDINATE = 1e60
"""Squares and products of coordinates must not overflow."""
LARGEST_NUMBER = 1e150
"""Bound of loads, moduli and gaps, so that their squares do not overflow."""


class Rows:
    """Base of frozen dataclasses of arrays with a row for each thing, chosen and joined together.

    What is no array is the same for all rows.
    """

    def take(self, chosen: Any) -> Self:
        """The record of some rows: numbers, a mask or a slice."""
        record: Any = self
        given = {key.name: getattr(record, key.name) for key in fields(record)}
        arrays = {name: v[chosen] for name, v in given.items() if isinstance(v, np.ndarray)}
        return replace(record, **arrays)  # type: ignore[no-any-return]

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """The record of the rows of several, all of arrays, one after another."""
        record: Any = cls
        names = [key.name for key in fields(record)]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


Key = TypeVar("Key", bound=Hashable)
Numbers = TypeVar("Numbers", Array, Index, States)


def scattered(values: Numbers, rows: Index | Mask, count: int, otherwise: float = 0) -> Numbers:
    """Return an array (count, ...) that has values (k, ...) in some rows, and a number elsewhere.

    >>> scattered(np.array([2.0, 3.0]), np.array([3, 1]), 4)
    array([0., 3., 0., 2.])
    """
    result = np.full((count, *values.shape[1:]), otherwise, dtype=values.dtype)
    result[rows] = values
    return result


def marked(rows: Index, count: int) -> Mask:
    """Return which of (count,) rows are among the given ones."""
    result = np.zeros(count, dtype=bool)
    result[rows] = True
    return result


def largest_by(row: Index, values: Numbers, count: int, least: float = 0.0) -> Numbers:
    """Return the largest of values (n, ...) in each of (count, ...) rows, and at least `least`.

    >>> largest_by(np.array([0, 2, 0]), np.array([1.0, 5.0, 3.0]), 3)
    array([3., 0., 5.])
    """
    result = np.full((count, *values.shape[1:]), least, dtype=values.dtype)
    np.maximum.at(result, row, values)
    return result


def smallest_by(row: Index, values: Array, count: int) -> Array:
    """Return the smallest of values (n, ...) in each of (count, ...) rows, infinite without any."""
    return -largest_by(row, -values, count, -np.inf)


def linked(pairs: Index, count: int) -> Index:
    """Return the group (count,) of each of some things; things of a pair (2, n) are in one group.

    >>> linked(np.array([[0, 3], [2, 1]]), 5)
    array([0, 1, 0, 1, 2], dtype=int32)
    """
    import scipy.sparse.csgraph

    graph = scipy.sparse.coo_array((np.ones(pairs.shape[1]), tuple(pairs)), shape=(count, count))
    return np.asarray(scipy.sparse.csgraph.connected_components(graph, directed=False)[1])


def connected(nodes: Mapping[Key, Collection[Hashable]]) -> list[list[Key]]:
    """Return the keys that hang together by what they have in common, in their order.

    >>> connected({"a": "xy", "b": "z", "c": "wx"})
    [['a', 'c'], ['b']]
    """
    place = {
        node: k for k, node in enumerate(dict.fromkeys(n for own in nodes.values() for n in own))
    }
    pairs = [(k, len(nodes) + place[n]) for k, own in enumerate(nodes.values()) for n in own]
    label = linked(np.array(pairs, dtype=np.int64).reshape(-1, 2).T, len(nodes) + len(place))
    groups: dict[int, list[Key]] = {}
    for key, number in zip(nodes, label.tolist(), strict=False):
        groups.setdefault(number, []).append(key)
    return list(groups.values())


def even_bounds(count: int, size: int) -> Index:
    """Bounds (size + 1,) of PETSc's own split of `count` things: the first ones have one more."""
    sizes = np.full(size, count // size, dtype=np.int64)
    sizes[: count % size] += 1
    return np.concatenate([[0], np.cumsum(sizes)])


def ranked(counts: Index) -> tuple[Index, Index]:
    """Return each number i counts[i] times, and beside it 0, 1, ... counts[i] - 1."""
    source = np.repeat(np.arange(len(counts)), counts)
    return source, np.arange(len(source)) - (np.cumsum(counts) - counts)[source]


def shown(point: Iterable[float], digits: int = 6) -> str:
    """Return a point as text.

    Examples
    --------
    >>> shown((0.5, 1.0, -2.0))
    '(0.5, 1, -2)'
    """
    return f"({', '.join(f'{component:.{digits}g}' for component in point)})"
