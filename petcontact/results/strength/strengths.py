"""Generalised stress intensities K: how strongly stress grows towards a place without a bound."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from ...arrays import Array, Mask
from ...fields.stress_state import StressState
from ...linalg.nearest import Nearest
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import record, replace
from ...refinement.corner_exponents import NEAR
from ...refinement.corner_modes import Expansion, Mode
from ...round_off import first_largest, largest_first
from ..evaluated import Evaluated
from ..records import StepResult
from .place import Place
from .singular_places import all_places, singular_places
from .strength_fit import Sides

NEARER, FARTHER = (0.0, 0.5), (0.1, 1.0)
"""Shares of the distance up to which nodes are fitted, between which those lie that say how certain
K is."""
TOP, AROUND = 0.5, 5
"""Distance within which no value is larger than a top, over that from the next place without a
bound, and how many of the nearest are no larger: the two on either side along a curve."""
RING = 2.0
"""Outer edge of the ring about a place, over the distance at which stress is told: what falls from
the place has waves up to there, which are no maxima."""
TOGETHER = 8
"""Points whose nearest are looked for at once: most often the first of all is a top."""
CRACK = math.sqrt(2.0 * math.pi)
"""Stress intensity factor of a crack over the K of its mode: σ = K_I/√(2πr)."""


ANGLES, PHASES = 37, 8
"""Angles at which the stress of a mode is compared, and phases of a complex exponent: stress
between them is less than 1 % larger."""


@record
class Fit:
    """How strongly stress grows towards a place.

    Attributes
    ----------
    place : Place
    expansion : Expansion
    mode : Mode
    value : float
        K [stress · length^(1-λ)], of a complex exponent the amplitude; NaN where too few nodes lie
        beside the place.
    across : float
        σ_zz over σ_rr + σ_θθ [-].
    spreads : callable
        Returns the spreads of all modes of the expansion: three more fits, for who asks.
    number : int
        Of the mode among them.
    """

    place: Place
    expansion: Expansion
    mode: Mode
    value: float
    across: float
    spreads: Callable[[], list[float]]
    number: int

    @property
    def spread(self) -> float:
        """What K differs by from those of other nodes and weights."""
        return self.spreads()[self.number]

    @property
    def power(self) -> float:
        """That of the distance with which stress grows, λ - 1 < 0 [-]."""
        return self.mode.exponent.real - 1.0

    def amplitude(self, key: str) -> float:
        """The largest stress at a distance r, over r^(λ-1): "pressure" or "shear" on the side
        θ = 0, or an attribute of `StressState` at any angle."""
        sign = math.copysign(1.0, self.value)
        of = self.expansion, self.mode, self.place.angle, self.across
        return abs(self.value) * _amplitude(*of, key, sign)

    @property
    def unit(self) -> float:
        """What K is told over: of a crack the stress intensity factor is √(2π) times as large."""
        return CRACK if self.is_crack else 1.0

    @property
    def is_crack(self) -> bool:
        """Whether K is told as a stress intensity factor: σ = K_I/√(2πr)."""
        return not self.place.pressed and abs(self.mode.exponent.real - 0.5) < NEAR


@functools.lru_cache(maxsize=4096)
def _amplitude(
    expansion: Expansion, mode: Mode, angle: float, across: float, key: str, sign: float
) -> float:
    """`Fit.amplitude` of K = 1 or -1."""
    on_side = key in ("pressure", "shear")
    theta = np.zeros(1) if on_side else np.linspace(0.0, angle, ANGLES)
    rows = expansion.rows(mode.exponent, theta) @ mode.coefficients
    phases = np.exp(1j * np.linspace(0.0, 2.0 * math.pi, PHASES, endpoint=False))
    if mode.exponent.imag == 0.0:
        phases = phases[:1]
    rows = sign * (phases[:, None, None] * rows).real
    stress = np.zeros((len(phases), len(theta), 6))
    if expansion.components == 2:
        stress[..., [3, 1, 0]] = rows[..., 2:]
        stress[..., 2] = across * (stress[..., 0] + stress[..., 1])
    else:
        stress[..., [5, 4]] = rows[..., 1:]
    stress = stress.reshape(-1, 6)
    if on_side:
        shear = np.hypot(stress[:, 3], stress[:, 5])
        return float((-stress[:, 1] if key == "pressure" else shear).max())
    state = StressState(stress[:, :0], stress[:, :0], stress, stress[:, 2])
    return float(getattr(state, key).max())


def fits(solution: Evaluated, step: StepResult) -> list[Fit]:
    """Return K of all modes of all places after an increment."""
    return solution.at_end("fits", step, lambda: [*_fits(solution, step)])


def _fits(solution: Evaluated, step: StepResult) -> Iterator[Fit]:
    materials = {each.name: each.material for each in solution.posed.bodies}
    for body, places in singular_places(solution, step).items():
        material = materials[body]
        across = 0.0 if material.plane == "stress" else material.poisson_ratio
        for place in (each for each in places if each.expansions):
            sides = Sides(solution.body_fields(body, step), place)
            for expansion in place.expansions:
                found = sides.fit(expansion)
                spreads = functools.cache(functools.partial(_spreads, sides, expansion, found))
                yield from _pressing(
                    Fit(place, expansion, mode, float(found[0, k]), across, spreads, k)
                    for k, mode in enumerate(expansion.modes)
                )


def _pressing(fits: Iterable[Fit]) -> list[Fit]:
    """The fits of an expansion. What presses does not pull: such a fit is one of something else."""
    own = list(fits)
    pulls = own and own[0].place.pressed and own[0].value < 0.0 and own[0].value < -own[0].spread
    return [replace(fit, value=math.nan) for fit in own] if pulls else own


def _spreads(sides: Sides, expansion: Expansion, found: Array) -> list[float]:
    """How far K of each mode may be off, by fits of nearer and farther nodes, and of equal weights.

    It is off by no more than it differs from another fit and that one is off: of nearer and of
    farther nodes each says so of the other. What the nodes of a fit do not tell counts where none
    of the others tells it; where half of the nodes are too few it may be anything."""
    others = np.stack([sides.fit(expansion, NEARER), sides.fit(expansion, FARTHER)])
    apart = np.abs(others[:, 0] - found[0])
    untold = np.fmin(found[1], np.fmin(*(apart + others[:, 1])))
    alike = np.abs(sides.fit(expansion, alike=True)[0] - found[0])
    every = np.maximum(np.maximum(apart.sum(axis=0), alike), untold)
    return [float(each) for each in np.where(np.isnan(every), found[2], every)]


@record
class Beside:
    """What of a traction of a pair lies beside places without a bound.

    Attributes
    ----------
    hidden : (m,) array
        Nodes that are nearer to a place than where stress is told, or in elements that end there.
    endless : (d,) array, optional
        The place at which the traction has no bound, that with the largest where there are several.
    """

    hidden: Mask
    endless: Array | None


def _parts(mesh: BoundaryMesh, place: Place) -> set[str]:
    """The parts that meet at a place."""
    return {mesh.part_names[number] for number in mesh.part[list(place.elements)]}


def growth(solution: Evaluated, step: StepResult, body: str, x: Array) -> Array:
    """Return how much more stresses at points (n, d) may be at places where stress grows so slowly
    that it is told as a value, and over the change by the last elements there, (2, n) [-]."""
    more, mesh = np.zeros((2, len(x))), solution.meshes[body]
    for each in all_places(solution, step)[1][body]:
        near = each.leaves_out(x)
        more = np.maximum(more, np.outer([each.growth(mesh), each.halvings(mesh)], near))
    return more


def known(solution: Evaluated, step: StepResult, place: Place) -> list[Fit]:
    """The modes of a place whose K is known."""
    own = (fit for fit in fits(solution, step) if fit.place is place)
    return [fit for fit in own if math.isfinite(fit.value)]


def tops(
    x: Array, values: Array, reach: Array, usable: Mask, least: Array | None = None
) -> Iterator[int]:
    """Yield the rows of usable values (n,) at points (n, d) that are tops, the largest first: none
    within their reach (n,) is larger, nor one of the `AROUND` nearest.

    Of values that are not certain `least` (n,) are the least that they may be.
    """
    rows, least = np.flatnonzero(usable), values if least is None else least
    if not len(rows):
        return
    nearest = Nearest(x)
    reach = np.minimum(reach, float(np.ptp(x, axis=0).max()))
    rows = rows[largest_first(values[rows])]
    for first in range(0, len(rows), TOGETHER):
        some = rows[first : first + TOGETHER]
        around = nearest(x[some], AROUND)
        for k in some[least[around].max(axis=1) <= values[some]].tolist():
            if least[np.linalg.norm(x - x[k], axis=1) <= reach[k]].max() <= values[k]:
                yield k


def told_at(fits: Sequence[Fit], key: str) -> float:
    """The sum of what grows towards a place at the distance at which stress is told."""
    return float(sum(fit.amplitude(key) * fit.place.distance**fit.power for fit in fits))


def level(r: Array, place: Place, values: Array) -> float:
    """The largest of values (n,) at distances (n,) from a place on the ring about it."""
    ring = (r >= place.distance) & (r < RING * place.distance)
    return float(values[ring].max(initial=0.0))


def beside(solution: Evaluated, step: StepResult, of: str, key: str, values: Array) -> Beside:
    """Return what of the values (m,) of "pressure" or "shear" at the nodes of a pair does not count
    for its largest.

    It has no bound where K r^(λ-1) is more than what is elsewhere at the distance at which stress
    is told.
    """
    body, part = solution.sides[of]
    mesh, x = solution.meshes[body], step.pairs[of].x
    if key == "shear" and any(
        side.name == of and side.law.friction_bound is not None
        for side in solution.posed.interfaces
    ):  # no shear is larger
        return Beside(np.zeros(len(x), dtype=bool), None)
    away = {
        place: place.away(x)
        for place in singular_places(solution, step)[body]
        if part in _parts(mesh, place)
    }
    bound = _largest_top(mesh, x, values, away)
    hidden, endless = np.zeros(len(x), dtype=bool), list[tuple[float, Array]]()
    for place, r in away.items():
        own = known(solution, step, place)
        grows = told_at(own, key)
        elsewhere = max(bound, level(r, place, values) - grows)
        if grows > elsewhere:
            endless.append((grows, place.x))
        if own:
            hidden |= r < place.reach(mesh)
    endless += _under_top(solution, step, [*away], of, values, hidden)
    return Beside(hidden, max(endless, key=lambda each: each[0], default=(0.0, None))[1])


def _under_top(
    solution: Evaluated,
    step: StepResult,
    places: Sequence[Place],
    of: str,
    values: Array,
    hidden: Mask,
) -> Iterator[tuple[float, Array]]:
    """Yield places at which the largest value (m,) lies, if there is no K, or if all that presses
    is nearer than where stress is told: under an apex pressure grows like a logarithm."""
    element = solution.meshes[solution.sides[of][0]].element[solution.nodes[of]]
    left = np.where(hidden, 0.0, values)
    top = first_largest(left if (told := left.any()) else values)
    for place in places:
        if element[top] in place.elements and not (told and known(solution, step, place)):
            yield 0.0, place.x


def _largest_top(mesh: BoundaryMesh, x: Array, values: Array, away: Mapping[Place, Array]) -> float:
    """The largest of values (n,) at points (n, d) that is a top, at distances (n,) from places
    where stress is told, or more; 0 where there is none."""
    nearest = np.min([np.full(len(x), np.inf), *away.values()], axis=0)
    beyond = (r > each.reach(mesh) for each, r in away.items())
    far = np.all([values < np.inf, *beyond], axis=0)
    top = next(tops(x, values, TOP * nearest, far), None)
    return 0.0 if top is None else float(values[top])
