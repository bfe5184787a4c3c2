"""What is known along the sides (g, displacements, tractions, loads of the volume): where it is
rough, and elements that resolve it."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Literal

import numpy as np

from ..arrays import Array, Index, Mask
from ..frozen import frozen
from ..geometry.arcs import on_arcs
from ..geometry.outline import Outline, Side
from ..geometry.same_place import SMALLEST
from ..mesh.basis import gauss, lagrange
from ..model.expressions import Value, evaluate
from ..model.loads import VolumeLoads
from ..model.problem import Condition, Contact, Displacement, Problem, Traction
from .expression_features import degree, kinks, samples_of, uniform

ORDER = 5
"""Largest order of an element."""
OWN_SAMPLES = 16
"""Samples of an element besides those of its side that lie in it."""
ARC_SAMPLES = 64
"""Samples of a side, more only where an expression may be narrow."""
MOST_ELEMENTS = 600
"""Elements of one side beyond which data are given up as unresolved."""
MIDDLE = np.array([0.5])
JUMP = -0.75
"""Power of the distance with which slopes change below which data jump."""
PARABOLA = 2.0
"""Degree of polynomials that have one minimum and no narrow places."""


@frozen
class Field:
    """Data of one kind that vary along one side.

    Attributes
    ----------
    kind : str
        "displacement", "traction", "friction bound", ...: errors are relative to the integral of
        all that is of one kind.
    values : callable
        Fractions (n,) of the side to values (n, c).
    switches : (2, k) array
        Places of the side at which the data have a kink or a jump, as fractions, and the powers
        that tell which, see `kinks`.
    samples, sampled : (n,) and (n, c) arrays
        Fractions that show all of it, increasing, and the values there.
    size : float
        Integral of |values| over the boundary, of all data of this kind [unit of the data ·
        length].
    length : float
        Of the side [length].
    degree : float
        Of the polynomial that the values are of the place, infinite where they are none.
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
        """Integral over each element (k,) of |f - I_p f|, relative to `size`; I_p f passes through
        the Gauss points.

        Elements are given by their ends as fractions, increasing and apart.
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
        # samples of the side see what is narrower than an element
        element = np.searchsorted(start, self.samples, side="right") - 1
        mine = (element >= 0) & (self.samples < end[np.maximum(element, 0)])
        element, s = element[mine], self.samples[mine]
        basis = lagrange(order, 2.0 * (s - start[element]) / width[element] - 1.0)
        gap = self.sampled[mine] - np.einsum("bq,qbc->qc", basis, nodal[element])
        by_side = np.bincount(element, self.weights[mine] * np.linalg.norm(gap, axis=1), len(start))
        return np.asarray(np.maximum(by_own, by_side) * self.length / self.size)

    @functools.cached_property
    def weights(self) -> Array:
        """Of the trapezoidal rule on the samples."""
        width = np.diff(self.samples)
        return np.asarray(0.5 * (np.append(width, 0.0) + np.insert(width, 0, 0.0)))


def fields(problem: Problem, outline: Outline) -> list[list[Field]]:
    """Data of each side that vary along it.

    Raises
    ------
    InputError
        As `evaluate`; values that are not finite count as zero (those at nodes are reported when
        they are evaluated there).
    """
    found: list[list[Field]] = [[] for _ in outline.sides]
    sizes: dict[str, float] = {}
    every = []
    for k, (side, offset) in enumerate(zip(outline.sides, outline.offsets, strict=True)):
        at = functools.partial(variables, side, offset)
        for kind, given, values in _conditions(problem, side, at):
            varies = any(callable(v) or isinstance(v, str) for v in given) or (
                side.curvature and kind == "traction"
            )
            every.append((k, side, at, kind, given, values, varies))
    if not any(varies for *_, varies in every):
        return found
    for k, side, at, kind, given, values, varies in every:
        size = float(np.linalg.norm(values(MIDDLE)))
        if varies:
            power = math.inf if side.curvature else max(map(degree, given))
            field = Field(
                kind, values, *_shown(given, side, at, values, power), 1.0, side.length, power
            )
            found[k].append(field)
            size = float(field.weights @ np.linalg.norm(field.sampled, axis=1))
        sizes[kind] = sizes.get(kind, 0.0) + size * side.length
    return [
        [replace(field, size=sizes[field.kind]) for field in row if sizes[field.kind] > 0.0]
        for row in found
    ]


def _shown(
    given: list[Value],
    side: Side,
    at: Callable[[Array], dict[str, Array]],
    values: Callable[[Array], Array],
    power: float,
) -> tuple[Array, Array, Array]:
    """Kinks and jumps, samples, and values there, of expressions and functions together; a function
    shows no text, and a parabola shows all of it on few samples."""
    texts = [value for value in given if isinstance(value, str) and power > PARABOLA]
    samples = [samples_of(text, at) for text in texts] or [
        uniform() if any(map(callable, given)) else np.empty(0)
    ]
    every = np.unique(np.concatenate([np.linspace(0.0, 1.0, ARC_SAMPLES), *samples]))
    sampled, found = values(every), [np.empty((2, 0))]
    far = float(np.abs([side.start, side.end]).max()) / side.length
    if len(every) > ARC_SAMPLES:
        for c, column in enumerate(sampled.T):
            one = functools.partial(_component, values, c)
            found.append(np.stack(kinks(one, every, column, far)))
    return np.concatenate(found, axis=1), every, sampled


NEAR = 1e-3
"""Of a side, between points that show a slope: round-off and the fourth power leave 1e-9 of it."""


def _component(values: Callable[[Array], Array], number: int, at: Array) -> Array:
    return np.asarray(values(at)[:, number])


def gap_switches(gap: Value, side: Side, offset: float) -> tuple[Array, Array]:
    """Places inside a side at which a gap has a kink, and at which it jumps, as fractions."""
    if not (callable(gap) or isinstance(gap, str)):
        return np.empty(0), np.empty(0)
    at = functools.partial(variables, side, offset)
    values = functools.partial(_values, [gap], "gap", at, False)
    power = math.inf if side.curvature else degree(gap)
    (place, power), *_ = _shown([gap], side, at, values, power)
    return place[power >= JUMP], place[power < JUMP]


def gap_slope(gap: Value, side: Side, offset: float, end: int) -> float:
    """Of a gap along a side, at its start (0) or end (1), over the largest gap per length of the
    side; of a parabola through three points, which is exact to the fourth order where it is even.
    """
    at = functools.partial(variables, side, offset)
    near = NEAR * np.arange(3)
    places = np.concatenate([1.0 - near if end else near, np.linspace(0.0, 1.0, 17)])
    values = _values([gap], "gap", at, False, places)[:, 0]
    slope = (-3.0 * values[0] + 4.0 * values[1] - values[2]) / (2.0 * NEAR)
    return float(abs(slope) / (np.abs(values).max() or 1.0))


def variables(side: Side, offset: float, at: Array) -> dict[str, Array]:
    """Variables of expressions at fractions (n,) of a side."""
    (x, y), (nx, ny) = side.point(at).T, _normals(side, at).T
    return {"x": x, "y": y, "nx": nx, "ny": ny, "s": offset + side.length * at}


def _normals(side: Side, at: Array) -> Array:
    straight = side.curvature == 0.0
    normal = on_arcs(
        side.start, side.end, side.half_angle, np.zeros(1) if straight else 2.0 * at - 1.0
    )[1]
    return np.broadcast_to(normal, (len(at), 2)) if straight else normal


def _conditions(
    problem: Problem, side: Side, at: Callable[[Array], dict[str, Array]]
) -> Iterator[tuple[str, list[Value], Callable[[Array], Array]]]:
    """Kind, components and values of what is known on a side, but for arrays, which belong to the
    nodes of one mesh."""
    for number, condition in enumerate(problem.boundary):
        if condition.part != side.part:
            continue
        key = f"boundary[{number}] ({condition.part})"
        for kind, given, normal in given_data(condition):
            if not any(isinstance(value, tuple) for value in given):
                yield kind, given, functools.partial(_values, given, key, at, normal and side)
    # the tractions of particular solutions are about as rough as what they are for
    for key, given in _in_volume(problem.loads):
        yield (
            key,
            given,
            functools.partial(
                _values, given, key, lambda s: {name: at(s)[name] for name in "xy"}, False
            ),
        )


def _in_volume(loads: VolumeLoads | None) -> Iterator[tuple[str, list[Value]]]:
    """Keys and components of loads that vary in the volume."""
    if loads is not None:
        every = [
            ("temperature", (loads.temperature,)),
            ("force", loads.force or ()),
            ("acceleration", loads.acceleration or ()),
        ]
        yield from (
            (f"loads.{key}", list(given))
            for key, given in every
            if any(isinstance(v, str) for v in given)
        )


def given_data(condition: Condition) -> Iterator[tuple[str, list[Value], bool]]:
    """Kinds of data of a condition, their components, and whether they are along the normal."""
    if isinstance(condition, Displacement):
        yield (
            "displacement",
            [component for component in condition.value if component != "free"],
            False,
        )
        yield "traction", list(condition.traction or ()), False
    elif isinstance(condition, Traction):
        if condition.pressure is not None:
            yield "traction", [condition.pressure], True
        else:
            yield "traction", list(condition.value or ()), False
    elif isinstance(condition, Contact):
        given = (
            ("friction bound", condition.friction_bound),
            ("gap", condition.gap or None),
            ("friction coefficient", condition.friction_coefficient),
        )
        yield from ((kind, [value], False) for kind, value in given if value is not None)


def _values(
    given: list[Value],
    key: str,
    at: Callable[[Array], dict[str, Array]],
    along_normal: Side | Literal[False],
    fractions: Array,
) -> Array:
    """Values (n, c) of components at fractions (n,) of a side, times its normal if it is given; 0
    where not finite."""
    names = at(fractions)
    columns = [evaluate(value, names, len(fractions), key, otherwise=0.0) for value in given]
    values = np.column_stack(columns or [np.zeros(len(fractions))])
    return (
        values if along_normal is False else np.asarray(values * _normals(along_normal, fractions))
    )


def resolved(
    breaks: Array, orders: Index, data: list[Field], tolerance: float, least: float = SMALLEST
) -> tuple[Array, Index, float]:
    """Elements of a side with orders and cuts enough for its data.

    Parameters
    ----------
    breaks : (n + 1,) array
        Fractions of the side.
    orders : (n,) array
    data : list of Field
        Of the side.
    tolerance : float
        Defect that an element may have [-].
    least : float, optional
        Fraction of the side that no element is smaller than.

    Returns
    -------
    breaks, orders : arrays
        The same elements with orders raised up to ORDER or, where that is not enough, cut in
        halves.
    missed : float
        Largest defect that is left above the tolerance, 0 where there is none.
    """
    missed = 0.0
    for field in data:
        breaks, orders, left = _resolved(breaks, orders, field, tolerance, least)
        missed = max(missed, left)
    return breaks, orders, missed


def _resolved(
    breaks: Array, orders: Index, field: Field, tolerance: float, least: float
) -> tuple[Array, Index, float]:
    done: list[tuple[Array, Array, Index]] = []
    start, end, order = breaks[:-1], breaks[1:], orders
    count, missed = 0, 0.0
    while len(start):
        wanted, left = _order_enough(field, start, end, order, tolerance)
        ready = wanted >= 0
        hopeless: Mask = ~ready & (
            (end - start < 2.0 * least) | (count + len(start) > MOST_ELEMENTS)
        )
        if hopeless.any():
            missed = max(missed, float(left[hopeless].max()))
        stays = ready | hopeless
        done.append((start[stays], end[stays], np.where(ready, wanted, ORDER)[stays]))
        count += int(np.count_nonzero(stays))
        start, end, order = start[~stays], end[~stays], order[~stays]
        middle = 0.5 * (start + end)
        start, end = (
            np.column_stack([start, middle]).ravel(),
            np.column_stack([middle, end]).ravel(),
        )
        order = np.repeat(order, 2)
    starts, _, all_orders = (np.concatenate(column) for column in zip(*done, strict=True))
    place = np.argsort(starts)
    return np.append(starts[place], breaks[-1]), all_orders[place].astype(np.int64), missed


def _order_enough(
    field: Field, start: Array, end: Array, order: Index, tolerance: float
) -> tuple[Index, Array]:
    """The least order of each element, not below its own, that resolves the data, or -1; and the
    defect it leaves."""
    result, defect = np.full(len(order), -1), np.full(len(order), np.inf)
    for p in range(int(order.min()), ORDER + 1):
        open_ = np.flatnonzero((result < 0) & (order <= p))
        if len(open_) == 0:
            continue
        defect[open_] = field.defects(start[open_], end[open_], p) if p < field.degree else 0.0
        result[open_[defect[open_] <= tolerance]] = p
    return result, defect
