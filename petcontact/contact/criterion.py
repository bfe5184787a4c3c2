"""When a method may stop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from ..arrays import Array
from ..frozen import frozen
from ..round_off import HALF, SOLVED, SUMMED, of_vectors
from .friction_law import contact_norm, group_norms, ratio
from .law_protocol import ContactLaw, law_residual
from .system import ContactSystem

Stop = Literal["both", "displacement", "residual"]
SLACK = 1e3
"""How much larger than the tolerance the relative friction residual may be when the change has met
it: a change that is small only because ρ is far off is no convergence."""

FLOOR = 1e-3
"""Of the size of u_0: displacements below it are compared with it and not with themselves, as where
all nodes stick."""


@frozen
class Criterion:
    """The stopping criterion of section 5, and two others.

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
        """The relative change of a step that led to (v, σ), from ‖δv‖, ‖v‖, ‖δσ‖ and ‖σ‖; v without
        gaps, beside which all changes are small."""
        if self.stop != "displacement":
            moved, size = moved + pushed, size + traction
        return moved / size if size > 0.0 else (0.0 if moved == 0.0 else 1.0)

    def met(self, change: float, relative_residual: float) -> bool:
        """Whether the method may stop."""
        if self.stop == "residual":
            return relative_residual <= self.tolerance
        return change <= self.tolerance and relative_residual <= SLACK * self.tolerance


def balanced(
    law: ContactLaw, system: ContactSystem, v: Array, sigma: Array, fallback: float = 1.0
) -> tuple[float | Array, float, float]:
    """ρ = ‖σ‖/‖displacement‖, with which both terms of R_ρ weigh the same, (k,) where a law has
    more than one group; and ‖displacement‖ and ‖σ‖.

    The displacement is v itself where v = 0 is sticking; where v_n is a gap it is what contact
    adds, rigid motions apart.
    """
    weight, groups = system.weight, law.groups
    # bodies and obstacles that only contact holds may move as one where all of it sticks: then v -
    # u_0 is no displacement that contact adds, which is Sσ
    strained = 0.0 if system.modes is None else contact_norm(system.apply(sigma), weight)
    if len(groups) == 1:
        (moved, _), (traction, _), (free, _) = group_norms(weight, groups, v, sigma, system.u_0)
        return ratio(max(moved, FLOOR * max(free, strained)), traction, fallback), moved, traction
    (moved, *parts), (traction, *tractions) = group_norms(
        weight, groups, moves(law, system, v), sigma
    )
    floor = FLOOR * max(moved, strained)
    common = ratio(max(moved, floor), traction, fallback)
    rho = np.empty(law.k)
    for group, part, own in zip(groups, parts, tractions, strict=True):
        rho[group] = ratio(max(part, floor), own, common)
    return rho, moved, traction


def without_motions(system: ContactSystem, moved: Array) -> Array:
    """A displacement (m, k) less the rigid motion nearest to it."""
    modes = system.modes
    return moved if modes is None else moved - modes.motion @ (modes.fit @ moved.ravel())


def relative_residual(
    law: ContactLaw,
    system: ContactSystem,
    v: Array,
    sigma: Array,
    fallback: float = 1.0,
    scale: float = 0.0,
) -> float:
    """‖R_ρ‖/‖σ‖ with the balanced ρ: independent of a method's ρ and of units.

    `scale` is the largest ‖σ‖ seen so far: where friction vanishes σ itself does, and cannot be its
    own measure.
    """
    rho, _, traction = balanced(law, system, v, sigma, fallback)
    residual, noise = (
        law_residual(law, v, sigma, rho),
        rho * of_vectors(v, system.u_0, share=SUMMED),
    )
    (left,), (of,) = group_norms(system.weight, (), residual, np.broadcast_to(noise, v.shape))
    return over_traction(left, of, max(traction, scale))


def over_traction(left: float, noise: float, traction: float) -> float:
    """‖R_ρ‖/‖σ‖ of both norms, 0 where ‖R_ρ‖ is no more than ρ times the round-off of v; where
    σ = 0 the law holds, 0, or not, 1."""
    if left <= noise:
        return 0.0
    return left / traction if traction > 0.0 else 1.0


