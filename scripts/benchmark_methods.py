#!/usr/bin/env python3
"""Time petcontact's methods and their peers on one dual problem, to the same true error.

The problem is Example 1's, with S made symmetric so that quadratic-programming solvers can take
part: minimise ½σᵀWSσ + σᵀWu_0 over |σ| <= g. Times include everything that a solver sets up from S;
they are CPU seconds on one thread (set OPENBLAS_NUM_THREADS=1), so that other work on the machine
disturbs them little.

    python scripts/benchmark_methods.py --sizes 160 640 2560
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from petcontact import Contact, Displacement, Material, MeshOptions, Method, Rectangle, Traction
from petcontact.contact.criterion import Criterion
from petcontact.contact.iteration import Iteration
from petcontact.contact.laws import Tresca
from petcontact.contact.methods.registry import method_of
from petcontact.contact.system import ContactSystem, Surrogate
from petcontact.model.problem import Problem
from petcontact.pipeline.run import prepare
from petcontact.pipeline.steps.step_loop import first_increment
from petcontact.runtime.petsc import petsc

Array = np.ndarray


@dataclass
class Dual:
    """The dual problem as peers see it: S (m, m), u_0, g and the weights (m,); and what our methods
    need besides."""

    posed: ContactSystem
    compliance_matrix: Array
    u_0: Array
    bound: Array
    weight: Array
    ksp_iterations: int = 0
    elastic_solves: int = 0
    applications: int = 0
    matrix_free: bool = False
    modes: None = None

    def apply(self, sigma_t: Array) -> Array:
        """S σ_t."""
        self.applications += 1
        return self.compliance_matrix @ sigma_t

    def compliance(self) -> Array:
        """S."""
        return self.compliance_matrix

    def surrogate(self) -> Surrogate | None:
        """T."""
        return self.posed.surrogate()

    def robin(self, rho: float, f: Array) -> tuple[Array, Array]:
        """Robin solve from scratch."""
        change, sigma = self.robin_increment(rho, f - rho * self.u_0)
        return self.u_0 + change, sigma

    def robin_increment(self, rho: float, r: Array) -> tuple[Array, Array]:
        """Robin solve for an increment."""
        self.elastic_solves += 1
        sigma = np.linalg.solve(np.eye(len(r)) + rho * self.compliance_matrix, r)
        return self.apply(sigma), sigma


def example_1(contact_nodes: int) -> Dual:
    """Example 1 with that many constant elements on Γ_C; the other sides take at most h = 0.025."""
    size = 8.0 / contact_nodes
    others = dict.fromkeys(("top", "left", "right"), max(size, 0.025))
    case = Problem(
        material=Material(young_modulus=1e4, poisson_ratio=0.3),
        geometry=Rectangle(lower_left=(0.0, 0.0), upper_right=(8.0, 4.0)),
        mesh=MeshOptions(element_size=size, element_sizes=others),
        boundary=(
            Contact(part="bottom", friction_bound=150.0),
            Displacement(part="top", value=(0.0, 0.0)),
            Traction(part="left", value=(400.0, 0.0)),
            Traction(part="right", value=(0.0, 0.0)),
        ),
        bem={"mat_type": "dense"},
    )
    prepared = prepare(case, petsc().COMM_SELF)
    system, law = first_increment(prepared).system, prepared.discrete.law
    form = system.weight[:, None] * system.compliance()
    symmetric = 0.5 * (form + form.T) / system.weight[:, None]
    return Dual(system, symmetric, system.u_0, law.bound, system.weight)


def ours(name: str, tolerance: float) -> Callable[[Dual], Array]:
    """One of petcontact's methods."""
    method = Method(name=name, tolerance=tolerance)
    iteration = Iteration(Criterion(tolerance), method.max_iterations)
    return lambda dual: method_of(method)(dual, Tresca(dual.bound), iteration).sigma[:, 0]


