"""What a sweep records of a case: scalars of a solution, the same in two and three dimensions."""

from __future__ import annotations

import math
import pkgutil
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..contact.law_protocol import OPEN, SLIP
from ..errors import InputError
from ..model.problem import Problem
from ..results.solution import Solution
from ..results.strength.singular_places import singular_places
from ..results.strength.strengths import Fit, beside, fits, told_at
from ..round_off import WRITTEN, first_largest
from ..untyped import Keyed
from .published import published_count

Quantity = Callable[[Solution], float]
QUANTITIES = (
    "max_displacement",
    "max_u_t",
    "slip_length",
    "slip_share",
    "contact_area",
    "tension_share",
    "max_pressure",
    "dissipated_energy",
)
PEAKS = {"peak_von_mises": "von Mises", "peak_first_principal": "first principal"}
"""Largest stresses, by their names among the numbers of a solution."""


def contact_quantities(solution: Solution) -> dict[str, float]:
    """Return scalars of all bodies, contact parts and interfaces together, after the last step.

    Returns
    -------
    dict of str to float
        max_displacement: largest |u| at a node of a body [length]; max_u_t: largest |u_t|, between
        bodies the largest slip, at a node [length]; slip_length, slip_share: length (in space:
        area) of what slips, and its share; contact_area: length (area) of what is not open;
        tension_share: share that is pulled, σ_n > 0, where a foundation would let go [-];
        max_pressure: largest p at a node [stress]; dissipated_energy: what friction took in all
        steps, of a single one -∫ σ_t·u_t [stress · length^dim].
    """
    columns = solution.columns()
    weight, state, sigma_n = columns["weight"], columns["state"], columns["sigma_n"]
    length, slips = float(weight.sum()) or 1.0, float(weight[state == SLIP].sum())
    pulled = sigma_n > WRITTEN * float(np.abs(sigma_n).max(initial=0.0))
    steps = solution.steps or solution.tried
    quantities = (
        max(np.linalg.norm(b.u, axis=1).max(initial=0.0) for b in solution.bodies.values()),
        float(np.linalg.norm(columns["slip"], axis=1).max(initial=0.0)),
        slips,
        slips / length,
        float(weight[state != OPEN].sum()),
        float(weight[pulled].sum()) / length,
        float(-sigma_n.min(initial=0.0)),
        sum(pair.dissipated for step in steps for pair in step.pairs.values()),
    )
    return dict(zip(QUANTITIES, quantities, strict=True))


def resultants(solution: Solution) -> dict[str, float]:
    """Return the force ∫ σ n on the body, of a pair on the secondary: force_x, force_y.

    With torsion the moment about the axis is there, too. Of several interfaces the names follow, as
    in force_x_bottom.
    """
    forces = {
        (key, name): value
        for name, pair in solution.pairs.items()
        for key, value in (
            *((f"force_{axis}", value) for axis, value in zip("xyz", pair.force, strict=False)),
            *((("moment", pair.moment),) if len(pair.force) > pair.x.shape[1] else ()),
        )
    }
    single = len(solution.pairs) == 1
    return {key if single else f"{key}_{name}": float(v) for (key, name), v in forces.items()}


def over_steps(solution: Solution) -> dict[str, float]:
    """Return what the path to the last solution has reached.

    Returns
    -------
    dict of str to float
        load_factor: share of a step with `until` after which a whole contact slips, 1 if none does
        [-]. peak_force_x, peak_force_y: the component of `resultants` that was largest by size
        after any increment of the load steps. Of several such steps or contacts names follow.
    """
    steps, given = solution.steps, solution.problem.step
    ended = {
        step.name or str(number): max(s.load_factor for s in own)
        for number, step in enumerate(given, 1)
        if step.until and (own := [s for s in steps if s.step == number])
    }
    single = len(ended) == 1
    factors = {"load_factor" if single else f"load_factor_{k}": v for k, v in ended.items()}
    paths = [resultants(replace(solution, steps=[step], failed=None)) for step in steps]
    return factors | {
        f"peak_{key}": max((path[key] for path in paths), key=abs)
        for key in (paths[0] if given and paths else ())
    }


