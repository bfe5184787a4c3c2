"""Bodies that only contact holds and that carry nothing: their least motion.

No equation decides how a roller without load lies in its bearing. What a solver leaves there is the
history of its iterates, and may be as large as the bearing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from ..arrays import Array, Mask
from ..round_off import SOLVED
from .law_protocol import ContactLaw
from .laws import SignoriniCoulomb
from .state import ContactState
from .system import ContactSystem, Modes


def amplitudes(system: ContactSystem, outcome: ContactState) -> Array:
    """Return α (r,) of a solution: the smallest one of those that contact cannot tell apart."""
    if system.modes is None:
        return np.zeros(0)
    left = (outcome.v - system.u_0 - system.apply(outcome.sigma)).ravel()
    return np.asarray(system.modes.fit @ left)


def with_least_motion(
    system: ContactSystem, law: ContactLaw, outcome: ContactState, began: Array
) -> ContactState:
    """Return a solution whose idle bodies are as near as may be to where they began, at α (r,)."""
    if system.modes is None or not outcome.converged or not isinstance(law, SignoriniCoulomb):
        return outcome
    idle = idle_motions(system.modes, law, outcome.sigma)
    if not idle.any():
        return outcome
    moved = np.where(idle, amplitudes(system, outcome) - began, 0.0)
    return replace(outcome, v=least_motion(system.modes, law, outcome.v, moved))


def idle_motions(modes: Modes, law: SignoriniCoulomb, sigma: Array) -> Mask:
    """Return which motions (r,) move no node that carries a traction σ (m, k) or cannot part."""
    carry = sigma.any(axis=1) | ~law.unilateral
    return np.asarray(~np.abs(modes.motion[carry]).any(axis=(0, 1)))


def least_motion(modes: Modes, law: SignoriniCoulomb, v: Array, moved: Array) -> Array:
    """Return v (m, k) [length] with the least motion, without overlap, of bodies that are idle.

    It is the least-distance program min |β| over v_n <= 0 at the nodes that β moves. Its dual is a
    problem of nonnegative least squares (Lawson and Hanson, Solving Least Squares Problems, 1974,
    chapter 23). v stays as it is where every motion leaves an overlap.

    Parameters
    ----------
    modes : Modes
    law : SignoriniCoulomb
    v : (m, k) array
        [length]
    moved : (r,) array
        How far v is from where the bodies began, in amplitudes of idle motions, else 0.

    Examples
    --------
    A die that began .2 below the ground and has risen by .5 goes back to the ground:

    >>> up = Modes(np.array([[[0.0], [-1.0]]]), np.zeros((1, 1, 2)), np.zeros(1))
    >>> law = SignoriniCoulomb(np.zeros(1), np.full(1, np.inf), np.ones(1, dtype=bool), 2)
    >>> bool(np.abs(least_motion(up, law, np.array([[0.0, -0.3]]), np.array([0.5]))).max() < 1e-12)
    True
    """
    idle = moved != 0.0
    near = np.abs(modes.motion[:, :, idle]).any(axis=(1, 2))
    if law.absent is not None:
        near &= ~law.absent
    if not near.any():
        return v
    unit = modes.motion[near][:, :, idle] / modes.size[idle]
    began = v[near] - unit @ (moved * modes.size)[idle]
    size = float(np.abs(began).max(initial=0.0)) or 1.0
    rows = np.vstack([-unit[:, -1].T, began[:, -1] / size])
    target = np.append(np.zeros(len(rows) - 1), 1.0)
    left = target - rows @ scipy.optimize.nnls(rows, target)[0]
    least = v.copy()
    if left[-1] > SOLVED:
        least[near] = began - unit @ (size * left[:-1] / left[-1])
        least[near, -1] = np.minimum(least[near, -1], 0.0)
    return least
