"""Contacts with zones: how far p changes from one band to the next, where contact is expected
to begin, and what the next band is like."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence

import numpy as np
import scipy

from ...arrays import Array, Mask
from ...fields.boundary.places import located, sizes
from ...geometry.chart import Chart
from ...given.interface_data import PosedInterface
from ...mesh.surface_mesh import as_surface
from ...record import field, record, replace
from ...refinement.panels.bands import LEVELS
from ...refinement.panels.forecast import WIDER
from ...refinement.panels.rings import SHRINK
from ...refinement.panels.zone import ContactBand, ContactEllipse, Zone, with_stick, zone_of
from ...results.records import PairResult, StepResult, step_ends
from ...results.solution import Solution
from .surface_errors import TailErrors

LEFT = SHRINK / (1.0 - SHRINK)
"""Error of p over its change from a band with one line less between the ridge and the edge [-]. The
L2 error of polynomials next to a root is proportional to the width of the last panel, which falls
by `SHRINK` with each line."""
UNKNOWN = ContactEllipse(np.zeros(2), np.eye(2))
"""The zone of a contact that no forecast has."""
NEAR = 0.01
"""Distance of a node from a panel of another mesh of its face over the size of the panel, up to
which it lies on it [-]."""


FEWEST = 10
"""Least number of nodes whose pressure gives an ellipse: twice as many as it has parameters."""


@record
class ZonedContact:
    """A contact with a zone: its interface, the charts of its faces, the zone on the first one, and
    whether that is a loop."""

    side: PosedInterface
    charts: list[Chart]
    zone: Zone
    closed: bool = False

    @property
    def is_band(self) -> bool:
        return isinstance(self.zone, ContactBand)

    def away(self, x: Array) -> Mask:
        """Return which points (n, 3) are away from ends where p is infinite."""
        return self.zone.away(self.charts[0].local(x))

    def holds(self, x: Array) -> Mask:
        """Return which points (n, 3) of the first face lie in the zone."""
        return self.zone.holds(self.charts[0].local(x))


@record
class LaidBands:
    """The bands that meshes have.

    Attributes
    ----------
    long : dict
        The zones of each interface; none where one of them is not known.
    lines : dict of tuples of int
        Lines between the ridge and the edge of each band, on all meshes on which it was new.
    most : int
        Largest number of lines of first bands.
    """

    long: dict[str, list[ZonedContact]] = field(default_factory=dict)
    lines: dict[str, tuple[int, ...]] = field(default_factory=dict)
    most: int = LEVELS - 1

    @property
    def by_change(self) -> bool:
        """Whether the error is known from changes between bands only, whatever tails say."""
        return any(map(self.has_band, self.lines))

    def has_band(self, name: str) -> bool:
        """Return whether a contact has a band, by its interface."""
        return any(long.is_band for long in self.long[name])

    def apart(self, before: Solution, after: Solution, errors: TailErrors) -> float:
        """Return the relative error of p and q by their change from one band to the next [-].

        It is infinite unless all contacts that carry anything have bands on both: tails tell the
        error of rings. Ends at which p is infinite are left out.
        """
        worst = 0.0
        for old, new in zip(step_ends(before.steps), step_ends(after.steps), strict=True):
            for side in after.posed.interfaces:
                if not new.pairs[side.name].size.any():
                    continue
                if len(self.lines.get(side.name, ())) < 2 or not self.has_band(side.name):
                    return np.inf
                x, longs = new.pairs[side.name].x, self.long[side.name]
                weight = errors.weight(side, new) * np.all([one.away(x) for one in longs], axis=0)
                worst = max(worst, _difference((before, old), (after, new), side, weight))
        return LEFT * worst

    @property
    def places(self) -> dict[str, Callable[[Array], Mask]]:
        """Functions by interface that return which points (n, 3) lie in its band."""
        return {name: functools.partial(_held, self.long[name]) for name in self.lines}


def _held(longs: Sequence[ZonedContact], x: Array) -> Mask:
    return np.asarray(np.any([long.holds(x) for long in longs], axis=0))


def followed(
    longs: Sequence[ZonedContact], solution: Solution, name: str, sticks: bool
) -> list[ZonedContact]:
    """Return the zones of a contact that carry anything as a solution has them, or none if one of
    them has another shape. Each node belongs to the nearest one."""
    steps, result = step_ends(solution.steps or solution.tried), list[ZonedContact]()
    pairs = [step.pairs[name] for step in steps]
    away = [
        scipy.spatial.cKDTree(long.charts[0].at(long.zone.points)).query(pairs[-1].x)[0]
        for long in longs
    ]
    for k, long in enumerate(longs):
        own = np.argmin(away, axis=0) == k
        if any(pair.pressure[own].any() for pair in pairs):
            # a band may turn out to be round: slices do not see what is
            zone: Zone | None = _round_zone(long.charts[0], pairs, own, sticks)
            if zone is None and isinstance(long.zone, ContactBand):
                zone = _moved_band(long, long.zone, pairs, own)
            if zone is None:
                return []
            result.append(replace(long, zone=zone))
    return result


def _round_zone(
    chart: Chart, pairs: Sequence[PairResult], own: Mask, sticks: bool
) -> ContactEllipse | None:
    """Return the ellipse of contact of nodes after the last step, with the disc that sticks, or
    None if contact has another shape; earlier steps lie inside."""
    last, place = pairs[-1], chart.images(chart.local(pairs[-1].x[own]))
    nodes = np.tile(np.flatnonzero(own), chart.copies)
    closed = np.any([pair.pressure[nodes] > 0.0 for pair in pairs], axis=0)
    if np.count_nonzero(closed) < FEWEST:
        return None
    weight = last.weight[nodes]
    zone = zone_of(place, weight, last.pressure[nodes], closed)
    if zone is None or not sticks:
        return zone
    return with_stick(zone, place, weight, last.state[nodes], last.slip_increment[nodes])


def _moved_band(
    long: ZonedContact, band: ContactBand, pairs: Sequence[PairResult], own: Mask
) -> ContactBand:
    """Return a band with the widths, the length and the place that nodes of a solution give it.

    Ends that are sharp stay, and the ridge stays parallel to itself.
    """
    pair = max(pairs, key=lambda each: float(each.weight[own] @ each.pressure[own]))
    chart = long.charts[0]
    across, along = band.coordinates(chart.images(chart.local(pair.x)))
    force = np.tile(pair.weight * pair.pressure * own, chart.copies)
    force[~band.is_inside(along)] = 0.0
    if not force.any():
        return band
    off = float(force @ across / force.sum())
    half = _half_widths(long.closed, band, along, across - off, force)
    s, ends = band.s, band.ends
    if not any(band.sharp):
        both = _spread(s, band.load * np.gradient(s)), _spread(along, force)
        s, moved = (_moved(places, *both) for places in (s, np.array(ends)))
        ends = float(moved[0]), float(moved[1])
    points, sides = band.at(s)
    on_face = chart.holds(points, chart.slack)
    return replace(
        band,
        points=(points + off * sides)[on_face],
        across=sides[on_face],
        s=s[on_face],
        half=half(s)[on_face],
        load=band.load[on_face],
        ends=(max(ends[0], float(s[on_face].min())), min(ends[1], float(s[on_face].max()))),
    )


def _half_widths(
    closed: bool, band: ContactBand, along: Array, across: Array, force: Array
) -> Callable[[Array], Array]:
    """Return the half-width along a ridge, slightly wider than that of forces (n,) at places.

    Hertz' slices have ∫ p x²/∫ p = a²/4, and along an ellipse a² is a parabola. Around a closed
    ridge it is a constant and a wave.
    """
    (low, high), root = band.ends, np.sqrt(force)

    def basis(s: Array) -> Array:
        share = (s - low) / (high - low)
        if not closed:
            return np.vander(share, 3)
        turn = 2.0 * math.pi * share
        return np.column_stack([np.ones(len(s)), np.cos(turn), np.sin(turn)])

    of_square, *_ = np.linalg.lstsq(
        root[:, None] * basis(along), 4.0 * root * across**2, rcond=None
    )
    return lambda s: np.asarray(WIDER * np.sqrt(np.maximum(basis(s) @ of_square, 0.0)))


def _moved(places: Array, old: tuple[float, float], new: tuple[float, float]) -> Array:
    """Return places (n,) moved from one mean and standard deviation to others, slightly longer."""
    return new[0] + WIDER * new[1] / old[1] * (places - old[0])


def _spread(values: Array, weight: Array) -> tuple[float, float]:
    """Return the mean and the standard deviation of values."""
    mean = float(weight @ values / weight.sum())
    return mean, float(np.sqrt(weight @ (values - mean) ** 2 / weight.sum()))


def _difference(
    before: tuple[Solution, StepResult],
    after: tuple[Solution, StepResult],
    side: PosedInterface,
    weight: Array,
) -> float:
    """Return the relative L2 difference of p and q of an interface, at the nodes of the second
    mesh, with weights (m,) [-]."""
    old, new = (step.pairs[side.name] for _, step in (before, after))
    mesh = as_surface([*before[0].meshes.values()][side.body])
    element, place = located(mesh, new.x, side.part, NEAR * sizes(mesh))
    found = element >= 0
    basis = mesh.basis_at(element[found], place[found])[:, before[0].nodes[side.name]]
    square = (basis @ _tractions(old) - _tractions(new)[found]) ** 2
    of_p, of_q = weight[found] @ square[:, 0], weight[found] @ square[:, 1:].sum(axis=1)
    size = float(weight @ new.size**2)
    return math.sqrt(max(float(of_p), float(of_q)) / size) if size > 0.0 else 0.0


def _tractions(pair: PairResult) -> Array:
    """Return p and the vector σ_t, (m, 4) [stress]."""
    return np.column_stack([pair.pressure, np.einsum("mk,mkd->md", pair.sigma_t, pair.tangent)])
