"""Groups: which cases one elimination serves."""

from __future__ import annotations

import numpy as np
import pytest
from sweep_files import CONFIGS, sweep_file

from petcontact.sweep.design.sweep import read_sweep
from petcontact.sweep.problems import shares_elimination
from petcontact.sweep.schedule.groups import make_groups


def test_cases_that_differ_in_the_method_alone_share_a_group():
    sweep = read_sweep(CONFIGS / "tables.toml")
    groups = make_groups(sweep)
    assert groups.size.tolist() == [16] * 8
    for number in range(8):
        places = np.flatnonzero(groups.of_case == number)
        assert groups.first[number] == places[0]
        assert len({(sweep.coordinates(k)["problem"], sweep.coordinates(k)["element_size"]) for k in places}) == 1
    readings = make_groups(read_sweep(CONFIGS / "sweep_readings.toml"))
    assert readings.size.tolist() == [128] * 8


def test_formulation_and_petsc_options_make_groups(tmp_path):
    path = sweep_file(tmp_path, """
problems = ["example1.toml"]
[cross]
formulation = ["condensed", "full"]
"petsc.ksp_type" = ["preonly", "gmres"]
"boundary.0.friction_bound" = [100.0, 150.0]
tolerance = [1e-5, 1e-6]
""")  # fmt: skip
    groups = make_groups(read_sweep(path))
    # a friction bound is nothing that the elimination depends on
    assert groups.size.tolist() == [4] * 4
    assert len(groups.representatives()) == 2


@pytest.mark.parametrize(
    ("key", "value", "shared"),
    [
        ("method.rho", 1.0, True), ("method.formulation", "full", False), ("title", "x", True),
        ("petsc.ksp_type", "gmres", False),
        ("contact.0.friction_coefficient", 0.3, True), ("contact.1.friction_bound", 2, True),
        ("contact.0.friction_coefficient", 0.0, False), ("contact.0.friction_coefficient", "0.1*x**2", False),
        ("contact.0.gap", 0.1, False), ("boundary.0.friction_bound", 1.0, True), ("boundary.1.value.0", 1.0, False),
        ("obstacle.0.displacement", ["free", -0.1], True), ("step.1.obstacle.0.displacement.1", -0.1, True),
        ("obstacle.0.centre", [0.0, 1.0], False), ("step.0.boundary.0.value.1", 1.0, False),
    ],
)  # fmt: skip
def test_what_the_elimination_depends_on(key, value, shared):
    assert shares_elimination(key, value) == shared


def test_friction_that_is_zero_has_a_group_of_its_own(tmp_path):
    text = 'problems = ["press_fit.toml"]\n[cross]\n"contact.0.friction_coefficient" = [0.0, 0.1, 0.2]\n'
    (tmp_path / "press_fit.toml").write_text((CONFIGS / "press_fit.toml").read_text())
    assert sorted(make_groups(read_sweep(sweep_file(tmp_path, text))).size.tolist()) == [1, 2]
