"""What the noise of measured gaps, tools and sides does to contact."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ...arrays import Array, shown
from ...contact.law_protocol import OPEN
from ...geometry.noise import Noise
from ...geometry.smooth_curve import SmoothCurve, SmoothSide
from ...geometry.surface import Boundary
from ...given.interface_data import PosedInterface
from ...results.records import PairResult
from ...results.report import Finding
from ...round_off import first_largest
from .findings import limit_of, new_finding

NoiseAt = Callable[[Array, float], Noise]
"""From a place and half the width of contact there to what noise does."""


def followed_noise(
    sides: Sequence[PosedInterface], boundaries: Sequence[Boundary]
) -> Iterator[Finding]:
    """Find curves that follow the noise of the points of a gap, a tool or a side."""
    for side, what, noise_at in _measured(sides, boundaries):
        noise = noise_at(np.zeros(boundaries[side.body].dim), 0.0)
        if noise.share > limit_of("noise"):
            yield new_finding(
                "noise",
                f"the points of {what} have a noise of about {noise.largest:.1g}, which their "
                "spline follows",
                f"pair {side.name!r}",
                advice=f"give smooth = {2.0 * noise.largest:.1g}",
                measured=noise.share,
            )


def spread_by_noise(
    sides: Sequence[PosedInterface],
    boundaries: Sequence[Boundary],
    pairs: dict[str, PairResult],
) -> Iterator[Finding]:
    """Find contacts whose largest pressure noise has changed.

    The largest pressure of a line contact under a force grows with the root of the curvature of the
    gap, and changes by half as much. The curvature is a mean over the contact, as pressures
    hardly feel waves that are shorter.
    """
    for side, what, noise_at in _measured(sides, boundaries):
        pair = pairs[side.name]
        if not (pair.state != OPEN).any():
            continue
        most = first_largest(pair.pressure)
        noise = noise_at(pair.x[most], _half_width(pair, most))
        if (change := 0.5 * noise.spread) > limit_of("spread"):
            yield new_finding(
                "spread",
                f"the points of {what} have a noise of about {noise.largest:.1g}: the curvature "
                f"at {shown(pair.x[most], 3)} is known to {noise.spread:.1g} of it, and the "
                f"largest pressure to {change:.1%}",
                f"pair {side.name!r}",
                advice=f"compare with smooth = {2.0 * noise.largest:.1g} and more, or measure more",
                measured=change,
            )


def _measured(
    sides: Sequence[PosedInterface], boundaries: Sequence[Boundary]
) -> Iterator[tuple[PosedInterface, str, NoiseAt]]:
    """Yield each curve through points that an interface has, and its name for messages."""
    for side in sides:
        if side.law.gap is not None:
            yield side, "the gap", side.law.gap.noise_at
        for body, part in side.ends:
            boundary = boundaries[body]
            section = getattr(boundary, "section", boundary)
            in_section = getattr(boundary, "in_section", np.asarray)
            own = [s for s in getattr(section, "sides", ()) if s.part == part]
            for curve in {s.curve: None for s in own if isinstance(s, SmoothSide)}:
                yield side, f"part {part!r}", functools.partial(_seen, curve, in_section)


def _seen(
    curve: SmoothCurve, in_section: Callable[[Array], Array], x: Array, reach: float
) -> Noise:
    return curve.noise_at(in_section(x), reach)


def _half_width(pair: PairResult, most: int) -> float:
    """Return half the extent of contact around a node, in space of its shorter direction."""
    closed = pair.state != OPEN
    if pair.x.shape[1] > 2:
        return 0.5 * float(np.sort(np.ptp(pair.x[closed], axis=0))[1])
    order = np.argsort(pair.arc_length)
    at = int(np.flatnonzero(order == most)[0])
    ends = np.flatnonzero(~closed[order])
    before, after = ends[ends < at], ends[ends > at]
    low = int(before.max(initial=-1)) + 1
    high = int(after.min(initial=len(order))) - 1
    return 0.5 * float(np.ptp(pair.arc_length[order[[low, high]]]))
