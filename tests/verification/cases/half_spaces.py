"""Problems whose field is known: blocks cut out of half spaces, with its displacement on the far
faces."""

from __future__ import annotations

import numpy as np

from petcontact import (
    Body,
    BoundaryChange,
    Box,
    Contact,
    Displacement,
    Material,
    MeshOptions,
    Obstacle,
    ObstacleChange,
    Pair,
    Problem,
    SideBySide,
    Step,
    Traction,
)
from petcontact.mesh.basis import gauss
from petcontact.reference.cattaneo_mindlin import PointPartialSlip
from petcontact.reference.hertz import PointContact


def half_space(x, y, z, force, nu, young):
    """u (3, n) of z < 0 under a point force (F_x, F_z) at the origin (Boussinesq; Cerruti; Johnson
    3.18, 3.75)."""
    shear, depth, (along, down) = young / (2.0 * (1.0 + nu)), -z, force
    rho, k, down = np.sqrt(x * x + y * y + z * z), 1.0 - 2.0 * nu, -down
    s = rho + depth
    radial = depth / rho**3 - k / (rho * s)
    normal = np.array([x * radial, y * radial, -(2.0 * (1.0 - nu) / rho + depth**2 / rho**3)])
    shift = np.array(
        [
            1.0 / rho + x * x / rho**3 + k * (1.0 / s - x * x / (rho * s * s)),
            x * y / rho**3 - k * x * y / (rho * s * s),
            -(x * depth / rho**3 + k * x / (rho * s)),
        ]
    )
    return (down * normal + along * shift) / (4.0 * np.pi * shear)


FACES = ("left", "right", "front", "back")


def _space(sign, force, nu, young, move):
    """The same as three functions, of the body below (sign 1) or, turned about the y axis, above;
    plus a rigid motion."""

    def component(k):
        turn = (sign, 1.0, sign)[k]
        return lambda x, y, z: (
            turn * half_space(sign * x, y, sign * z, force, nu, young)[k] + move[k]
        )

    return tuple(component(k) for k in range(3))


def _spheres(title, nu, young, load, drags, approach, shifts):
    """R = 50, a = 1, µ = 0.4: approach and shifts of far points are given, step by step, and the
    forces are found."""
    half, bodies, changes = 3.0, [], [[] for _ in drags]
    for name, sign, face, end in (
        ("lower", 1.0, "top", "bottom"),
        ("upper", -1.0, "bottom", "top"),
    ):
        low, high = sorted((0.0, -sign * half))
        held = (*FACES, end)
        bodies.append(
            Body(
                name,
                Material(young, nu),
                Box((-half, -half, low), (half, half, high)),
                MeshOptions(1.5, element_sizes={face: 0.4}, order=1, exponent=1.0),
                boundary=[Displacement(part, (0.0, 0.0, 0.0)) for part in held],
            )
        )
        for change, drag, shift in zip(changes, drags, shifts, strict=True):
            # half of approach and shift on either body: the lower one rises, and lags behind
            move = (-0.5 * sign * shift, 0.0, 0.5 * sign * approach)
            field = _space(sign, (drag, -load), nu, young, move)
            change += [BoundaryChange(body=name, part=part, value=field) for part in held]
    sides = {"secondary": "lower.top", "primary": "upper.bottom"}
    pair = Pair("pair", **sides, gap="(x**2 + y**2)/100", friction_coefficient=0.4)
    pushes = [Step("push", increments=2, boundary=change) for change in changes[1:]]
    steps = [Step("press", boundary=changes[0]), *pushes]
    return Problem(title=title, body=bodies, contact=[pair], step=steps)


def cattaneo_in_space():
    """CONTACT's example cattaneo: G = 200, ν = 0.42, approach 0.02 and shift 0.0081724."""
    title, load, shifts = "CONTACT, cattaneo: spheres with ν = 0.42", 9.1954, (0.0, 0.0081724)
    return _spheres(title, 0.42, 568.0, load, (0.0, 0.875 * 0.4 * load), 0.02, shifts)


POINT = PointContact(16.0 / 3.0, 50.0, 200.0)
"""Spheres of E = 400, ν = 0, E* = 200: a = 1."""
DRAGGED = PointPartialSlip(POINT, 0.4, 0.4 * POINT.load * (1.0 - 0.6**3))


def mindlin_in_space():
    """Press, +Q, -Q, +Q with ν = 0; shift 3µP/(16a)·2(2-ν)/G·(1 - (c/a)²), c/a = 0.6."""
    q, shift = DRAGGED.force, 3.0 * 0.4 * POINT.load / 16.0 * 4.0 / 200.0 * (1.0 - 0.6**2)
    title, drags = "Cattaneo, Mindlin and Deresiewicz: spheres pushed to and fro", (0.0, q, -q, q)
    shifts = (0.0, shift, -shift, shift)
    return _spheres(title, 0.0, 400.0, POINT.load, drags, POINT.approach, shifts)


