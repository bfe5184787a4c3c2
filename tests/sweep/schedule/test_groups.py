"""Groups: which cases one elimination serves."""

from __future__ import annotations

import pytest
from shapes import drawn, elastic, problem, rectangle
from sweep_files import CONFIGS, sweep_of

from petcontact.sweep.problems import elimination_needs
from petcontact.sweep.schedule.cost import estimate
from petcontact.sweep.schedule.groups import make_groups


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
        ("boundary.1.value.0", "free", "free"),
        ("boundary.1.value", [1.0, "free"], [None, "free"]),
        ("step.0.boundary.0.value.1", 1.0, None),
        ("step.1.loads.0.temperature", 20.0, None),
        ("loads.acceleration", [0.0, "y"], [None, None]),
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


@pytest.mark.parametrize("condition", ["contact", "symmetry"])
def test_a_case_without_a_mesh_costs_what_its_first_mesh_does(condition):
    below = {"part": "bottom", "condition": condition}
    below |= {"friction_bound": 1.0} if condition == "contact" else {}
    block = problem(
        material=elastic(1.0, 0.3),
        geometry=rectangle([0.0, 0.0], [1.0, 1.0]),
        boundary=[below, *(drawn(part, [0.0, 0.0]) for part in ("left", "right", "top"))],
    )
    cost = estimate(block, 1)
    assert cost.adaptive and cost.nodes > 0
    assert (cost.contact_unknowns > 0) == (condition == "contact")
