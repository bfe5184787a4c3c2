"""Rigid motions that nothing resists: bodies that lie free, and loads that push them to where they
touch."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...linalg.root import root_between
from ...round_off import CHAINED, HALF, WRITTEN
from ..active_set.pivots import PATIENCE, Pivot
from ..law_protocol import ContactLaw, law_residual
from ..linearisation import Linearisation
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
    return tau(root_between(lambda way: left(way) - wanted, 0.0, end))


def in_equilibrium(
    system: ContactSystem, law: ContactLaw, v: Array, sigma: Array, rho: float | Array
) -> Array:
    """Return v (m, k) after the rigid motion for which -Π(ρv - σ) is in equilibrium with the loads.

    These tractions are the projection of σ - ρv onto those that the law allows and that are in
    equilibrium. A Robin step alone moves bodies as if all nodes touched. The motion is found by
    Newton's method. Each step ends where the work of what is out of balance vanishes along it. No
    step is taken along which nothing holds the loads.
    """
    modes = system.modes
    if modes is None:
        return v
    unit = modes.basis / modes.size[:, None]
    motion, resultant = modes.motion @ unit, np.tensordot(unit.T, modes.resultant, 1)
    most, tau = np.max(rho), rho * v - sigma
    pull = np.broadcast_to(rho / most, v.shape)[:, :, None] * motion
    stuck = HALF * np.tensordot(resultant, pull, 2)

    def left(tau: Array) -> Array:
        return np.asarray(unit.T @ modes.unbalanced(-law.project(tau)))

    def work(way: float) -> float:
        return float(step @ left(tau + way * (pull @ step)))

    for _ in range(PATIENCE):
        force = left(tau)
        if np.abs(force).max() <= CHAINED * np.abs(unit.T @ modes.load).max():
            break
        slope = Linearisation.from_law(law, tau).derivative @ pull
        step = np.linalg.lstsq(np.tensordot(resultant, slope, 2) + stuck, force, rcond=None)[0]
        now, end = work(0.0), work(1.0)
        if not end <= now / 2.0 < now:
            break
        if end < 0.0:
            step = root_between(work, 0.0, 1.0) * step
        tau, v = tau + pull @ step, v + motion @ step / most
    return v
