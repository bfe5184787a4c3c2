"""Whether surfaces overlap, at the nodes and between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array, Index
from ...compliance.bodies import BodiesSystem, Interface
from ...contact.criterion import displaced_by
from ...contact.law_protocol import ContactLaw, law_residual
from ...contact.state import ContactState
from ...contact.system import ContactSystem, is_monolithic
from ...results.report import Finding
from ...round_off import CHAINED, WRITTEN
from .between_nodes import Places
from .findings import limit_of, new_finding

NEGLIGIBLE = 1e-2
"""Part of what tractions displace that an overlap between nodes may be off by."""


class Overlap(NamedTuple):
    """How far surfaces overlap after an increment.

    Attributes
    ----------
    at_nodes, between : float
        The largest overlap at nodes and between them, over itself and what tractions displace
        anywhere, in [0, 1]: a contact that is cut into two pairs is the same.
    depth : float
        Of the latter [length].
    displaced : float
        The most that tractions displace on any interface [length].
    finding : Finding, optional
        The latter overlap, where it is more than is accepted of an increment by itself.
    pressed, pressed_where : float, str
        As `between`, and its place in words, of all elements, those in contact among them, where
        that was asked for.
    """

    at_nodes: float = 0.0
    between: float = 0.0
    depth: float = 0.0
    displaced: float = 0.0
    finding: Finding | None = None
    pressed: float = 0.0
    pressed_where: str = ""


def overlaps(
    bodies: BodiesSystem,
    system: ContactSystem,
    law: ContactLaw,
    places: list[Places | None],
    outcome: ContactState,
    *,
    closed: bool = False,
) -> Overlap:
    """The largest overlap at nodes and between them, and between nodes in contact where asked for
    (`closed`).

    At nodes it is what the law forbids of v_n, also where a bilateral contact comes apart: any law
    says so.
    """
    if bodies.k < bodies.components:
        return Overlap()
    both = outcome.v - system.u_0
    moved = both if system.modes is None else system.apply(outcome.sigma)
    rigid = both - moved
    noise = (WRITTEN if is_monolithic(system) else CHAINED) * (
        np.abs(system.u_0[:, -1])
        + np.abs(rigid[:, -1])
        + np.abs(moved).max(initial=0.0)
        + np.where(np.isfinite(bodies.gap), np.abs(bodies.gap), 0.0)
    )
    # R_ρ/ρ is what the law forbids of v, but for σ/ρ, which is to be less than round-off
    least = noise.min(initial=np.inf)
    rho = float(np.abs(outcome.sigma).max(initial=0.0) / least) if 0.0 < least < np.inf else 0.0
    rho = rho if rho > 0.0 else 1.0
    forbidden = np.abs(law_residual(law, outcome.v, outcome.sigma, rho)[:, -1]) / rho
    at_nodes = worst = deepest = pressed = 0.0
    finding, pressed_text = None, ""
    strained = displaced_by(system, outcome.v, outcome.sigma, bodies.slices)
    scale = float(np.abs(strained).max(initial=0.0))
    for where, face, between in zip(bodies.slices, bodies.interfaces, places, strict=True):
        seen = np.isfinite(face.gap)
        depth = float((forbidden - noise)[where][seen].max(initial=0.0))
        at_nodes = max(at_nodes, _share(depth, scale))
        if between is None:
            continue
        depth, place = between.overlap(
            outcome.v[where, -1],
            face.gap,
            outcome.states[where],
            NEGLIGIBLE * scale,
            unfaced=not outcome.sigma[where].any(),
        )
        share = _share(depth - float(noise[where].max(initial=0.0)), scale)
        if share > limit_of("overlap on the way") and _yields(bodies, outcome, places, face, depth):
            share, depth = 0.0, 0.0
        if share > max(worst, limit_of("overlap on the way")) and place is not None:
            finding = new_finding(
                "overlap on the way",
                f"surfaces overlap between nodes: {_told(face, between, depth, place)}",
                measured=share,
            )
        worst, deepest = max((worst, deepest), (share, depth))
        if closed and scale > 0.0:
            depth, place = between.overlap(
                outcome.v[where, -1], face.gap, outcome.states[where], NEGLIGIBLE * scale, True
            )
            if (share := _share(depth, scale)) > pressed and place is not None:
                pressed, pressed_text = share, _told(face, between, depth, place)
    return Overlap(at_nodes, worst, deepest, scale, finding, pressed, pressed_text)


def _told(face: Interface, between: Places, depth: float, place: tuple[Index, Array]) -> str:
    point = ", ".join(f"{coordinate:.6g}" for coordinate in between.point(*place))
    return f"pair {face.name!r} by {depth:.3g} at ({point})"


def _yields(
    bodies: BodiesSystem,
    outcome: ContactState,
    places: list[Places | None],
    face: Interface,
    depth: float,
) -> bool:
    """Whether a free body of a pair carries nothing and has room to move away by as much: then no
    traction is missed."""
    for number in (face.body, face.primary):
        if number is None or bodies.bodies[number].modes.shape[2] < bodies.motions.count:
            continue
        beside = [
            every
            for every in zip(bodies.slices, bodies.interfaces, places, strict=True)
            if number in (every[1].body, every[1].primary)
        ]
        carries = any(outcome.sigma[where].any() for where, *_ in beside)
        if not carries and all(
            _clears(outcome, where, other, between, depth)
            for where, other, between in beside
            if other is not face
        ):
            return True
    return False


def _clears(
    outcome: ContactState, where: slice, face: Interface, between: Places | None, depth: float
) -> bool:
    """Whether the sides of a pair, at the nodes and between them, are more than a depth apart."""
    v_n, states = outcome.v[where, -1] + depth, outcome.states[where]
    return v_n.max(initial=-np.inf) < 0.0 and (
        between is None or between.overlap(v_n, face.gap, states, 0.0)[0] == 0.0
    )


def _share(depth: float, scale: float) -> float:
    return depth / (depth + scale) if depth > 0.0 else 0.0
