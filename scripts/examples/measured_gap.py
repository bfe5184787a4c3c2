"""A gap that was measured: a profile in a CSV file, interpolated by a function of x."""

import csv
import tempfile
from pathlib import Path

import numpy as np

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

with tempfile.TemporaryDirectory() as folder:
    file = Path(folder) / "profile.csv"  # as an instrument writes it: place, height
    place = np.linspace(-1.0, 1.0, 81)
    np.savetxt(
        file,
        np.column_stack([place, 0.002 * np.sin(9.0 * place)]),
        delimiter=",",
        header="x,height",
        comments="",
    )
    with open(file, newline="") as lines:
        rows = [(float(row["x"]), float(row["height"])) for row in csv.DictReader(lines)]
at, height = np.array(rows).T


def gap(x):
    """From the surface to a flat plate on its highest peak."""
    return height.max() - np.interp(x, at, height)


block = Body(
    "block",
    Material(1000.0, 0.3),
    Rectangle((-1.0, -1.0), (1.0, 0.0)),
    MeshOptions(element_size=0.5, order=1, element_sizes={"top": 0.04}),
    boundary=[Displacement("bottom", (0.0, 0.0))],
)
for press in (0.001, 0.003, 0.009):
    plate = Obstacle("plate", displacement=(0.0, -press))
    pair = solve(
        Problem(
            body=[block],
            obstacle=[plate],
            contact=[
                Pair("touch", secondary="block.top", primary="plate", gap=gap, direction=(0.0, 1.0))
            ],
        )
    ).pairs["touch"]
    print(f"lowered by {press}: {pair.area / 2.0:.0%} closed, force {-pair.force[1]:.3f}")
result = pair.area / 2.0