def newton_cholesky(dual: Dual) -> Array:
    """The few lines: semismooth Newton from full stick, Cholesky on the stick block."""
    form, base = dual.weight[:, None] * dual.compliance_matrix, dual.weight * dual.u_0[:, 0]
    active, sigma = np.zeros(len(base)), np.zeros(len(base))
    rho = 1.0 / np.diag(dual.compliance_matrix)
    for _ in range(100):
        stick = active == 0
        sigma = np.where(stick, 0.0, active * dual.bound)
        gradient = form @ sigma + base
        factor = scipy.linalg.cho_factor(
            form[np.ix_(stick, stick)], check_finite=False, overwrite_a=True
        )
        sigma[stick] = -scipy.linalg.cho_solve(factor, gradient[stick], check_finite=False)
        trial = sigma - rho * (form @ sigma + base) / dual.weight
        new = np.where(np.abs(trial) > dual.bound, np.sign(trial), 0.0)
        if np.array_equal(new, active):
            break
        active = new
    return sigma


def eigenprojection(dual: Dual) -> Array:
    """The paper's method with rule (4.3) on one eigendecomposition of S, at a tolerance that leaves
    a true error of 1e-8."""
    from petcontact.contact.friction_law import contact_norm
    from petcontact.contact.law_protocol import law_residual
    from petcontact.contact.laws import Tresca
    from petcontact.contact.rho_rules import Modified, usable_balance

    root = np.sqrt(dual.weight)
    values, vectors = scipy.linalg.eigh(
        dual.compliance_matrix * root[:, None] / root, check_finite=False
    )
    rule, rho = Modified(), 1.0
    u, sigma = dual.u_0.copy(), np.zeros_like(dual.u_0)
    for _ in range(20_000):
        r = -1.8 * law_residual(Tresca(dual.bound), u, sigma, rho)
        modal = vectors.T @ (root[:, None] * r) / (1.0 + rho * values)[:, None]
        moved = (vectors @ np.hstack([values[:, None] * modal, modal])) / root[:, None]
        du, dsigma = moved[:, :1], moved[:, 1:]
        u, sigma = u + du, sigma + dsigma
        step = contact_norm(du, dual.weight), contact_norm(dsigma, dual.weight)
        if step[1] <= 3e-11 * contact_norm(sigma, dual.weight) and step[0] <= 3e-11 * contact_norm(
            u, dual.weight
        ):
            break
        balance = usable_balance(step[1], step[0])
        rho = rule.update(rho, balance) if np.isfinite(balance) else rho
    return sigma[:, 0]


def tao_solver(kind: str) -> Callable[[Dual], Array]:
    """TAO alone on the dual problem, without the Newton steps that petcontact adds."""
    from petcontact.contact.methods import tao

    def solve(dual: Dual) -> Array:
        tao.DEFAULT_TYPE = kind
        return tao.minimise(
            dual.compliance_matrix,
            dual.u_0[:, 0],
            dual.bound,
            dual.weight,
            np.zeros(len(dual.bound)),
        )[-1]

    return solve


def scaled(dual: Dual) -> tuple[Array, Array, Array, Array]:
    """P with unit diagonal, q and the bound of the problem in x = σ/unit of order one, and unit."""
    form = dual.weight[:, None] * dual.compliance_matrix
    root = np.sqrt(np.diag(form))
    size = float(dual.bound.max() * root.mean())
    return (
        form / (root[:, None] * root),
        dual.weight * dual.u_0[:, 0] / (root * size),
        dual.bound * root / size,
        size / root,
    )


def osqp(dual: Dual) -> Array:
    """OSQP; its tolerance is set so that the true error is met."""
    import osqp as package
    import scipy.sparse

    p, q, bound, unit = scaled(dual)
    solver = package.OSQP()
    solver.setup(
        scipy.sparse.csc_matrix(np.triu(p)),
        q,
        scipy.sparse.identity(len(q), format="csc"),
        -bound,
        bound,
        eps_abs=1e-9,
        eps_rel=0.0,
        max_iter=200_000,
        verbose=False,
    )
    return np.asarray(solver.solve().x) * unit


