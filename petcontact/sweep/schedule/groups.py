"""Groups: cases that one assembly and one elimination serve, and what they will cost.

What a group is follows from the keys that vary and never from what is left to compute, so that a
sweep that is resumed computes what an uninterrupted one does, bit for bit.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from ...arrays import Index
from ...errors import PetcontactError
from ...model.problem import Problem
from ...record import record
from ..design.sweep import Sweep
from ..problems import elimination_needs
from .cost import PROCESS_MEMORY, Cost


@record
class Groups:
    """All groups of a sweep.

    Attributes
    ----------
    of_case : (n,) array
        The group of each case.
    first, size : (G,) arrays
        Place of each group's first case, and how many it has.
    mesh : (G,) array
        The same number for groups on the same mesh.
    """

    of_case: Index
    first: Index
    size: Index
    mesh: Index

    def representatives(self) -> Index:
        """Groups whose cost is to be estimated."""
        groups = np.unique(self.mesh, return_index=True)[1]
        # 64 meshes are made to know their costs; others cost what the nearest one does
        chosen = np.linspace(0, len(groups) - 1, min(64, len(groups))).round().astype(np.int64)
        return groups[np.unique(chosen)]

    def spread(self, costs: Sequence[Cost]) -> list[Cost]:
        """The cost of every group from those of the representatives."""
        sizes = self.mesh[self.representatives()]
        nearest = np.searchsorted(0.5 * (sizes[1:] + sizes[:-1]), self.mesh)
        return [costs[k] for k in nearest]


SHAPING = re.compile(r"method\.formulation$|(geometry|mesh|bem|body)(\.|$)")
"""Dotted keys on which the meshes of a case depend."""


def make_groups(sweep: Sweep) -> Groups:
    """Cases that differ in nothing that the elimination depends on belong together."""
    fixed = all(map(_has_fixed_meshes, _first_cases(sweep)))
    of_case, first, size = _numbers(
        _codes(sweep, lambda key, value: elimination_needs(key, value, meshes_fixed=fixed))
    )
    meshes, _, _ = _numbers(_codes(sweep, lambda key, value: value if SHAPING.match(key) else None))
    return Groups(of_case, first, size, meshes[first])


def _first_cases(sweep: Sweep) -> Iterator[Problem | None]:
    """One case of each base; None if it is invalid."""
    for place in range(0, len(sweep), len(sweep) // len(sweep.bases)):
        try:
            yield sweep[place]
        except PetcontactError:
            yield None


def _has_fixed_meshes(case: Problem | None) -> bool:
    """Whether sizes are given, or bodies are in space: other meshes of bodies in the plane resolve
    their data."""
    return case is not None and not any(
        body.mesh.automatic and case.outline(number).graded for number, body in enumerate(case.body)
    )


def _codes(sweep: Sweep, needs: Callable[[str, object], object]) -> list[Index]:
    """For the bases and each axis: entries that differ in nothing that is needed have the same
    number."""

    def needed(entry: Iterable[tuple[str, object]]) -> list[tuple[str, object]]:
        return [(key, what) for key, value in entry if (what := needs(key, value)) is not None]

    axes = (
        [needed(zip(axis.keys, some, strict=True)) for some in axis.values] for axis in sweep.axes
    )
    return [
        _same([[base.problem, needed(base.fixed.items())] for base in sweep.bases]),
        *map(_same, axes),
    ]


def _same(entries: Sequence[object]) -> Index:
    numbers: dict[str, int] = {}
    words = (json.dumps(entry, sort_keys=True, default=str) for entry in entries)
    return np.array([numbers.setdefault(word, len(numbers)) for word in words], np.int64)


def _numbers(codes: list[Index]) -> tuple[Index, Index, Index]:
    """A number for each case from those of its entries, without gaps and by first appearance; first
    places and sizes."""
    combined = np.zeros(1, np.int64)
    for code in codes:
        combined = (combined[:, None] * (int(code.max()) + 1) + code[None, :]).ravel()
    _, first, inverse, size = np.unique(
        combined, return_index=True, return_inverse=True, return_counts=True
    )
    order = np.argsort(first, kind="stable")
    return np.argsort(order)[inverse.ravel()], first[order], size[order]


def describe(
    sweep: Sweep, costs: Sequence[Cost], counts: tuple[int, int, int, int], teams: int, ranks: int
) -> list[str]:
    """The plan in a few lines, printed before a sweep starts.

    Parameters
    ----------
    sweep : Sweep
    costs : sequence of Cost
        Of the groups with work to do.
    counts : (cases, finished, to compute, groups)
    teams, ranks : int
        Teams, and ranks of each.
    """
    cases, finished, to_do, groups = counts
    shared = (
        f" in {_count(groups, 'group')} that share assembly and elimination"
        if groups < to_do and not all(cost.adaptive for cost in costs)
        else ""
    )
    plan = [
        f"{sweep.file.title or 'sweep'}: {_count(cases, 'case')}, {finished} finished already, "
        f"{to_do} to compute{shared}",
        f"  {_count(teams, 'team')} of {_count(ranks, 'rank')} each; kept beside the table: "
        f"{sweep.keep}",
    ]
    if costs:
        largest = max(costs, key=lambda cost: cost.memory)
        per_rank = PROCESS_MEMORY + largest.memory / ranks
        plan.append(
            f"  largest system{' on a first mesh' * largest.adaptive}: {largest.nodes} nodes, "
            f"{largest.contact_unknowns} contact unknowns; memory: about "
            f"{per_rank / 1e6:.0f} MB a rank"
        )
    return plan


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' if number != 1 else ''}"
