"""The error of a solution in space from the tails of its tractions on panels."""

from __future__ import annotations

import functools
import math

import numpy as np

from ...arrays import Array, Index, Mask
from ...bem.kernels import kernel_for
from ...contact.law_protocol import OPEN, SLIP
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.surface_mesh import as_surface
from ...model.interfaces import PosedInterface
from ...refinement.panels.axes import directions
from ...refinement.panels.marks import element_sizes, faded
from ...refinement.panels.tail import FADE, TINY, Tails, rim_distance
from ...results.records import PairResult, StepResult, step_ends
from ...results.solution import Solution
from ..judge.findings import limit_of
from ..judge.remainders import DataRemainders, GapRemainder, gap_remainders
from ..judge.thickness import bending_error
from .difference import displacement_scale

OF_SLIP = (2.0, 0.29, 0.42, 1.3)
"""Error of u_t over its tail, for order 0, 1, 2, and above; these factors are fitted to the runs of
scripts/verify_space."""
LEAST = (0.26, 0.42)
"""The next degrees over the last one, for order 2 and 3, of x ln x, which displacements are beside
edges of loaded faces: Legendre coefficients fall as k^-3."""
SECOND = 9.2
"""Of linear elements in contact, over the square of that error relative to u_t: h² as against the h
of their tail."""
BESIDE = 0.41
"""The error of u_t over that of u on other faces, before it fades with the distance."""
HELD = 0.085
"""Error of u_t over what the tails of tractions on other faces would move a half space by; they
move the whole contact."""
UNEVEN = 1.4
"""Error of u_t over what tractions lack of equilibrium."""
LINEAR = 1.65
"""Factor on both of them, of linear panels: what bends them is of the next order, and not in their
tails."""
MOST = (1.3, 2.5)
"""The same of panels of order 2 and 3, enough whatever the order below gives: where that is poor,
the step from it says little of the next one."""
EVENLY, EVEN = 0.4, 0.1
"""Error of resultants over that of a nearly even p, whose panels are all off alike: .24 and .32 of
a ring on a shaft; and the variance of such a p over the square of its mean."""
SURELY = 2.0
"""Estimated errors of σ_t by which it lies below the friction bound where nothing slips."""