def clarabel(dual: Dual) -> Array:
    """Clarabel's interior points."""
    import clarabel as package
    import scipy.sparse

    p, q, bound, unit = scaled(dual)
    identity = scipy.sparse.identity(len(q), format="csc")
    settings = package.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-13
    constraints = scipy.sparse.vstack([identity, -identity], format="csc")
    limits = np.concatenate([bound, bound])
    cones = [package.NonnegativeConeT(2 * len(q))]
    solver = package.DefaultSolver(
        scipy.sparse.csc_matrix(np.triu(p)), q, constraints, limits, cones, settings
    )
    return np.asarray(solver.solve().x) * unit


def proxqp(dual: Dual) -> Array:
    """ProxQP, dense."""
    import proxsuite

    p, q, bound, unit = scaled(dual)
    solver = proxsuite.proxqp.dense.QP(len(q), 0, 0, True)
    solver.settings.eps_abs = 1e-10
    solver.init(p, q, None, None, None, None, None, -bound, bound)
    solver.solve()
    return np.asarray(solver.results.x) * unit


def piqp(dual: Dual) -> Array:
    """PIQP, dense."""
    import piqp as package

    p, q, bound, unit = scaled(dual)
    solver = package.DenseSolver()
    solver.settings.eps_abs = solver.settings.eps_duality_gap_abs = 1e-12
    solver.settings.eps_rel = solver.settings.eps_duality_gap_rel = 0.0
    solver.setup(P=p, c=q, x_l=-bound, x_u=bound)
    solver.solve()
    return np.asarray(solver.result.x) * unit


SOLVERS: dict[str, Callable[[Dual], Array]] = {
    "petcontact semismooth-newton": ours("semismooth-newton", 1e-8),
    "petcontact operator-robin": ours("operator-robin", 2e-9),
    "Newton, Cholesky (few lines)": newton_cholesky,
    "TAO bnls": tao_solver("bnls"),
    "TAO gpcg": tao_solver("gpcg"),
    "TAO tron": tao_solver("tron"),
    "rule (4.3), one eigendecomposition": eigenprojection,
    "OSQP": osqp,
    "Clarabel": clarabel,
    "ProxQP": proxqp,
    "PIQP": piqp,
}


@dataclass(frozen=True)
class Measured:
    """Best CPU time [s] of several runs, and the true relative error of σ_t, or why there is
    none."""

    solver: str
    size: int
    seconds: float
    error: float
    note: str = ""


def measure(dual: Dual, name: str, exact: Array, seconds: float = 3.0, runs: int = 20) -> Measured:
    """Best of up to `runs` runs, or as many as fit into `seconds`."""
    best, error, spent = np.inf, np.nan, 0.0
    for _ in range(runs):
        began = time.process_time()
        try:
            sigma = SOLVERS[name](dual)
        except ImportError as missing:
            return Measured(name, len(exact), np.nan, np.nan, f"not installed ({missing.name})")
        took = time.process_time() - began
        best, spent = min(best, took), spent + took
        error = float(np.sqrt(dual.weight @ (sigma - exact) ** 2) / np.sqrt(dual.weight @ exact**2))
        if spent > seconds:
            break
    return Measured(name, len(exact), best, error)


def main() -> None:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--sizes", type=int, nargs="+", default=[160, 640, 2560], help="contact nodes"
    )
    parser.add_argument("--solvers", nargs="+", default=list(SOLVERS), help="names as in the table")
    parser.add_argument(
        "--quick", action="store_true", help="the smallest size, which measures nothing"
    )
    arguments = parser.parse_args()
    if arguments.quick:
        arguments.sizes = [20]
    print(
        "| solver | n_C | time/ms | times Newton, Cholesky | error of σ_t |\n| --- | ---: | ---: "
        "| ---: | ---: |"
    )
    for size in arguments.sizes:
        dual = example_1(size)
        exact = ours("semismooth-newton", 1e-8)(dual)
        yardstick = measure(dual, "Newton, Cholesky (few lines)", exact).seconds
        for name in arguments.solvers:
            row = measure(dual, name, exact)
            cells = (
                row.note
                or f"{1e3 * row.seconds:.2f} | {row.seconds / yardstick:.2f} | {row.error:.1e}"
            )
            print(f"| {name} | {size} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
