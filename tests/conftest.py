"""Shared pieces of the tests: the paper's examples, and PETSc started once."""

from __future__ import annotations

import dataclasses
import signal

import pytest
from hypothesis import settings

from petcontact import (
    Contact,
    Displacement,
    Material,
    MeshOptions,
    Method,
    Problem,
    Rectangle,
    Traction,
)
from petcontact.contact.methods.registry import method_of
from petcontact.pipeline.run import run
from petcontact.runtime.petsc import petsc
from petcontact.runtime.threads import cap_blas_threads

cap_blas_threads()
# a loaded machine is no counterexample; each run draws other examples, so that few a run are many
settings.register_profile("untimed", deadline=None, max_examples=15)
settings.load_profile("untimed")


@pytest.fixture(autouse=True)
def handlers():
    """The command line, run inside a test, takes SIGINT and SIGTERM over: they are given back."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(autouse=True)
def told(monkeypatch):
    """Options of a problem that nothing used are told by the next command in the process: not by
    that of the next test."""
    monkeypatch.setattr("petcontact.runtime.petsc._from_tables", {})


@pytest.fixture
def unestimated(monkeypatch):
    """Fixed meshes are solved on once: of tests that do not look at the estimated error, for which
    the problem is solved again on half as many elements."""
    monkeypatch.setattr("petcontact.pipeline.solve.with_estimate", lambda solution, *_: solution)


@pytest.fixture
def unsampled(monkeypatch):
    """The largest stresses are not looked for, which takes longer than a small solve: of tests of
    verdicts and files that do not look at them."""
    monkeypatch.setattr("petcontact.results.numbers.stress_peaks", lambda *_: {})


@pytest.fixture(scope="session")
def comm():
    """PETSc.COMM_SELF: the serial tests must not meet on a communicator of many."""
    return petsc().COMM_SELF


def example(number: int, *, mesh: MeshOptions | None = None, **method) -> Problem:
    """Example 1 or 2 of the paper as printed, on h = 0.1 unless a mesh is given."""
    modulus, ratio, corner, bound, left, right = {
        1: (10_000.0, 0.3, (8.0, 4.0), 150.0, 400.0, 0.0),
        2: (2_500.0, 0.2, (10.0, 2.0), 450.0, 1700.0, -1100.0),
    }[number]
    return Problem(
        material=Material(young_modulus=modulus, poisson_ratio=ratio),
        geometry=Rectangle(lower_left=(0.0, 0.0), upper_right=corner),
        mesh=mesh or MeshOptions(element_size=0.1),
        boundary=(
            Contact(part="bottom", friction_bound=bound),
            Displacement(part="top", value=(0.0, 0.0)),
            Traction(part="left", value=(left, 0.0)),
            Traction(part="right", value=(right, 0.0)),
        ),
        method=Method(**{"name": "projection", "rule": "modified", **method}),
    )


def run_with(prepared, method: Method, rule=None, **keywords):
    """The solution of a prepared problem by another method."""
    problem = prepared.discrete.problem.model_copy(update={"method": method})
    discrete = dataclasses.replace(prepared.discrete, problem=problem)
    return run(
        dataclasses.replace(prepared, discrete=discrete, method=method_of(method, rule)), **keywords
    )