class TailErrors:
    """Errors of a solution in space from its tails.

    Parameters
    ----------
    solution : Solution

    Attributes
    ----------
    meshes : list of SurfaceMesh
        Of the bodies.
    """

    def __init__(self, solution: Solution) -> None:
        self.solution, self._sides = solution, solution.problem.interfaces
        self.meshes = [as_surface(mesh) for mesh in solution.meshes.values()]
        self._sizes = [element_sizes(mesh) for mesh in self.meshes]
        self._of_gaps = dict[tuple[int, int], Array]()

    @functools.cached_property
    def tails(self) -> list[Tails]:
        """Of the meshes, at all their nodes."""
        return [Tails(mesh, np.arange(mesh.n_nodes)) for mesh in self.meshes]

    @functools.cached_property
    def _gaps(self) -> list[GapRemainder | None]:
        solution = self.solution
        nodes = [solution.nodes[side.name] for side in self._sides]
        return gap_remainders(solution.problem, self.meshes, nodes)

    @functools.cached_property
    def _data(self) -> DataRemainders:
        return DataRemainders(self.solution.problem, self.meshes)

    def gap_squares(self, step: StepResult, number: int) -> Array:
        """Squared errors of p after a step that come from what elements do not see of the gap of an
        interface, (n_elements,) of its secondary [stress² · area]."""
        gap, side = self._gaps[number], self._sides[number]
        if gap is None or self.solution.kind == "bilateral":
            return np.zeros(self.meshes[side.body].n_elements)
        key, pair = (id(step), number), step.pairs[side.name]
        if key not in self._of_gaps:
            self._of_gaps[key] = gap.squares(pair)
        return self._of_gaps[key]

    def overlaps(self) -> list[list[tuple[Array, float]]]:
        """Where surfaces overlap on open elements, and how wide, after the increment that failed or
        after all steps, of each body: see `GapRemainder.overlaps`."""
        failed = self.solution.failed
        steps = [failed] if failed is not None else step_ends(self.solution.steps)
        result: list[list[tuple[Array, float]]] = [[] for _ in self.meshes]
        for step, gap, side in (
            (step, *each) for step in steps for each in zip(self._gaps, self._sides, strict=True)
        ):
            if gap is not None and self.solution.kind != "bilateral":
                result[side.body].append(gap.overlaps(step.pairs[side.name]))
        return result

    def data_squares(self, step: StepResult) -> list[Array]:
        """The same of what elements do not see of given displacements and tractions, of each
        body."""
        result = []
        for number, mesh in enumerate(self.meshes):
            parts = [part for side in self._sides for b, part in side.ends if b == number]
            contact = np.isin(np.arange(mesh.n_elements), mesh.elements_of(*parts))
            result.append(self._data.squares(number, step.step, contact))
        return result

    def along(self) -> list[Array]:
        """Squares of the tails of tractions along both coordinates of elements at the ends of all
        steps, and of the pressure of what they do not see of gaps, (n_elements, 2) of each body
        [stress²]."""
        ends, result = step_ends(self.solution.steps), list[Array]()
        for number, mesh in enumerate(self.meshes):
            fields = ([*step.bodies.values()][number] for step in ends)
            result.append(np.sum([directions(mesh, body.traction) for body in fields], axis=0))
        for number, (gap, side) in enumerate(zip(self._gaps, self._sides, strict=True)):
            if gap is not None:
                square = np.sum([self.gap_squares(step, number) for step in ends], axis=0)
                result[side.body] += gap.along * (square / self._sizes[side.body] ** 2)[:, None]
        return result

    def error(self, beside: float = math.nan, whole: float = math.nan) -> tuple[float, float]:
        """Relative errors in L2, over all interfaces and step ends the largest: of u_t, or of p and
        q, and of resultants.

        The error of p and q is that of their tails over the norm of both, faded out towards the rim
        of a part.
        The error of u_t, over ‖u_t‖, is `whole` where that is known (see `whole_error`). Else it
        is the tail of u in the contact and what other faces add, which is `beside` where that is
        known (see `beside_error`) and else follows from `slip_squares` and from what tractions
        lack of equilibrium. Resultants are off by about the product of both errors and by the same
        lack. An even p is off alike everywhere, and so are its resultants. All are off by what
        thin bodies bend too little.
        """
        solution, ends = self.solution, step_ends(self.solution.steps)
        every = [self._of_pressure(step, n) for step in ends for n in range(len(self._sides))]
        worst, even, unseen = np.max([(0.0, 0.0, 0.0), *every], axis=0).tolist()
        uneven = max(
            (float(np.nan_to_num(step.residuals["equilibrium"])) for step in solution.steps),
            default=0.0,
        )
        if solution.kind != "bilateral":
            # what overlaps between nodes in contact is not pressed apart: forces lack as much as p
            pressed = max(
                (step.residuals.get("pressed", 0.0) for step in step_ends(solution.steps)),
                default=0.0,
            )
            lacks, bending = (
                pressed if pressed > limit_of("overlap under pressure") else 0.0,
                max(map(bending_error, self.meshes)),
            )
            of_resultants = worst**2 + uneven + EVENLY * even + bending + unseen
            return min(max(math.hypot(worst, bending), lacks), 1.0), min(
                max(of_resultants, lacks), 1.0
            )
        if all(_sticks(pair) for step in solution.steps for pair in step.pairs.values()):
            return 0.0, worst**2 + uneven
        if not math.isnan(whole):
            return min(whole, 1.0), worst * min(whole, 1.0) + uneven
        squares, (mesh,) = self.slip_squares(solution.last), self.meshes
        contact = np.isin(np.arange(mesh.n_elements), mesh.element[solution.contact.nodes])
        scale, order = displacement_scale(solution), int(mesh.order[~contact].max(initial=0))
        tails = math.hypot(math.sqrt(squares[~contact].sum()) / scale, UNEVEN * uneven)
        if math.isnan(beside):
            beside = tails * (LINEAR if order == 1 else 1.0)
        else:
            beside = math.hypot(min(beside, MOST[order - 2] * tails), UNEVEN * uneven)
        error = min(math.hypot(math.sqrt(squares[contact].sum()) / scale, beside), 1.0)
        return error, worst * error + uneven

    def _of_pressure(self, step: StepResult, number: int) -> tuple[float, float, float]:
        """Relative errors of p and q on an interface after a step: of all, the same where p is
        nearly even, and of what elements do not see of the gap."""
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
        square += sum(float(each.sum()) for each in self.data_squares(step))
        error = math.sqrt(square / size)
        even = error if _is_even(pair, weight) else 0.0
        return error, even, math.sqrt(float(rough.sum()) / size)

    def weight(self, side: PosedInterface, step: StepResult) -> Array:
        """Of the nodes of an interface (m,), which fade out towards the rim of the part [area]."""
        mesh, nodes = self.meshes[side.body], self.solution.nodes[side.name]
        return np.asarray(step.pairs[side.name].weight * inside(mesh, side.part, nodes))

    def smooth(self) -> list[Mask]:
        """Which linear panels of secondaries stick, or slip, all over after each step, away from
        rims of parts: p and q are smooth there, so that the next order gains more than smaller
        panels.

        Returns
        -------
        list of (n_elements,) bool arrays
            A body.
        """
        result = [np.zeros(mesh.n_elements, dtype=bool) for mesh in self.meshes]
        for number, side in enumerate(self._sides):
            mesh, nodes = self.meshes[side.body], self.solution.nodes[side.name]
            element, size = mesh.element[nodes], self._sizes[side.body][mesh.element[nodes]]
            good = (mesh.order[element] == 1) & (rim_distance(mesh, nodes, size) > size)
            for step in step_ends(self.solution.steps):
                state = step.pairs[side.name].state
                first = np.full(mesh.n_elements, OPEN, dtype=state.dtype)
                first[element] = state
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
        """Squared errors of u_t after a step that come from each element of a body in bilateral
        contact.

        In the contact that of the tail of u. Where all of an element slips u is smooth: its next
        degree is taken to be to the tail as the tail is to the degree before, on linear elements to
        u_t, and no less than `LEAST`. What other faces lack moves the contact, too, its elements
        that slip somewhere: the tails of u the less the further away they are, those of tractions,
        which are infinite along the edges of clamped faces, all alike.

        Returns
        -------
        (n_elements,) array
            [length² · area]
        """
        solution, (mesh,), (tails,), (body,) = (
            self.solution,
            self.meshes,
            self.tails,
            step.bodies.values(),
        )
        contact, slips, sticks = np.zeros((3, mesh.n_elements), dtype=bool)
        for name, pair in step.pairs.items():
            contact[mesh.element[solution.nodes[name]]] = True
            slips[mesh.element[solution.nodes[name][pair.state == SLIP]]] = True
            sticks[mesh.element[solution.nodes[name][pair.state != SLIP]]] = True
        area = np.bincount(mesh.element, mesh.weight)
        share = max(area[slips].sum() / area[contact].sum(), 1.0 / np.count_nonzero(contact))
        of_u = np.bincount(mesh.element, mesh.weight * tails.of(body.u, OF_SLIP, 1.0) ** 2)
        of_t = np.bincount(mesh.element, mesh.weight * tails.of(body.traction, (1.0,), 1.0) ** 2)
        compliance = kernel_for(mesh, solution.problem.body[0].material).half_space_compliance
        beside = (
            BESIDE**2 * faded(mesh, contact) * of_u
            + (HELD * compliance * self._sizes[0]) ** 2 * of_t
        )
        linear, higher = contact & (mesh.order == 1), contact & (mesh.order > 1) & ~sticks
        of_u[linear] *= (SECOND / displacement_scale(solution)) ** 2 * of_u[linear].sum()
        if higher.any():
            last, two = (area[higher] * tails.left(body.u, less)[higher] ** 2 for less in (1, 2))
            least = np.array(LEAST)[np.minimum(mesh.order[higher], 3) - 2]
            of_u[higher] = last * np.maximum(last.sum() / max(two.sum(), TINY), least**2)
        return np.where(contact, of_u, share * beside)


