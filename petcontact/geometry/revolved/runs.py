"""Sides of a section that follow one another without a corner, as one curve."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...record import record
from ...round_off import SINGLE
from ..outline import Side


@record
class Run:
    """Sides of one part of a section without a corner between them."""

    sides: Sequence[Side]

    @property
    def part(self) -> str:
        """Its part."""
        return self.sides[0].part

    @functools.cached_property
    def ends(self) -> Array:
        """Lengths along it at which its sides begin and end [length]."""
        return np.append(0.0, np.cumsum([side.length for side in self.sides]))

    @property
    def length(self) -> float:
        """[length]"""
        return float(self.ends[-1])

    def at(self, length: Array) -> Array:
        """Return the points (n, 2) at lengths along it."""
        number = np.clip(
            np.searchsorted(self.ends, length, side="right") - 1, 0, len(self.sides) - 1
        )
        share = (length - self.ends[number]) / np.diff(self.ends)[number]
        points = np.array([side.point(share) for side in self.sides])
        return np.asarray(points[number, np.arange(len(share))])

    def nearest(self, points: Array) -> Array:
        """Return the lengths along it of the points that are nearest to points (n, 2)."""
        shares = np.array([side.nearest(points) for side in self.sides])
        feet = np.array([side.point(t) for side, t in zip(self.sides, shares, strict=True)])
        number = np.linalg.norm(feet - points, axis=2).argmin(axis=0)
        share = shares[number, np.arange(len(points))]
        return np.asarray(self.ends[number] + share * np.diff(self.ends)[number])


def runs_of(sides: Sequence[Side]) -> list[Run]:
    """Return the runs of sides in the order of a section."""
    result = [Run(sides[:1])] if sides else []
    for one, two in itertools.pairwise(sides):
        smooth = float(one.tangents(np.ones(1))[0] @ two.tangents(np.zeros(1))[0]) > 1.0 - SINGLE
        if one.part == two.part and smooth and np.allclose(one.end, two.start):
            result[-1] = Run([*result[-1].sides, two])
        else:
            result.append(Run([two]))
    return result
