"""Generalised stress intensities K: how strongly stress grows towards a place without a bound.

Displacements u and tractions t at the nodes on both sides of the place, on all elements but those
that end there, are fitted by fields of its `Expansion`: a translation, the modes, and fields that
satisfy equilibrium but no condition on the sides, with the exponents of all regular terms, of loads
(1, 2, 3), and of what curved sides add to the modes (λ + 1, λ + 2). Rows are 2µ u and r t, both
over r^λ, each weighted by the length of the boundary over r. So every decade of r counts alike,
as elements graded towards the place are as exact in each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from ..arrays import Array, Complex, Mask
from ..fields.boundary.places import sizes
from ..fields.stress_state import StressState
from ..geometry.rotation import lifted
from ..mesh.boundary_mesh import BoundaryMesh
from ..refinement.corner_exponents import NEAR
from ..refinement.corner_modes import REGULAR, Expansion, Mode
from ..round_off import HALF, SINGLE, first_largest
from .body_fields import BodyFields
from .evaluated import Evaluated
from .place import Place
from .records import StepResult
from .singular_places import singular_places

NEAREST, FARTHEST = 1e-5, 0.3
"""Nodes that are fitted lie between these distances, over the size of the feature. Farther out
there are terms that `REGULAR` leaves out; nearer r^λ is as small as what solvers leave over."""
ENOUGH, FEWEST = 3.0, 12
"""Equations of a fit over its unknowns, at least: terms with the largest exponents are left out.
Nodes that are fitted, at least, where as many are nearer than the next corner: with four equations
each they are enough for two modes, a translation, a rotation and uniform stress."""
NEARER = 0.5
"""Share of the distance up to which nodes are fitted, of those that say how certain K is."""
APART = 1e-2
"""Exponents that are nearer to each other count as one in a fit."""
MATTERS = 0.01
"""Share of an element from its end up to which stress grows beyond what is elsewhere, for it to
matter in the whole element: with λ = 0.7 it is a quarter of that in its middle."""
TOP, AROUND = 0.5, 5
"""Distance within which no value is larger than a top, over that from the next place without a
bound, and how many of the nearest are no larger: the two on either side along a curve."""
CRACK = math.sqrt(2.0 * math.pi)
"""Stress intensity factor of a crack over the K of its mode: σ = K_I/√(2πr)."""


ANGLES, PHASES = 37, 8
"""Angles at which the stress of a mode is compared, and phases of a complex exponent: stress
between them is less than 1 % larger."""


@dataclass(frozen=True)
class Fit:
    """How strongly stress grows towards a place.

    Attributes
    ----------
    place : Place
    expansion : Expansion
    mode : Mode
    value, spread : float
        K [stress · length^(1-λ)], of a complex exponent the amplitude, and what it differs by from
        that of nearer nodes; NaN where too few nodes lie beside the place.
    across : float
        σ_zz over σ_rr + σ_θθ [-].
    """

    place: Place
    expansion: Expansion
    mode: Mode
    value: float
    spread: float
    across: float

    @property
    def power(self) -> float:
        """That of the distance with which stress grows, λ - 1 < 0 [-]."""
        return self.mode.exponent.real - 1.0

    def amplitude(self, key: str) -> float:
        """The largest stress at a distance r, over r^(λ-1): "pressure" or "shear" on the side
        θ = 0, or an attribute of `StressState` at any angle."""
        on_side = key in ("pressure", "shear")
        theta = np.zeros(1) if on_side else np.linspace(0.0, self.place.angle, ANGLES)
        rows = self.expansion.rows(self.mode.exponent, theta) @ self.mode.coefficients
        phases = np.exp(1j * np.linspace(0.0, 2.0 * math.pi, PHASES, endpoint=False))
        if self.mode.exponent.imag == 0.0:
            phases = phases[:1]
        rows = self.value * (phases[:, None, None] * rows).real
        stress = np.zeros((len(phases), len(theta), 6))
        if self.expansion.components == 2:
            stress[..., [3, 1, 0]] = rows[..., 2:]
            stress[..., 2] = self.across * (stress[..., 0] + stress[..., 1])
        else:
            stress[..., [5, 4]] = rows[..., 1:]
        stress = stress.reshape(-1, 6)
        if on_side:
            shear = np.hypot(stress[:, 3], stress[:, 5])
            return float((-stress[:, 1] if key == "pressure" else shear).max())
        state = StressState(stress[:, :0], stress[:, :0], stress, stress[:, 2])
        return float(getattr(state, key).max())

    def reach(self, amplitude: float, elsewhere: float) -> float:
        """The distance up to which stress with an amplitude exceeds what is elsewhere [length].

        Beyond that at which it is told, stress has no bound.
        """
        if not amplitude > 0.0:
            return 0.0
        if not elsewhere > 0.0:
            return math.inf
        return float((amplitude / elsewhere) ** (-1.0 / self.power))

    def hides(self, mesh: BoundaryMesh, size: float, elsewhere: float) -> float:
        """The distance up to which a stress does not count where one with an amplitude grows
        [length].

        Up to there that is as much as what is elsewhere. Where it matters in the elements that end
        at the place, these do not count, as polynomials do not grow like it.
        """
        reach = min(self.reach(size, elsewhere), self.place.distance)
        own = end_size(mesh, self.place)
        return max(reach, own) if reach > MATTERS * own else reach

    @property
    def told(self) -> tuple[float, float]:
        """K and its spread as they are told: of a crack the stress intensity factor."""
        unit = CRACK if self.is_crack else 1.0
        return unit * self.value, unit * self.spread

    @property
    def is_crack(self) -> bool:
        """Whether K is told as a stress intensity factor: σ = K_I/√(2πr)."""
        return not self.place.pressed and abs(self.mode.exponent.real - 0.5) < NEAR


def fits(solution: Evaluated, step: StepResult) -> list[Fit]:
    """Return K of all modes of all places after an increment."""
    return solution.once("fits", step, lambda: _fits(solution, step))


def _fits(solution: Evaluated, step: StepResult) -> list[Fit]:
    found = list[Fit]()
    materials = {each.name: each.material for each in solution.posed.bodies}
    for body, places in singular_places(solution, step).items():
        plane, ratio = materials[body].plane, materials[body].poisson_ratio
        across = 0.0 if plane == "stress" else ratio
        for place in (each for each in places if each.expansions):
            sides = _Sides(solution.body_fields(body, step), place)
            for expansion in place.expansions:
                values, nearer = sides.fit(expansion, 1.0), sides.fit(expansion, NEARER)
                for mode, *both in zip(expansion.modes, values, nearer, strict=True):
                    spread = float(np.nan_to_num(abs(both[1] - both[0])))
                    found.append(Fit(place, expansion, mode, both[0], spread, across))
    return found


@dataclass(frozen=True)
class Beside:
    """What of a traction of a pair lies beside places without a bound.

    Attributes
    ----------
    hidden : (m,) array
        Nodes that are nearer to a place than where K r^(λ-1) is as much as what is elsewhere.
    endless : (d,) array, optional
        The place at which the traction has no bound, that with the largest where there are several.
    """

    hidden: Mask
    endless: Array | None


def end_size(mesh: BoundaryMesh, place: Place) -> float:
    """The size of the largest element that ends at a place [length]."""
    return 2.0 * float(sizes(mesh)[list(place.elements)].max(initial=0.0))


def _parts(mesh: BoundaryMesh, place: Place) -> set[str]:
    """The parts that meet at a place."""
    return {mesh.part_names[number] for number in mesh.part[list(place.elements)]}


def known(solution: Evaluated, step: StepResult, place: Place) -> list[Fit]:
    """The modes of a place whose K is known."""
    own = (fit for fit in fits(solution, step) if fit.place is place)
    return [fit for fit in own if math.isfinite(fit.value)]


def tops(x: Array, values: Array, nearest: Array, usable: Mask) -> Iterator[int]:
    """Yield the rows of usable values (n,) at points (n, d) that are tops, the largest first: none
    within half the distance of the nearest place without a bound (n,) is larger, nor one of the
    `AROUND` nearest."""
    tree, rows = scipy.spatial.cKDTree(x), np.flatnonzero(usable)
    reach = np.minimum(TOP * nearest, float(np.ptp(x, axis=0).max()))
    for k in rows[np.argsort(-values[rows], kind="stable")].tolist():
        around = tree.query_ball_point(x[k], reach[k])
        around += tree.query(x[k], min(AROUND, len(x)))[1].reshape(-1).tolist()
        if values[around].max() <= values[k]:
            yield k


def told_at(fits: Sequence[Fit], key: str) -> float:
    """The sum of what grows towards a place at the distance at which stress is told."""
    return float(sum(fit.amplitude(key) * fit.place.distance**fit.power for fit in fits))


def level(r: Array, place: Place, values: Array) -> float:
    """The largest of values (n,) at distances (n,) from a place of once to twice that at which
    stress is told."""
    ring = (r >= place.distance) & (r < 2.0 * place.distance)
    return float(values[ring].max(initial=0.0))


def beside(solution: Evaluated, step: StepResult, of: str, key: str, values: Array) -> Beside:
    """Return what of the values (m,) of "pressure" or "shear" at the nodes of a pair does not count
    for its largest.

    It has no bound where K r^(λ-1) is more than what is elsewhere at the distance at which stress
    is told.
    """
    body, part = solution.sides[of]
    mesh, x = solution.meshes[body], step.pairs[of].x
    law = {each.name: each.law for each in solution.posed.interfaces}[of]
    if key == "shear" and law.friction_bound is not None:  # no shear is larger
        return Beside(np.zeros(len(x), dtype=bool), None)
    places = singular_places(solution, step)[body]
    away = {each: each.away(x) for each in places if part in _parts(mesh, each)}
    nearest = np.min([np.full(len(x), np.inf), *away.values()], axis=0)
    beyond = (r > max(each.distance, end_size(mesh, each)) for each, r in away.items())
    far = np.all([values < np.inf, *beyond], axis=0)
    top = next(tops(x, values, nearest, far), None)
    bound = 0.0 if top is None else float(values[top])
    hidden, endless = np.zeros(len(x), dtype=bool), list[tuple[float, Array]]()
    for place, r in away.items():
        own = known(solution, step, place)
        grows = told_at(own, key)
        elsewhere = max(bound, level(r, place, values) - grows)
        if grows > elsewhere:
            endless.append((grows, place.x))
        for fit in own:
            size = max(fit.amplitude("pressure"), fit.amplitude("shear"))
            hidden |= r < fit.hides(mesh, size, elsewhere)
    element = mesh.element[solution.nodes[of][first_largest(values)]]
    # under an apex pressure grows like a logarithm, which has no K
    apexes = (each for each in away if element in each.elements)
    endless += [(0.0, each.x) for each in apexes if not known(solution, step, each)]
    largest = max(endless, key=lambda each: each[0], default=(0.0, None))
    return Beside(hidden, largest[1])


def _solved(matrix: Array, data: Array) -> Array:
    """The unknowns of least squares, without what the data do not tell apart: singular values below
    the share of the data that no unknowns explain."""
    left, size, right = np.linalg.svd(matrix, full_matrices=False)
    parts = left.T @ data
    unexplained = np.linalg.norm(data - left @ parts) / (np.linalg.norm(data) or 1.0)
    told = size > max(float(unexplained), HALF) * size[0]
    return np.asarray(right[told].T @ (parts[told] / size[told]))


class _Sides:
    """Displacement and traction on the two sides of a place."""

    def __init__(self, fields: BodyFields, place: Place) -> None:
        mesh, axes = fields.mesh, np.stack([place.along, place.inward])
        ends = np.exp(1j * np.array([0.0, place.angle]))
        ways = np.stack([ends.real, ends.imag], axis=1) @ axes
        normals = np.stack([[0.0, -1.0], [-ends[1].imag, ends[1].real]]) @ axes
        away = mesh.x - place.x
        flat = away @ axes.T
        r, width = np.linalg.norm(flat, axis=1), np.linalg.norm(away - flat @ axes, axis=1)
        # nodes are of the side that they lie along and whose normal they have
        fits = (
            away @ ways.T / np.maximum(r, np.finfo(float).tiny)[:, None] + mesh.normal @ normals.T
        )
        side, elements = fits.argmax(axis=1), list(place.elements)
        usable = (
            (fits.max(axis=1) > 1.0)
            & (NEAREST * place.size < r)
            & (width <= place.width)
            & np.isin(mesh.part[mesh.element], mesh.part[elements])
            & ~np.isin(mesh.element, elements)
        )
        # on coarse meshes some lie farther away
        enough = np.sort(r[usable & (r < place.size)])[:FEWEST].max(initial=0.0)
        reach = max(FARTHEST * place.size, float(enough) * (1.0 + SINGLE))
        nodes = np.flatnonzero(usable & (r < reach))
        self._r, self._unit = r[nodes], reach
        start = place.angle * side[nodes]
        turned = np.arctan2(flat[nodes, 1], flat[nodes, 0]) - start
        self._theta = start + np.remainder(turned + math.pi, 2.0 * math.pi) - math.pi
        cosine, sine = np.cos(self._theta), np.sin(self._theta)
        self._turn = np.array([[cosine, sine], [-sine, cosine]]).transpose(2, 0, 1)
        self._normal = np.einsum("nij,nj->ni", self._turn, mesh.normal[nodes] @ axes.T)
        whole = lifted(axes, max(mesh.components, mesh.dim))
        if mesh.components == 3:
            whole = np.vstack([whole, np.cross(*whole)])
        u, traction = (values[nodes] @ whole.T for values in fields.data)
        u = 2.0 * fields.body.material.shear_modulus * u
        self._data = np.stack([u, traction * self._r[:, None]], axis=1)
        self._weight = np.sqrt(mesh.measure[nodes] / self._r)

    def fit(self, expansion: Expansion, share: float) -> list[float]:
        """Return K of the modes of an expansion, by nodes up to a share of the farthest."""
        near = (self._r <= share * self._unit)[:, None, None]
        rho, plane = self._r / self._unit, expansion.components == 2
        least = min(mode.exponent.real for mode in expansion.modes)
        scale = near * (self._weight * rho**-least)[:, None, None]
        data = self._data[..., :2] if plane else self._data[..., 2:]
        if plane:
            data = np.einsum("nij,nkj->nki", self._turn, data)
        columns = [
            self._columns(expansion, mode.exponent, mode.coefficients[:, None])
            for mode in expansion.modes
        ]
        still = np.zeros((len(rho), 2, expansion.components, expansion.components))
        still[:, 0] = self._turn if plane else 1.0
        count = sum(each.shape[-1] for each in columns)
        columns.append(still)
        most = 2.0 * expansion.components * int(near.sum()) / ENOUGH
        free = np.eye(2 * expansion.components, dtype=np.complex128)
        for power in self._powers(expansion):
            more = self._columns(expansion, power, free)
            if sum(each.shape[-1] for each in (*columns, more)) > most:
                break
            columns.append(more)
        matrix = np.concatenate(columns, axis=-1)
        if matrix.shape[-1] > most:
            return [math.nan] * len(expansion.modes)
        matrix = (matrix * scale[..., None]).reshape(data.size, -1)
        size = np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
        found = _solved(matrix / size, (data * scale).ravel()) / size
        parts, values = iter(found[:count].tolist()), list[float]()
        for mode in expansion.modes:
            value = (
                next(parts) if mode.exponent.imag == 0.0 else math.hypot(next(parts), next(parts))
            )
            values.append(value * self._unit**-mode.exponent.real)
        return values

    def _powers(self, expansion: Expansion) -> list[complex]:
        """The exponents of terms without conditions on the sides, increasing."""
        shadows = [mode.exponent + k for mode in expansion.modes for k in (1.0, 2.0)]
        every = [*expansion.regular, 1.0 + 0.0j, 2.0 + 0.0j, 3.0 + 0.0j, *shadows]
        kept = list[complex]()
        for power in sorted(every, key=lambda each: each.real):
            if power.real < REGULAR and all(abs(power - each) > APART for each in kept):
                kept.append(power)
        return kept

    def _columns(self, expansion: Expansion, power: complex, coefficients: Complex) -> Array:
        """Displacement and traction times r, (n, 2, c, k), of fields with an exponent."""
        rows = expansion.rows(power, self._theta) @ coefficients
        rows *= ((self._r / self._unit) ** power)[:, None, None]
        radial, around = self._normal[:, 0, None], self._normal[:, 1, None]
        if expansion.components == 2:
            u = rows[:, :2]
            traction = np.stack(
                [
                    rows[:, 4] * radial + rows[:, 2] * around,
                    rows[:, 2] * radial + rows[:, 3] * around,
                ],
                axis=1,
            )
        else:
            u, traction = rows[:, :1], (rows[:, 2] * radial + rows[:, 1] * around)[:, None]
        result = np.stack([u, traction], axis=1)
        parts = (result.real, -result.imag) if power.imag else (result.real,)
        return np.concatenate(parts, axis=-1)
