"""Whether contact forces of any size can hold the loads: a linear program over the cone of admissible tractions."""

from __future__ import annotations

import numpy as np
import scipy.optimize
import scipy.sparse

from ...arrays import Array
from .law import PairLaw

SMALL = 1e-8
"""Push that counts as none, relative to the loads."""


def unheld(balance: Array, resultant: Array, law: PairLaw) -> Array | None:
    """What of the loads no admissible traction holds, (r,); None where all can be held.

    Minimises Σ|Eσ + f| over p >= 0 where unilateral and |σ_t| <= b(p). A load that passes may still not be held: the
    tractions that would do it need not follow from the elastic problem.

    Parameters
    ----------
    balance, resultant : (r, 2m) array, (r,) array
        E, f.
    law : PairLaw
    """
    r, m = len(resultant), len(law.cap)
    scale = np.maximum(np.abs(balance).max(axis=1, initial=0.0), 1e-300)
    size = float(np.abs(resultant / scale).max(initial=0.0))
    if r == 0 or size == 0.0:
        return None
    # unknowns: σ_t, p+ >= 0, p- >= 0 (where not unilateral), and the slacks s+, s- >= 0
    columns = balance / scale[:, None]
    tangential, normal = columns[:, ::2], columns[:, 1::2]
    equal = np.concatenate([tangential, -normal, normal, np.eye(r), -np.eye(r)], axis=1)
    limited = np.flatnonzero(law.coulomb & ~law.bonded & law.present)
    k = len(limited)
    ones = np.ones(k)
    pull = scipy.sparse.csr_matrix((ones, (np.arange(k), limited)), shape=(k, m))
    push = scipy.sparse.csr_matrix((law.coefficient[limited], (np.arange(k), limited)), shape=(k, m))
    rest = scipy.sparse.csr_matrix((k, m + 2 * r))
    upper = scipy.sparse.vstack([scipy.sparse.hstack([pull, -push, rest]), scipy.sparse.hstack([-pull, -push, rest])])
    cap = np.where(law.present, np.where(law.bonded, np.inf, law.cap), 0.0)
    most = np.where(law.present, np.inf, 0.0)
    bounds = np.concatenate([
        np.column_stack([-cap, cap]), np.column_stack([np.zeros(m), most]),
        np.column_stack([np.zeros(m), np.where(law.unilateral, 0.0, most)]),
        np.column_stack([np.zeros(2 * r), np.full(2 * r, np.inf)]),
    ])  # fmt: skip
    cost = np.concatenate([np.zeros(3 * m), np.ones(2 * r)])
    answer = scipy.optimize.linprog(
        cost, A_ub=upper.tocsr() if k else None, b_ub=np.zeros(2 * k) if k else None, A_eq=equal,
        b_eq=-resultant / scale / size, bounds=bounds, method="highs",
    )  # fmt: skip
    if not answer.success or answer.fun <= SMALL:
        return None
    slack = answer.x[3 * m : 3 * m + r] - answer.x[3 * m + r :]
    return np.asarray(-slack * scale * size)