def wear(solution: Solution) -> dict[str, float]:
    """Return worn_volume and worn_depth of both sides together, if anything wears.

    Of several interfaces that wear the names follow.
    """
    worn = {name: pair for name, pair in solution.pairs.items() if pair.wear is not None}
    return {
        f"{key}_{name}" if len(worn) > 1 else key: float(value)
        for name, pair in worn.items()
        for key, value in (("worn_volume", pair.worn_volume.sum()), ("worn_depth", pair.worn_depth))
    }


def peaks(solution: Solution) -> dict[str, float]:
    """Return the largest stresses peak_von_mises and peak_first_principal [stress].

    A stress that is large only next to places where it has no bound is NaN.
    """
    numbers = [number for number in solution.numbers if math.isfinite(number.value[0])]
    return {
        name: max(
            (float(n.value[0]) for n in numbers if n.name.startswith(f"{stress} stress ")),
            default=math.nan,
        )
        for name, stress in PEAKS.items()
    }


def peak_von_mises(solution: Solution) -> float:
    """Return that of `peaks`; a sweep on fixed meshes may name it among its quantities."""
    return peaks(solution)["peak_von_mises"]


def peak_first_principal(solution: Solution) -> float:
    """Return that of `peaks`; a sweep on fixed meshes may name it among its quantities."""
    return peaks(solution)["peak_first_principal"]


def trust(solution: Solution) -> dict[str, float]:
    """Return estimated_error, see `Accuracy`, NaN where it is not known, and the number of
    warnings; on adaptive meshes also `peaks`.

    There they cost little in comparison with the solve. `unbounded` is the number of places where
    stress has no bound.
    """
    accuracy = solution.accuracy
    result = {"estimated_error": accuracy.error, "warnings": len(solution.warnings)}
    if accuracy.wanted is not None:
        endless = [number.name for number in solution.numbers if math.isinf(number.error)]
        result["unbounded"] = sum(name.startswith(PEAKS["peak_von_mises"]) for name in endless)
        result |= peaks(solution)
    return result


def unbounded_pressure(solution: Solution) -> dict[str, float]:
    """Return an infinite max_pressure where pressure has no bound, and how it grows there.

    Returns
    -------
    dict of str to float
        Empty where pressure has a bound. stress_intensity: K of the place where pressure is largest
        at the distance at which it is told; stress_exponent: its λ, pressure is K r^(λ-1). Under an
        apex neither is there. On given meshes only places beside the largest p are looked at, which
        takes less time than a case.
    """
    step, found = solution.last, list[Fit]()
    endless = False
    for name, pair in step.pairs.items():
        body, _ = solution.sides[name]
        top = solution.meshes[body].element[solution.nodes[name][first_largest(pair.pressure)]]
        near = any(top in place.elements for place in singular_places(solution, step)[body])
        if not near and solution.accuracy.wanted is None:
            continue
        at = beside(solution, step, name, "pressure", pair.pressure).endless
        if at is not None:
            endless = True
            own = (fit for fit in fits(solution, step) if fit.place.body == body)
            found += [fit for fit in own if np.array_equal(fit.place.x, at)]
    if not endless:
        return {}
    result = {"max_pressure": math.inf}
    if found := [fit for fit in found if math.isfinite(fit.value)]:
        most = max(found, key=lambda fit: told_at([fit], "pressure"))
        result["stress_intensity"] = most.unit * most.value
        result["stress_exponent"] = most.mode.exponent.real
    return result


OUTCOME = (
    "status",
    "published",
    "iterations",
    "final_rho",
    "residual",
    "elastic_residual",
    "iterate_seconds",
    "reason",
)
"""How a case ended: what follows the coordinates in CSV and Parquet, before the quantities."""
COLUMNS = ("id", "problem", "variant", *OUTCOME, "digest", "keep", "bytes", "sum")
"""What else a row of a sweep has, in its log and in its table."""
BEGINNINGS = ("force_", "moment", "peak_", "load_factor", "von_mises_", "history_", "worn_")
"""How names of columns begin that not all problems have."""


