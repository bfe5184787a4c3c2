"""What a sweep records of a case: scalars of a solution, the same in two and three dimensions."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array, States
from ..errors import InputError
from ..model.problem import Problem
from ..results.solution import Solution
from .published import published_count

Quantity = Callable[[Solution], float]
OPEN, SLIP = 2, 1


@dataclass(frozen=True)
class ContactState:
    """What quantities are made of: the nodes of all contact parts and interfaces below one another, after the last step.

    Attributes
    ----------
    weight : (m,) array
        Quadrature weights [length^(dim-1)].
    slip, sigma_t : (m, dim-1) arrays
        u_t, or the relative tangential displacement of two bodies [length], and the tangential traction [stress].
    sigma_n : (m,) array
        Normal traction, negative in compression [stress].
    state : (m,) array
        0 stick, 1 slip, 2 open.
    force : dict of str to (dim,) array
        On the body (of a pair: the secondary), by part or interface [stress · length^(dim-1)].
    dissipated : float
        What friction took, in all steps [stress · length^dim].
    worn : dict of str to (2,) array
        Volume and largest depth of wear, of both sides together, by interface that wears [length^dim], [length].
    """

    weight: Array
    slip: Array
    sigma_t: Array
    sigma_n: Array
    state: States
    force: dict[str, Array]
    dissipated: float
    worn: dict[str, Array]


def contact_of(solution: Solution) -> ContactState:
    """The contact state that a solution ends with."""
    columns = solution.columns()
    steps = solution.steps or solution.tried
    return ContactState(
        columns["weight"],
        columns["slip"],
        columns["sigma_t"],
        columns["sigma_n"],
        columns["state"],
        {name: pair.force for name, pair in solution.pairs.items()},
        sum(pair.dissipated for step in steps for pair in step.pairs.values()),
        {
            name: np.array([pair.worn_volume.sum(), pair.worn_depth])
            for name, pair in solution.pairs.items()
            if pair.wear is not None
        },
    )


def max_u_t(contact: ContactState) -> float:
    """Largest |u_t|, between bodies the largest slip, at a node [length]."""
    return float(np.linalg.norm(contact.slip, axis=1).max(initial=0.0))


def slip_length(contact: ContactState) -> float:
    """Length (in space: area) of what slips."""
    return float(contact.weight[contact.state == SLIP].sum())


def slip_share(contact: ContactState) -> float:
    """Share of the contact parts that slips [-]."""
    return slip_length(contact) / (float(contact.weight.sum()) or 1.0)


def contact_area(contact: ContactState) -> float:
    """Length (in space: area) of what is not open."""
    return float(contact.weight[contact.state != OPEN].sum())


def tension_share(contact: ContactState) -> float:
    """Share that is pulled, σ_n > 0 [-]: bilateral contact cannot open, a real one would there."""
    level = 1e-9 * float(np.abs(contact.sigma_n).max(initial=0.0))
    return float(contact.weight[contact.sigma_n > level].sum()) / (float(contact.weight.sum()) or 1.0)


def dissipated_energy(contact: ContactState) -> float:
    """What friction takes, of a single load step -∫ σ_t·u_t [stress · length^dim]."""
    return contact.dissipated


def resultants(contact: ContactState) -> dict[str, float]:
    """∫ σ n by component: force_x, force_y; of several parts or interfaces with their names, force_x_bottom."""
    single = len(contact.force) == 1
    return {f"force_{axis}" + ("" if single else f"_{name}"): float(value)
            for name, force in contact.force.items() for axis, value in zip("xyz", force, strict=False)}  # fmt: skip


def wear(contact: ContactState) -> dict[str, float]:
    """worn_volume, worn_depth and max_pressure where anything wears; of several interfaces that do with their names."""
    found = {f"{key}_{name}" if len(contact.worn) > 1 else key: float(value) for name, values in contact.worn.items()
             for key, value in zip(("worn_volume", "worn_depth"), values, strict=True)}  # fmt: skip
    return {**found, "max_pressure": float(-contact.sigma_n.min(initial=0.0))} if found else {}


QUANTITIES = {
    function.__name__: function
    for function in (max_u_t, slip_length, slip_share, contact_area, tension_share, dissipated_energy)
}
"""Of every case."""
COLUMNS = ("id", "problem", "variant", "status", "published", "iterations", "final_rho", "residual", "elastic_residual",
           "iterate_seconds", "reason", "digest", "keep", "bytes", "sum")  # fmt: skip
"""What else a row of a sweep has, in its log and in its table."""


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


def users(names: Sequence[str], folder: Path, coordinates: Sequence[str] = ()) -> dict[str, Quantity]:
    """Functions by "module:function"; modules are looked for beside the sweep file first.

    Raises
    ------
    InputError
        If one cannot be imported, or is none, or two columns of the table would have one name.
    """
    taken = [name for name in coordinates if name != "variant"]
    if clash := next((name for k, name in enumerate(taken) if name in taken[:k] or (k and is_column(name))), None):
        raise InputError(f"names: {clash}: a column of every table is called that, give another name")
    found: dict[str, Quantity] = {}
    sys.path.insert(0, str(folder.resolve()))
    try:
        for name in names:
            module, _, attribute = name.partition(":")
            try:
                function = importlib.import_module(module)
                for word in attribute.split("."):
                    function = getattr(function, word)
            except Exception as error:  # whatever a module of the user's raises
                raise InputError(f"quantities: {name}: cannot be imported ({type(error).__name__}: {error})") from None
            if not callable(function):
                raise InputError(f"quantities: {name}: not a function")
            short = attribute.rsplit(".", 1)[-1]
            if short in found or short in coordinates or is_column(short):
                raise InputError(f"quantities: {name}: there is a column {short} already; give the function another name")
            found[short] = function
    finally:
        sys.path.pop(0)
    return found


def is_column(name: str) -> bool:
    """Whether the table of any sweep has, or may have, such a column of its own."""
    own = name in COLUMNS or name in QUANTITIES or name == "max_pressure"
    return own or name.startswith(("force_", "von_mises_", "history_", "worn_"))


def row_of(
    id_: str, coordinates: Mapping[str, Any], solution: Solution, *,
    points: Sequence[Sequence[float]] = (), more: Mapping[str, Quantity] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """A row of the table: coordinates, how the solve ended, and the quantities; von Mises stress at `points`, and `more`."""
    contact = contact_of(solution)
    return {
        "id": id_, **coordinates, "status": solution.status, **_facts(solution), "reason": solution.reason,
        **{name: function(contact) for name, function in QUANTITIES.items()}, **resultants(contact), **wear(contact),
        **von_mises_at(solution, points), **{name: float(function(solution)) for name, function in (more or {}).items()},
    }  # fmt: skip


def _facts(solution: Solution) -> dict[str, Any]:
    seconds, case = solution.timings, solution.case
    return {
        "published": published_count(case) if isinstance(case, Problem) else None, "iterations": solution.iterations,
        "final_rho": solution.rho, "residual": solution.residual, "elastic_residual": solution.elastic_residual,
        "iterate_seconds": seconds["steps"] if "steps" in seconds else seconds["iterate"],
    }  # fmt: skip


def failed_row(id_: str, coordinates: Mapping[str, Any], case: Problem | None, reason: str) -> dict[str, Any]:
    """The row of a case that has no solution."""
    published = published_count(case) if isinstance(case, Problem) else None
    return {"id": id_, **coordinates, "status": "failed", "published": published, "iterations": 0, "reason": reason}