def _is_even(pair: PairResult, weight: Array) -> bool:
    """Whether p is nearly the same on all of an interface."""
    mean = float(weight @ pair.pressure) / float(weight.sum())
    return float(weight @ (pair.pressure - mean) ** 2) < EVEN * mean**2 * float(weight.sum())


def _sticks(pair: PairResult) -> bool:
    """Whether nothing slips, nor would if σ_t were off by several times its estimated error: then
    u_t = 0 is exact."""
    shear = np.linalg.norm(pair.sigma_t, axis=1) + SURELY * _errors(pair)[1]
    return not np.any(pair.state == SLIP) and bool(np.all(shear < pair.bound))


def _errors(pair: PairResult) -> tuple[Array, Array]:
    assert pair.pressure_error is not None and pair.sigma_t_error is not None
    return pair.pressure_error, pair.sigma_t_error


def inside(mesh: BoundaryMesh, part: str, nodes: Index) -> Array:
    """Factors (m,) of nodes of a part that fall from 1 to 0 over `FADE` of its size towards its
    rim.

    p may be infinite at the rim, and no mesh its L2 norm exact.
    """
    size = float(mesh.weight[mesh.nodes_of(part)].sum()) ** (1.0 / (mesh.dim - 1))
    return np.asarray(np.minimum(1.0, rim_distance(mesh, nodes, FADE * size) / (FADE * size)) ** 2)