def von_mises_at(solution: Solution, points: Sequence[Sequence[float]]) -> dict[str, float]:
    """The von Mises stress at points inside the body [stress]: von_mises_1, von_mises_2, ...

    Raises
    ------
    InputError
        If a point lies outside, or there are several bodies.
    """
    if not points:
        return {}
    solution.only_body("von_mises")
    values = solution.von_mises_at(points)
    return {f"von_mises_{number}": float(value) for number, value in enumerate(values, 1)}


def users(
    names: Sequence[str], folder: Path, coordinates: Sequence[str] = ()
) -> dict[str, Quantity]:
    """Functions by "module:function"; modules are looked for beside the sweep file first.

    Raises
    ------
    InputError
        If one cannot be imported, or is none, or two columns of the table would have one name.
    """
    taken = [name for name in coordinates if name != "variant"]
    if clash := next(
        (name for k, name in enumerate(taken) if name in taken[:k] or (k and is_column(name))),
        None,
    ):
        raise InputError(
            f"names: {clash}: a column of every table is called that, give another name"
        )
    quantities: dict[str, Quantity] = {}
    sys.path.insert(0, str(folder.resolve()))
    try:
        for name in names:
            try:
                function = pkgutil.resolve_name(name)
            except Exception as error:  # whatever a module of the user's raises
                raise InputError(
                    f"quantities: {name}: cannot be imported ({type(error).__name__}: {error})"
                ) from None
            if not callable(function):
                raise InputError(f"quantities: {name}: not a function")
            short = re.split("[.:]", name)[-1]
            taken_by_own = is_column(short) and function not in (
                peak_von_mises,
                peak_first_principal,
            )
            if short in quantities or short in coordinates or taken_by_own:
                raise InputError(
                    f"quantities: {name}: there is a column {short} already; give the function "
                    "another name"
                )
            quantities[short] = function
    finally:
        sys.path.pop(0)
    return quantities


def is_column(name: str) -> bool:
    """Return whether the table of some sweep has a column of this name."""
    own = {*COLUMNS, *QUANTITIES, *PEAKS, "estimated_error", "warnings", "unbounded"}
    own |= {"stress_intensity", "stress_exponent"}
    return name in own or name.startswith(BEGINNINGS)


def row_of(
    id_: str,
    coordinates: Mapping[str, object],
    solution: Solution,
    *,
    points: Sequence[Sequence[float]] = (),
    more: Mapping[str, Quantity] | None = None,
) -> Keyed:
    """A row of the table: coordinates, how the solve ended, and the quantities; von Mises stress at
    `points`, and `more`."""
    seconds = solution.timings
    return {
        "id": id_,
        **coordinates,
        "status": solution.status,
        "published": published_count(solution.problem),
        "iterations": solution.iterations,
        "final_rho": solution.last.rho,
        "residual": solution.last.residual,
        "elastic_residual": solution.last.residuals["elastic"],
        "iterate_seconds": seconds["steps"] if "steps" in seconds else seconds["iterate"],
        "reason": solution.reason,
        **contact_quantities(solution),
        **resultants(solution),
        **over_steps(solution),
        **wear(solution),
        **trust(solution),
        **unbounded_pressure(solution),
        **von_mises_at(solution, points),
        **{name: float(function(solution)) for name, function in (more or {}).items()},
    }


def failed_row(
    id_: str, coordinates: Mapping[str, object], case: Problem | None, reason: str
) -> Keyed:
    """Return the row of a case that has no solution."""
    return {
        "id": id_,
        **coordinates,
        "status": "failed",
        "published": None if case is None else published_count(case),
        "iterations": 0,
        "reason": reason,
    }
