"""The numbers of a solution that are printed and written: this list, and no other one.

Each has a place where it is a maximum, and a unit. `number_errors` adds the errors.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from ...arrays import Array, Index, shown
from ...contact.friction_law import lengths
from ...contact.law_protocol import OPEN
from ...fields.boundary.maxima import largest_length, maximum
from ...given.conditions import Displacement, Periodic, Symmetry
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import replace
from ...round_off import EPS, SINGLE, SOLVED, WRITTEN
from ..contact_zones import areas, hidden_slip
from ..evaluated import NOWHERE, Evaluated
from ..records import PairResult, StepResult
from ..strength.singular_places import singular_places
from ..strength.strengths import beside, fits, growth
from .number import DISPLACEMENT, ENERGY, Key, Number
from .peaks import stress_peaks

HELD = (Displacement, Symmetry, Periodic)
"""Conditions that hold a part."""


class _OfStep:
    """The numbers at the end of a step."""

    def __init__(
        self,
        solution: Evaluated,
        increments: list[StepResult],
        compared: bool,
    ) -> None:
        self._solution, self._increments, self._step = solution, increments, increments[-1]
        self._compared = compared
        self._fits = fits(solution, self._step)
        # bodies of revolution without torsion cannot turn
        self._motions = next(iter(solution.meshes.values())).motions
        turns = self._motions.planes
        self._units = {"length", "force", *(("rad", "moment") if turns else ())}
        self._acting = {name: resultant(pair) for name, pair in self._step.pairs.items()}
        self._touched = {side.obstacle for side in solution.posed.interfaces}

    def _number(
        self, name: str, of: str, value: Any, unit: str, scale: float = 0.0, **more: Any
    ) -> Number:
        """Return a number, of a vector the components along which bodies may move: no sum of radial
        tractions is a force. Components that are round-off are 0."""
        value = np.atleast_1d(value)
        if unit in ("force", "length") and len(value) > 1:
            value = value[[*self._motions.along]]
        value = np.where(np.abs(value) > SOLVED * scale, value, 0.0)
        return Number(name, of, self._step.step, self._step.cycle, value, unit, scale, **more)

    def all(self) -> Iterator[Number]:
        """Yield the numbers of pairs, of obstacles, and of bodies."""
        for name in self._step.pairs:
            yield from self._resultants(name)
            yield from self._of_contact(name)
        yield from self._of_obstacles()
        strengths = list(self._strengths())
        rising = sorted(strengths, key=lambda each: np.nan_to_num(each.size))
        largest = {each.key: each for each in rising}  # the last of those with one name
        yield from (largest[key] for key in dict.fromkeys(each.key for each in strengths))
        yield from self._displaced()
        yield from self._held()

    def _resultants(self, name: str) -> Iterator[Number]:
        pair, (force, moment) = self._step.pairs[name], self._acting[name]
        for word, value, unit, scale in (
            ("force", pair.force, "force", force),
            ("moment", pair.moment, "moment", moment),
            ("force on the primary", pair.force_primary, "force", force),
            ("moment on the primary", pair.moment_primary, "moment", moment),
        ):
            if value is not None and unit in self._units:
                yield self._number(word, name, value, unit, scale)

    def _of_contact(self, name: str) -> Iterator[Number]:
        """Yield the largest tractions and slip, the areas, the energy and the wear of a pair."""
        pair = self._step.pairs[name]
        closed = pair.state != OPEN
        pressure = np.where(closed, pair.pressure, 0.0)
        yield self._largest_traction("largest p", name, pressure, "pressure", np.inf)
        contact = contact_of(self._solution, self._step, name, self._moving(name))
        hidden, far, taken, bound = hidden_slip(*contact)
        q = lengths(pair.sigma_t) * closed
        left = max(0.0, bound - float(q.max()))
        yield self._largest_traction("largest q", name, q, "shear", pair.bound, left)
        for word, (size, alone) in zip(("contact area", "slipping"), areas(*contact), strict=True):
            left = alone + hidden * (word == "slipping")
            yield self._number(word, name, size, "area", float(pair.weight.sum()), alone=left)
        yield from self._of_slip(name, far, taken)
        if pair.wear is not None:
            yield self._number("worn volume", name, pair.worn_volume.sum(), "volume")
            yield self._largest("worn depth", name, pair.wear.sum(axis=1), "length")

    def _of_slip(self, name: str, far: float, taken: float) -> Iterator[Number]:
        """Yield the largest slip and the energy, which may be off by what hidden slip takes."""
        pair, (force, _) = self._step.pairs[name], self._acting[name]
        body, closed = self._solution.sides[name][0], pair.state != OPEN
        # what rigid motions and coordinates leave by round-off is no slip, and its work no energy
        moved = float(np.abs(self._step.bodies[body].u).max(initial=0.0))
        moved += float(np.abs(pair.x).max(initial=0.0)) * EPS / SOLVED
        # nor is what a method leaves of the law of friction
        far = max(far, moved * (rest := self._step.residuals.get("tangential", 0.0)))
        yield self._largest("largest slip", name, lengths(pair.slip) * closed, "length", moved, far)
        spent, left = (
            sum(getattr(each.pairs[name], key) for each in self._increments)
            for key in ("dissipated", "dissipated_error")
        )
        left = np.nan_to_num(left) + taken + moved * force * rest
        yield self._number(ENERGY, name, spent, "moment", moved * force, alone=left)

    def _moving(self, name: str) -> PairResult:
        """Return the result of a pair with the slip of the last increment in which it slipped: a
        step that moves nothing has the edges of stick of the one before."""
        pair = self._step.pairs[name]
        least = WRITTEN * float(np.abs(pair.slip).max(initial=0.0))
        if np.abs(pair.slip_increment).max(initial=0.0) > least:
            return pair
        before = itertools.takewhile(lambda each: each is not self._step, self._solution.steps)
        slid = (each.pairs[name].slip_increment for each in reversed(list(before)))
        moved = next((each for each in slid if np.abs(each).max(initial=0.0) > least), None)
        return pair if moved is None else replace(pair, slip_increment=moved)

    def _largest(
        self, word: str, of: str, values: Array, unit: str, scale: float = 0.0, alone: float = 0.0
    ) -> Number:
        """Return the maximum of a function on elements."""
        body, _ = self._solution.sides[of]
        top, place, _ = maximum(self._solution.meshes[body], self._solution.nodes[of], values)
        return self._number(word, of, top, unit, scale, place=place, alone=alone)

    def _largest_traction(
        self, word: str, of: str, values: Array, key: str, bound: Array | float, alone: float = 0.0
    ) -> Number:
        """Return the maximum of a traction that may have no bound, at most what friction allows."""
        near = beside(self._solution, self._step, of, key, values)
        mesh, nodes = self._solution.meshes[self._solution.sides[of][0]], self._solution.nodes[of]
        kept = values if near.endless is not None else np.where(near.hidden, 0.0, values)
        top, place, _ = maximum(mesh, nodes, kept, bound)
        if near.endless is None or not top > 0.0:
            at = self._solution.sides[of][0], place[None]
            alone = max(alone, top * float(growth(self._solution, self._step, *at)[0, 0]))
            return self._number(word, of, top, "stress", place=place, alone=alone)
        return self._number(word, of, top, "stress", place=near.endless, error=np.inf, alone=alone)

    def _strengths(self) -> Iterator[Number]:
        """Yield K of each place without a bound, in the order of their exponents; of edges between
        the same sides the largest, as there are more of them on finer meshes."""
        for place, found in itertools.groupby(self._fits, key=lambda each: each.place):
            modes = sorted(found, key=lambda each: each.power)
            where = shown(np.where(np.abs(place.x) < SINGLE * place.size, 0.0, place.x), 6)
            at = "" if place.is_edge else f" at {where}"
            for k, fit in enumerate(modes, 1):
                own = f"_{fit.mode.name}" if fit.is_crack else f"_{k}" * (len(modes) > 1)
                yield Number(
                    f"K{own}{at} ({place.sides})",
                    place.body,
                    self._step.step,
                    self._step.cycle,
                    np.array([fit.unit * fit.value]),
                    f"stress length^{-fit.power:.4g}",
                    place=place.x,
                    beside=None if place.is_edge else place.x,
                    exponent=fit.mode.exponent.real,
                    alone=0.0 if self._compared else fit.unit * fit.spread,
                )

    def _of_obstacles(self) -> Iterator[Number]:
        force, moment = np.sum([(0.0, 0.0), *self._acting.values()], axis=0).tolist()
        for k, given in enumerate(self._solution.problem.obstacles_at[self._step.step]):
            obstacle, moved = self._step.obstacles[given.name], given.motions(self._motions)
            for word, value, unit, scale, by in (
                ("moved", obstacle.displacement, "length", 0.0, moved[: self._motions.dim]),
                ("turned", obstacle.rotation, "rad", 0.0, moved[self._motions.dim :]),
                ("held by", obstacle.force, "force", force, ["free"]),
                ("held by moment", obstacle.moment, "moment", moment, ["free"]),
            ):
                if unit in self._units and k in self._touched:
                    error = 0.0 if all(isinstance(each, float) for each in by) else np.nan
                    yield self._number(word, given.name, value, unit, scale, error=error)

    def _displaced(self) -> Iterator[Number]:
        """Yield the largest displacement of each body; it may lie between nodes, as at corners."""
        for name, result in self._step.bodies.items():
            mesh = self._solution.meshes[name]
            size, x, element = largest_length(mesh, result.u)
            location = {"place": x, "part": mesh.part_names[mesh.part[element]]}
            yield self._number(DISPLACEMENT, name, size, "length", **location)

    def _held(self) -> Iterator[Number]:
        """Yield the forces and moments on the parts that supports hold."""
        for body in self._solution.posed.bodies:
            mesh, result = self._solution.meshes[body.name], self._step.bodies[body.name]
            acting = float(mesh.weight @ np.abs(result.traction).max(axis=1))
            # a rigid motion leaves round-off of E times displacement over the size of the body
            rough = float(np.abs(result.u).max() / np.ptp(mesh.x, axis=0).max())
            rough *= body.material.young_modulus * float(mesh.weight.sum())
            conditions = body.conditions[self._step.step - 1].items()
            for part in (part for part, each in conditions if isinstance(each, HELD)):
                rows = mesh.nodes_of(part)
                held = {"force": (mesh.weight[rows] @ result.traction[rows], 1.0)}
                if mesh.components > mesh.dim:
                    far = float(np.abs(mesh.x).max())
                    held["moment"] = np.asarray(result.moment_on(mesh, part)), far
                for unit, (value, arm) in held.items():
                    one = self._number(
                        f"{unit} on {part}", body.name, value, unit, max(acting, rough) * arm
                    )
                    yield replace(one, scale=acting * arm)


def contact_of(
    solution: Evaluated, step: StepResult, name: str, pair: PairResult
) -> tuple[BoundaryMesh, Index, PairResult, float, list[int]]:
    """Return the mesh and the nodes of a pair, a result of it, its compliance, and the elements of
    the secondary at places where stress has no bound, as for `areas`."""
    body = solution.sides[name][0]
    materials = {each.name: each.material for each in solution.problem.body}
    owners = {body, solution.primaries.get(name, NOWHERE)[0]} & set(materials)
    compliance = sum(
        (1.0 - materials[each].plane_strain_ratio) / materials[each].shear_modulus
        for each in owners
    )
    places = singular_places(solution, step)[body]
    elements = [element for place in places for element in place.elements]
    return solution.meshes[body], solution.nodes[name], pair, compliance, elements


def resultant(pair: PairResult) -> tuple[float, float]:
    """Return the sum of the sizes of all forces of a pair, and the largest moment of that sum.

    The moment is the sum times the largest coordinate of the nodes.
    """
    size = float(pair.weight @ pair.size)
    return size, size * float(np.abs(pair.x).max(initial=0.0))


End = tuple[int, int]
"""Numbers of a step and of a cycle, at whose end numbers are."""


def ends_of(solution: Evaluated) -> dict[End, StepResult]:
    """The last increments of all steps."""
    return {(step.step, step.cycle): step for step in solution.steps}


def end_of(solution: Evaluated, number: Number) -> StepResult:
    """The last increment of the step that a number belongs to."""
    return ends_of(solution)[number.step, number.cycle]


def by_key(other: Evaluated, ends: Collection[End] | None = None) -> dict[Key, Number]:
    """The numbers of another mesh or path at some ends, by default at all, with which those of a
    solution are compared."""
    return {each.key: each for each in numbers_of(other, False, True, ends)}


def numbers_of(
    solution: Evaluated,
    peaks: bool = True,
    compared: bool = False,
    ends: Collection[End] | None = None,
) -> list[Number]:
    """Return the numbers at the ends of steps, by default of all, without errors.

    The largest stresses are among them if `peaks` is true. Of numbers that are only compared what
    fits of K leave uncertain is not looked for.
    """
    # the increments of each step, in the first cycle and in later ones
    by_step = itertools.groupby(solution.steps, key=lambda step: (step.step, step.cycle))
    steps = [list(some) for at, some in by_step if ends is None or at in ends]
    own = (_OfStep(solution, increments, compared).all() for increments in steps)
    numbers = itertools.chain.from_iterable(own)
    return [*numbers, *(stress_peaks(solution, [each[-1] for each in steps]) if peaks else [])]
