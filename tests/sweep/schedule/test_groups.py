"""Groups: which cases one elimination serves."""

from __future__ import annotations

import numpy as np
import pytest
from sweep_files import CONFIGS, sweep_of

from petcontact.sweep.design.sweep import read_sweep
from petcontact.sweep.problems import elimination_needs
from petcontact.sweep.schedule.groups import make_groups


def test_cases_that_differ_in_the_method_alone_share_a_group():
    sweep = read_sweep(CONFIGS / "tables.toml")
    groups = make_groups(sweep)
    assert groups.size.tolist() == [16] * 8
    for number in range(8):
        places = np.flatnonzero(groups.of_case == number)
        assert groups.first[number] == places[0]
        assert (
            len(
                {
                    (sweep.coordinates(k)["problem"], sweep.coordinates(k)["element_size"])
                    for k in places
                }
            )
            == 1
        )
    readings = make_groups(read_sweep(CONFIGS / "sweep_readings.toml"))
    assert readings.size.tolist() == [128] * 8


def test_formulation_and_petsc_options_make_groups(tmp_path):
    crossed = {
        "formulation": ["condensed", "full"],
        "petsc.ksp_type": ["preonly", "gmres"],
        "boundary.0.friction_bound": [100.0, 150.0],
        "tolerance": [1e-5, 1e-6],
    }
    groups = make_groups(sweep_of(tmp_path, cross=crossed))
    # a friction bound is nothing that the elimination depends on
    assert groups.size.tolist() == [4] * 4
    assert len(groups.representatives()) == 2


@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize(
    ("key", "value", "needs"),
    [
        ("method.rho", 1.0, None),
        ("method.formulation", "full", "full"),
        ("petsc.ksp_type", "gmres", "gmres"),
        ("cycle.count", 5, None),
        ("step.0.increments", 3, None),
        ("contact.0.friction_coefficient", 0.3, None),
        ("contact.0.wear_coefficient", 1e-3, None),
        ("contact.0.friction_coefficient", 0.0, 0.0),
        ("body.1.boundary.0.friction_bound", 1.0, None),
        ("step.1.obstacle.0.displacement.1", -0.1, None),
        ("obstacle.0.centre", [0.0, 1.0], [0.0, 1.0]),
        ("material.young_modulus", 1.0, 1.0),
        ("boundary.1.condition", "traction", "traction"),
    ],
)
def test_what_the_elimination_depends_on(key, value, needs, fixed):
    assert elimination_needs(key, value, meshes_fixed=fixed) == needs


@pytest.mark.parametrize(
    ("key", "value", "needs"),
    [
        ("contact.0.gap", 0.1, None),
        ("contact.0.gap", "geometry", True),
        ("boundary.1.value.0", 1.0, None),
        ("boundary.1.value.0", "free", True),
        ("boundary.1.value", [1.0, "free"], [False, True]),
        ("step.0.boundary.0.value.1", 1.0, None),
        ("step.1.loads.0.temperature", 20.0, None),
        ("loads.acceleration", [0.0, "y"], [False, False]),
        ("body.0.point_force.1.force.0", 2.0, None),
        ("material.density", 1.0, None),
    ],
)
def test_loads_and_gaps_are_nothing_to_meshes_of_given_sizes(key, value, needs):
    assert elimination_needs(key, value, meshes_fixed=True) == needs
    assert elimination_needs(key, value, meshes_fixed=False) == value


def test_meshes_that_resolve_their_data_are_not_shared_by_loads(tmp_path):
    (tmp_path / "example1_adaptive.toml").write_text(
        (CONFIGS / "example1_adaptive.toml").read_text()
    )
    crossed = {"boundary.2.value.0": [1.0, 2.0, "x"], "rho": [1.0, 2.0]}
    for fixed, sizes in (({}, [2, 2, 2]), ({"element_size": 0.8}, [6])):
        sweep = sweep_of(tmp_path, problems=["example1_adaptive.toml"], set=fixed, cross=crossed)
        assert make_groups(sweep).size.tolist() == sizes


def test_friction_that_is_zero_has_a_group_of_its_own(tmp_path):
    crossed = {"contact.0.friction_coefficient": [0.0, 0.1, 0.2]}
    (tmp_path / "press_fit.toml").write_text((CONFIGS / "press_fit.toml").read_text())
    sweep = sweep_of(tmp_path, problems=["press_fit.toml"], cross=crossed)
    assert sorted(make_groups(sweep).size.tolist()) == [1, 2]
