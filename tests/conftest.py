"""Fixtures of all tests."""

from __future__ import annotations

import os
import signal

import pytest
import threadpoolctl
from hypothesis import HealthCheck, settings

from petcontact.runtime.petsc import petsc
from petcontact.runtime.threads import cap_blas_threads

# many processes test at once, and to wait for one another's threads takes longer than the work
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
cap_blas_threads()
threadpoolctl.threadpool_limits(int(os.environ["OPENBLAS_NUM_THREADS"]), user_api="blas")
# a loaded machine is no counterexample; each run draws other examples, so that few a run are many
settings.register_profile(
    "untimed", deadline=None, max_examples=15, suppress_health_check=[HealthCheck.too_slow]
)
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
    monkeypatch.setattr(
        "petcontact.pipeline.solve.with_estimate",
        lambda solution, comm, law, report: report(solution, None),
    )


@pytest.fixture
def unsampled(monkeypatch):
    """The largest stresses are not looked for, which takes longer than a small solve: of tests of
    verdicts and files that do not look at them."""
    monkeypatch.setattr("petcontact.results.numbers.printed.stress_peaks", lambda *_: [])


@pytest.fixture(scope="session")
def comm():
    """PETSc.COMM_SELF: the serial tests must not meet on a communicator of many."""
    return petsc().COMM_SELF