def displaced_by(
    system: ContactSystem, v: Array, sigma: Array, pairs: Sequence[slice], share: float = FLOOR
) -> Array:
    """What tractions displace at their nodes, (m, k) [length], rigid motions apart: all together,
    or those of a pair by themselves where others take back all of it but a share.

    A ring that is bonded to a shaft and pressed on it from outside is strained and does not move:
    what is left of its displacement is round-off, and no measure of it.
    """
    moved = np.array(v - system.u_0 if system.modes is None else system.apply(sigma))
    sizes = [float(np.abs(moved[pair]).max(initial=0.0)) for pair in pairs]
    for pair, size in zip(pairs, sizes, strict=True):
        if size < share * max(sizes) and sigma[pair].any():
            alone = np.zeros_like(sigma)
            alone[pair] = sigma[pair]
            own = without_motions(system, system.apply(alone))[pair]
            moved[pair] = own if np.abs(own).max() > size else moved[pair]
    return moved


def natural_residuals(
    law: ContactLaw,
    system: ContactSystem,
    v: Array,
    sigma: Array,
    pairs: Sequence[slice] = (slice(None),),
) -> tuple[float, ...]:
    """‖R_ρ‖/‖σ‖ of each group of components, the largest of some pairs, each with its own σ and
    balanced ρ.

    A pair is a slice of the nodes. What sticks or presses lightly in one is not lost beside the
    tractions of another; one that does not move beside others is not measured by the round-off of
    its displacement; a pair without tractions has 0 or 1, see `over_traction`.
    """
    displaced, sizes, found = moves(law, system, v), list[float](), [[0.0] * len(law.groups)]
    least = (
        system.u_0 if len(law.groups) == 1 else displaced
    )  # where all nodes stick v is round-off
    rho, common, strained = np.empty(sigma.shape), None, displaced_by(system, v, sigma, pairs)
    still = HALF * contact_norm(displaced, system.weight)
    for pair in pairs:
        four = (x[pair] for x in (sigma, displaced, strained, least))
        norms = group_norms(system.weight[pair], law.groups, *four)
        (size, *tractions), (_, *moving), (whole, *straining), (floor, *_) = norms
        for group, traction, moved, own in zip(
            law.groups, tractions, moving, straining, strict=True
        ):
            # under a free plate that all of a body sticks to, tangents move by round-off only
            own = own if own > SOLVED * whole else whole
            rho[pair, group] = balance = ratio(
                max(moved, still, FLOOR * max(floor, own)), traction or size, 0.0
            )
            if balance == 0.0:
                common = balanced(law, system, v, sigma)[0] if common is None else common
                rho[pair, group] = np.broadcast_to(common, law.k)[group]
        sizes.append(size)
    residual = law_residual(law, v, sigma, rho)
    noise = rho * of_vectors(v, system.u_0, share=SUMMED)
    for pair, size in zip(pairs, sizes, strict=True):
        (_, *left), (_, *of) = group_norms(
            system.weight[pair], law.groups, residual[pair], noise[pair]
        )
        found.append([over_traction(a, b, size) for a, b in zip(left, of, strict=True)])
    return tuple(
        max(column, key=lambda value: (value != value, value))
        for column in zip(*found, strict=True)
    )


def equilibrium_defect(system: ContactSystem, sigma: Array) -> float:
    """Largest |Eσ + f| over the work of all tractions and loads, on motions of unit size; 0 without
    rigid motions."""
    return (
        0.0 if system.modes is None else system.modes.defect(sigma, np.eye(len(system.modes.load)))
    )


def moves(law: ContactLaw, system: ContactSystem, v: Array) -> Array:
    """The displacement (m, k) that tractions are compared with: v where v = 0 is sticking, v - u_0
    where v_n is a gap."""
    return v if len(law.groups) == 1 else without_motions(system, v - system.u_0)