def _beside(force=(0.6, -1.0)):
    return _space(1.0, force, 0.3, 1.0, (0.0, 0.0, 0.0))


def beside_along(x):
    """u_x of `beside_a_force` at points (n, 3)."""
    return _beside()[0](*x.T)


def beside_down(x):
    """Its u_z."""
    return _beside()[2](*x.T)


def beside_a_force(force=(0.6, -1.0)):
    """A block beside an inclined point force: the free surface above, exact displacement on the
    other faces but one.

    That is the plane of symmetry y = 0, a smooth bilateral contact.
    """
    field = _beside(force)
    return Problem(
        title="Boussinesq and Cerruti: a block beside a point force",
        material=Material(1.0, 0.3),
        geometry=Box((0.6, 0.0, -1.0), (2.6, 1.5, 0.0)),
        mesh=MeshOptions(0.5, order=2, exponent=1.0),
        boundary=[
            *(Displacement(part, field) for part in ("left", "right", "back", "bottom")),
            Contact("front"),
            Traction("top", (0.0, 0.0, 0.0)),
        ],
    )


def spence(steps=35, far=100.0):
    """CONTACT's example spence35, a body of revolution: the force of step k is the last one times
    (k/steps)³. It ends at a sphere that moves as a half space does under the force at the centre,
    which errs by the square of the contact's radius over its own.
    """
    load, shares = 0.4705, [(k / steps) ** 3 for k in range(1, steps + 1)]

    def field(share):
        def component(k):
            return lambda x, y: half_space(x, 0.0 * x, y, (0.0, -share * load), 0.0, 1.0)[k]

        return component(0), component(2)

    def step(share):
        pressed = ObstacleChange("sphere", force=(0.0, -share * load))
        return Step(boundary=[BoundaryChange(part="far", value=field(share))], obstacle=[pressed])

    sides = [
        {"part": "far", "to": [far, 0.0], "radius": far},
        {"part": "free", "to": [5.0, 0.0]},
        {"part": "top", "to": [0.0, 0.0]},
        {"part": "axis", "to": [0.0, -far]},
    ]
    law = {"gap": "x**2/243", "friction_coefficient": 0.2986}
    return Problem(
        title="Spence: rigid sphere on a half space, µ = 0.2986",
        symmetry="axial",
        material=Material(1.0, 0.0),
        geometry=SideBySide(loops=[sides]),
        boundary=[Displacement("far", field(1.0)), Traction("free", (0.0, 0.0))],
        obstacle=[Obstacle("sphere", displacement=(0.0, "free"), force=(0.0, -load))],
        contact=[Pair("top", secondary="top", primary="sphere", **law)],
        step=[step(share) for share in shares],
    )


def uniform_square():
    """Love: pressure 1 on [-½, ½]² of a half space of G = 1, ν = 0.28; a quarter, symmetric by
    bilateral smooth contact."""
    nu, young, end = 0.28, 2.56, 1.5
    nodes, weights = gauss(9)
    pairs = [(0.5 * a, 0.5 * w) for a, w in zip(nodes, weights, strict=True)]
    places = [(a, b, v * w) for a, v in pairs for b, w in pairs]

    def component(k):
        return lambda x, y, z: sum(
            w * half_space(x - a, y - b, z, (0.0, -1.0), nu, young)[k] for a, b, w in places
        )

    field = tuple(component(k) for k in range(3))
    square = "where((x < 0.5)*(y < 0.5), -1, 0)"
    return Problem(
        title="CONTACT, subsurf: uniform pressure on a square",
        material=Material(young, nu),
        geometry=Box((0.0, 0.0, -end), (end, end, 0.0)),
        mesh=MeshOptions(0.25, order=2, exponent=1.0),
        boundary=[
            *(Displacement(part, field) for part in ("right", "back", "bottom")),
            Contact("left"),
            Displacement("front", ("free", 0.0, "free")),
            Traction("top", (0.0, 0.0, square)),
        ],
    )


def under_the_middle(x, nu=0.28, half=0.5):
    """Von Mises stress under the middle of the same square, at points (n, 3): Newmark's σ_z of four
    corners, and the trace -(1 + ν)/π times the solid angle of the square."""
    z = -x[:, 2]
    square, reach = half**2, np.sqrt(2.0 * half**2 + z**2)
    angle = 4.0 * np.arctan2(square, z * reach)
    vertical = -(8.0 * square * z / ((square + z**2) * reach) + angle) / (2.0 * np.pi)
    trace = -(1.0 + nu) / np.pi * angle
    return np.abs(vertical - 0.5 * (trace - vertical))
