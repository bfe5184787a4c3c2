"""A contact of several parts as one: what it does on the nodes of all its secondary parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from ..arrays import Array
from ..runtime.hints import Named

T = TypeVar("T", bound=Any)
"""The type of pairs, `PairResult`."""
NODAL = (
    "x",
    "normal",
    "tangent",
    "weight",
    "arc_length",
    "pressure",
    "sigma_t",
    "bound",
    "gap",
    "slip",
    "slip_increment",
    "state",
    "primary",
    "wear",
)
"""Fields of a pair with a row a node."""
SUMS = ("force", "moment", "dissipated", "dissipated_error")
"""Fields of a pair that are sums over its nodes."""


class Pairs(Named[T]):
    """The interfaces by name. The name of a contact of several parts gives all of it.

    Examples
    --------
    >>> Pairs({"seat: a on b": 1, "other": 2}).parts_of("seat")
    {'seat: a on b': 1}
    """

    def parts_of(self, contact: str) -> dict[str, T]:
        """The pairs of a contact of several parts, by their names."""
        return {name: pair for name, pair in self.items() if name.startswith(f"{contact}: ")}

    def __missing__(self, name: str) -> T:
        parts = self.parts_of(name)
        return joined(list(parts.values())) if parts else super().__missing__(name)


def joined(pairs: Sequence[T]) -> T:
    """Return what the pairs of one contact do together.

    Each node of a secondary part stands once, with the primary that it meets first.
    """
    sides = list[list[T]]()  # of each secondary part the pairs with all its primaries
    for pair in pairs:
        if sides and np.array_equal(sides[-1][0].x, pair.x):
            sides[-1].append(pair)
        else:
            sides.append([pair])
    rows = {key: _rows(sides, key) for key in NODAL}
    sums = {key: np.sum([getattr(pair, key) for pair in pairs], axis=0) for key in SUMS}
    nothing = dict.fromkeys(("force_primary", "moment_primary", "errors"))
    overlap = max(pair.overlap for pair in pairs)
    return replace(pairs[0], **rows, **sums, **nothing, overlap=overlap)


def _rows(sides: Sequence[Sequence[Any]], key: str) -> Array | None:
    """Return a field at the nodes of all secondary parts, as the pair that each belongs to has it.

    A node that meets no primary has the values of the first pair.
    """
    if getattr(sides[0][0], key) is None:
        return None
    rows = list[Array]()
    for side in sides:
        chosen = np.array([np.isfinite(pair.gap) for pair in side]).argmax(axis=0)
        rows.append(np.stack([getattr(p, key) for p in side])[chosen, np.arange(len(chosen))])
    return np.concatenate(rows)


def shares(parts: Mapping[str, Any], *, axial: bool) -> dict[str, float]:
    """Return the share of a contact's force that each of its pairs carries, by name [-].

    It is that along the force of all of them, with `axial` along the axis. Where this is 0, as
    between the jaws of a vice, it is that of the pressures.
    """
    forces = np.array([pair.force for pair in parts.values()])
    forces = forces[:, 1:2] if axial else forces
    whole, sizes = forces.sum(axis=0), np.linalg.norm(forces, axis=1)
    loads = forces @ whole
    if not np.linalg.norm(whole) > 1e-6 * sizes.sum():
        loads = np.array([float(pair.weight @ np.abs(pair.pressure)) for pair in parts.values()])
    return dict(zip(parts, (loads / (loads.sum() or 1.0)).tolist(), strict=True))
