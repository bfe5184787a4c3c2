"""Known data that vary within elements are named where a mesh misses them."""

from __future__ import annotations

import numpy as np
import pytest
from marks import slow

from petcontact import (
    Bem,
    Body,
    BoundaryChange,
    Box,
    Circle,
    Contact,
    Displacement,
    Material,
    MeshOptions,
    Problem,
    Rectangle,
    SideBySide,
    Sphere,
    Step,
    Traction,
    solve,
)
from petcontact.pipeline.judge.remainders import missed_data

SOFT = Material(young_modulus=1000.0, poisson_ratio=0.3)
NARROW = "10*exp(-(y - 0.52)**2/2e-4)"
SMOOTH = "10*sin(pi*y)"


def block(side=0.0, bound=0.3, step=()):
    sides = [
        Traction("left", (side, 0.0)),
        Displacement("top", (0.0, -0.01)),
        Contact("bottom", friction_bound=bound),
    ]
    sides.append(Traction("right", (0.0, 0.0)))
    return Problem(
        material=SOFT,
        geometry=Rectangle((0.0, 0.0), (1.0, 1.0)),
        mesh=MeshOptions(element_size=0.125, order=1),
        boundary=sides,
        step=step,
    )


def warned(problem):
    found = solve(problem)
    return [text for text in found.warnings if "misses" in text]


def test_a_narrow_load_between_the_nodes_and_a_pole_that_none_meets_are_named():
    assert warned(block(SMOOTH)) == []
    for load in (NARROW, "1/(y - 0.5)"):
        (text,) = warned(block(load))
        assert "of the traction on left" in text


def test_functions_bounds_and_steps_are_looked_at():
    (text,) = warned(block(lambda y: 0.0 * y, "1 + 1e3*(abs(x - 0.53) < 0.005)"))
    assert "of the friction bound on bottom" in text
    step = Step(name="load", boundary=[BoundaryChange(part="left", value=(NARROW, 0.0))])
    (text,) = warned(block(step=[step]))
    assert "of the traction on left" in text


@pytest.mark.parametrize(
    ("pressure", "count"), [("1 + 0.2*x", 0), ("exp(-((x - 0.3)**2 + (y - 0.55)**2)/1e-4)", 1)]
)
def test_in_space(pressure, count):
    sides = [
        Traction("top", pressure=pressure),
        Contact("bottom", friction_bound=0.3),
        *(Traction(part, (0.0,) * 3) for part in ("left", "right", "front", "back")),
    ]
    box = Problem(
        material=SOFT,
        geometry=Box((0.0,) * 3, (1.0,) * 3),
        mesh=MeshOptions(element_size=0.5),
        boundary=sides,
    )
    solution = solve(box)
    found = missed_data(box, [*solution.meshes.values()])
    assert len(found) == count and all("of the traction on top" in text for text in found)
    assert [text for text in solution.warnings if "misses" in text] == found


RING = SideBySide((Circle("rim", (0, 0), 1), Circle("hole", (0, 0), 0.5)))
TURN = {2: ("0.01*(y - 1)", "-0.01*x"), 3: ("0.01*(z - 1)", "0.02*z", "-0.01*x - 0.02*y")}


@pytest.mark.parametrize(
    ("body", "storage", "order"),
    [
        (RING, "hodlr", 2),
        (Sphere(centre=(0, 0, 0), radius=1), "dense", 1),
        slow(Sphere(centre=(0, 0, 0), radius=1), "hmatrix", 1),
    ],
)
def test_rotations_that_are_given_strain_no_curved_body(body, storage, order):
    """Elements do not hold them: a ball of order 1 had stresses of .1 E times the angle."""
    d = 2 + isinstance(body, Sphere)
    part = "top" if d == 3 else "hole"
    steps = [
        Step(name="back", boundary=[BoundaryChange(body="ball", part=part, value=(0.0,) * d)]),
        Step(name="on", boundary=[BoundaryChange(body="ball", part=part, value=TURN[d])]),
    ]
    held = Body(
        name="ball",
        material=SOFT,
        geometry=body,
        mesh=MeshOptions(element_size=0.5, order=order),
        boundary=[Displacement(part, TURN[d])],
    )
    found = solve(Problem(body=[held], bem=Bem(mat_type=storage), step=steps))
    assert found.status == "converged"
    assert (
        max(np.abs(found.boundary_state(step=k)[1].von_mises).max() for k in (1, 2))
        < 1e-10 * SOFT.young_modulus * 0.02
    )


def test_held_faces_of_constant_elements_that_a_rotation_meets_at_their_nodes_are_held():
    """One row of nodes on each end of a plate: a rigid rotation through them is not what is given,
    which bends the plate."""
    ends = [Displacement("left", (0.0, 0.0, 0.0)), Displacement("right", (0.0, 0.0, 0.5))]
    plate = Body(
        name="plate",
        material=SOFT,
        geometry=Box((0, 0, 0), (8, 2, 0.4)),
        boundary=ends,
        mesh=MeshOptions(0.8, order=0),
    )
    found = solve(Problem(body=[plate]))
    assert found.bodies["plate"].traction.any() and not found.converged
