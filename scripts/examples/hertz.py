"""Hertz: a parabolic indenter pressed into a block as wide as eight contacts, beside the closed
solution."""

from petcontact import (
    Body,
    Displacement,
    Material,
    MeshOptions,
    Obstacle,
    Pair,
    Problem,
    Rectangle,
    solve,
)
from petcontact.reference.hertz import LineContact, contact_modulus

radius, depth = 4.0, 8.0
block = Body(
    "block",
    Material(1000.0, 0.3),
    Rectangle((-depth, -depth), (depth, 0.0)),
    MeshOptions(element_size=2.0, order=2, element_sizes={"top": 0.1}),
    boundary=[Displacement("bottom", (0.0, 0.0))],
)
indenter = Obstacle("indenter", displacement=(0.0, "free"), force=(0.0, -100.0))
problem = Problem(
    "Hertz",
    body=[block],
    obstacle=[indenter],
    contact=[
        Pair(
            "touch",
            secondary="block.top",
            primary="indenter",
            gap=f"x**2/(2*{radius})",
            direction=(0.0, 1.0),
        )
    ],
)
solution = solve(problem)
pair = solution.pairs["touch"]
theory = LineContact(100.0, radius, contact_modulus(1000.0, 0.3))
print(f"peak {pair.pressure.max():.2f}, theory {theory.peak:.2f}")
print(f"half-width {pair.area / 2:.3f}, theory {theory.half_width:.3f}")
result = pair.pressure.max() / theory.peak
