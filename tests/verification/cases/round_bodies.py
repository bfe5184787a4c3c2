"""Bodies of revolution as Gmsh files of curved panels, and the problems that need them."""

from __future__ import annotations

import atexit
import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np
from axial_forms import INDENTED, Lubkin
from curved_bodies import written

from petcontact import Body, Displacement, Gmsh, Material, MeshOptions, Obstacle, Pair, Problem
from petcontact.reference import persson

from .half_spaces import half_space

_FOLDER = tempfile.TemporaryDirectory()
atexit.register(_FOLDER.cleanup)


def revolved(name, profile, sectors):
    """The path of a file of a body about the z axis: parts by name, and for each a function of [0,
    1] to (r, z) with breaks.

    Where it begins or ends on the axis panels are triangles.
    """
    parts = {}
    for part, curve, breaks in profile:
        for low, high in pairwise(breaks):
            at = [curve(t) for t in (low, 0.5 * (low + high), high)]
            if at[2][0] < 1e-12:
                at = at[::-1]
            cells = [
                _cell(at, 2.0 * np.pi * k / sectors, 2.0 * np.pi / sectors) for k in range(sectors)
            ]
            parts.setdefault(part, []).append(np.array(cells))
    return written(Path(_FOLDER.name) / f"{name}.msh", parts)


def _cell(at, start, turn):
    """Points of a panel between (r, z) of its ends and middle: of nine nodes, of six on the
    axis."""
    (near, middle, far), (a, b, c) = at, (start, start + 0.5 * turn, start + turn)
    point = lambda rz, angle: (rz[0] * np.cos(angle), rz[0] * np.sin(angle), rz[1])  # noqa: E731
    ends = [(near, a), (far, a), (far, c), (near, c)]
    middles = [(middle, a), (far, b), (middle, c)]
    inner = [(near, b), (middle, b)]
    if near[0] < 1e-12:
        ends, inner = ends[:3], []
    return [point(*place) for place in (*ends, *middles, *inner)]


def line(start, end):
    """The straight curve between two points (r, z)."""
    return lambda t: np.array(start) * (1.0 - t) + np.array(end) * t


def arc(centre, radius, first, last):
    """The circle about (r, z) between two angles."""

    def at(t):
        angle = first + t * (last - first)
        return np.array(centre) + radius * np.array([np.cos(angle), np.sin(angle)])

    return at


PUNCH = {"young": 1.0, "nu": 0.3, "far": 6.0, "shear": 1.0 / 2.6}
"""Material and radius of the half ball; a = 1."""


def persson_pressure(x):
    """Of a pin in a hole at (0, 0) under a force 1 along -y, a contact of 60 degrees to either
    side."""
    return persson.pressure(np.arctan2(x[:, 0], -x[:, 1]), np.radians(60.0))


def round_punch(kind="frictionless"):
    """A flat round punch of radius 1 on a half ball, moved by 1: down ("frictionless", "bonded"),
    "pushed", or "twisted".

    The far face moves as a half space does under the resultant at the centre. What is pushed has no
    normal traction.
    """
    young, nu, far, shear = PUNCH["young"], PUNCH["nu"], PUNCH["far"], PUNCH["shear"]
    force = {
        "frictionless": 2.0 * young / (1.0 - nu**2),
        "bonded": 4.0 * shear * np.log(3.0 - 4.0 * nu) / (1.0 - 2.0 * nu),
        "pushed": 8.0 * shear / (2.0 - nu),
        "twisted": 16.0 / 3.0 * shear,
    }[kind]
    known = {"pushed": (force, 0.0)}.get(kind, (0.0, -force))

    def component(k):
        if kind == "twisted":
            return lambda x, y, z: (
                np.array([-y, x, 0.0 * x])[k] * force / (4.0 * np.pi * shear * far**3)
            )
        return lambda x, y, z: half_space(x, y, z, known, nu, young)[k]

    near = np.array([0.0, 0.4, 0.7, 0.87, 0.95, 0.985, 1.0])
    apart = (np.array([1.0, 1.015, 1.05, 1.15, 1.5, 2.5, 4.0, far]) - 1.0) / (far - 1.0)
    profile = [
        ("punch", line((0.0, 0.0), (1.0, 0.0)), near),
        ("free", line((1.0, 0.0), (far, 0.0)), apart),
        ("far", arc((0.0, 0.0), far, 0.0, -0.5 * np.pi), np.linspace(0.0, 1.0, 4)),
    ]
    held = [Displacement("far", tuple(component(k) for k in range(3)))]
    obstacle, pair = [], []
    if kind == "pushed":
        held.append(Displacement("punch", (1.0, 0.0, "free")))
    else:
        down, turn = (0.0, 1.0) if kind == "twisted" else (-1.0, 0.0)
        moves = {"displacement": (0.0, 0.0, down), "rotation": (0.0, 0.0, turn)}
        normal = "bilateral" if kind == "frictionless" else "bonded"
        obstacle = [Obstacle("punch", **moves)]
        pair = [Pair("face", secondary="half.punch", primary="punch", normal=normal)]
    shape, mesh = Gmsh(revolved("half-ball", profile, 8)), MeshOptions(order=2)
    body = Body("half", Material(young, nu), shape, mesh, boundary=held)
    return Problem(title=f"Round flat punch, {kind}", body=[body], obstacle=obstacle, contact=pair)


LUBKIN = Lubkin(0.6)


def turned_balls(c=LUBKIN.c):
    """Two balls that are pressed and turned until they stick up to a radius c."""
    return Lubkin(c).problem()


def hertz_pressure(x):
    return LUBKIN.scale * INDENTED["ball"].pressure(np.minimum(x[:, 0], 1.0)) * (x[:, 0] < 1.0)


def lubkin_shear(x):
    return LUBKIN.shear(x[:, 0]) * (x[:, 0] < 1.0)
