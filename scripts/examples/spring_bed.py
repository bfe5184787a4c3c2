"""A body of another code: a stiffness on points, here a bed of springs (Winkler), as a superelement
under a rigid ball."""

import tempfile
from pathlib import Path

import numpy as np

from petcontact import Body, Material, Obstacle, Pair, Problem, Superelement, solve

stiffness, depth = 100.0, 0.1  # of the bed, and how far the ball is lowered
points = np.column_stack(
    [np.linspace(1.0, -1.0, 41), np.zeros(41)]
)  # leftwards: the body lies on the left, below
faces = np.column_stack([np.arange(40), np.arange(1, 41)])
share = np.full(41, 0.05)
share[[0, -1]] = 0.025
with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "bed.npz"
    np.savez(
        file, points=points, elements=faces, stiffness=np.diag(np.repeat(stiffness * share, 2))
    )
    bed = Problem(
        body=[Body("bed", Material(stiffness, 0.0), Superelement(file=str(file)))],
        obstacle=[Obstacle("ball", displacement=(0.0, -depth))],
        contact=[
            Pair(
                "touch", secondary="bed.contact", primary="ball", gap="x**2/2", direction=(0.0, 1.0)
            )
        ],
    )
    pair = solve(bed).pairs["touch"]
exact = stiffness * depth * 4.0 / 3.0 * np.sqrt(2.0 * depth)
print(f"force {-pair.force[1]:.3f}, of springs {exact:.3f}")
result = -pair.force[1] / exact
