"""What can be done with a problem can be done with every kind of problem; what is yet to come is
refused in one line. Bodies of the plane and one body in space are what most other tests solve."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import pytest

from petcontact import load, read_result, solve
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.contact.rho_rules import SelfAdaptive
from petcontact.pipeline.pose.discretise import discretise

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"
KINDS = {
    "axial": ("axial_press_fit", 5.0),
    "torsion": ("axial_torque", 5.0),
    "space": ("space_stack", 1.0),
}
"""A config of two bodies and load steps each, of which contact alone holds one, and the size of
its elements here."""


def posed(kind, **changes):
    """The problem of a kind, with changes, __ for a dot."""
    name, size = KINDS[kind]
    mesh = {f"body.{k}.mesh": {"element_size": size, "order": 1} for k in range(2)}
    changes = {key.replace("__", "."): value for key, value in changes.items()}
    return load(CONFIGS / f"{name}.toml", mesh | changes)


@functools.cache
def solved(kind):
    return solve(posed(kind))


def assert_alike(kind, other, tolerance, solution=None):
    solution = solution or solved(kind)
    assert solution.converged and other.converged, (solution.reason, other.reason)
    for name, pair in solution.pairs.items():
        size = max(np.abs(pair.pressure).max(), np.abs(pair.sigma_t).max())
        for key in ("pressure", "sigma_t"):
            off = getattr(other.pairs[name], key) - getattr(pair, key)
            assert np.abs(off).max() < tolerance * size, key


def rule_of_ones_own(kind, tmp_path):
    class Counted(SelfAdaptive):
        calls = 0

        def update(self, rho, balance):
            Counted.calls += 1
            return super().update(rho, balance)

    # where contact alone holds a stiff hub the projection method takes thousands of iterations
    most = 5000 if kind == "space" else 30
    keys = {"method__tolerance": 1e-8, "method__max_iterations": most}
    solution = solve(posed(kind, **keys), rule=Counted(2.0))
    assert Counted.calls > 0 and solution.provenance.rule == "Counted"
    if kind == "space":
        assert_alike(kind, solution, 1e-3)


def law_of_ones_own(kind, tmp_path):
    changed = posed(kind, contact__0__friction_coefficient=0.5)
    own = solve(posed(kind), law=discretise(changed).law)
    assert_alike(kind, own, 1e-12, solve(changed))


def method_of_ones_own(kind, tmp_path):
    """And from the solution without friction."""
    seen = []

    def method(system, law, iteration):
        seen.append((iteration.start, system.u_0))
        return SemismoothNewton()(system, law, iteration)

    assert_alike(kind, solve(posed(kind), method=method), 1e-12)
    nodes = sum(len(pair.x) for pair in solved(kind).pairs.values())
    assert {len(u_0) for _, u_0 in seen} == {nodes}
    seen.clear()
    assert_alike(kind, solve(posed(kind, method__start="frictionless"), method=method), 1e-6)
    (v, sigma), u_0 = seen[0]
    assert np.array_equal(v, u_0) and not sigma.any()


def monitor_that_ends_the_solve(kind, tmp_path):
    assert solve(posed(kind), monitor=lambda state: "enough").reason.startswith("enough")


def restart(kind, tmp_path):
    solved(kind).save(tmp_path / "r.h5")
    again = solve(posed(kind, method__start=f"{tmp_path / 'r.h5'}:1"))
    assert len(again.steps) == len(solved(kind).steps)
    assert_alike(kind, again, 1e-7)


def compressed_operators(kind, tmp_path):
    storage, tolerance = ("hmatrix", 1e-7) if kind == "space" else ("hodlr", 1e-9)
    mesh = {f"body__{k}__mesh": {"element_size": 0.5, "order": 1} for k in range(2)}
    bem = {"bem__mat_type": storage, f"bem__{storage}_tol": tolerance}
    solution = solve(posed(kind, **mesh, **bem))
    assert storage in solution.provenance.solver
    assert_alike(kind, solution, 1e-5, solve(posed(kind, **mesh)))


def wear_over_cycles(kind, tmp_path):
    """What it opens is a gap; a part that is pressed and never drawn along does not wear."""
    cycle = {"first": "push", "last": "release", "count": 8}
    solution = solve(posed(kind, cycle=cycle, contact__0__wear_coefficient=1e-2))
    assert solution.converged and solution.wear.cycle[-1] == 8
    ((name, depth),) = solution.wear.depth.items()
    pair = solution.pairs[name]
    assert np.all(np.diff(depth @ pair.weight) > 0.0)
    assert np.array_equal(depth[-1], pair.wear.sum(axis=1))
    solution.save(tmp_path / "r.h5")
    assert read_result(tmp_path / "r.h5").verdict() == solution.verdict()


ALL = rule_of_ones_own, law_of_ones_own, method_of_ones_own, monitor_that_ends_the_solve, restart
MEMBERS = [(capability, kind) for kind in KINDS for capability in ALL]
MEMBERS += [(compressed_operators, "space"), (wear_over_cycles, "space")]
QUICK = {(capability, kind) for capability, kind in MEMBERS if kind != "space"}
QUICK |= {(monitor_that_ends_the_solve, "space")}


@pytest.mark.parametrize(
    ("capability", "kind"),
    [
        pytest.param(
            *member,
            id=f"{member[1]}-{member[0].__name__}",
            marks=() if member in QUICK else pytest.mark.slow,
        )
        for member in MEMBERS
    ],
)
def test_every_kind_of_problem(capability, kind, tmp_path):
    capability(kind, tmp_path)
