"""The outlines of a plane body before and after, as curves."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...mesh.basis import lagrange
from ...mesh.curve_mesh import CurveMesh

CHORD = 0.07
"""Angle of the chords of arcs [rad]: of an arc that fills a picture, with a radius of 400 pixels,
they are off by r CHORD²/8, a quarter of a pixel."""


def round_places(mesh: CurveMesh) -> Array:
    """Places on elements, -1 to 1, between which polynomials and the widest arc look smooth."""
    chords = np.ceil(2.0 * np.abs(mesh.half_angle).max() / CHORD)
    return np.linspace(-1.0, 1.0, max(int(chords), 8) + 1)


def outlines(mesh: CurveMesh, u: Array, factor: float) -> list[tuple[Array, Array]]:
    """Return the initial and the deformed curve (k, 2) of each loop; arcs are round."""
    everywhere = round_places(mesh)
    number, initial, moved, deformed = [], [], [], []
    curved = mesh.curvature != 0.0
    for order, bent in sorted({*zip(mesh.order.tolist(), curved.tolist(), strict=True)}):
        chosen = np.flatnonzero((mesh.order == order) & (curved == bent))
        # constant elements by their middle, which is where their displacement is accurate
        at, xi = everywhere if bent else everywhere[:1], everywhere if order else np.zeros(1)
        nodal = u[mesh.first_node[chosen][:, None] + np.arange(order + 1), :2]
        values = np.einsum("jk,ejc->ekc", lagrange(order, xi), nodal)
        number.append(np.repeat(chosen, len(at)))
        initial.append(mesh.on_elements(chosen, at)[0].reshape(-1, 2))
        moved.append(np.repeat(chosen, len(xi)))
        deformed.append((mesh.on_elements(chosen, xi)[0] + factor * values).reshape(-1, 2))
    loops, curves = mesh.loops(), list[tuple[Array, Array]]()
    still, moving = _curves(loops, number, initial), _curves(loops, moved, deformed)
    for k, closed in enumerate(_closed(mesh, loops)):
        end = still[k][:1] if closed else mesh.end[loops[k][-1]][None]
        curves.append(
            (np.vstack([still[k], end]), np.vstack([moving[k], moving[k][: int(closed)]]))
        )
    return curves


def _curves(loops: list[Index], numbers: list[Index], points: list[Array]) -> list[Array]:
    """Return a curve for each loop through points, which have the numbers of their elements."""
    number = np.concatenate(numbers)
    order = np.argsort(number, kind="stable")
    return np.split(
        np.concatenate(points)[order],
        np.searchsorted(number[order], [int(loop[0]) for loop in loops[1:]]),
    )


def _closed(mesh: CurveMesh, loops: list[Index]) -> list[bool]:
    """Return whether each loop ends at its start; superelements have a part of it only."""
    return [bool(np.array_equal(mesh.end[loop[-1]], mesh.start[loop[0]])) for loop in loops]
