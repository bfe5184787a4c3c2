"""Errors of p from parts of gaps and given data that a mesh does not represent between its nodes.

The polynomials f_h of the elements stand for a given function f; the remainder is f - f_h.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Array, Index, Mask, largest_by, marked, scattered, smallest_by
from ...bem.kernels import kernel_for
from ...contact.friction_law import lengths
from ...contact.law_protocol import OPEN
from ...errors import the_body
from ...geometry.rotation import lifted
from ...given.body_data import Body
from ...given.conditions import Condition, Term
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...given.sites import Sites
from ...given.values import Given
from ...mesh.approximation import Samples, sampled
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import Keeping
from ...refinement.panels.panel_cuts import element_sizes, faded
from ...results.records import PairResult
from ...round_off import TINY
from ..pose.load_states import samples_of_term, stand_ins
from .findings import limit_of

BINS = 8
"""Strips of an element along each coordinate, in which the remainder is averaged across."""
BOUNDS = "friction_bound", "friction_coefficient"


def missed_data(posed: Posed, meshes: Sequence[BoundaryMesh], data: DataRemainders) -> list[str]:
    """Return a sentence for each given function of which a mesh misses a large share.

    The share is the integral of |f - f_h| over that of |f|, with the polynomials f_h of the
    elements.

    Examples
    --------
    >>> missed_data(posed, meshes, DataRemainders(posed.bodies, meshes))
    ["the body: its mesh misses 97 % of the traction on left, which varies within elements; use
    smaller elements there"]
    """
    shares = dict[tuple[int, str, str], float]()
    for body in posed.bodies:
        for part, term in _given_terms(*body.conditions):
            key = body.number, term.kind, part
            shares[key] = max(data.left(body.number, part, term)[1], shares.get(key, 0.0))
    for side, quantity in itertools.product(posed.interfaces, BOUNDS):
        datum = getattr(side.law, quantity)
        if datum is not None and datum.varies and datum.everywhere:
            samples, nodal = samples_of_datum(datum, side.part, meshes[side.body])
            share = samples.share(samples.left(nodal), samples.values)
            shares[side.body, quantity.replace("_", " "), side.part] = share
    return [
        f"{the_body(posed.bodies[number].name)}: its mesh misses {share:.0%} of the {quantity} on "
        f"{part}, which varies within elements; use smaller elements there"
        for (number, quantity, part), share in shares.items()
        if share > limit_of("known data")
    ]


def _given_terms(*states: dict[str, Condition]) -> Iterator[tuple[str, Term]]:
    """Yield the part and each term of the displacements and tractions at the ends of steps."""
    for part, condition in itertools.chain.from_iterable(map(dict.items, states)):
        for term in condition.terms:
            yield part, term


class GapRemainder:
    """The part of the gap of a unilateral contact that the elements do not represent.

    Parameters
    ----------
    side : PosedInterface
        An interface whose gap is an expression or a function.
    mesh : BoundaryMesh
    nodes : (m,) array
        Nodes of the contact.
    stiffness : float
        E* of both bodies [stress].
    """

    def __init__(
        self, side: PosedInterface, mesh: BoundaryMesh, nodes: Index, stiffness: float
    ) -> None:
        self._mesh, self._nodes, self._stiffness = mesh, nodes, stiffness
        assert side.law.gap is not None
        self._gap = side.law.gap
        self._samples, nodal = samples_of_datum(self._gap, side.part, mesh)
        self._nodal = nodal[nodes, 0]
        self._size = element_sizes(mesh)

    @functools.cached_property
    def _unfaced(self) -> Mask:
        """At which samples nothing is opposite, (q,)."""
        mesh, element, place = self._mesh, self._samples.element, self._samples.place
        sites = Sites(*mesh.at(element, place), mesh.arc_lengths(element, place))
        return np.isinf(self._gap.near(sites, np.inf))

    @functools.cached_property
    def _rough(self) -> Array:
        return self._samples.rough(self._samples.values)[:, 0]

    def squares(self, pair: PairResult) -> Array:
        """Return the squared error of p on each element from the remainder, (n_elements,) [stress²
        · area].

        On an element without nodes in contact, the error is E* times the largest overlap between
        nodes over twice the element size. On others it is the pressure of the gap's remainder
        (`_of_waves`).

        Parameters
        ----------
        pair : PairResult
            The contact after a step.
        """
        mesh, samples = self._mesh, self._samples
        opening, touched = self._opening(pair)
        deepest = largest_by(samples.element, -opening, mesh.n_elements)
        pressed = self._stiffness * deepest / (2.0 * self._size)
        area = np.bincount(mesh.element, mesh.weight)
        return np.where(touched, self._of_waves(pair.pressure, opening) ** 2, pressed**2 * area)

    def overlaps(self, pair: PairResult) -> tuple[Array, float]:
        """Return where elements without nodes in contact overlap most, and the width of that
        region.

        The points (k, d) have at least half of the largest overlap. The width is the root of their
        area, in the plane their length [length].
        """
        mesh, samples = self._mesh, self._samples
        opening, touched = self._opening(pair)
        opening[touched[samples.element]] = 0.0
        deep = opening < min(0.5 * float(opening.min()), 0.0)
        width = float(samples.weight[deep].sum()) ** (1.0 / (mesh.dim - 1))
        return mesh.at(samples.element[deep], samples.place[deep])[0], width

    def _opening(self, pair: PairResult) -> tuple[Array, Mask]:
        """Return the distance of the surfaces at the samples (q,) [length] and the elements in
        contact.

        The given gap changes as at the nodes. Nodes with nothing opposite change as the others do
        in the mean: a tool may be smaller than an element. A sample with nothing opposite is open.
        An element (n_elements,) is in contact if one of its nodes is.
        """
        changes, faced = np.zeros(self._mesh.n_nodes), np.isfinite(pair.gap)
        changed = (pair.gap - self._nodal)[faced]
        changes[self._nodes] = changed.mean() if changed.size else 0.0
        changes[self._nodes[faced]] = changed
        closed = self._mesh.element[self._nodes[pair.state != OPEN]]
        touched = marked(closed, self._mesh.n_elements)
        opening = self._samples.values[:, 0] + self._samples.basis @ changes
        return np.where(self._unfaced, np.inf, opening), touched

    def _of_waves(self, pressure: Array, opening: Array) -> Array:
        """Return the L2 norm of the pressure that the gap's remainder causes on each element,
        (n_elements,).

        A wave of number k and amplitude a takes the pressure E* k a/2 to close. The remainder of an
        element of order p has p + 1 zeros, hence about (p + 2)/2 half waves. The gap closes only
        partly there: the share is the variation of p, over the pressure that the resolved gap would
        take to close in half a wave.

        The remainder is that of the gap or, if smaller, that of the opening between the nodes. The
        opening is clipped at twice the amplitude that p can close: beyond that a point is open, at
        any distance.
        """
        mesh, samples = self._mesh, self._samples
        most = largest_by(mesh.element[self._nodes], pressure, mesh.n_elements)
        p = scattered(pressure, self._nodes, mesh.n_nodes)
        half_wave = self._stiffness * math.pi / self._size
        waves = half_wave * 0.5 * (mesh.order + 2)
        closed = np.minimum(opening, (2.0 * most / waves)[samples.element])
        clipped = samples.norms(samples.rough(closed[:, None])[:, 0])
        rough = np.minimum(samples.norms(self._rough), clipped)
        seen = samples.norms(samples.around_mean(samples.values[:, 0] - self._rough))
        mean = np.bincount(mesh.element, mesh.weight * p) / np.bincount(mesh.element, mesh.weight)
        varies = np.bincount(mesh.element, mesh.weight * (p - mean[mesh.element]) ** 2)
        whole = np.maximum(half_wave * (seen + rough), TINY)
        share = np.minimum((np.sqrt(varies) + half_wave * rough) / whole, 1.0)
        return np.asarray(waves * share * rough)

    @functools.cached_property
    def directional_shares(self) -> Array:
        """Return the shares of the remainder that vary along each of the two coordinates,
        (n_elements, 2)."""
        mesh, samples = self._mesh, self._samples
        low = smallest_by(samples.element, samples.place, mesh.n_elements)
        high = largest_by(samples.element, samples.place, mesh.n_elements, -np.inf)
        width = (high - low)[samples.element]
        bins = np.minimum(BINS - 1, BINS * (samples.place - low[samples.element]) // width)
        result = np.empty((mesh.n_elements, 2))
        for axis in (0, 1):
            key = samples.element * BINS + bins[:, axis].astype(np.int64)
            count = BINS * mesh.n_elements
            weight = np.bincount(key, samples.weight, count)
            mean = np.bincount(key, samples.weight * self._rough, count)
            square = np.divide(mean**2, weight, out=np.zeros(count), where=weight > 0.0)
            result[:, axis] = square.reshape(-1, BINS).sum(axis=1)
        whole = result.sum(axis=1, keepdims=True)
        return np.divide(result, whole, out=np.full_like(result, 0.5), where=whole > 0.0)


def samples_of_datum(datum: Given, part: str, mesh: BoundaryMesh) -> tuple[Samples, Array]:
    """Return samples of a datum on a part, and its values (n, 1) at all nodes; 0 where not
    finite."""

    def function(element: Index, local: Array, x: Array, normal: Array) -> Array:
        return datum.near(Sites(x, normal, mesh.arc_lengths(element, local)))[:, None]

    nodes = mesh.nodes_of(part)
    nodal = scattered(datum.near(mesh.sites(nodes))[:, None], nodes, mesh.n_nodes)
    return sampled(mesh, part, function, [datum], datum), nodal


def gap_remainders(
    posed: Posed, meshes: Sequence[BoundaryMesh], nodes: Sequence[Index]
) -> list[GapRemainder | None]:
    """Return the gap remainder of each contact.

    It is None for a gap that is a number or that of the geometry, and for contacts that cannot
    open.
    """
    remainders = list[GapRemainder | None]()
    for side, contact_nodes in zip(posed.interfaces, nodes, strict=True):
        gap = side.law.gap
        rough = gap is not None and gap.varies and gap.everywhere
        opens = side.law.normal == "unilateral" and rough
        remainders.append(
            GapRemainder(side, meshes[side.body], contact_nodes, 1.0 / posed.softness(side))
            if opens
            else None
        )
    return remainders


class DataRemainders(Keeping):
    """The remainders of displacements and tractions that are given on parts of bodies.

    Parameters
    ----------
    bodies : sequence of Body
    meshes : sequence of BoundaryMesh
    """

    def __init__(self, bodies: Sequence[Body], meshes: Sequence[BoundaryMesh]) -> None:
        self._bodies, self._meshes = bodies, meshes

    def squares(self, number: int, step: int, contact: Mask) -> Array:
        """Return the squared error of p from each element of a body at the end of a step,
        (n_elements,).

        The unit is [stress² · area]. The remainder has no resultant on any element, so that its
        effect fades with the distance from the contact (see `faded`). A displacement times E* over
        twice the element size is a pressure.

        Parameters
        ----------
        number, step : int
            Number of the body, from 0, and of the step, from 1.
        contact : (n_elements,) array
            Which elements are in contact.
        """
        mesh, result = self._meshes[number], np.zeros(self._meshes[number].n_elements)
        compliance = kernel_for(mesh, self._bodies[number].material).half_space_compliance
        stiff = 1.0 / (math.pi * compliance * element_sizes(mesh))
        for part, term in _given_terms(self._bodies[number].conditions[step - 1]):
            scale = stiff if term.kind == "displacement" else 1.0
            result += scale**2 * self.left(number, part, term)[0]
        return result * faded(mesh, contact)

    def resultant_error(self) -> float:
        """Return the largest error of the integrals of given tractions over their size [-]."""
        errors = [
            self.left(body.number, part, term)[2]
            for body in self._bodies
            for part, term in _given_terms(*body.conditions)
            if term.kind == "traction"
        ]
        return max(errors, default=0.0)

    def unseen(self) -> dict[str, list[float]]:
        """Return the largest given tractions that the meshes do not have, as `Accuracy.unseen`."""
        result = dict[str, list[float]]()
        for body in self._bodies:
            names = self._meshes[body.number].part_names
            found = dict.fromkeys(names, 0.0)
            for part, term in _given_terms(*body.conditions):
                if term.kind == "traction":
                    found[part] = max(found[part], self.left(body.number, part, term)[3])
            if any(found.values()):
                result[body.name] = [found[name] for name in names]
        return result

    def left(self, number: int, part: str, term: Term) -> tuple[Array, float, float, float]:
        """Return the squared remainder on each element, its share of the data [-], the error of
        their integral over that of their size [-], and the largest; computed once."""
        return self.once((number, part, term), lambda: self._looked_at(number, part, term))

    def _looked_at(self, number: int, part: str, term: Term) -> tuple[Array, float, float, float]:
        mesh = self._meshes[number]
        samples, nodes = samples_of_term(term, mesh, part), mesh.nodes_of(part)
        if samples is None:
            return np.zeros(mesh.n_elements), 0.0, 0.0, 0.0
        normal = lifted(mesh.normal[nodes], mesh.components)
        at_nodes = term.near(mesh.sites(nodes), normal)
        known = stand_ins(term, samples, nodes, at_nodes)
        left = samples.left(scattered(known, nodes, mesh.n_nodes))
        lost = float(np.linalg.norm(samples.weight @ left)) + samples.doubt
        size = float(samples.weight @ np.linalg.norm(samples.values, axis=1))
        square = samples.over_elements((left**2).sum(axis=1))
        share, most = samples.share(left, samples.values), float(lengths(left).max(initial=0.0))
        return square, share, lost / size if size else 0.0, most
