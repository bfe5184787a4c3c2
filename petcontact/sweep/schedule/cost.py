"""What a group of cases that share assembly and elimination will cost: time and memory, by the size of its mesh."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from ...compliance.spectral import shares
from ...errors import PetcontactError
from ...model.assembly import Assembly
from ...model.case import Case
from ...model.solver_options import Bem
from ...pipeline.choice import is_compressed, resolved_bem
from ...refinement.meshes import mesh_of

# Seconds on one core of 2020, fitted to Examples 1 and 2 at h = 0.4 ... 0.0125: only their ratios matter, they decide the
# order of the groups and who joins whom.
ENTRY = 8e-8
FLOP = 4e-11
MEMORY_FLOP = 2.5e-10
"""Of products with a vector, which wait for the memory."""
FIXED = 2e-3
CASE = 1.4e-3
ITERATIONS = 40
COMPRESSED = 3e-5
EIGEN = 25.0
PROCESS_MEMORY = 1.35e8
"""Bytes of a rank before it has read a case: Python, numpy, PETSc and HDF5."""


@dataclass(frozen=True)
class Cost:
    """Size of a prepared problem, and what it takes.

    Attributes
    ----------
    nodes, contact_unknowns : int
        n, and the tangential unknowns on Γ_C; 0 where the body cannot be meshed.
    prepare, case : float
        Estimated seconds of assembly and elimination, and of each case after them.
    memory : float
        Estimated bytes of its matrices, all ranks of a team together.
    """

    nodes: int
    contact_unknowns: int
    prepare: float
    case: float
    memory: float


def estimate(case: Case | Assembly, cases: int, ranks: int) -> Cost:
    """Size, time and memory from the mesh alone, for so many cases; `ranks` solve each case together."""
    try:
        bodies = case.body if isinstance(case, Assembly) else [case]
        sizes = [_size(body, _contact_parts(case, body), resolved_bem(case.bem)) for body in bodies]
    except PetcontactError:
        # the sweep meets the same error in its turn and records it case by case
        return Cost(0, 0, FIXED, FIXED, 0.0)
    costs = [_of_body(case, *size, cases, ranks) for size in sizes]
    n, m, prepare, solve, memory = (sum(column) for column in zip(*map(astuple, costs), strict=True))
    return Cost(n, m, FIXED + prepare / ranks, CASE + ITERATIONS * solve / ranks, memory)


def _contact_parts(case: Case | Assembly, body: Any) -> set[str]:
    parts = {condition.part for condition in body.boundary if condition.condition == "contact"}
    pairs = case.contact if isinstance(case, Assembly) else ()
    return parts | {side.split(".")[-1] for pair in pairs for side in (pair.secondary, pair.primary)}


def _size(body: Any, contact: set[str], bem: Bem) -> tuple[int, int, int, bool]:
    """Dimension and nodes of a body, contact unknowns, and whether its operators would be compressed."""
    mesh = mesh_of(body)
    on_contact = np.isin(np.array(mesh.part_names)[mesh.node_part], list(contact))
    return mesh.dim, mesh.n_nodes, (mesh.dim - 1) * int(on_contact.sum()), is_compressed(bem, mesh)


def _of_body(case: Case | Assembly, dim: int, n: int, m: int, compressed: bool, cases: int, ranks: int) -> Cost:
    """Seconds of elimination and of one iteration, and memory, for one body."""
    bem, unknowns = resolved_bem(case.bem), dim * n
    full = case.method.formulation == "full"
    if not full and compressed:
        levels = math.log2(max(2.0, n / bem.hodlr_leaf))
        prepare, solve = COMPRESSED * n * levels, COMPRESSED * n * levels / 15.0
        memory = 8.0 * unknowns * (2 * bem.hodlr_leaf + 40.0 * levels) * 2.5
    else:
        factor = 2.0 / 3.0 * unknowns**3
        prepare = ENTRY * n * n + FLOP * (factor + 2.0 * unknowns**2 * m)
        solve = FLOP * (factor if full else 2.0 / 3.0 * m**3 + 6.0 * m * m)
        memory = 8.0 * (unknowns**2 * (2 if full or ranks > 1 else 1) + 2 * unknowns * m + 3 * m * m)
    if not full and ranks == 1 and shares(cases, m):
        prepare, solve = prepare + FLOP * EIGEN * m**3, MEMORY_FLOP * 6.0 * m * m
        memory += 8.0 * 5 * m * m
    return Cost(n, m, prepare, solve, memory)
