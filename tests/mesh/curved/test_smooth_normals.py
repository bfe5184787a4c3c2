"""Normals of the smooth surfaces that quadratic panels stand for."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import elastic, moved, problem

from petcontact.pipeline.pose.discretise import discretise


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def of_cylinder(x: np.ndarray) -> np.ndarray:
    return unit(x * [1.0, 1.0, 0.0])


def of_torus(x: np.ndarray) -> np.ndarray:
    """About z; its tube has the middle line of radius 2."""
    return unit(x - 2.0 * of_cylinder(x))


def error(mesh, part, true) -> tuple[float, float]:
    """Of the normals of the panels, and of the smooth ones."""
    nodes = mesh.nodes_of(part)
    wanted = true(mesh.x[nodes])
    return tuple(
        np.sqrt((np.sum((n[nodes] - wanted) ** 2, axis=1)).mean())
        for n in (mesh.normal, mesh.smooth_normal)
    )


def revolved(loops, size, order=2):
    parts = {side["part"] for side in loops} - {"axis"}
    body = problem(
        material=elastic(1.0, 0.3),
        geometry={"shape": "revolved", "loops": [loops]},
        mesh={"element_size": size, "order": order},
        boundary=[moved(part, [0.0, 0.0, 0.0]) for part in parts],
    )
    return discretise(body).meshes[0]


CAN = [
    {"part": "caps", "to": [1, 0]},
    {"part": "round", "to": [1, 2]},
    {"part": "caps", "to": [0, 2]},
    {"part": "axis", "to": [0, 0]},
]
RING = [
    {"part": "round", "to": [3, 0], "through": [2, -1]},
    {"part": "round", "to": [1, 0], "through": [2, 1]},
]


@pytest.mark.parametrize(
    ("true", "share", "loops"), [(of_cylinder, 0.05, CAN), (of_torus, 1.0, RING)]
)
def test_of_other_round_surfaces(true, share, loops):
    errors = np.array([error(revolved(loops, size), "round", true) for size in (1.0, 0.5)])
    assert np.all(errors[:, 1] < share * errors[:, 0])
