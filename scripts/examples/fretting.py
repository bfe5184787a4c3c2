"""A pad pressed on a half-plane and rubbed: the hysteresis loop and the energy of each cycle."""

import numpy as np

from petcontact import (
    Body,
    Displacement,
    Material,
    MeshOptions,
    Obstacle,
    ObstacleChange,
    Pair,
    Problem,
    Rectangle,
    Step,
    solve,
)

ground = Body(
    "ground",
    Material(1.0, 0.3),
    Rectangle((-3.0, -3.0), (3.0, 0.0)),
    MeshOptions(element_size=1.0, order=1, element_sizes={"top": 0.15}),
    boundary=[Displacement("bottom", (0.0, 0.0))],
)
pad = Obstacle("pad", displacement=(0.0, -0.1))


def moved(x):
    return [ObstacleChange(name="pad", displacement=(x, -0.1))]


rub = Problem(
    body=[ground],
    obstacle=[pad],
    contact=[
        Pair(
            "touch",
            secondary="ground.top",
            primary="pad",
            gap="x**2/4",
            direction=(0.0, 1.0),
            friction_coefficient=0.5,
        )
    ],
    step=[
        Step("press"),
        Step("to", increments=4, obstacle=moved(0.06)),
        Step("fro", increments=4, obstacle=moved(-0.06)),
        Step("to again", increments=4, obstacle=moved(0.06)),
    ],
)
solution = solve(rub)
for step in solution.steps:
    pair = step.pairs["touch"]
    print(
        f"{step.name:>8} {step.load_factor:4.2f}  Q = {pair.force[0]:+.4f}  dissipated "
        f"{pair.dissipated:.2e}"
    )
whole = np.sum([step.pairs["touch"].dissipated for step in solution.steps[-8:]])
print(f"a whole cycle takes {whole:.4g}")
result = whole
