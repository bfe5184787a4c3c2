"""One flat panel of random shape in a random plane."""

from __future__ import annotations

import numpy as np

from petcontact.mesh.panels import Panels, make_panels


def placed(outline: np.ndarray, order: int, rng: np.random.Generator) -> Panels:
    """A panel of given corners (c, 2), turned and moved at random."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return make_panels((outline @ turn[:2] + rng.normal(size=3))[None], order, np.arange(1))[0]


def a_panel(corners: int, order: int, rng: np.random.Generator) -> Panels:
    """Corners on an ellipse: no quadrilateral of these is a parallelogram."""
    angle = np.sort(rng.uniform(0.0, 0.5, corners)) + 2.0 * np.pi * np.arange(corners) / corners
    return placed(
        np.column_stack([np.cos(angle), rng.uniform(0.3, 1.0) * np.sin(angle)]), order, rng
    )
