"""Stopping criteria of contact methods, and the measures of error that they use."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from ..arrays import Array
from ..record import record
from ..round_off import CHAINED, HALF, ROUNDED, SOLVED, SUMMED, of_vectors
from .friction_law import contact_norm, group_norms, ratio
from .law_protocol import ContactLaw, law_residual
from .system import ContactSystem

Stop = Literal["both", "displacement", "residual"]
SLACK = 1e3
"""Largest friction residual over the tolerance when the change is below the tolerance [-]. A change
that is small only because ρ is wrong is no convergence."""

FLOOR = 1e-3
"""Displacement over the size of u_0, below which it is compared with u_0 instead of itself [-]. An
example is a contact in which all nodes stick."""


@record
class Criterion:
    """The stopping criterion of section 5 of the paper, and two others.

    Attributes
    ----------
    tolerance : float
    stop : {"both", "displacement", "residual"}
        Relative change of v and σ together (the paper's), of v alone, or ‖R_ρ‖/‖σ‖ with the
        balanced ρ.
    """

    tolerance: float
    stop: Stop = "both"

    def change(self, moved: float, size: float, pushed: float, traction: float) -> float:
        """Return the relative change of a step to (v, σ), from ‖δv‖, ‖v‖, ‖δσ‖ and ‖σ‖ [-].

        v must not include gaps, next to which all changes are small.
        """
        if self.stop != "displacement":
            moved, size = moved + pushed, size + traction
        return moved / size if size > 0.0 else (0.0 if moved == 0.0 else 1.0)

    def met(self, change: float, relative_residual: float) -> bool:
        """Return whether the method may stop."""
        if self.stop == "residual":
            return relative_residual <= self.tolerance
        return change <= self.tolerance and relative_residual <= SLACK * self.tolerance


def balanced(
    law: ContactLaw, system: ContactSystem, v: Array, sigma: Array
) -> tuple[float | Array, float, float]:
    """Return ρ = ‖σ‖/‖displacement‖, ‖displacement‖ and ‖σ‖.

    With this ρ both terms of R_ρ have equal weight. It is (k,) if a law has more than one group.
    The displacement is v itself if v = 0 means stick. If v_n includes a gap, the displacement is
    what contact adds, without rigid motions.
    """
    weight, groups = system.weight, law.groups
    # bodies that only contact holds may move together if all nodes stick: the displacement that
    # contact adds is then Sσ and not v - u_0
    strained = 0.0 if system.modes is None else contact_norm(system.apply(sigma), weight)
    if len(groups) == 1:
        (moved, _), (traction, _), (free, _) = group_norms(weight, groups, v, sigma, system.u_0)
        return ratio(max(moved, FLOOR * max(free, strained)), traction, 1.0), moved, traction
    (moved, *parts), (traction, *tractions) = group_norms(
        weight, groups, moves(law, system, v), sigma
    )
    floor = FLOOR * max(moved, strained)
    common = ratio(max(moved, floor), traction, 1.0)
    rho = np.empty(law.k)
    for group, part, own in zip(groups, parts, tractions, strict=True):
        rho[group] = ratio(max(part, floor), own, common)
    return rho, moved, traction


def smooth_balance(law: ContactLaw, system: ContactSystem) -> float | Array:
    """Return ‖σ‖/‖Sσ‖ of unit tractions, without rigid motions; (k,) if the law has several groups
    [stress/length].

    It is the w of (4.1) for smooth tractions and does not depend on units. A group whose unit
    tractions cause rigid motions only has the ratio of all.
    """
    unit = np.ones_like(system.u_0)
    whole = system.apply(unit)
    (push, *pushed), (move, *moved), (most, *_) = group_norms(
        system.weight, law.groups, unit, without_motions(system, whole), whole
    )
    # equal pressures move a preloaded pair as a whole, equal shear turns a disc: less is round-off
    common, rho = ratio(max(move, CHAINED * most), push, 1.0), np.empty(law.k)
    for group, traction, way in zip(law.groups, pushed, moved, strict=True):
        rho[group] = ratio(way if way > CHAINED * most else 0.0, traction, common)
    return float(rho[0]) if len(law.groups) == 1 else rho


def without_motions(system: ContactSystem, moved: Array) -> Array:
    """Return a displacement (m, k) minus the rigid motion nearest to it [length]."""
    modes = system.modes
    return moved if modes is None else moved - modes.motion @ (modes.fit @ moved.ravel())


def beyond_round_off(system: ContactSystem, v: Array, rho: float | Array, residual: Array) -> Array:
    """Return what R_ρ at each node exceeds ρ times the round-off of v there by, (m, k) [stress].

    A node that touches has a small gap, and little round-off but that of coordinates, which are as
    large as the largest gap.
    """
    size = of_vectors(v, system.u_0, share=1.0)
    noise = rho * (SUMMED * size + ROUNDED * size.max(initial=0.0))
    return np.asarray(np.maximum(np.abs(residual) - noise, 0.0))


def over_traction(left: float, traction: float) -> float:
    """Return ‖R_ρ‖/‖σ‖ from both norms; if σ = 0 it is 0 where the law holds, else 1 [-]."""
    return left / traction if traction > 0.0 else float(left > 0.0)


def displaced_by(system: ContactSystem, v: Array, sigma: Array, pairs: Sequence[slice]) -> Array:
    """Return the displacement that tractions cause at their nodes, without rigid motions, (m, k)
    [length].

    If the tractions of other pairs cancel almost all of a pair's displacement, its tractions alone
    are taken. An example is a ring that is bonded to a shaft and pressed onto it from outside. It
    is strained and does not move, so that its displacement is round-off.
    """
    moved = np.array(v - system.u_0 if system.modes is None else system.apply(sigma))
    sizes = [float(np.abs(moved[pair]).max(initial=0.0)) for pair in pairs]
    for pair, size in zip(pairs, sizes, strict=True):
        if size < FLOOR * max(sizes) and sigma[pair].any():
            alone = np.zeros_like(sigma)
            alone[pair] = sigma[pair]
            own = without_motions(system, system.apply(alone))[pair]
            moved[pair] = own if np.abs(own).max() > size else moved[pair]
    return moved


def _balances(
    law: ContactLaw, system: ContactSystem, v: Array, sigma: Array, pairs: Sequence[slice]
) -> tuple[Array, list[float]]:
    """Return ρ (M, k), balanced within each pair and group, and ‖σ‖ of each pair."""
    displaced, sizes = moves(law, system, v), list[float]()
    # where all nodes stick v is round-off
    least = system.u_0 if len(law.groups) == 1 else displaced
    rho, common, strained = np.empty(sigma.shape), None, displaced_by(system, v, sigma, pairs)
    still = HALF * contact_norm(displaced, system.weight)
    for pair in pairs:
        (size, *tractions), (_, *moving), (whole, *straining), (floor, *_) = group_norms(
            system.weight[pair],
            law.groups,
            sigma[pair],
            displaced[pair],
            strained[pair],
            least[pair],
        )
        for group, traction, moved, own in zip(
            law.groups, tractions, moving, straining, strict=True
        ):
            # under a free plate to which a whole body sticks, tangential motion is round-off
            own = own if own > SOLVED * whole else whole
            rho[pair, group] = balance = ratio(
                max(moved, still, FLOOR * max(floor, own)), traction or size, 0.0
            )
            if balance == 0.0:
                common = balanced(law, system, v, sigma)[0] if common is None else common
                rho[pair, group] = np.broadcast_to(common, law.k)[group]
        sizes.append(size)
    return rho, sizes


def natural_residuals(
    law: ContactLaw,
    system: ContactSystem,
    v: Array,
    sigma: Array,
    pairs: Sequence[slice] = (slice(None),),
    least: float = 0.0,
) -> tuple[float, ...]:
    """Return ‖R_ρ‖/‖σ‖ of each group of components, the largest over pairs [-].

    Smaller ‖σ‖ than `least` count as that.

    A pair is a slice of the nodes, with its own σ and balanced ρ. Thus light pressure or stick in
    one pair is judged by itself and not next to the tractions of another. A pair that hardly moves
    is not judged by the round-off of its displacement. A pair without tractions has 0 or 1, see
    `over_traction`.
    """
    rho, sizes = _balances(law, system, v, sigma, pairs)
    residuals = [[0.0] * len(law.groups)]
    residual = beyond_round_off(system, v, rho, law_residual(law, v, sigma, rho))
    for pair, size in zip(pairs, sizes, strict=True):
        ((_, *left),) = group_norms(system.weight[pair], law.groups, residual[pair])
        residuals.append([over_traction(group, max(size, least)) for group in left])
    return tuple(
        max(column, key=lambda value: (value != value, value))
        for column in zip(*residuals, strict=True)
    )


def equilibrium_defect(system: ContactSystem, sigma: Array) -> float:
    """Return the largest |Eσ + f| over the work of all tractions and loads, on motions of unit size
    [-].

    It is 0 without rigid motions.
    """
    return (
        0.0 if system.modes is None else system.modes.defect(sigma, np.eye(len(system.modes.load)))
    )


def moves(law: ContactLaw, system: ContactSystem, v: Array) -> Array:
    """Return the displacement (m, k) with which tractions are compared [length].

    It is v if v = 0 means stick, and v - u_0 without rigid motions if v_n includes a gap.
    """
    return v if len(law.groups) == 1 else without_motions(system, v - system.u_0)
