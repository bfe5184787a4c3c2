"""Rigid motions that nothing resists: bodies that lie free, and loads that push them to where they
touch."""

from __future__ import annotations

import numpy as np
import scipy

from ...arrays import Array
from ...round_off import WRITTEN
from ..active_set.pivots import Pivot
from ..law_protocol import ContactLaw, law_residual
from ..system import ContactSystem


def lies_free(system: ContactSystem, law: ContactLaw) -> bool:
    """Return whether no load acts along a rigid motion, and nothing touches without motion."""
    v, modes = system.u_0, system.modes
    idle = modes is not None and not modes.load.any()
    return idle and not law_residual(law, v, np.zeros_like(v), 1.0).any()


def touching(
    system: ContactSystem, law: ContactLaw, step: Pivot, *, against: bool = False
) -> Array | None:
    """Return τ after a motion along the push of the loads, or against it, or None.

    The motion ends where friction that reverses or nodes that close stop it. With constant
    pressures the unbalanced load falls along the motion, and grows against it. But the
    pressures follow the shear: if a body tips rather than slides, it is the other way round.
    """
    modes, v, sigma = system.modes, step.v, step.sigma
    assert modes is not None
    along = modes.motion @ step.push
    moved = np.abs(along) > WRITTEN * np.abs(along).max(initial=0.0)
    if not moved.any():
        return None
    far = 2.0 * float((np.abs(v[moved]) / np.abs(along[moved])).max())
    # where nothing touches yet, what the loads ask of all nodes together
    held = float(step.push @ step.push) / float(
        np.abs(np.tensordot(step.push, modes.resultant, 1)).sum()
    )
    # ρ|v| is 1e4 |σ|: contact stops a free motion, and slip turns where it vanishes
    rho = (
        1e4
        * max(held, float(np.abs(sigma).max(initial=0.0)))
        / (float(np.abs(v).max(initial=0.0)) or 1.0)
    )

    def tau(way: float) -> Array:
        return np.asarray(rho * (v + way * along) - sigma)

    def left(way: float) -> float:
        return float(step.push @ modes.unbalanced(-law.project(tau(way))))

    now = left(0.0)
    wanted, end = (2.0 * now, -far) if against else (0.0, far)
    if now <= 0.0:
        return tau(0.0)
    if not (left(end) - wanted) * (now - wanted) < 0.0:
        return None
    return tau(scipy.optimize.brentq(lambda way: left(way) - wanted, 0.0, end))
