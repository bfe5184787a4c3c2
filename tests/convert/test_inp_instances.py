"""Decks in parts and instances, as Abaqus/CAE writes them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from inp_decks import converted, grid, sets

from petcontact import solve

E, HIGH, WAY = 1000.0, 1.0, 0.01


def assembly() -> str:
    """Two instances of a square, the upper one turned by 180 degrees, so that its head lies on that
    of the lower one."""
    part, number = grid([0.0, 0.0], [2.0, HIGH], [2, 2], 1, 1, "CPE4", "ALL")
    return "\n".join(
        [
            *("*Heading", "*Part, name=Square", *part),
            *sets("Foot", number, 1, 0),
            *("*Elset, elset=Upper, generate", "2, 4, 2"),
            *("*Surface, type=ELEMENT, name=Head", "Upper, S3"),
            *("*Solid Section, elset=ALL, material=Soft", ",", "*End Part"),
            *("*Assembly, name=Assembly", "*Instance, name=Low-1, part=Square", "*End Instance"),
            *(
                "*Instance, name=Up-1, part=Square",
                f"-2., {-2.0 * HIGH}, 0.",
                "0., 0., 0., 0., 0., 1., 180.",
                "*End Instance",
            ),
            *("*Nset, nset=Moved, instance=Up-1", "Foot", "*Nset, nset=Corner, instance=Low-1"),
            *(str(number[0, 0]), "*Elset, elset=_Seat_S3, instance=Low-1", "Upper"),
            *("*Surface, type=ELEMENT, name=Seat", "_Seat_S3, S3", "*End Assembly"),
            *("*Material, name=Soft", "*Elastic", f"{E}, 0."),
            *("*Surface Interaction, name=Smooth", "1.,", "*Step", "*Static"),
            *("*Contact Pair, interaction=Smooth", "Up-1.Head, Seat"),
            *("*Boundary", "Low-1.Foot, 2, 2", f"Moved, 2, 2, {-WAY}", "Up-1.Foot, 1, 1"),
            *("*Boundary", f"Low-1.{number[0, 0]}, 1, 1", f"Low-1.{number[2, 0]}, 1, 1"),
            *(f"Low-1.{number[1, 0]}, 1", "*End Step"),
        ]
    )


def test_instances_are_moved_turned_and_in_contact(tmp_path: Path) -> None:
    problem, notes = converted(tmp_path, assembly())
    assert notes == ["*SURFACE LOW-1-HEAD: in no contact pair or load; not taken"]
    solution = solve(problem)
    pressure = solution.pairs["pair1"].pressure
    assert np.allclose(pressure, E * WAY / (2.0 * HIGH), rtol=1e-6)
    assert {each.secondary for each in problem.contact} == {"UP-1.UP-1-HEAD"}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("part=Square", "part=Sqare", "*INSTANCE: no part 'SQARE'; there are SQUARE"),
        ("-2., -2.0, 0.", "-2., up", "*INSTANCE: a number was expected"),
        ("Up-1.Head, Seat", "Up-2.Head, Seat", "each surface must lie on a body"),
        ("Moved, 2", "Up-3.Foot, 2", "no NSET 'Up-3.Foot'; there are"),
    ],
)
def test_a_name_that_is_none_is_told(old: str, new: str, said: str, tmp_path: Path) -> None:
    try:
        told = "\n".join(converted(tmp_path, assembly().replace(old, new))[1])
    except ValueError as error:
        told = str(error)
    assert said in told


@pytest.mark.parametrize(
    ("freedom", "taken"), [("1", True), ("2", False), ("1, 2", True), ("1, 1, 0.1", False)]
)
def test_a_face_that_is_held_along_its_turned_normal_is_a_roller(
    freedom: str, taken: bool, tmp_path: Path
) -> None:
    """A square that is turned by 30 degrees, pressed on its roller."""
    part, number = grid([0.0, 0.0], [2.0, 2.0], [2, 2], 1, 1, "CPE4", "ALL")
    up = np.array([-0.5, np.sqrt(0.75)])
    text = [
        *("*Part, name=A", *part, *sets("Foot", number, 1, 0)),
        *("*Surface, name=Head", "2, S3", "4, S3", "*Solid Section, elset=ALL, material=M"),
        *("*End Part", "*Assembly", "*Instance, name=I, part=A", "0., 0.", "0, 0, 0, 0, 0, 1, 30"),
        *("*End Instance", "*End Assembly", "*Material, name=M", "*Elastic", f"{E}, 0."),
        *("*Transform, nset=I.Foot", f"{up[0]}, {up[1]}, 0., {-up[1]}, {up[0]}, 0."),
        *("*Step", "*Boundary", f"I.Foot, {freedom}", "*Dload", "I.Head, P, 5.", "*End Step"),
    ]
    problem, notes = converted(tmp_path, "\n".join(text))
    assert (notes == []) == taken
    if taken:
        solution = solve(problem)
        (mesh,), (body,) = solution.meshes.values(), solution.last.bodies.values()
        assert np.allclose(body.u @ up, -5.0 / E * (mesh.x @ up), atol=1e-8)
