"""The Hessenberg form of S that cases share, against solves with I + ρS."""

from __future__ import annotations

import pytest
from examples import example
from prepared import Posed

from petcontact import MeshOptions
from petcontact.runtime.petsc import options


@pytest.mark.parametrize(
    "given", [{}, {"ksp_type": "gmres"}, {"ksp_monitor": ""}, {"pc_type": "lu"}]
)
def test_whoever_names_a_ksp_gets_it(given):
    case = example(2, mesh=MeshOptions(element_size=0.4))
    with options(given):
        posed = Posed(case, cases=8)
    assert ("Hessenberg" in posed.bodies.describe()) == (not given)
    posed.close()
