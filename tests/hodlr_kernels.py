"""Outlines and kernels for the tests of the compression: of the kind of elasticity's, written down
in a few lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from petcontact.compression.hodlr import compress


@dataclass(frozen=True)
class Nodes:
    """points (n, 2), normals (n, 2), element lengths (n,), and where sides begin."""

    points: np.ndarray
    normals: np.ndarray
    lengths: np.ndarray
    breaks: np.ndarray

    def __len__(self):
        return len(self.points)


def polygon(corners, per_side, grading=1.0):
    """Elements on a closed polygon; with grading > 1 the longest and the smallest of a side differ
    by this factor."""
    pieces, starts, count = [], [], 0
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        x = np.linspace(-1, 1, per_side)
        size = grading ** (-np.abs(x))
        size *= np.hypot(*(b - a)) / size.sum()
        along = (np.cumsum(size) - 0.5 * size) / size.sum()
        direction = (b - a) / np.hypot(*(b - a))
        normal = np.tile([direction[1], -direction[0]], (per_side, 1))
        pieces.append((a + along[:, None] * (b - a), normal, size))
        starts.append(count)
        count += per_side
    return Nodes(*(np.concatenate(part) for part in zip(*pieces, strict=True)), np.array(starts))


def star(rng, n_corners, per_side, grading=1.0):
    """A random star-shaped polygon."""
    angle = 2 * np.pi * (np.arange(n_corners) + 0.3 * rng.random(n_corners)) / n_corners
    radius = rng.uniform(0.6, 1.6, n_corners)
    return polygon(
        np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1), per_side, grading
    )


def circle(n, radius=1.0, centre=(0.0, 0.0), clockwise=False):
    """Elements on a circle; clockwise for a hole."""
    angle = 2 * np.pi * (np.arange(n) + 0.5) / n * (-1 if clockwise else 1)
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    normals = -outward if clockwise else outward
    return Nodes(
        np.array(centre) + radius * outward,
        normals,
        np.full(n, 2 * np.pi * radius / n),
        np.array([0]),
    )


def together(*parts):
    """Several outlines, one after another."""
    shifts = np.cumsum([0, *(len(part) for part in parts[:-1])])
    arrays = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("points", "normals", "lengths")
    )
    return Nodes(
        *arrays, np.concatenate([p.breaks + s for p, s in zip(parts, shifts, strict=True)])
    )


class Mixed:
    """Two equations a node; columns of a single layer on every second side, of a double layer on
    the others.

    The single layer is that of elasticity with its logarithm; the double layer has its 1/r kernels,
    of which one part vanishes on a straight side and the other does not.
    """

    def __init__(self, nodes, single=None):
        self.nodes = nodes
        side = np.searchsorted(nodes.breaks, np.arange(len(nodes)), "right")
        self.single = side % 2 == 0 if single is None else single
        self.row_offsets = self.col_offsets = 2 * np.arange(len(nodes) + 1)

    def __call__(self, rows, columns):
        nodes = self.nodes
        r = nodes.points[columns] - nodes.points[rows][:, None]
        same = np.asarray(rows)[:, None] == np.asarray(columns)
        square = (r * r).sum(axis=2)
        square[same] = 1.0
        w, n = nodes.lengths[columns], nodes.normals[columns]
        block = np.empty((len(rows), 2, len(columns), 2))
        log = np.where(same, np.log(w / 2) - 1.0, 0.5 * np.log(square))
        flux = (r * n).sum(axis=2) / square
        swirl = (r[:, :, 1] * n[:, 0] - r[:, :, 0] * n[:, 1]) / square
        for a in range(2):
            for b in range(2):
                rr = r[:, :, a] * r[:, :, b] / square
                delta = float(a == b)
                layer = w * (1.8 * delta * log - rr) / -np.pi
                double = (
                    w * (flux * (0.4 * delta + 2 * rr) + 0.4 * (a - b) * swirl) / (2.8 * np.pi)
                    + 0.5 * delta * same
                )
                block[:, a, :, b] = np.where(self.single[columns], layer, double)
        return block.reshape(2 * len(rows), 2 * len(columns))


class Partial(Mixed):
    """Of the single-layer columns of some nodes only the one along the normal: one column a node,
    none elsewhere."""

    def __init__(self, nodes, chosen):
        super().__init__(nodes, np.ones(len(nodes), dtype=bool))
        self.chosen = chosen
        self.col_offsets = np.concatenate([[0], np.cumsum(chosen)])

    def __call__(self, rows, columns):
        columns = np.asarray(columns)[self.chosen[columns]]
        both = super().__call__(rows, columns).reshape(2 * len(rows), len(columns), 2)
        return (both * self.nodes.normals[columns]).sum(axis=2)


def compressed(operator, tol=1e-8, leaf=24, **more):
    """The operator compressed, clusters ending where sides do."""
    nodes = operator.nodes
    offsets = operator.row_offsets, operator.col_offsets
    return compress(operator, nodes.points, *offsets, tol, leaf, breaks=nodes.breaks, **more)


def dense(operator):
    everything = np.arange(len(operator.nodes))
    return operator(everything, everything)


def case(name, rng):
    """Outlines that are hard each in its own way."""
    if name == "star":
        return star(rng, 7, 60)
    if name == "graded":
        return star(rng, 5, 80, grading=1e4)
    square = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [0.0, 4.0]])
    places = [(x, y) for x in (1.0, 3.0, 5.0) for y in (1.0, 3.0)]
    holes = [circle(60, 0.4, place, clockwise=True) for place in places]
    return together(polygon(square, 60), *holes)


CASES = ("star", "graded", "holes")
