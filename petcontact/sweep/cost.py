"""What a sweep will cost: groups of cases that share assembly and elimination, their time and memory."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ..compliance.spectral import shares
from ..errors import PetcontactError
from ..model.case import Case
from ..pipeline.prepare import CROSSOVER, resolved_bem
from ..refinement.marks import mesh_of
from .cases import SweepCase

# Seconds on one core of 2020, fitted to Examples 1 and 2 at h = 0.4 ... 0.0125: only their ratios matter, they decide the
# order of the groups and who joins whom.
ENTRY = 8e-8
FLOP = 4e-11
FIXED = 2e-3
CASE = 1.2e-2
ITERATIONS = 40
COMPRESSED = 3e-5
EIGEN = 25.0
PROCESS_MEMORY = 1.35e8
"""Bytes of a rank before it has read a case: Python, numpy, PETSc and HDF5."""


@dataclass(frozen=True)
class Group:
    """Cases of one body, mesh, material and formulation: one assembly and one elimination serve them all.

    Attributes
    ----------
    cases : tuple of int
        Their places in the sweep.
    nodes, contact_nodes : int
        n and m; 0 where the body cannot be meshed.
    prepare, case : float
        Estimated seconds of assembly and elimination, and of each case after them.
    memory : float
        Estimated bytes of the group's matrices, all ranks of a team together.
    """

    cases: tuple[int, ...]
    nodes: int
    contact_nodes: int
    prepare: float
    case: float
    memory: float


def group_cases(cases: Sequence[SweepCase], chosen: Iterable[int]) -> list[tuple[int, ...]]:
    """Places of the chosen cases, those together that differ only in what a prepared problem does not depend on."""
    groups: dict[str, list[int]] = {}
    for place in chosen:
        groups.setdefault(_key(cases[place].case), []).append(place)
    return [tuple(places) for places in groups.values()]


def _key(case: Case) -> str:
    data = case.model_dump(mode="json", exclude={"method", "title"})
    return json.dumps([data, case.method.formulation], sort_keys=True)


def estimate(places: tuple[int, ...], case: Case, ranks: int) -> Group:
    """Size, time and memory of a group from its mesh alone; `ranks` solve each case together."""
    try:
        mesh = mesh_of(case, case.geometry.outline())
    except PetcontactError:
        # the sweep meets the same error in its turn and records it case by case
        return Group(places, 0, 0, FIXED, FIXED, 0.0)
    contact = [b.part for b in case.boundary if b.condition == "contact"]
    on_contact = np.isin(np.array(mesh.part_names)[mesh.node_part], contact)
    n, m = mesh.n_nodes, int(on_contact.sum())
    bem = resolved_bem(case.bem)
    full = case.method.formulation == "full"
    if not full and (bem.mat_type == "hodlr" or (bem.mat_type == "auto" and n > CROSSOVER)):
        levels = math.log2(max(2.0, n / bem.hodlr_leaf))
        prepare, solve = COMPRESSED * n * levels, COMPRESSED * n * levels / 15.0
        memory = 8.0 * 2 * n * (2 * bem.hodlr_leaf + 40.0 * levels) * 2.5
    else:
        factor = 2.0 / 3.0 * (2 * n) ** 3
        prepare = ENTRY * n * n + FLOP * (factor + 2.0 * (2 * n) ** 2 * m)
        solve = FLOP * (factor if full else 2.0 / 3.0 * m**3 + 6.0 * m * m)
        memory = 8.0 * ((2 * n) ** 2 * (2 if full or ranks > 1 else 1) + 2 * (2 * n) * m + 3 * m * m)
    if not full and ranks == 1 and shares(len(places), m):
        prepare, solve = prepare + FLOP * EIGEN * m**3, FLOP * 6.0 * m * m
        memory += 8.0 * 5 * m * m
    return Group(places, n, m, FIXED + prepare / ranks, CASE + ITERATIONS * solve / ranks, memory)


def describe(groups: Sequence[Group], title: str, cases: int, finished: int, teams: int, ranks: int) -> list[str]:
    """The plan in a few lines, printed before the sweep starts."""
    to_do = sum(len(group.cases) for group in groups)
    plan = [
        f"{title or 'sweep'}: {_count(cases, 'case')}, {finished} finished already, {to_do} to compute in "
        f"{_count(len(groups), 'group')} that share assembly and elimination",
        f"  {_count(teams, 'team')} of {_count(ranks, 'rank')} each",
    ]
    if groups:
        largest = max(groups, key=lambda group: group.memory)
        per_rank = PROCESS_MEMORY + largest.memory / ranks
        plan.append(
            f"  largest system: {2 * largest.nodes} unknowns, {largest.contact_nodes} contact nodes; "
            f"memory: about {per_rank / 1e6:.0f} MB a rank"
        )
    return plan


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"

