"""The contact system on compressed operators against the dense one."""

from __future__ import annotations

import pytest
from examples import example
from prepared import Posed, operators

from petcontact import InputError, MeshOptions, SolverError, solve
from petcontact.given.tables.solver_options import Bem
from petcontact.pipeline.choice import resolved_bem
from petcontact.runtime.petsc import options

pytestmark = pytest.mark.usefixtures("unestimated")


def compressed(case, **bem):
    return case.model_copy(update={"bem": Bem(mat_type="hodlr", **bem)})


def test_a_compression_that_misses_its_tolerance_is_an_error(comm, monkeypatch):
    """Entries that change between the compression and the probe stand for any compression that went
    wrong."""
    case = example(1, mesh=MeshOptions(element_size=0.1))
    kind = type(operators(case))
    exact = kind.system_entries
    calls = []

    def drifting(self, rows, columns):
        calls.append(1)
        return exact(self, rows, columns) * (1.0 + 1e-6 * len(calls))

    monkeypatch.setattr(kind, "system_entries", drifting)
    with pytest.raises(SolverError, match="compressed operator is off by"):
        Posed(compressed(case, hodlr_tol=1e-10), comm)


def test_options_have_precedence_over_the_table():
    with options({"bem_mat_type": "hodlr", "bem_hodlr_tol": "1e-8", "bem_hodlr_leaf": 32}):
        bem = resolved_bem(Bem(mat_type="dense", hodlr_leaf=100))
        assert (bem.mat_type, bem.hodlr_tol, bem.hodlr_leaf) == ("hodlr", 1e-8, 32)
    with options({"bem_hodlr_tol": "tight"}), pytest.raises(InputError, match="bem_hodlr_tol"):
        resolved_bem(Bem())
    with options({"bem_mat_type": "sparse"}), pytest.raises(InputError, match="mat_type"):
        resolved_bem(Bem())


def test_full_formulation_is_dense():
    case = compressed(example(1, mesh=MeshOptions(element_size=0.4), formulation="full"))
    with pytest.raises(InputError, match=r"full.*dense"):
        solve(case)
