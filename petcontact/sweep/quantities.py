"""What a sweep tells of a case: scalars of a solution, the same in two and three dimensions."""

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
from ..mesh.curve_mesh import as_curve
from ..model.case import Case
from ..results.steps.solution import AssemblySolution
from .problems import AnyCase, AnySolution
from .published import published_count

Quantity = Callable[[AnySolution], float]
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
    """

    weight: Array
    slip: Array
    sigma_t: Array
    sigma_n: Array
    state: States
    force: dict[str, Array]
    dissipated: float


def contact_of(solution: AnySolution) -> ContactState:
    """The contact state that a solution ends with."""
    if isinstance(solution, AssemblySolution):
        pairs = solution.last.pairs
        columns = (np.concatenate([getattr(pair, key) for pair in pairs.values()])
                   for key in ("weight", "slip", "sigma_t", "pressure", "state"))  # fmt: skip
        weight, slip, sigma_t, pressure, state = columns
        dissipated = sum(pair.dissipated for step in solution.steps for pair in step.pairs.values())
        return ContactState(weight, slip, sigma_t, -pressure, state, {n: p.force for n, p in pairs.items()}, dissipated)
    contact = solution.contact
    traction = contact.weight[:, None] * solution.traction[contact.nodes]
    force = {part: traction[contact.part == part].sum(axis=0) for part in dict.fromkeys(contact.part.tolist())}
    return ContactState(
        contact.weight, contact.u_t, contact.sigma_t, contact.sigma_n, contact.state, force,
        float(-(contact.weight[:, None] * contact.sigma_t * contact.u_t).sum()),
    )  # fmt: skip


def max_u_t(contact: ContactState) -> float:
    """Largest |u_t|, between bodies the largest slip, at a node [length]."""
    return float(np.linalg.norm(contact.slip, axis=1).max(initial=0.0))


def slip_length(contact: ContactState) -> float:
    """Length (in space: area) of what slips."""
    return float(contact.weight[contact.state == SLIP].sum())


def slip_share(contact: ContactState) -> float:
    """Share that slips [-]."""
    return slip_length(contact) / float(contact.weight.sum())


def contact_area(contact: ContactState) -> float:
    """Length (in space: area) of what is not open."""
    return float(contact.weight[contact.state != OPEN].sum())


def tension_share(contact: ContactState) -> float:
    """Share that is pulled, σ_n > 0 [-]: bilateral contact cannot open, a real one would there."""
    level = 1e-9 * float(np.abs(contact.sigma_n).max(initial=0.0))
    return float(contact.weight[contact.sigma_n > level].sum() / contact.weight.sum())


def dissipated_energy(contact: ContactState) -> float:
    """What friction takes, of a single load step -∫ σ_t·u_t [stress · length^dim]."""
    return contact.dissipated


def resultants(contact: ContactState) -> dict[str, float]:
    """∫ σ n by component: force_x, force_y; of several parts or interfaces with their names, force_x_bottom."""
    single = len(contact.force) == 1
    return {f"force_{axis}" + ("" if single else f"_{name}"): float(value)
            for name, force in contact.force.items() for axis, value in zip("xyz", force, strict=False)}  # fmt: skip


QUANTITIES = {
    function.__name__: function
    for function in (max_u_t, slip_length, slip_share, contact_area, tension_share, dissipated_energy)
}
"""Of every case."""
COLUMNS = ("id", "problem", "variant", "status", "published", "iterations", "final_rho", "residual", "elastic_residual",
           "iterate_seconds", "reason", "digest", "keep", "bytes", "sum")  # fmt: skip
"""What else a row of a sweep has, in its log and in its table."""


def von_mises_at(solution: AnySolution, points: Sequence[Sequence[float]]) -> dict[str, float]:
    """The von Mises stress at points inside the body [stress]: von_mises_1, von_mises_2, ...

    Raises
    ------
    InputError
        If a point lies outside, or there are several bodies.
    """
    if not points:
        return {}
    if isinstance(solution, AssemblySolution):
        raise InputError("von_mises: points are those of one body, this problem has several or load steps")
    from ..fields.interior import field_at, normal_stress_out_of_plane, von_mises

    material = solution.case.material
    _, stress = field_at(as_curve(solution.mesh), solution.u, solution.traction, material, np.array(points))
    values = von_mises(stress, normal_stress_out_of_plane(stress, material))
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
    return name in COLUMNS or name in QUANTITIES or name.startswith(("force_", "von_mises_", "history_"))


def row_of(
    id_: str, coordinates: Mapping[str, Any], solution: AnySolution, *,
    points: Sequence[Sequence[float]] = (), more: Mapping[str, Quantity] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """A row of the table: coordinates, how the solve ended, and the quantities; von Mises stress at `points`, and `more`."""
    contact = contact_of(solution)
    return {
        "id": id_, **coordinates, "status": solution.status, **_facts(solution), "reason": solution.reason,
        **{name: function(contact) for name, function in QUANTITIES.items()}, **resultants(contact),
        **von_mises_at(solution, points), **{name: float(function(solution)) for name, function in (more or {}).items()},
    }  # fmt: skip


def _facts(solution: AnySolution) -> dict[str, Any]:
    if isinstance(solution, AssemblySolution):
        return {
            "published": None, "iterations": solution.iterations, "final_rho": None,
            "residual": solution.last.residuals["tangential"], "elastic_residual": solution.last.residuals["elastic"],
            "iterate_seconds": solution.timings["steps"],
        }  # fmt: skip
    return {
        "published": published_count(solution.case), "iterations": solution.iterations, "final_rho": solution.rho,
        "residual": solution.residual, "elastic_residual": solution.elastic_residual,
        "iterate_seconds": solution.timings["iterate"],
    }  # fmt: skip


def failed_row(id_: str, coordinates: Mapping[str, Any], case: AnyCase | None, reason: str) -> dict[str, Any]:
    """The row of a case that has no solution."""
    published = published_count(case) if isinstance(case, Case) else None
    return {"id": id_, **coordinates, "status": "failed", "published": published, "iterations": 0, "reason": reason}
