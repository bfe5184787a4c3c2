"""Methods and rules side by side on the same discrete problems, over a list of ρ_0: what each one
costs, what it leaves.

Counts are those of the contact system: an elastic solve is a solve with S (with I + ρS, T + S or a
stick block), an application a product with S. Errors are relative, in L2(Γ_C) with the node
weights, against a given solution or against the system's own one by semismooth Newton, which is
exact up to round-off.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..arrays import Array
from ..contact.criterion import Criterion, natural_residuals
from ..contact.friction_law import contact_norm
from ..contact.iteration import Iteration
from ..contact.law_protocol import ContactLaw
from ..contact.methods.registry import method_of
from ..contact.state import ContactState, Monitor
from ..contact.system import ContactSystem
from ..errors import InputError
from ..given.tables.solver_options import Method
from ..model.problem import Problem
from ..pipeline.run import described, prepare
from ..pipeline.steps.start import carried_over
from ..pipeline.steps.step_loop import first_increment
from ..record import record
from ..results.solution import read_result
from ..runtime.hints import demand_name
from ..runtime.petsc import options
from ..runtime.ranks import alone, shared_solve
from ..untyped import Comm, Keyed

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


def named_contenders(word: str) -> list[str]:
    """The contenders of a name: their own, or a `name` or `rule` of `[method]`.

    >>> named_contenders("modified"), named_contenders("tao")
    (['rule (4.3)'], ['tao'])

    Raises
    ------
    InputError
        If there is none.
    """
    of_rule = [name for name, keys in CONTENDERS.items() if keys.get("rule") == word]
    named = of_rule or [name for name, keys in CONTENDERS.items() if keys["name"] == word]
    allowed = {key: None for keys in CONTENDERS.values() for key in keys.values()}
    if not named:
        demand_name(
            "--methods: no contender", word, dict.fromkeys([*allowed, *CONTENDERS]), "they are"
        )
    return named or [word]


@record
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
        After each iteration, where it was asked for; none for TAO, whose own products nobody
        counts.
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
    cases: Sequence[tuple[str, Problem]],
    *,
    contenders: Sequence[str] | None = None,
    rhos: Sequence[float] = RHOS,
    reference: str | None = None,
    comm: Comm = None,
    say: Callable[[Trial], None] | None = None,
) -> list[Trial]:
    """Run every contender on every case and ρ_0.

    Parameters
    ----------
    cases : sequence of (label, Problem)
        Each is eliminated once, and its first increment solved; ω, τ, c_max, tolerance and limit
        are of its `[method]`.
    contenders : sequence of str, optional
        Keys of CONTENDERS; by default those that take the problem at hand.
    rhos : sequence of float
        ρ_0 for the projection method [stress/length]; runs of the middle one are followed iteration
        by iteration.
    reference : str, optional
        Result file to measure errors against; by default each system's own solution.
    comm : PETSc.Comm, optional
    say : callable, optional
        Called with each row.

    Raises
    ------
    InputError
        If the ranks are called with different values, or a case has no contact.
    RanksError
        If another rank fails, or does not begin within 60 s (PETCONTACT_PATIENCE).
    """

    def call() -> Callable[[], Keyed]:
        more = {"contenders": contenders, "rhos": [*rhos], "reference": reference}
        return lambda: {label: described(case) for label, case in cases} | more

    with shared_solve(comm, call) as comm:
        return _compared(cases, contenders, rhos, reference, comm, alone(say))


def _compared(
    cases: Sequence[tuple[str, Problem]],
    contenders: Sequence[str] | None,
    rhos: Sequence[float],
    reference: str | None,
    comm: Comm,
    say: Callable[[Trial], None] | None,
) -> list[Trial]:
    followed = rhos[len(rhos) // 2]
    rows = []
    if idle := [label for label, case in cases if not case.interfaces]:
        raise InputError(f"{idle[0]}: nothing is in contact, and methods differ in contact only")
    for label, case in cases:
        prepared = prepare(case, comm, cases=len(contenders or CONTENDERS) * len(rhos))
        with contextlib.closing(prepared), options(case.petsc):
            trials = _Trials(first_increment(prepared).system, prepared.discrete.law)
            if reference is None:
                state = trials.iterate(Method(name="semismooth-newton", tolerance=1e-9))
                trials.exact = state.v, state.sigma
            else:
                trials.exact = carried_over(prepared, read_result(reference).last)
            for name in contenders or CONTENDERS:
                for rho in rhos if "rule" in CONTENDERS[name] else (None,):
                    try:
                        row = trials.run(
                            case.method, label, name, rho, follow=rho in (None, followed)
                        )
                    except (
                        InputError
                    ):  # a method for other problems; where nobody asked for it, it is left out
                        if contenders is not None:
                            raise
                        break
                    rows.append(row)
                    if say is not None:
                        say(row)
    return rows


@dataclass
class _Trials:
    """Runs on one contact system.

    Attributes
    ----------
    system : ContactSystem
    law : ContactLaw
    exact : pair of (m, k) arrays
        v and σ to measure errors against.
    """

    system: ContactSystem
    law: ContactLaw
    exact: tuple[Array, Array] = (np.zeros((0, 0)),) * 2

    def iterate(self, method: Method, monitor: Monitor | None = None) -> ContactState:
        """The outcome of a method, started from zero."""
        iteration = Iteration(
            Criterion(method.tolerance, method.stop), method.max_iterations, None, monitor
        )
        return method_of(method)(self.system, self.law, iteration)

    def run(
        self, method: Method, label: str, name: str, rho: float | None, *, follow: bool
    ) -> Trial:
        """One trial of a contender."""
        changes, system = {**CONTENDERS[name], **({} if rho is None else {"rho": rho})}, self.system
        method = method.model_copy(update=changes)
        path: list[tuple[int, float]] = []
        if follow and name != "tao":
            first = system.applications
            self.iterate(
                method,
                lambda state: path.append((system.applications - first, self._residual(state))),
            )
        solves = system.elastic_solves
        applications = system.applications
        began = time.perf_counter()
        state = self.iterate(method)
        seconds = time.perf_counter() - began
        return Trial(
            label,
            name,
            rho,
            state.converged,
            len(state.history),
            system.elastic_solves - solves,
            system.applications - applications,
            seconds,
            self._residual(state),
            *self._errors(state),
            path,
        )

    def _residual(self, state: ContactState) -> float:
        return max(natural_residuals(self.law, self.system, state.v, state.sigma))

    def _errors(self, state: ContactState) -> tuple[float, float]:
        weight, pairs = self.system.weight, zip((state.v, state.sigma), self.exact, strict=True)
        found = [
            contact_norm(a - b, weight) / (contact_norm(b, weight) or np.nan) for a, b in pairs
        ]
        return found[0], found[1]
