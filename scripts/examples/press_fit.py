"""A ring shrunk on a shaft: the pressure of Lamé, and the torque that it carries."""

import numpy as np

from petcontact import (
    Body,
    Circle,
    Displacement,
    Material,
    MeshOptions,
    Pair,
    Problem,
    SideBySide,
    Traction,
    solve,
)
from petcontact.reference.lame import Cylinder

steel, fine = Material(200_000.0, 0.3), MeshOptions(element_size=0.35, order=2)
tube = Body(
    "tube",
    steel,
    SideBySide(loops=[Circle("rim", (0, 0), 1.0), Circle("bore", (0, 0), 0.5)]),
    fine,
    boundary=[Displacement("bore", (0.0, 0.0))],
)
ring = Body(
    "ring",
    steel,
    SideBySide(loops=[Circle("outside", (0, 0), 2.0), Circle("inside", (0, 0), 1.0)]),
    fine,
    boundary=[Traction("outside", (0.0, 0.0))],
)
fit = Problem(
    body=[tube, ring],
    contact=[
        Pair(
            "fit",
            secondary="tube.rim",
            primary="ring.inside",
            gap="-0.001",
            friction_coefficient=0.2,
        )
    ],
)
solution = solve(fit)
pair = solution.pairs["fit"]
pressure = float(pair.weight @ pair.pressure / pair.weight.sum())
outer = Cylinder(1.0, 2.0, 200_000.0, 0.3, pressure_inside=pressure).displacement(np.array([1.0]))[
    0
]
torque = 0.2 * pressure * 2.0 * np.pi
print(
    f"pressure {pressure:.2f}, even to {np.ptp(pair.pressure) / pressure:.1e}; the ring grows by "
    f"{outer:.3e} of 1e-3; it carries a torque of {torque:.1f} per length"
)
result = float(
    np.linalg.norm(
        solution.bodies["ring"].u[solution.meshes["ring"].nodes_of("inside")], axis=1
    ).mean()
    / outer
)
