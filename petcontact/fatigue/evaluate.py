"""A fatigue parameter of a solution, by its name: values at places of all bodies, and the largest
of them."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..linalg.root import root_between
from ..record import record, replace
from ..results.data import SolutionData
from ..results.numbers.peaks import stress_name
from ..results.records import below
from ..runtime.hints import demand_name
from ..untyped import Keyed
from .parameters import PARAMETERS
from .ruiz import ruiz_sites
from .stress_cycle import Sites, cycle_of, parts_in_contact, sites_of

RUIZ = {"ruiz-1": 0, "ruiz-2": 1}
"""Places of the values among those of `ruiz_sites`."""
NAMES = (*PARAMETERS, *RUIZ)
LAYERS = 6
"""Depths below the surface, denser towards it."""


@record
class Found:
    """A parameter at the places of one body: `value` (n,), and `normal` (n, 3) of critical planes
    where it has these."""

    sites: Sites
    value: Array
    normal: Array | None = None


@record
class Fatigue:
    """A parameter over a cycle.

    Attributes
    ----------
    parameter : str
        One of `NAMES`.
    increments : int
        Of the cycle.
    found : tuple of Found
        By body, or side of an interface; at least one.
    error : float
        Of the largest value, by the errors of mesh and path that the solution's stresses, q and
        slip have; nan where these are not known.
    """

    parameter: str
    increments: int
    found: tuple[Found, ...]
    error: float = np.nan

    @property
    def places(self) -> int:
        """Number of points."""
        return sum(len(result.value) for result in self.found)

    @property
    def largest(self) -> tuple[Found, int]:
        """Where it is largest, and the number of the place there."""
        worst = max(self.found, key=lambda result: float(result.value.max()))
        return worst, int(worst.value.argmax())


def fatigue(
    solution: SolutionData,
    parameter: str,
    *,
    first: str | None = None,
    last: str | None = None,
    depth: float = 0.0,
    sensitivity: float | None = None,
    bodies: list[str] | None = None,
    parts: list[str] | None = None,
) -> Fatigue:
    """A fatigue parameter over a cycle of load steps, on the surface and below it.

    Parameters
    ----------
    solution : Solution
    parameter : {"smith-watson-topper", "findley", "crossland", "dang-van", "ruiz-1", "ruiz-2"}
    first, last : str, optional
        Names of the steps that the cycle begins and ends with; by default those of `[cycle]`, or
        all steps.
    depth : float
        How far below the surface, too, next to contact; 0 for the surface alone [length].
    sensitivity : float, optional
        k of Findley, α of Crossland and Dang Van, which need it [-].
    bodies : list of str, optional
        All by default.
    parts : list of str, optional
        Names of parts of the surface; those in contact by default.

    Raises
    ------
    InputError
        If there are no such steps, bodies or parts, a constant is missing, the parameter has no
        depth, or nothing is left to look at.
    """
    _check(parameter, depth, sensitivity)
    increments, names = cycle_of(solution, first, last), list(solution.meshes)
    for body in bodies or ():
        demand_name("no body", body, names, "bodies are")
    chosen = _chosen_parts(solution, bodies or names, parts)
    results: list[Found] = []
    if parameter in RUIZ:
        for name in solution.nodes:
            for place, *values in ruiz_sites(solution, increments, name):
                if place.part[0] in chosen.get(place.body, ()):
                    results.append(Found(place, values[RUIZ[parameter]]))
    else:
        depths = depth * (np.arange(LAYERS + 1) / LAYERS) ** 2
        for member in solution.problem.body:
            if own := chosen.get(member.name):
                sites = sites_of(solution, increments, member.name, own, depths[depths > 0.0])
                function, material = PARAMETERS[parameter][0], member.material
                results.append(Found(sites, *function(sites.stress, material, sensitivity or 0.0)))
    if not results:
        raise InputError(
            "fatigue: none of these parts is in contact"
            if parts
            else "fatigue: nothing is in contact"
        )
    result = Fatigue(parameter, len(increments), tuple(results))
    return replace(result, error=_error(solution, result, sensitivity))


def _error(solution: SolutionData, result: Fatigue, sensitivity: float | None) -> float:
    """What the largest value changes by where the stress there is larger by the largest error of
    a largest stress, and q and slip by theirs."""
    worst, k = result.largest
    stress, value = worst.sites.stress[:, k : k + 1], float(worst.value[k])
    size = float(np.abs(np.linalg.eigvalsh(stress)).max())
    # the largest error of all bodies: digits choose between equal stresses
    errors = [n.error for n in solution.numbers if stress_name(n) and np.isfinite(n.error)]
    larger = 1.0 + max(errors, default=np.nan) / (size or 1.0)
    if result.parameter in RUIZ:
        of_stress = larger if result.parameter == "ruiz-2" else 1.0
        return (of_stress * _work(solution) - 1.0) * value
    if not np.isfinite(larger):
        return np.nan
    (material,) = [b.material for b in solution.problem.body if b.name == worst.sites.body]
    raised, _ = PARAMETERS[result.parameter][0](larger * stress, material, sensitivity or 0.0)
    return float(raised[0]) - value


def _work(solution: SolutionData) -> float:
    """How many times as large q times slip may be; nan where this is not known."""
    times = 1.0
    for name in ("largest q", "largest slip"):
        numbers = [n for n in solution.numbers if n.name == name and np.isfinite(n.error)]
        size = max((n.size for n in numbers), default=np.nan)
        times *= 1.0 + max((n.error for n in numbers), default=np.nan) / (size or 1.0)
    return times


def _check(parameter: str, depth: float, sensitivity: float | None) -> None:
    """Whether there is such a parameter, and it has what is given."""
    demand_name("parameter: no", parameter, NAMES)
    for name, value in (("depth", depth), ("sensitivity", sensitivity or 0.0)):
        if not 0.0 <= value < np.inf:
            raise InputError(f"{name}: must be 0 or more, got {value:g}")
    if depth and parameter in RUIZ:
        raise InputError(
            f"depth: {parameter} is of slip and shear on the surface, below it there is none"
        )
    needed = parameter in PARAMETERS and PARAMETERS[parameter][1]
    if needed != (sensitivity is not None):
        raise InputError(
            f"sensitivity: {parameter} {'needs it, such as 0.3' if needed else 'has none'}"
        )


def _chosen_parts(
    solution: SolutionData, bodies: list[str], parts: list[str] | None
) -> dict[str, list[str]]:
    if parts is None:
        return {body: own for body, own in parts_in_contact(solution).items() if body in bodies}
    names = {
        body: [name for name in parts if name in solution.meshes[body].part_names]
        for body in bodies
    }
    chosen = list(
        dict.fromkeys(name for body in bodies for name in solution.meshes[body].part_names)
    )
    for name in parts:
        demand_name("no part", name, chosen, "parts are")
    return names


def cycles_to_failure(damage: float, young_modulus: float, constants: tuple[float, ...]) -> float:
    """N at which (σ_f'²/E)(2N)^(2b) + σ_f' ε_f' (2N)^(b+c) is a value of Smith, Watson and Topper's
    parameter.

    Parameters
    ----------
    damage : float
        σ_n,max Δε_n/2 [stress].
    young_modulus : float
        [stress]
    constants : (σ_f', b, ε_f', c)
        Of Basquin's, and of Coffin and Manson's law; b and c are negative.

    Returns
    -------
    float
        Infinite where nothing opens.

    Raises
    ------
    InputError
        If the constants have the wrong signs.

    Examples
    --------
    >>> round(cycles_to_failure(1000.0**2 / 200e3 * 2e6**-0.2, 200e3, (1000.0, -0.1, 0.0, -0.6)))
    1000000
    """
    strength, b, ductility, c = constants
    if not (strength > 0.0 and b < 0.0 and ductility >= 0.0 and c < 0.0):
        raise InputError("life: σ_f' must be positive, b and c negative, ε_f' not negative")
    if damage <= 0.0:
        return float("inf")

    def excess(exponent: float) -> float:
        reversals = np.exp(exponent)
        return float(
            np.log(
                (strength**2 / young_modulus) * reversals ** (2.0 * b)
                + strength * ductility * reversals ** (b + c)
            )
            - np.log(damage)
        )

    if excess(-50.0) <= 0.0:
        return 0.0
    if excess(300.0) >= 0.0:
        return float("inf")
    return 0.5 * float(np.exp(root_between(excess, -50.0, 300.0)))


def table(result: Fatigue) -> Keyed:
    """Columns of a table, a row a place: body, part, x, y (and z), depth, arc length, value, and n
    of critical planes."""
    rows = list[Keyed]()
    for location in result.found:
        sites, count = location.sites, len(location.value)
        row = {
            "body": np.full(count, sites.body),
            "part": sites.part,
            **dict(zip("xyz", sites.x.T, strict=False)),
            "depth": sites.depth,
            "arc_length": sites.along,
            result.parameter.replace("-", "_"): location.value,
        }
        if location.normal is not None:
            row |= dict(zip(("plane_nx", "plane_ny", "plane_nz"), location.normal.T, strict=True))
        rows.append(row)
    return below(rows)
