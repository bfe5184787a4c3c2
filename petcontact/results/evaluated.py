"""Displacement and stress of a solution anywhere in its bodies and on their boundaries."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable, Sequence
from typing import TypeVar

import numpy as np

from ..arrays import Array, Index
from ..bem.particular.volume import VolumeSolution, volume_solution
from ..errors import InputError, in_body
from ..fields.interior import Progress
from ..fields.stress_state import StressState
from ..given.posed import Posed
from ..linalg.nearest import Nearest
from ..mesh.boundary_mesh import BoundaryMesh
from ..model.problem import Problem
from ..record import Keeping, field, record
from ..refinement.panels.data_lines import gap_edges
from ..runtime.hints import Hinted, Listed, demand_name
from ..untyped import ArrayLike
from .body_fields import BodyFields, states_at
from .records import StepResult, WearHistory, step_ends
from .report import Accuracy, Finding, Provenance

T = TypeVar("T")
NOWHERE = ("", "")
"""Body and part of the primary of a pair that has none, as that with an obstacle."""
LEAST_SLIP = 1e-3
"""Smallest slip that errors are compared with, over the displacement by the tractions, or of the
whole body."""


@record
class Evaluated(Keeping, Hinted):
    """What a solve found, and what can be evaluated of it anywhere in the bodies.

    `results.solution.Solution` describes the attributes, since users meet them there.
    """

    problem: Problem
    meshes: dict[str, BoundaryMesh]
    nodes: dict[str, Index]
    sides: dict[str, tuple[str, str]]
    steps: list[StepResult]
    status: str
    reason: str
    timings: dict[str, float]
    accuracy: Accuracy = field(default_factory=Accuracy)
    provenance: Provenance = field(default_factory=Provenance)
    findings: tuple[Finding, ...] = ()
    failed: StepResult | None = None
    wear: WearHistory | None = None
    volumes: dict[str, VolumeSolution | None] | None = None
    coarser: Evaluated | None = field(default=None, repr=False, compare=False)
    undivided: Evaluated | None = field(default=None, repr=False, compare=False)
    paths: tuple[Evaluated, ...] = field(default=(), repr=False, compare=False)
    tracked: Evaluated | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "steps", Listed(self.steps))  # steps["press"]: its increments

    @property
    def tried(self) -> list[StepResult]:
        """The increments that were solved and the one that failed."""
        return self.steps if self.failed is None else [*self.steps, self.failed]

    @property
    def last(self) -> StepResult:
        """The last increment that was solved; the one that failed where none was."""
        return (self.steps or self.tried)[-1]

    def increment(self, step: StepResult | int | None) -> StepResult:
        """An increment, by its number from 1 on; the last one by default.

        Raises
        ------
        InputError
            If there is no such increment.
        """
        if not isinstance(step, int):
            return step or self.last
        if not 0 < step <= len(self.steps):
            raise InputError(f"step: there are increments 1 to {len(self.steps)}, got {step}")
        return self.steps[step - 1]

    def body_fields(
        self, body: str | None = None, step: StepResult | int | None = None
    ) -> BodyFields:
        """Displacement and stress of a body, the first one by default, after an increment, inside
        and on the boundary.

        Raises
        ------
        InputError
            If there is no such body or increment.
        """
        names, after = [each.name for each in self.problem.body], self.increment(step)
        name = names[0] if body is None else body
        demand_name("no body", name, names, "bodies are")
        return self.at_end(
            ("fields", name),
            after,
            lambda: BodyFields(
                self.posed.bodies[names.index(name)],
                self.meshes[name],
                after.bodies[name],
                self.volume_solutions[name],
                self.contact_states(name, after),
                after.shares,
            ),
        )

    def at_end(self, key: Hashable, step: StepResult, compute: Callable[[], T]) -> T:
        """Return what is computed of an increment; of the ends of steps, whose numbers are printed,
        it is kept."""
        if not any(step is each for each in step_ends(self.tried)):
            return compute()
        return self.once((key, id(step)), compute)

    def contact_states(self, body: str, step: StepResult) -> Index:
        """State of the nodes of a body after an increment, (n,): -1 off the contact; numbers of
        several pairs differ.

        On a primary side the states are those of the nearest nodes of the secondary.
        """
        mesh, states = self.meshes[body], np.full(self.meshes[body].n_nodes, -1)
        for k, (name, pair) in enumerate(step.pairs.items()):
            if self.sides[name][0] == body:
                states[self.nodes[name]] = 3 * k + pair.state
            owner, part = self.primaries.get(name, NOWHERE)
            if owner == body:
                nodes = mesh.nodes_of(part)
                nearest = functools.partial(Nearest(pair.x), mesh.x[nodes])
                states[nodes] = 3 * k + pair.state[self.once(("nearest", name), nearest)[:, 0]]
        return states

    @property
    def posed(self) -> Posed:
        """The problem as it was solved, without its config."""
        return self.problem.posed

    @functools.cached_property
    def primaries(self) -> dict[str, tuple[str, str]]:
        """Body and part of the primary side of each interface between bodies, as `sides`."""
        names = [body.name for body in self.posed.bodies]
        return {
            side.name: (names[side.primary[0]], side.primary[1])
            for side in self.posed.interfaces
            if side.primary is not None and not side.is_condition
        }

    @functools.cached_property
    def volume_solutions(self) -> dict[str, VolumeSolution | None]:
        """The particular solutions for volume loads by body."""
        if self.volumes is not None:
            return self.volumes
        return {
            body.name: volume_solution(body, self.meshes[body.name]) for body in self.posed.bodies
        }

    @functools.cached_property
    def gap_edges(self) -> dict[str, list[Array]]:
        """Points (k, d) of each edge that presses on an interface's secondary, by its gap
        [length]."""
        given, bodies = self.problem.body, self.posed.bodies
        return {
            side.name: gap_edges(
                self.meshes[given[side.body].name]
                if hasattr(given[side.body].geometry, "file")  # which need not be here
                else self.posed.outline_of(side.body),
                side.part,
                side.law.gap,
            )
            if side.law.gap is not None and bodies[side.body].has_inside
            else []
            for side in self.posed.interfaces
            if side.law.normal == "unilateral"
        }

    def state_at(
        self,
        points: ArrayLike,
        body: str | None = None,
        step: StepResult | int | None = None,
        part: str | None = None,
        progress: Progress | None = None,
    ) -> StressState:
        """Displacement and stress at points inside a body or on its boundary.

        Inside they come from the representation formula, see `fields.interior.field_at`; on the
        boundary from the traction and the slope of the displacement, see `fields.boundary.stress`.

        Parameters
        ----------
        points : (k, d) array
            [length]
        body : str, optional
            Its name; the first one by default.
        step : StepResult or int, optional
            An increment, or its number from 1 on as in a result file; the last one by default.
        part : str, optional
            Of the boundary, on which all points lie; it says which side of a corner is meant.
        progress : callable, optional
            Called with the share of the elements that is done.

        Raises
        ------
        InputError
            If there is no such body, part or increment, or a point lies outside.

        Examples
        --------
        >>> state = solution.state_at([[4.0, 2.0], [4.0, 0.0]])
        >>> state.u, state.von_mises  # (2, d) [length], (2,) [stress]
        """
        return self.states_at(points, [step], body, part, progress)[0]

    def states_at(
        self,
        points: ArrayLike,
        steps: Sequence[StepResult | int | None],
        body: str | None = None,
        part: str | None = None,
        progress: Progress | None = None,
        outside: float | None = None,
    ) -> list[StressState]:
        """Return `state_at` after each of some increments, which cost little more than one.

        Points outside have the value `outside`, and are refused if it is None.
        """
        fields = [self.body_fields(body, step) for step in steps]
        try:
            return states_at(fields, points, part, progress, outside)
        except InputError as error:
            if len(self.meshes) == 1:
                raise
            name = fields[0].body.name
            others = f"; body=... names another: {', '.join(self.meshes)}" if body is None else ""
            raise InputError(f"{in_body(name)}{error}{others}") from None

    def at(
        self, points: ArrayLike, body: str | None = None, step: StepResult | int | None = None
    ) -> Array:
        """Displacement at points (k, d) of a body, (k, d) [length]; see `state_at`."""
        return self.state_at(points, body, step).u

    def stress_at(
        self,
        points: ArrayLike,
        body: str | None = None,
        step: StepResult | int | None = None,
        part: str | None = None,
    ) -> Array:
        """Return the stress at points (k, d) of a body [stress]; see `state_at`.

        The components are xx, yy, xy (k, 3), in space xx, yy, zz, xy, xz, yz (k, 6); those of
        bodies of revolution are in `StressState`.
        """
        return self.state_at(points, body, step, part).stress

    def von_mises_at(
        self,
        points: ArrayLike,
        body: str | None = None,
        step: StepResult | int | None = None,
        part: str | None = None,
    ) -> Array:
        """Von Mises stress at points (k, d) of a body, (k,) [stress]; see `state_at`."""
        return self.state_at(points, body, step, part).von_mises

    def boundary_state(
        self, body: str | None = None, step: StepResult | int | None = None
    ) -> tuple[Index, StressState]:
        """Return the elements (q,) and the state of points of a body's boundary.

        The points are the nodes and the places at which the stress is most accurate.
        """
        return self.body_fields(body, step).samples

    def stress_on_boundary(
        self, body: str | None = None, step: StepResult | int | None = None
    ) -> Array:
        """Stress (n, 3), in space (n, 6), at the nodes of a body's boundary, components as of
        `stress_at` [stress]."""
        fields = self.body_fields(body, step)
        return fields.on_boundary(fields.mesh.element, fields.mesh.places).stress


def displacement_scale(solution: Evaluated) -> float:
    """Return the norm by which errors of u_t are divided, for one body in bilateral contact.

    It is ‖u_t‖, or U = (∫_Γ|u|²/|Γ| |Γ_C|)^½ times LEAST_SLIP if that is larger. If almost all of
    Γ_C sticks, ‖u_t‖ alone would be almost 0.
    """
    (mesh,), pairs = solution.meshes.values(), solution.last.pairs.values()
    (body,) = solution.last.bodies.values()
    mean_square = float(mesh.weight @ np.sum(body.u**2, axis=1)) / float(mesh.weight.sum())
    whole = np.sqrt(mean_square * sum(float(pair.weight.sum()) for pair in pairs))
    slip = np.sqrt(sum(float(pair.weight @ np.sum(pair.slip**2, axis=1)) for pair in pairs))
    return float(max(slip, LEAST_SLIP * whole)) or 1.0
