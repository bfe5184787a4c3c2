"""Methods and rules side by side on the same discrete problems, over a list of ρ_0: what each one costs, what it leaves.

Counts are those of the contact system: an elastic solve is a solve with S (with I + ρS, T + S or a stick block), an
application a product with S. Errors are relative, in L2(Γ_C) with the node weights, against a given solution or against
the system's own one by semismooth Newton, which is exact up to round-off.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arrays import Array
from ..contact.criterion import relative_residual
from ..contact.friction_law import contact_norm
from ..contact.state import ContactState
from ..model.case import Case
from ..model.solver_options import Method
from ..pipeline.initial_state import initial_functions
from ..pipeline.prepare import Prepared, prepare
from ..pipeline.run import iterate
from ..runtime.petsc import options

RHOS = tuple(10.0**k for k in range(8))
"""ρ_0 of the paper's tables [daN/mm³]."""
CONTENDERS = {
    "fixed rho": {"name": "projection", "rule": "fixed"},
    "rule (4.2)": {"name": "projection", "rule": "self-adaptive"},
    "rule (4.3)": {"name": "projection", "rule": "modified"},
    "rule (4.3) safeguarded": {"name": "projection", "rule": "modified-safeguarded"},
    "operator-robin": {"name": "operator-robin"},
    "semismooth-newton": {"name": "semismooth-newton"},
    "tao": {"name": "tao"},
}
"""What takes part, by the keys of `[method]` that it changes."""


@dataclass(frozen=True)
class Trial:
    """One run.

    Attributes
    ----------
    problem, contender : str
    rho : float or None
        ρ_0 [stress/length]; None for methods that have none.
    converged : bool
    iterations, elastic_solves, applications : int
    seconds : float
        Wall time of the method on a prepared system.
    residual : float
        ‖R_ρ‖/‖σ_t‖ with the balanced ρ [-].
    error_u, error_sigma : float
        Against the reference [-]; NaN where the reference has no σ_t.
    path : list of (applications, residual)
        After each iteration, where it was asked for; none for TAO, whose own products nobody counts.
    """

    problem: str
    contender: str
    rho: float | None
    converged: bool
    iterations: int
    elastic_solves: int
    applications: int
    seconds: float
    residual: float
    error_u: float
    error_sigma: float
    path: list[tuple[int, float]] = field(default_factory=list)


def compare(
    cases: Sequence[tuple[str, Case]],
    *,
    contenders: Sequence[str] = tuple(CONTENDERS),
    rhos: Sequence[float] = RHOS,
    path_rho: float | None = None,
    reference: str | None = None,
    comm: Any = None,
    say: Callable[[Trial], None] | None = None,
) -> list[Trial]:
    """Run every contender on every case and ρ_0.

    Parameters
    ----------
    cases : sequence of (label, Case)
        Each is discretised and eliminated once; ω, τ, c_max, tolerance and limit are those of its `[method]`.
    contenders : sequence of str
        Keys of CONTENDERS.
    rhos : sequence of float
        ρ_0 for the projection method [stress/length].
    path_rho : float, optional
        The ρ_0 whose runs are followed iteration by iteration; the middle one by default.
    reference : str, optional
        Result file to measure errors against; by default each system's own solution.
    comm : PETSc.Comm, optional
    say : callable, optional
        Called with each row.
    """
    followed = path_rho if path_rho is not None else rhos[len(rhos) // 2]
    rows = []
    for label, case in cases:
        prepared = prepare(case, comm, cases=len(contenders) * len(rhos))
        try:
            with options(case.petsc):
                exact = _reference(prepared, reference)
                for name in contenders:
                    for rho in rhos if "rule" in CONTENDERS[name] else (None,):
                        row = _run(prepared, case.method, label, name, rho, exact, follow=rho in (None, followed))
                        rows.append(row)
                        if say is not None:
                            say(row)
        finally:
            prepared.close()
    return rows


def _reference(prepared: Prepared, name: str | None) -> tuple[Array, Array]:
    if name is not None:
        operators = prepared.operators
        start = initial_functions(name, prepared.system, operators.mesh, operators.data.contact_nodes)
        assert start is not None
        return start
    state = iterate(prepared, Method(name="semismooth-newton", tolerance=1e-9))
    return state.v, state.sigma


def _run(
    prepared: Prepared, method: Method, label: str, name: str, rho: float | None, exact: tuple[Array, Array], *,
    follow: bool,
) -> Trial:  # fmt: skip
    system = prepared.system
    changes: dict[str, Any] = {**CONTENDERS[name], "start": "zero"}
    if rho is not None:
        changes["rho"] = rho
    method = method.model_copy(update=changes)
    measure = _Measure(prepared, exact)
    path: list[tuple[int, float]] = []
    if follow and name != "tao":
        first = system.applications
        iterate(
            prepared, method,
            monitor=lambda state: path.append((system.applications - first, measure.residual(state))),
        )  # fmt: skip
    solves, applications, began = system.elastic_solves, system.applications, time.perf_counter()
    state = iterate(prepared, method)
    seconds = time.perf_counter() - began
    return Trial(
        label, name, rho, state.converged, len(state.history), system.elastic_solves - solves,
        system.applications - applications, seconds, measure.residual(state), *measure.errors(state), path,
    )  # fmt: skip


class _Measure:
    """Residual and errors of a state."""

    def __init__(self, prepared: Prepared, exact: tuple[Array, Array]) -> None:
        self._law, self._system, self._exact = prepared.law, prepared.system, exact

    def residual(self, state: ContactState) -> float:
        return relative_residual(self._law, self._system, state.v, state.sigma)

    def errors(self, state: ContactState) -> tuple[float, float]:
        pairs = zip((state.v, state.sigma), self._exact, strict=True)
        return tuple(  # type: ignore[return-value]
            contact_norm(a - b, self._system.weight) / (contact_norm(b, self._system.weight) or np.nan) for a, b in pairs
        )
