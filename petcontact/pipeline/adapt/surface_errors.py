"""Error of a solution in space, estimated from the tails of its tractions on panels."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
import scipy

from ...arrays import Array, Index, Mask, scattered, shown
from ...bem.kernels import kernel_for
from ...contact.law_protocol import OPEN, SLIP
from ...given.interface_data import PosedInterface
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.surface_mesh import as_surface
from ...record import Keeping
from ...refinement.panels.cut_directions import directions
from ...refinement.panels.panel_cuts import element_sizes, faded
from ...refinement.panels.tail import FADE, Tails, rim_distance
from ...results.evaluated import displacement_scale
from ...results.records import PairResult, StepResult, step_ends
from ...results.solution import Solution
from ...round_off import TINY
from ..judge.findings import limit_of
from ..judge.first_panels import missed_volume
from ..judge.remainders import DataRemainders, GapRemainder, gap_remainders
from ..judge.thickness import bending_error, held_nodes

OF_SLIP = (2.0, 0.29, 0.42, 1.3)
"""Error of u_t over its tail, for orders 0, 1, 2 and above [-]. The factors are fitted to the runs
of scripts/verify_space."""
SECOND = 9.2
"""Error of u_t on linear contact elements over the square of `OF_SLIP` times its tail, all relative
to u_t [-]. The error falls as h², the tail as h."""
OTHER_FACES = 0.95
"""Error of u_t over the error of u on other faces, before it fades with the distance [-]. With this
factor and `HELD` nine of ten errors from linear faces are at most 0.77 of the estimated ones, from
faces of order 2 at most 0.56 (scripts/verify_space --only others, seed 51, 20 problems, and seed
52, 40 problems). Of a block with one linear panel a face they are as large as estimated."""
HELD = 0.2
"""Error of u_t over the displacement of a half-space under the tails of tractions on other faces
[-]. These move the whole contact."""
EVEN = 0.1
"""Largest variance over the square of its mean of a nearly uniform p, whose error has one sign
everywhere [-]. By Cauchy and Schwarz resultants are then wrong by up to the error of p: 0.24 and
0.32 times it for a ring on a shaft."""


class TailErrors(Keeping):
    """Errors of a solution in space from its tails.

    Parameters
    ----------
    solution : Solution

    Attributes
    ----------
    meshes : list of SurfaceMesh
        Meshes of the bodies.
    """

    def __init__(self, solution: Solution) -> None:
        self.solution, self._sides = solution, solution.posed.interfaces
        self.meshes = [as_surface(mesh) for mesh in solution.meshes.values()]
        self._sizes = [element_sizes(mesh) for mesh in self.meshes]
        self._mirrors = [body.mirrors for body in solution.posed.bodies]

    @functools.cached_property
    def tails(self) -> list[Tails]:
        """Tails of each mesh, at all its nodes."""
        return [
            Tails(mesh, np.arange(mesh.n_nodes), own)
            for mesh, own in zip(self.meshes, self._mirrors, strict=True)
        ]

    @functools.cached_property
    def _gaps(self) -> list[GapRemainder | None]:
        solution = self.solution
        nodes = [solution.nodes[side.name] for side in self._sides]
        return gap_remainders(solution.posed, self.meshes, nodes)

    @functools.cached_property
    def _data(self) -> DataRemainders:
        return DataRemainders(self.solution.posed.bodies, self.meshes)

    def gap_squares(self, step: StepResult, number: int) -> Array:
        """Return the squared error of p from the part of a gap that elements do not represent,
        (n_elements,).

        The gap is that of one interface after a step, the elements are those of its secondary
        [stress² · area].
        """
        gap, side = self._gaps[number], self._sides[number]
        if gap is None or self.solution.kind == "bilateral":
            return np.zeros(self.meshes[side.body].n_elements)
        return self.once((id(step), number), lambda: gap.squares(step.pairs[side.name]))

    def overlaps(self) -> list[list[tuple[Array, float]]]:
        """Return, for each body, where surfaces overlap on open elements, and the width of these
        regions.

        They are those of the failed increment, or of all step ends: see `GapRemainder.overlaps`.
        """
        failed = self.solution.failed
        steps = [failed] if failed is not None else step_ends(self.solution.steps)
        result: list[list[tuple[Array, float]]] = [[] for _ in self.meshes]
        for step, gap, side in (
            (step, *gap_and_side)
            for step in steps
            for gap_and_side in zip(self._gaps, self._sides, strict=True)
        ):
            if gap is not None and self.solution.kind != "bilateral":
                result[side.body].append(gap.overlaps(step.pairs[side.name]))
        return result

    def data_squares(self, step: StepResult) -> list[Array]:
        """Return the squared error of p from the part of given displacements and tractions that
        elements do not represent, (n_elements,) for each body [stress² · area]."""
        result = []
        for number, mesh in enumerate(self.meshes):
            parts = [part for side in self._sides for b, part in side.ends if b == number]
            contact = np.isin(np.arange(mesh.n_elements), mesh.elements_of(*parts))
            result.append(self._data.squares(number, step.step, contact))
        return result

    def directional_squares(self) -> list[Array]:
        """Return the squared tails along both coordinates of elements, (n_elements, 2) for each
        body [stress²].

        They are the sum over step ends for tractions and for the pressure of unresolved gaps.
        """
        ends, result = step_ends(self.solution.steps), list[Array]()
        for number, mesh in enumerate(self.meshes):
            fields = ([*step.bodies.values()][number] for step in ends)
            result.append(np.sum([directions(mesh, body.traction) for body in fields], axis=0))
        for number, (gap, side) in enumerate(zip(self._gaps, self._sides, strict=True)):
            if gap is not None:
                square = np.sum([self.gap_squares(step, number) for step in ends], axis=0)
                result[side.body] += (
                    gap.directional_shares * (square / self._sizes[side.body] ** 2)[:, None]
                )
        return result

    @functools.cached_property
    def shared(self) -> float:
        """Relative error of resultants that finer panels in the contact do not reduce [-].

        It is that of the integrals of given tractions and of volume forces, that of bending and of
        loads inside, and what tractions lack to balance."""
        given = self._data.resultant_error() + missed_volume(self.solution.posed, self.meshes)
        return given + self.of_bodies + self._unbalanced

    @functools.cached_property
    def of_bodies(self) -> float:
        """Relative error of p by the bending of thin bodies, and by what polynomials miss of loads
        inside bodies [-]."""
        each = zip(self.meshes, self.solution.posed.bodies, strict=True)
        bending = max(bending_error(mesh, held_nodes(mesh, body)) for mesh, body in each)
        volumes = [*self.solution.volume_solutions.values()]
        pairs = [
            (step.pairs[side.name], [volume for b in side.bodies if (volume := volumes[b])])
            for step in step_ends(self.solution.steps)
            for side in self._sides
        ]
        shares = [
            sum(volume.missed for volume in own)
            * math.sqrt(pair.weight[pair.size > 0.0].sum() / (pair.weight @ pair.size**2))
            for pair, own in pairs
            if pair.size.any()
        ]
        return bending + max(shares, default=0.0)

    def error(self, apart: float = math.inf) -> tuple[float, float]:
        """Return the relative L2 error of u_t, or of p and q, and the relative error of resultants
        [-].

        They are the largest over all interfaces and step ends. The error of p and q is the norm of
        their tails over their own norm, with weights that fade out towards the rim of a part.

        The error of u_t over ‖u_t‖ is the tail of u in the contact plus the error from other faces.
        The latter follows from `slip_squares` and the imbalance of tractions.

        Resultants have about the product of both errors, plus the imbalance. A uniform p has an
        error of one sign, which resultants then have, too. All errors include the bending of thin
        bodies and what polynomials miss of loads inside.

        `apart` is another estimate of the error of p and q; the smaller one counts.
        """
        if self.solution.kind != "bilateral":
            both = np.max([(0.0, 0.0), *self.by_pair(apart).values()], axis=0)
            return float(both[0]), float(both[1])
        worst = float(self._of_pairs[:, 0].max(initial=0.0))
        if all(_sticks(pair) for step in self.solution.steps for pair in step.pairs.values()):
            return 0.0, worst**2 + self._unbalanced
        own, beside = self.slip_errors()
        error = min(math.hypot(own, beside), 1.0)
        return error, worst * error + self._unbalanced

    def by_pair(self, apart: float = math.inf) -> dict[str, tuple[float, float]]:
        """Return both errors of each interface (`error`), where p is unknown.

        What is wrong with the force of one contact moves that of another one by no more than it is
        itself, and by no larger share. The other p changes by as much.
        """
        worst, even, unseen = self._of_pairs.T
        worst = np.minimum(worst, apart)
        moved = (self._forces_moved * (worst**2 + even + unseen)).max(axis=1, initial=0.0)
        # an overlap between nodes in contact means that p and the forces are too small
        ends = step_ends(self.solution.steps)
        lacks = max((step.residuals.get("pressed", 0.0) for step in ends), default=0.0)
        lacks = lacks if lacks > limit_of("overlap under pressure") else 0.0
        of_p = np.maximum(worst, np.minimum(moved, worst.max(initial=0.0)))
        errors = np.array([np.hypot(of_p, self.of_bodies), moved + self.shared])
        each = zip(self._sides, np.clip(errors, lacks, 1.0).T.tolist(), strict=True)
        return {side.name: (own, of_resultants) for side, (own, of_resultants) in each}

    @functools.cached_property
    def _forces_moved(self) -> Array:
        """The largest share of each interface's force that is moved by all of another one's force,
        at most 1, (n_interfaces, n_interfaces)."""
        result = np.zeros((len(self._sides), len(self._sides)))
        for step in step_ends(self.solution.steps):
            pairs = (step.pairs[side.name] for side in self._sides)
            own = np.array([[max(float(pair.weight @ pair.pressure), TINY)] for pair in pairs])
            result = np.maximum(result, np.minimum(own, own.T) / own)
        return result

    @functools.cached_property
    def _of_pairs(self) -> Array:
        """The largest errors of `_of_pressure` of each interface, (n_interfaces, 3)."""
        ends, numbers = step_ends(self.solution.steps), range(len(self._sides))
        errors = [[self._of_pressure(step, n) for n in numbers] for step in ends]
        return np.asarray(np.reshape(errors, (-1, len(numbers), 3)).max(axis=0, initial=0.0))

    @functools.cached_property
    def _unbalanced(self) -> float:
        """The largest imbalance of the tractions over a force that others balance [-].

        Such a force is at most half of the sum that the imbalance is a share of, and it may be off
        by all that is left."""
        residuals = [step.residuals["equilibrium"] for step in self.solution.steps]
        return 2.0 * float(np.nan_to_num(residuals).max(initial=0.0))

    @property
    def _in_contact(self) -> Mask:
        """Which elements of the only body are in bilateral contact, (n_elements,)."""
        (mesh,) = self.meshes
        return np.isin(np.arange(mesh.n_elements), mesh.element[self.solution.contact.nodes])

    def slip_errors(self) -> tuple[float, float]:
        """Return the relative errors of u_t that come from the contact and from other faces, by
        their tails and the imbalance of the tractions [-]."""
        squares, scale = self.slip_squares(self.solution.last), displacement_scale(self.solution)
        own, others = (math.sqrt(squares[k].sum()) for k in (self._in_contact, ~self._in_contact))
        return own / scale, math.hypot(others / scale, self._unbalanced)

    def _of_pressure(self, step: StepResult, number: int) -> tuple[float, float, float]:
        """Return three relative errors of p and q on an interface after a step [-].

        They are the total error, the total error if p is nearly uniform (else 0), and the error
        from the unresolved gap.
        """
        side = self._sides[number]
        pair, weight = step.pairs[side.name], self.weight(side, step)
        size = float(weight @ pair.size**2)
        if size == 0.0:
            return 0.0, 0.0, 0.0
        rough, mesh = self.gap_squares(step, number), self.meshes[side.body]
        element = mesh.element[self.solution.nodes[side.name]]
        of_p, of_q = (
            np.bincount(element, weight * error**2, mesh.n_elements) for error in _errors(pair)
        )
        square = max(float(np.maximum(of_p, rough).sum()), float(of_q.sum()))
        square += sum(float(squares.sum()) for squares in self.data_squares(step))
        error = math.sqrt(square / size)
        even = error if _is_even(pair, weight) else 0.0
        return error, even, math.sqrt(float(rough.sum()) / size)

    def where(self) -> str:
        """Return where p is most in doubt on the interface with the largest error, in words."""
        ends = step_ends(self.solution.steps)
        every = [(step, number) for step in ends for number in range(len(self._sides))]
        step, number = max(every, key=lambda each: self._of_pressure(*each)[0])
        side, pair = self._sides[number], step.pairs[self._sides[number].name]
        worst = int(np.argmax(self.weight(side, step) * _errors(pair)[0] ** 2))
        element = self.meshes[side.body].element[self.solution.nodes[side.name][worst]]
        size = self._sizes[side.body][element]
        at = shown(pair.x[worst], 4)
        return f"contact {side.name!r} at {at}, where they are {size:.2g} long"

    def are_off_contact(self, estimate: float) -> bool:
        """Return whether more of the squared error of p is that of overlaps on elements without
        nodes in contact than of anything else, by the estimated error of p [-]."""
        worst = 0.0
        for step in step_ends(self.solution.steps):
            for number, side in enumerate(self._sides):
                pair, mesh = step.pairs[side.name], self.meshes[side.body]
                rough = self.gap_squares(step, number).copy()
                rough[mesh.element[self.solution.nodes[side.name][pair.state != OPEN]]] = 0.0
                size = float(self.weight(side, step) @ pair.size**2)
                worst = max(worst, float(rough.sum()) / size if size else 0.0)
        return worst > estimate**2 - worst

    def weight(self, side: PosedInterface, step: StepResult) -> Array:
        """Return the weights of an interface's nodes (m,), faded out towards the rim of the part
        [area]."""
        mesh, nodes = self.meshes[side.body], self.solution.nodes[side.name]
        edges, own = self.solution.gap_edges.get(side.name, []), self._mirrors[side.body]
        return np.asarray(step.pairs[side.name].weight * inside(mesh, side.part, nodes, edges, own))

    def smooth(self) -> list[Mask]:
        """Return which linear panels of secondaries have smooth p and q, (n_elements,) for each
        body.

        All their nodes stick, or all slip, after each step, and they are away from rims of parts.
        There a higher order gains more than smaller panels.
        """
        result = [np.zeros(mesh.n_elements, dtype=bool) for mesh in self.meshes]
        for number, side in enumerate(self._sides):
            mesh, nodes = self.meshes[side.body], self.solution.nodes[side.name]
            element, size = mesh.element[nodes], self._sizes[side.body][mesh.element[nodes]]
            away = rim_distance(mesh, nodes, size, self._mirrors[side.body])
            good = (mesh.order[element] == 1) & (away > size)
            for step in step_ends(self.solution.steps):
                state = step.pairs[side.name].state
                first = scattered(state, element, mesh.n_elements, OPEN)
                good &= (state != OPEN) & (state == first[element])
                seen = np.bincount(
                    element,
                    self.weight(side, step) * _errors(step.pairs[side.name])[0] ** 2,
                    mesh.n_elements,
                )
                good &= (self.gap_squares(step, number) <= seen)[element]
            result[side.body][element] = True
            result[side.body][element[~good]] = False
        return result

    def slip_squares(self, step: StepResult) -> Array:
        """Return the squared error of u_t after a step in bilateral contact, from each element.

        In the contact it is that of the tail of u. Where a whole element slips, u is smooth. There
        the error is at least the next degree, which is extrapolated: its ratio to the tail is the
        ratio of the tail to the degree below. On linear elements the degree below is u_t itself.
        Errors of other faces move the elements that slip. Those from the tails of u fade with the
        distance. Those from the tails of tractions, which are infinite along edges of clamped
        faces, do not fade.

        Returns
        -------
        (n_elements,) array
            [length² · area]
        """
        solution, (mesh,), (tails,) = self.solution, self.meshes, self.tails
        (body,) = step.bodies.values()
        contact, slips, sticks = np.zeros((3, mesh.n_elements), dtype=bool)
        for name, pair in step.pairs.items():
            contact[mesh.element[solution.nodes[name]]] = True
            slips[mesh.element[solution.nodes[name][pair.state == SLIP]]] = True
            sticks[mesh.element[solution.nodes[name][pair.state != SLIP]]] = True
        area = np.bincount(mesh.element, mesh.weight)
        share = max(area[slips].sum() / area[contact].sum(), 1.0 / np.count_nonzero(contact))
        of_u = np.bincount(mesh.element, mesh.weight * tails.errors(body.u, OF_SLIP, 1.0) ** 2)
        of_t = np.bincount(
            mesh.element, mesh.weight * tails.errors(body.traction, (1.0,), 1.0) ** 2
        )
        kernel = kernel_for(mesh, solution.posed.bodies[0].material)
        of_others = (
            OTHER_FACES**2 * faded(mesh, contact) * of_u
            + (HELD * kernel.half_space_compliance * self._sizes[0]) ** 2 * of_t
        )
        linear, higher = contact & (mesh.order == 1), contact & (mesh.order > 1) & ~sticks
        of_u[linear] *= (SECOND / displacement_scale(solution)) ** 2 * of_u[linear].sum()
        if higher.any():
            last = area[higher] * tails.left(body.u, 1)[higher] ** 2
            two = area[higher] * tails.left(body.u, 2)[higher] ** 2
            of_u[higher] = np.maximum(of_u[higher], last * last.sum() / max(two.sum(), TINY))
        return np.where(contact, of_u, share * of_others)


def _is_even(pair: PairResult, weight: Array) -> bool:
    """Return whether p is nearly uniform on an interface."""
    mean = float(weight @ pair.pressure) / float(weight.sum())
    return float(weight @ (pair.pressure - mean) ** 2) < EVEN * mean**2 * float(weight.sum())


def _sticks(pair: PairResult) -> bool:
    """Return whether u_t = 0 is exact.

    Nothing slips, and nothing would slip if σ_t were larger by its estimated error.
    """
    shear = np.linalg.norm(pair.sigma_t, axis=1) + _errors(pair)[1]
    return not np.any(pair.state == SLIP) and bool(np.all(shear < pair.bound))


def _errors(pair: PairResult) -> tuple[Array, Array]:
    assert pair.pressure_error is not None and pair.sigma_t_error is not None
    return pair.pressure_error, pair.sigma_t_error


def inside(
    mesh: BoundaryMesh,
    part: str,
    nodes: Index,
    pressing: Sequence[Array] = (),
    mirrors: Sequence[str] = (),
) -> Array:
    """Return factors (m,) for nodes of a part that fall from 1 to 0 over `FADE` of its size,
    towards its rim, see `rim_distance`, and the points of edges that press on it, see `gap_edges`.

    p may be infinite there, so that no mesh has its exact L2 norm.
    """
    size = float(mesh.weight[mesh.nodes_of(part)].sum()) ** (1.0 / (mesh.dim - 1))
    away = [scipy.spatial.cKDTree(points).query(mesh.x[nodes])[0] for points in pressing]
    distance = np.min([rim_distance(mesh, nodes, FADE * size, mirrors), *away], axis=0)
    return np.asarray(np.minimum(1.0, distance / (FADE * size)) ** 2)
