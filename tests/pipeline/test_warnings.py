"""Motions that are not small."""

from __future__ import annotations

from petcontact import Contact, Displacement, Material, MeshOptions, Problem, Rectangle, Traction, solve


def test_a_body_that_turns_is_warned_of(comm):
    """A block whose top is turned by 3 rad, above a floor that it does not reach."""
    block = Problem(
        material=Material(young_modulus=1.0, poisson_ratio=0.3), geometry=Rectangle((0.0, 0.0), (1.0, 1.0)),
        mesh=MeshOptions(element_size=0.25),
        boundary=[Contact("bottom", normal="unilateral", gap=10.0), Displacement("top", ("-3*y", "3*x")),
                  *(Traction(part, (0.0, 0.0)) for part in ("left", "right"))],
    )  # fmt: skip
    assert "turns by 3 rad" in solve(block, comm=comm).verdict()
