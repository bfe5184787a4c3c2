"""Random long contacts of a rigid body on a block, drawn from a seed, and their pressure on a half
space."""

from __future__ import annotations

import numpy as np

from petcontact import Problem
from petcontact.given.tables.base import parse
from petcontact.refinement.panels.forecast import hertz_ellipse

KINDS = ("ellipse", "roller", "crown")
HALF = 1.0
"""Half the length of a contact, or of what may touch [length]."""
ROOM = 12.0
"""Half the width of the block, and its height [length]."""
CELLS = 26, 40
"""Rectangles across and along a quarter of a contact."""


def random_band(seed, number):
    """A band: an ellipse, a roller with sharp ends, or one with a crown of the fourth power, whose
    length is 3 to 100 times its width, turned by any angle or not at all.

    Returns its name, the problem, and p as a function of points (n, 3).
    """
    random = np.random.default_rng([seed, number, 31])
    kind, ratio = KINDS[number % 3], float(np.exp(random.uniform(np.log(4.0), np.log(100.0))))
    modulus, poisson = float(10.0 ** random.uniform(0.0, 3.0)), float(random.uniform(0.1, 0.45))
    angle = float(random.choice([0.0, random.uniform(0.0, np.pi)]))
    stiff, c, s = modulus / (1.0 - poisson**2), float(np.cos(angle)), float(np.sin(angle))
    x, y = f"({c}*x + {s}*y)", f"({c}*y - {s}*x)"
    across, width = float(10.0 ** random.uniform(-1.0, 1.0)), HALF / ratio
    if kind == "ellipse":
        along = across * ratio ** float(random.uniform(-2.0, -1.6))
        half, long, _ = hertz_ellipse((across, along), 1.0, 1.0)
        force = stiff * (HALF / long) ** 3
        gap = f"{0.5 * across}*{x}**2 + {0.5 * along}*{y}**2"
        ellipse = np.array([half * HALF / long, HALF])

        def pressure(place):
            inside = 1.0 - np.sum((place / ellipse) ** 2, axis=1)
            return 1.5 * force / (np.pi * ellipse.prod()) * np.sqrt(np.maximum(inside, 0.0))

    else:
        line = 0.25 * np.pi * stiff * across * width**2  # of Hertz' line contact
        force, crown = 2.0 * HALF * line, 0.0
        if kind == "crown":
            crown = float(random.uniform(4.0, 12.0)) * line / stiff / HALF**4
        gap = f"where(abs({y}) <= {HALF}, {0.5 * across}*{x}**2 + {crown}*{y}**4, 1e3)"
        pressure = _on_quarter(
            lambda u, v: 0.5 * across * u**2 + crown * v**4, (2.2 * width, HALF), force, stiff
        )
    turn = np.array([[c, -s], [s, c]])
    title = f"{number}: {kind}, {ratio:.0f}, turned {np.degrees(angle):.0f}°"
    return (
        title,
        parse(Problem, _pressed(gap, force, modulus, poisson), title),
        (lambda points: pressure(points[:, :2] @ turn)),
    )


def _pressed(gap, force, modulus, poisson):
    faces = ("left", "right", "front", "back")
    held = {"part": "bottom", "condition": "displacement", "value": [0.0] * 3}
    free = [{"part": part, "condition": "traction", "value": [0.0] * 3} for part in faces]
    block = {
        "name": "block",
        "material": {"young_modulus": modulus, "poisson_ratio": poisson},
        "geometry": {"shape": "box", "lower": [-ROOM] * 3, "upper": [ROOM, ROOM, 0.0]},
        "boundary": [held, *free],
    }
    tool = {"name": "tool", "displacement": [0.0, 0.0, "free"], "force": [0.0, 0.0, -force]}
    pair = {"name": "pair", "secondary": "block.top", "primary": "tool", "gap": gap}
    return {"body": [block], "obstacle": [tool], "contact": [pair]}


def _corner(x, y):
    """∫∫ 1/r over the rectangle between the origin and a corner (Love 1929)."""
    r = np.hypot(x, y)

    def term(s, t):
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = np.where(t >= 0.0, t + r, s * s / (r - t))
            return np.where(s == 0.0, 0.0, s * np.log(reach))

    return term(x, y) + term(y, x)


def _on_quarter(gap, size, force, stiff):
    """The pressure of a rigid body on a half space, even in both coordinates, constant on
    rectangles; p as a function of points (n, 2)."""
    share = 1.0 - (1.0 - np.linspace(0.0, 1.0, CELLS[1] + 1)) ** 2
    lines = size[0] * np.linspace(0.0, 1.0, CELLS[0] + 1), size[1] * share
    middle = [0.5 * (line[1:] + line[:-1]) for line in lines]
    x, y = (each.ravel() for each in np.meshgrid(*middle, indexing="ij"))
    a, b = (
        each.ravel()
        for each in np.meshgrid(*(0.5 * np.diff(line) for line in lines), indexing="ij")
    )
    moved = np.zeros((len(x), len(x)))
    for u in (x, -x):
        for v in (y, -y):
            dx, dy = x[:, None] - u, y[:, None] - v
            moved += _corner(dx + a, dy + b) - _corner(dx - a, dy + b)
            moved += _corner(dx - a, dy - b) - _corner(dx + a, dy - b)
    moved /= np.pi * stiff
    area, height = 16.0 * a * b, gap(x, y)
    on = height <= np.quantile(height, 0.8)
    for _ in range(200):
        rows = np.flatnonzero(on)
        both = np.linalg.solve(
            moved[np.ix_(rows, rows)], np.column_stack([np.ones(len(rows)), height[rows]])
        )
        depth = (force + area[rows] @ both[:, 1]) / (area[rows] @ both[:, 0])
        p = np.zeros(len(x))
        p[rows] = depth * both[:, 0] - both[:, 1]
        later = (on & (p > 0.0)) | (~on & (height + moved @ p < depth))
        if np.array_equal(later, on):
            break
        on = later
    square = np.pad(p.reshape(CELLS) ** 2, ((1, 0), (1, 0)), mode="edge")
    ticks = [np.append(0.0, each) for each in middle]

    def pressure(place):
        u, v = np.abs(place).T
        i, j = (
            np.clip(np.searchsorted(tick, w) - 1, 0, len(tick) - 2)
            for tick, w in zip(ticks, (u, v), strict=True)
        )
        r, t = (
            np.minimum((w - tick[k]) / (tick[k + 1] - tick[k]), 1.0)
            for tick, w, k in zip(ticks, (u, v), (i, j), strict=True)
        )
        low = (1.0 - t) * square[i, j] + t * square[i, j + 1]
        high = (1.0 - t) * square[i + 1, j] + t * square[i + 1, j + 1]
        return np.sqrt((1.0 - r) * low + r * high) * ((u < size[0]) & (v < size[1]))

    return pressure
