"""Overlaps of surfaces after an increment, at the nodes and between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, Index
from ...compliance.reduced_bodies import BodiesSystem, Interface
from ...contact.criterion import displaced_by
from ...contact.law_protocol import ContactLaw, law_residual
from ...contact.state import ContactState
from ...contact.system import ContactSystem, is_monolithic
from ...results.report import Finding
from ...round_off import CHAINED, ROUNDED, WRITTEN
from .between_nodes import Sampling
from .findings import limit_of, new_finding


class Overlap(NamedTuple):
    """How far surfaces overlap after an increment.

    The three relative overlaps are d / (d + s) in [0, 1]. Here d is the overlap and s the largest
    displacement that tractions cause on any interface. Thus cutting a contact into two pairs
    changes nothing.

    Attributes
    ----------
    at_nodes, between : float
        The largest relative overlap at nodes, and between them.
    depth : float
        The largest overlap between nodes [length].
    displaced : float
        The displacement s [length].
    finding : Finding, optional
        The overlap between nodes, if it exceeds the limit for one increment.
    pressed, pressed_where : float, str
        As `between`, with elements in contact included, and its position in words; only on request.
    """

    at_nodes: float = 0.0
    between: float = 0.0
    depth: float = 0.0
    displaced: float = 0.0
    finding: Finding | None = None
    pressed: float = 0.0
    pressed_where: str = ""


def _noise(bodies: BodiesSystem, system: ContactSystem, outcome: ContactState) -> Array:
    """Return the round-off of overlaps at nodes, (M,) [length]."""
    both = outcome.v - system.u_0
    moved = both if system.modes is None else system.apply(outcome.sigma)
    gap = np.where(np.isfinite(bodies.gap), np.abs(bodies.gap), 0.0)
    sizes = (
        np.abs(system.u_0[:, -1])
        + np.abs((both - moved)[:, -1])
        + np.abs(moved).max(initial=0.0)
        + gap
    )
    share = WRITTEN if is_monolithic(system) else CHAINED
    # coordinates are as large as the largest gap
    return np.asarray(share * sizes + ROUNDED * gap.max(initial=0.0))


def overlaps(
    bodies: BodiesSystem,
    system: ContactSystem,
    law: ContactLaw,
    samplings: list[Sampling | None],
    outcome: ContactState,
    *,
    closed: bool = False,
) -> Overlap:
    """Return the largest overlap at nodes and between them.

    At nodes it is the part of v_n that the law forbids, hence also a gap in bilateral contact.
    `closed` asks for the overlap in elements in contact, too.
    """
    if bodies.k < bodies.components:
        return Overlap()
    noise = _noise(bodies, system, outcome)
    # R_ρ/ρ is the forbidden part of v plus σ/ρ; ρ is so large that σ/ρ is below round-off
    least = noise.min(initial=np.inf)
    rho = float(np.abs(outcome.sigma).max(initial=0.0) / least) if 0.0 < least < np.inf else 0.0
    rho = rho if rho > 0.0 else 1.0
    forbidden = np.abs(law_residual(law, outcome.v, outcome.sigma, rho)[:, -1]) / rho
    at_nodes = worst = deepest = pressed = 0.0
    finding, pressed_text = None, ""
    strained = displaced_by(system, outcome.v, outcome.sigma, bodies.slices)
    scale = float(np.abs(strained).max(initial=0.0))
    for where, interface, between in zip(bodies.slices, bodies.interfaces, samplings, strict=True):
        seen = np.isfinite(interface.gap)
        depth = float((forbidden - noise)[where][seen].max(initial=0.0))
        at_nodes = max(at_nodes, _share(depth, scale))
        if between is None:
            continue
        depth, position = between.overlap(
            outcome.v[where, -1] - noise[where],
            interface.gap,
            outcome.states[where],
            limit_of("overlap") * scale,
            unfaced=not outcome.sigma[where].any(),
        )
        share = _share(depth, scale)
        if share > limit_of("overlap on the way") and _yields(
            bodies, outcome, samplings, interface, depth
        ):
            share, depth = 0.0, 0.0
        if share > max(worst, limit_of("overlap on the way")) and position is not None:
            finding = new_finding(
                "overlap on the way",
                f"surfaces overlap between nodes: {_text(interface, between, depth, position)}",
                measured=share,
            )
        worst, deepest = max((worst, deepest), (share, depth))
        if closed and scale > 0.0:
            depth, position = between.overlap(
                outcome.v[where, -1],
                interface.gap,
                outcome.states[where],
                limit_of("overlap") * scale,
                True,
            )
            if (share := _share(depth, scale)) > pressed and position is not None:
                pressed, pressed_text = share, _text(interface, between, depth, position)
    return Overlap(at_nodes, worst, deepest, scale, finding, pressed, pressed_text)


def _text(
    interface: Interface, between: Sampling, depth: float, position: tuple[Index, Array]
) -> str:
    point = ", ".join(f"{coordinate:.6g}" for coordinate in between.point(*position))
    return f"pair {interface.name!r} by {depth:.3g} at ({point})"


def _yields(
    bodies: BodiesSystem,
    outcome: ContactState,
    samplings: list[Sampling | None],
    interface: Interface,
    depth: float,
) -> bool:
    """Return whether a free body of a pair has no contact and room to move away by the overlap.

    In that case no traction is missed.
    """
    for number in (interface.body, interface.primary):
        if number is None or bodies.bodies[number].modes.shape[2] < bodies.motions.count:
            continue
        touching = [
            entry
            for entry in zip(bodies.slices, bodies.interfaces, samplings, strict=True)
            if number in (entry[1].body, entry[1].primary)
        ]
        carries = any(outcome.sigma[where].any() for where, *_ in touching)
        if not carries and all(
            _clears(outcome, where, neighbour, between, depth)
            for where, neighbour, between in touching
            if neighbour is not interface
        ):
            return True
    return False


def _clears(
    outcome: ContactState,
    where: slice,
    interface: Interface,
    between: Sampling | None,
    depth: float,
) -> bool:
    """Return whether the sides of a pair are farther apart than `depth`, at nodes and between
    them."""
    v_n, states = outcome.v[where, -1] + depth, outcome.states[where]
    return v_n.max(initial=-np.inf) < 0.0 and (
        between is None or between.overlap(v_n, interface.gap, states, 0.0)[0] == 0.0
    )


def _share(depth: float, scale: float) -> float:
    return depth / (depth + scale) if depth > 0.0 else 0.0
