"""How well displacement and traction on the boundary satisfy the boundary integral equations, seen without any solver."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...bem.operators import BoundaryOperators

PROBED_NODES = 24
ELASTIC_LIMIT = 1e-7
"""Largest accepted defect of the boundary integral equations, relative to the largest displacement."""
SAFE = 0.1
"""Of it: compressed operators that come nearer are replaced by dense ones."""


def elastic_residual(operators: BoundaryOperators, u: Array, traction: Array) -> float:
    """Largest defect of (4.10) at random nodes, from exact kernel entries, over the largest displacement (a rigid motion
    of the known displacements apart).

    It sees what no KSP can: a wrong or badly conditioned factorisation, a compression that missed its tolerance.
    """
    count = min(PROBED_NODES, operators.mesh.n_nodes)
    rows = np.sort(np.random.default_rng(20190).choice(operators.mesh.n_nodes, count, replace=False))
    u = u if operators.data.rigid is None else u - operators.data.rigid
    defect = np.abs(operators.residual(rows, u, traction)).max()
    scale = np.abs(u).max()
    return float(defect / scale) if scale > 0.0 else float(defect)
