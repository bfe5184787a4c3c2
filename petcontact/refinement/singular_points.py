"""What makes a solution less smooth before anything is solved: corners, by their angle, and kinks in the data."""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array, Mask
from ..bem.boundary_data import evaluate_boundary
from ..geometry.outline import Outline, Side
from ..mesh.curve_mesh import build_mesh
from ..mesh.grading import at_ends, turn
from ..model.problem import Problem, Traction

RIGHT_ANGLE = 0.7
"""1/(2λ) of a right angle clamped on one side and free on the other, λ = 0.71 (ν = 0.3): the mildest that is assumed."""
SAMPLES, FINER = 512, 32
"""Points of a side that are looked at for kinks, and of an interval in which one is."""
OTHERS = 16
"""Points of each other side meanwhile."""
PROMINENT, WINDOW = 8.0, 16
"""How much larger a second difference is at a kink than the median of so many neighbours on either side."""
MOST = 20
"""Kinks of one side; data with more are rough everywhere, and no grading helps."""


def corner_powers(problem: Problem, outline: Outline) -> list[tuple[float, float]]:
    """1/(2λ) at the start and the end of each side: the power of the error with which elements have to shrink there.

    Displacements behave like r^λ at a corner of interior angle ω (Williams, J. Appl. Mech. 19 (1952)), and far away the
    error of elements of size a is about a^(2λ). Where one side is held and the other free λ = π/2ω is a lower bound from
    a right angle on, where both are alike ½ is one beyond a straight angle. A contact side counts as held: it may stick.
    """
    free = {condition.part for condition in problem.boundary if isinstance(condition, Traction)}

    def power(before: Side, after: Side) -> float:
        angle = math.pi - turn(before, after)
        if (before.part in free) != (after.part in free):
            exponent = math.pi / (2.0 * angle) if angle > 0.75 * math.pi else 1.0
        else:
            exponent = 0.5 if angle > 1.01 * math.pi else 1.0
        return max(RIGHT_ANGLE, 0.5 / exponent)

    return at_ends(outline, power)


def kinks(problem: Problem, outline: Outline) -> list[Array]:
    """Arc lengths on each side at which the data given as expressions have a kink or a jump [length]."""
    found: list[Array] = [np.empty(0) for _ in outline.sides]
    varying = {condition.part for condition in problem.boundary if _has_expression(condition.model_dump())}
    for k, side in enumerate(outline.sides):
        if side.part not in varying:
            continue
        at, values = _data(problem, outline, k, 0.0, 1.0, SAMPLES)
        rough = np.flatnonzero(_prominent(values))
        groups = np.split(rough, np.flatnonzero(np.diff(rough) > 2) + 1) if len(rough) else []
        # what stands out at the very end is the end's own singularity, and ends are graded
        groups = [group for group in groups if group[0] > 1 and group[-1] < SAMPLES - 4]
        if len(groups) <= MOST:
            places = [_located(problem, outline, k, at[group[0]], at[group[-1] + 2]) for group in groups]
            found[k] = side.length * np.array(places, dtype=np.float64)
    return found


def _has_expression(value: object) -> bool:
    """Whether a condition has a text that is no number and no name."""
    if isinstance(value, dict):
        return any(_has_expression(item) for key, item in value.items() if key not in ("part", "condition"))
    if isinstance(value, (tuple, list)):
        return any(map(_has_expression, value))
    return callable(value) or (isinstance(value, str) and value != "free")


def _data(problem: Problem, outline: Outline, side: int, low: float, high: float, count: int) -> tuple[Array, Array]:
    """Equidistant fractions (count,) of a side between two, and all data there (count, 3): g and the known components.

    They are the nodes of a mesh of constant elements, so that data mean what they mean in a solve.
    """
    ends = np.linspace(low, high, count + 1)
    breaks = [np.linspace(0.0, 1.0, OTHERS + 1) for _ in outline.sides]
    breaks[side] = np.concatenate([[0.0][: int(low > 0.0)], ends, [1.0][: int(high < 1.0)]])
    mesh = build_mesh(outline, breaks, [np.zeros(len(b) - 1, dtype=np.int64) for b in breaks])
    data = evaluate_boundary(problem, mesh, held=False)
    values = np.column_stack([np.zeros(mesh.n_nodes), data.value])
    values[data.contact_nodes, 0] = data.friction_bound
    first = OTHERS * side + int(low > 0.0)
    return 0.5 * (ends[1:] + ends[:-1]), values[first : first + count]


def _prominent(values: Array) -> Mask:
    """Which second differences (k-2,) of (k, c) data stand out from their neighbours."""
    second = np.abs(np.diff(values, 2, axis=0))
    padded = np.pad(second, ((WINDOW, WINDOW), (0, 0)), mode="reflect")
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * WINDOW + 1, axis=0)
    noise = 1e-9 * np.abs(values).max(axis=0)
    return np.asarray((second > PROMINENT * np.median(around, axis=-1) + noise).any(axis=1))


def _located(problem: Problem, outline: Outline, side: int, low: float, high: float) -> float:
    """The place in an interval, as a fraction of the side, at which second differences are largest."""
    while high - low > 1e-9:
        at, values = _data(problem, outline, side, low, high, FINER)
        second = np.abs(np.diff(values, 2, axis=0))
        scale = np.abs(values).max(axis=0)
        worst = np.max(second / np.where(scale > 0.0, scale, 1.0), axis=1)
        if worst.max() < 1e-12:
            break
        k = int(np.argmax(worst)) + 1
        reach = 2.0 * (high - low) / FINER
        low, high = max(low, at[k] - reach), min(high, at[k] + reach)
    return 0.5 * (low + high)
