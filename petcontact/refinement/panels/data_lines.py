"""Lines across the faces of boxes on which known data have a kink or a jump: panels end there."""

from __future__ import annotations

import functools
import itertools

import numpy as np

from ...arrays import Array
from ...geometry.same_place import TOLERANCE, distinct
from ...geometry.surface import BOX_PARTS, BoxSurface, face_axes
from ...mesh.pairs.box_faces import grid_lines, mesh_of_lines
from ...mesh.pairs.common_breakpoints import with_joints
from ...mesh.surface_mesh import SurfaceMesh
from ...model.expressions import Value, evaluate
from ...model.problem import Problem
from ..expression_features import kinks, uniform
from ..known_data import given_data

ACROSS = np.sqrt(np.array([0.003, 0.03, 0.11, 0.23, 0.41, 0.63, 0.89]))
"""Shares of a face at which data are looked at along it; no figure is the same on two of them but
by a line across."""
MOST = 16
"""Lines along one axis of a face; more of them are data that are rough everywhere."""


def with_data_lines(problem: Problem, box: BoxSurface, mesh: SurfaceMesh) -> SurfaceMesh:
    """The mesh of a box, with panels that end where the data of its faces have a kink or a jump on
    a line across them; others there give way where they are close."""
    lines = data_lines(problem, box)
    sides = grid_lines(box, mesh) if any(map(len, lines)) else []
    if not sides:
        return mesh
    return mesh_of_lines(
        box,
        [
            with_joints(side, line) if len(line) else side
            for side, line in zip(sides, lines, strict=True)
        ],
    )


def data_lines(problem: Problem, box: BoxSurface) -> list[Array]:
    """Fractions of both axes of each face, twelve, at which its data have a kink or a jump on a
    line across the face.

    Parameters
    ----------
    problem : Problem
        Of one body.
    box : BoxSurface

    Examples
    --------
    >>> [line.round(3).tolist() for line in data_lines(problem, box) if len(line)]
    [[0.25, 0.75]]
    """
    result, names = [np.empty(0) for _ in range(12)], list(BOX_PARTS)
    for condition in problem.boundary:
        number = names.index(condition.part)
        given = itertools.chain.from_iterable(each for _, each, _ in given_data(condition))
        varying = [v for v in given if callable(v) or isinstance(v, str)]
        for k, value in itertools.product((0, 1), varying):
            far = float(np.abs([box.lower, box.upper]).max() / (box.upper - box.lower).min())
            found = _across(value, functools.partial(_variables, box, condition.part, k), far)
            result[2 * number + k] = distinct(
                np.concatenate([result[2 * number + k], found]), TOLERANCE, 1.0
            )
    return result


def _across(value: Value, at: functools.partial[dict[str, Array]], far: float) -> Array:
    """Fractions of an axis at which data have a kink or a jump on two lines along it, at least."""
    shares = uniform()

    def values(share: float, fractions: Array) -> Array:
        return evaluate(value, at(share, fractions), len(fractions), "", otherwise=0.0)

    every = [
        kinks(functools.partial(values, share), shares, values(share, shares), far)[0]
        for share in ACROSS
    ]
    places = np.sort(np.concatenate([np.unique(each) for each in every]))
    twice = places[1:][np.diff(places) < TOLERANCE]
    found = distinct(twice, TOLERANCE, 1.0)
    found = found[(found > 0.0) & (found < 1.0)]
    return found if len(found) <= MOST else np.empty(0)


def _variables(
    box: BoxSurface, part: str, axis: int, share: float, fractions: Array
) -> dict[str, Array]:
    """Variables of expressions at fractions (n,) of an axis of a face, at a share of the other."""
    across, side = BOX_PARTS[part]
    axes, at = face_axes(across, side), np.empty((len(fractions), 3))
    at[:, axes[axis]], at[:, axes[1 - axis]], at[:, across] = fractions, share, float(side)
    normal = np.zeros_like(at)
    normal[:, across] = 2 * side - 1
    x = box.lower + at * (box.upper - box.lower)
    return dict(zip(("x", "y", "z", "nx", "ny", "nz"), (*x.T, *normal.T), strict=True))
