"""Copies of a problem with other values, which `model_copy` does not check, are solved or refused in
one line that names the key."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from petcontact import (
    Contact,
    Displacement,
    InputError,
    Material,
    MeshOptions,
    Method,
    Problem,
    Rectangle,
    Step,
    Traction,
    adapt,
    solve,
)

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

BLOCK = Problem(
    material=Material(1e4, 0.3),
    geometry=Rectangle((0, 0), (8, 4)),
    mesh=MeshOptions(element_size=1.0),
    boundary=[
        Contact("bottom", friction_bound=150.0),
        Displacement("top", (0, 0)),
        Traction("left", (400, 0)),
        Traction("right", (0, 0)),
    ],
)
WRONG = {
    "mesh.order": (7, -1, 1.5, "two", True, math.nan),
    "mesh.element_size": (0, -1.0, math.nan, math.inf, "small", [1.0]),
    "mesh.levels": (-3, 1.5),
    "material.young_modulus": (-1, 0.0, math.nan, None, "stiff"),
    "material.poisson_ratio": (0.7, -1.5, math.nan),
    "geometry.upper_right": (3.0, (8,), (8, math.nan), (-1, 4)),
    "method.rho": (0.0, -1.0, math.inf),
    "method.omega": (2.0, 0.0),
    "method.max_iterations": (0, 1.5),
    "boundary": (None, 3, [None], [3], [[Contact("bottom")]]),
    "material": (None, 3, [Material(1e4, 0.3)]),
    "mesh": (3, {"element_sise": 1.0}, {"element_size": -1.0}),
    "geometry": (None, "rectangle"),
    "method": ("projection", {"rho": -1.0}),
    "step": (3, [3], [Step(name="a").model_copy(update={"increments": 0})]),
    "obstacle": (3, [None]),
}
RIGHT = {
    "mesh.order": (np.int64(1), 2),
    "mesh.element_size": (np.float64(0.9), 2),
    "mesh": ({"element_size": 1.5},),
    "material": ({"young_modulus": 1.0, "poisson_ratio": 0.2},),
}


def copied(key, value):
    table, _, name = key.partition(".")
    if not name:
        return BLOCK.model_copy(update={table: value})
    return BLOCK.model_copy(update={table: getattr(BLOCK, table).model_copy(update={name: value})})


@pytest.mark.parametrize("key", WRONG)
def test_a_wrong_value_is_refused_by_its_key(key):
    for value in WRONG[key]:
        for door in (solve, adapt):
            with pytest.raises(InputError) as refused:
                door(copied(key, value))
            assert all(word in str(refused.value) for word in key.split(".")), refused.value
            assert "\n" not in str(refused.value)


@pytest.mark.parametrize("key", RIGHT)
def test_a_right_value_of_another_type_is_taken(key):
    for value in RIGHT[key]:
        assert solve(copied(key, value)).converged


def test_what_was_constructed_without_checks_is_checked():
    bare = Problem.model_construct(body=BLOCK.body)
    assert solve(bare).converged
    with pytest.raises(InputError, match="young_modulus"):
        solve(BLOCK.model_copy(update={"material": Material.model_construct(poisson_ratio=0.3)}))


def test_random_values_are_solved_or_refused_by_their_key():
    draw = random.Random()
    values = [0, -1, 1.5, 7, math.nan, None, "x", True, [], [1], {}, np.float64(0.3), np.ones(2)]
    keys = [f"mesh.{name}" for name in MeshOptions.model_fields if name != "accuracy"]
    keys += [f"material.{name}" for name in Material.model_fields]
    keys += [f"method.{name}" for name in Method.model_fields]
    for _ in range(120):
        key, value = draw.choice(keys), draw.choice(values)
        try:
            solution = solve(copied(key, value))
        except InputError as refused:
            assert key.partition(".")[2] in str(refused), (key, value, refused)
        else:
            assert solution.status in ("converged", "not converged", "failed"), (key, value)


@pytest.mark.parametrize("door", [solve, adapt])
@pytest.mark.parametrize(
    ("given", "said"),
    [
        (((1, 2),), "a Problem or the name of a TOML file is expected, got tuple"),
        (("no_such_file.toml",), "no_such_file.toml: cannot be read"),
        *(
            (("configs/example1.toml", name), f"{name}: a function is expected, got int")
            for name in ("monitor", "announce", "reached")
        ),
        (("configs/example1.toml", "law"), "law: int has no k, groups, project"),
    ],
)
def test_what_is_no_problem_no_function_and_no_law_is_refused_by_name(door, given, said):
    problem, *names = given
    with pytest.raises(InputError, match=said):
        door(problem, **dict.fromkeys(names, 4))
