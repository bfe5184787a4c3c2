"""The smallest ball round the points of a path: what the amplitude of a vector or a tensor is, and
what its mean is."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..round_off import SOLVED


def smallest_ball(points: Array) -> tuple[Array, Array]:
    """Centres and radii of the smallest balls round the points of some paths.

    Two points have their middle. For more, weights λ of the points are moved, from the nearest that
    carries some to the farthest, so that Σ λ|x|² - |Σ λx|² rises to the square of the radius (the
    dual problem, by pairwise Frank-Wolfe steps).

    Parameters
    ----------
    points : (..., k, m) array
        k points of each path.

    Returns
    -------
    centre : (..., m) array
    radius : (...) array

    Examples
    --------
    >>> triangle = np.array([[0.0, 0.0], [2.0, 0.0], [1.0, np.sqrt(3.0)]])
    >>> centre, radius = smallest_ball(triangle)
    >>> bool(abs(radius - 2.0 / np.sqrt(3.0)) < 1e-6)
    True
    """
    shape, x = points.shape[:-2], points.reshape(-1, *points.shape[-2:])
    rows = np.arange(len(x))
    first = np.argmax(np.sum((x - x[:, :1]) ** 2, axis=2), axis=1)
    second = np.argmax(np.sum((x - x[rows, first][:, None]) ** 2, axis=2), axis=1)
    weight = np.zeros(x.shape[:2])
    np.add.at(weight, (rows, first), 0.5)
    np.add.at(weight, (rows, second), 0.5)
    centre = np.einsum("nk,nkm->nm", weight, x)
    going = rows if x.shape[1] > 2 else rows[:0]
    # nearly all paths need less than 50 steps
    for _ in range(1000):
        if not len(going):
            break
        y = x[going]
        distance = np.sum((y - centre[going][:, None]) ** 2, axis=2)
        own = np.arange(len(going))
        far = np.argmax(distance, axis=1)
        near = np.argmin(np.where(weight[going] > 0.0, distance, np.inf), axis=1)
        # the dual value is Σ λ d²
        gap = distance[own, far] - np.sum(weight[going] * distance, axis=1)
        step = y[own, far] - y[own, near]
        length = np.sum(step**2, axis=1)
        gain = distance[own, far] - distance[own, near]
        move = np.minimum(
            np.divide(0.5 * gain, length, out=np.zeros(len(own)), where=length > 0.0),
            weight[going, near],
        )
        weight[going, far] += move
        weight[going, near] -= move
        centre[going] += move[:, None] * step
        going = going[(gap > SOLVED * distance[own, far]) & (move > 0.0)]
    radius = np.sqrt(np.max(np.sum((x - centre[:, None]) ** 2, axis=2), axis=1))
    return centre.reshape(*shape, x.shape[2]), radius.reshape(shape)
