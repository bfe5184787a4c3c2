"""Given data along the sides, where they are rough, and elements that resolve them.

The data are g, displacements, tractions and loads of the volume.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ..arrays import Array, Index, Mask
from ..geometry.outline import Outline
from ..geometry.same_place import SMALLEST
from ..given.body_data import Body, Loads
from ..given.conditions import Condition, Contact, Term
from ..given.features import MOST_FEATURES
from ..given.lines import OWN_SAMPLES, Line, lines_of
from ..given.sites import Sites
from ..mesh.basis import gauss, lagrange
from ..record import record, replace
from .levels import SLIP_LADDER

ORDER = max(level.grading.order for level in SLIP_LADDER.levels)
"""Largest order of an element: that of the finest levels."""


@record
class SideData:
    """Data of one kind that vary along one side.

    Attributes
    ----------
    kind : str
        "displacement", "traction", "friction bound", ...: errors are relative to the integral over
        all data of one kind.
    values : callable
        Function from fractions (n,) of the side to values (n, c).
    switches : (2, k) array
        Fractions at which the data have a kink or a jump, and the powers that distinguish these,
        see `kinks`.
    samples, sampled : (n,) and (n, c) arrays
        Increasing fractions that resolve the data, and the values there.
    size : float
        Integral of |values| over the boundary, of all data of this kind [unit of the data ·
        length].
    length : float
        Length of the side [length].
    degree : float
        Degree of the values as a polynomial of the fraction, infinite if they are none.
    """

    kind: str
    values: Callable[[Array], Array]
    switches: Array
    samples: Array
    sampled: Array
    size: float
    length: float
    degree: float = math.inf

    def defects(self, start: Array, end: Array, order: int) -> Array:
        """Return the integral of |f - I_p f| over each element (k,), relative to `size` [-].

        I_p f interpolates f at the Gauss points. `start` and `end` are the ends of the elements as
        fractions, increasing and apart.
        """
        width = end - start
        xi = gauss(order)[0]
        at_nodes = self.values((start[:, None] + 0.5 * width[:, None] * (1.0 + xi)).ravel())
        nodal = at_nodes.reshape(len(start), order + 1, -1)
        own = (np.arange(OWN_SAMPLES) + 0.5) / OWN_SAMPLES
        inside = self.values((start[:, None] + width[:, None] * own).ravel()).reshape(
            len(start), OWN_SAMPLES, -1
        )
        gap = inside - np.einsum("bq,ebc->eqc", lagrange(order, 2.0 * own - 1.0), nodal)
        by_own = np.sqrt(np.einsum("eqc,eqc->eq", gap, gap)).mean(axis=1) * width
        # the samples of the side show features that are narrower than an element
        element = np.searchsorted(start, self.samples, side="right") - 1
        within = (element >= 0) & (self.samples < end[np.maximum(element, 0)])
        element, s = element[within], self.samples[within]
        basis = lagrange(order, 2.0 * (s - start[element]) / width[element] - 1.0)
        gap = self.sampled[within] - np.einsum("bq,qbc->qc", basis, nodal[element])
        by_side = np.bincount(
            element, self.weights[within] * np.linalg.norm(gap, axis=1), len(start)
        )
        return np.asarray(np.maximum(by_own, by_side) * self.length / self.size)

    @functools.cached_property
    def weights(self) -> Array:
        """Weights of the trapezoidal rule on the samples [-]."""
        width = np.diff(self.samples)
        return np.asarray(0.5 * (np.append(width, 0.0) + np.insert(width, 0, 0.0)))


def fields(body: Body, outline: Outline) -> list[list[SideData]]:
    """Return the data of each side that vary along it, at the beginning.

    Raises
    ------
    InputError
        As `Given.values`. Values that are not finite count as zero here; those at nodes are
        reported when they are evaluated there.
    """
    return varying_data(body.boundary, body.volume, outline)


def varying_data(
    conditions: Sequence[Condition], loads: Loads, outline: Outline
) -> list[list[SideData]]:
    """Return the data of conditions and of volume loads that vary along each side, see `fields`."""
    result: list[list[SideData]] = [[] for _ in outline.sides]
    sizes: dict[str, float] = {}
    data = []
    for k, line in enumerate(lines_of(outline)):
        for kind, term in _terms(conditions, loads, line):
            varies = term.varies or (line.side.curvature and kind == "traction")
            data.append((k, line, kind, term, varies))
    if not any(varies for *_, varies in data):
        return result
    for k, line, kind, term, varies in data:
        values = functools.partial(_values, term, line)
        size, length = float(np.linalg.norm(values(np.array([0.5])))), line.side.length
        if varies:
            features = line.features(term.given, values)
            field = SideData(kind, values, *features, 1.0, length, line.degree(term.given))
            result[k].append(field)
            size = float(field.weights @ np.linalg.norm(field.sampled, axis=1))
        sizes[kind] = sizes.get(kind, 0.0) + size * length
    return [
        [replace(field, size=sizes[field.kind]) for field in row if sizes[field.kind] > 0.0]
        for row in result
    ]


def _terms(conditions: Sequence[Condition], loads: Loads, line: Line) -> Iterator[tuple[str, Term]]:
    """Yield the given data on a side, by kind.

    One value a node is left out, since it belongs to one mesh.
    """
    for condition in conditions:
        if condition.part == line.side.part:
            yield from ((kind, term) for kind, term in rough_data(condition) if term.everywhere)
    # the tractions of a particular solution are about as rough as its load
    for key in ("temperature", "force", "acceleration"):
        data = getattr(loads, key)
        term = Term("load", data if isinstance(data, tuple) else (data,))
        if term.varies:
            yield f"loads.{key}", term


def rough_data(condition: Condition) -> Iterator[tuple[str, Term]]:
    """Yield each kind of data of a condition whose roughness elements resolve."""
    for term in condition.terms:
        yield term.kind, replace(term, data=tuple(term.given))
    if isinstance(condition, Contact):
        law = condition.law
        given = (
            ("friction bound", law.friction_bound),
            ("gap", None if law.gap is None or law.gap.is_zero else law.gap),
            ("friction coefficient", law.friction_coefficient),
            ("gap", law.interference),
            ("gap", law.clearance),
        )
        yield from ((kind, Term(kind, (datum,))) for kind, datum in given if datum is not None)


def _values(term: Term, line: Line, fractions: Array) -> Array:
    """Return values (n, c) of a term at fractions (n,) of a side, 0 where not finite."""
    if not term.data:
        return np.zeros((len(fractions), 1))
    sites = line.sites(fractions)
    in_volume = term.kind == "load"
    return term.near(Sites(sites.x) if in_volume else sites, line.normals(fractions))


def resolved(
    breaks: Array, orders: Index, data: list[SideData], tolerance: float, least: float = SMALLEST
) -> tuple[Array, Index, float]:
    """Return the elements of a side, with orders raised and elements cut until they resolve its
    data.

    Parameters
    ----------
    breaks : (n + 1,) array
        Fractions of the side.
    orders : (n,) array
    data : list of SideData
        Data of the side.
    tolerance : float
        Accepted defect of an element [-].
    least : float, optional
        Least size of an element, as a fraction of the side.

    Returns
    -------
    breaks, orders : arrays
        The elements. Orders are raised up to ORDER; if that is not enough, elements are halved.
    missed : float
        Largest remaining defect above the tolerance, or 0.
    """
    missed = 0.0
    for field in data:
        breaks, orders, left = _resolved(breaks, orders, field, tolerance, least)
        missed = max(missed, left)
    return breaks, orders, missed


def _resolved(
    breaks: Array, orders: Index, field: SideData, tolerance: float, least: float
) -> tuple[Array, Index, float]:
    done: list[tuple[Array, Array, Index]] = []
    start, end, order = breaks[:-1], breaks[1:], orders
    count, missed = 0, 0.0
    while len(start):
        wanted, left = _order_enough(field, start, end, order, tolerance)
        ready = wanted >= 0
        hopeless: Mask = ~ready & (
            (end - start < 2.0 * least) | (count + len(start) > MOST_FEATURES)
        )
        if hopeless.any():
            missed = max(missed, float(left[hopeless].max()))
        stays = ready | hopeless
        done.append((start[stays], end[stays], np.where(ready, wanted, ORDER)[stays]))
        count += int(np.count_nonzero(stays))
        start, end, order = start[~stays], end[~stays], order[~stays]
        middle = 0.5 * (start + end)
        start = np.column_stack([start, middle]).ravel()
        end = np.column_stack([middle, end]).ravel()
        order = np.repeat(order, 2)
    starts, _, all_orders = (np.concatenate(column) for column in zip(*done, strict=True))
    sorting = np.argsort(starts)
    return np.append(starts[sorting], breaks[-1]), all_orders[sorting].astype(np.int64), missed


def _order_enough(
    field: SideData, start: Array, end: Array, order: Index, tolerance: float
) -> tuple[Index, Array]:
    """Return the least order of each element that resolves the data, or -1, and its defect.

    The order is not below the present one.
    """
    result, defect = np.full(len(order), -1), np.full(len(order), np.inf)
    for p in range(int(order.min()), ORDER + 1):
        open_ = np.flatnonzero((result < 0) & (order <= p))
        if len(open_) == 0:
            continue
        defect[open_] = field.defects(start[open_], end[open_], p) if p < field.degree else 0.0
        result[open_[defect[open_] <= tolerance]] = p
    return result, defect
