"""Problems whose field is known: blocks cut out of half spaces, with its displacement on the far
faces."""

from __future__ import annotations

import numpy as np

import petcontact
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
    Step,
    Symmetry,
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
    half, bodies, steps = 3.0, [], [[] for _ in range(len(drags))]
    for name, sign, low, high, end in (
        ("lower", 1.0, -half, 0.0, "bottom"),
        ("upper", -1.0, 0.0, half, "top"),
    ):
        face = "top" if sign > 0.0 else "bottom"
        bodies.append(
            Body(
                name,
                Material(young, nu),
                Box((-half, -half, low), (half, half, high)),
                MeshOptions(1.5, element_sizes={face: 0.4}, order=1, exponent=1.0),
                boundary=[Displacement(part, (0.0, 0.0, 0.0)) for part in (*FACES, end)],
            )
        )
        for step, drag, shift in zip(steps, drags, shifts, strict=True):
            # half of approach and shift on either body: the lower one rises, and lags behind
            field = _space(
                sign, (drag, -load), nu, young, (-0.5 * sign * shift, 0.0, 0.5 * sign * approach)
            )
            step += [BoundaryChange(body=name, part=part, value=field) for part in (*FACES, end)]
    pair = Pair(
        "pair",
        secondary="lower.top",
        primary="upper.bottom",
        gap="(x**2 + y**2)/100",
        friction_coefficient=0.4,
    )
    pushes = [Step("push", increments=2, boundary=step) for step in steps[1:]]
    return Problem(
        title=title, body=bodies, contact=[pair], step=[Step("press", boundary=steps[0]), *pushes]
    )


def cattaneo_in_space():
    """CONTACT's example cattaneo: G = 200, ν = 0.42, approach 0.02 and shift 0.0081724."""
    drag = 0.875 * 0.4 * 9.1954
    return _spheres(
        "CONTACT, cattaneo: spheres with ν = 0.42",
        0.42,
        568.0,
        9.1954,
        (0.0, drag),
        0.02,
        (0.0, 0.0081724),
    )


POINT = PointContact(16.0 / 3.0, 50.0, 200.0)
"""Spheres of E = 400, ν = 0, E* = 200: a = 1."""
DRAGGED = PointPartialSlip(POINT, 0.4, 0.4 * POINT.load * (1.0 - 0.6**3))
LOOP = DRAGGED.dissipated_in_a_cycle(200.0)
"""G* = 200, from (2 - 0)/(4·200) twice."""


def mindlin_in_space():
    """Press, +Q, -Q, +Q with ν = 0; shift 3µP/(16a)·2(2-ν)/G·(1 - (c/a)²), c/a = 0.6."""
    q, shift = DRAGGED.force, 3.0 * 0.4 * POINT.load / 16.0 * 4.0 / 200.0 * (1.0 - 0.6**2)
    return _spheres(
        "Cattaneo, Mindlin and Deresiewicz: spheres pushed to and fro",
        0.0,
        400.0,
        POINT.load,
        (0.0, q, -q, q),
        POINT.approach,
        (0.0, shift, -shift, shift),
    )


def beside_a_force(force=(0.6, -1.0)):
    """A block beside an inclined point force: the free surface above, exact displacement on the
    other faces but one.

    That is the plane of symmetry y = 0, a smooth bilateral contact.
    """
    field = _space(1.0, force, 0.3, 1.0, (0.0, 0.0, 0.0))
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


def _loads(pair):
    """Points and forces (n, 3) of the contact tractions on the whole face, from those of a
    quarter."""
    traction = (
        np.einsum("mt,mtc->mc", pair.sigma_t, pair.tangent) - pair.pressure[:, None] * pair.normal
    )
    force = pair.weight[:, None] * traction
    turns, closed = np.array([[1, 1, 1], [-1, 1, 1], [1, -1, 1], [-1, -1, 1]]), pair.state != 2
    return np.vstack([pair.x[closed] * turn for turn in turns]), np.vstack(
        [force[closed] * turn for turn in turns]
    )


def _under(loads, nu, young):
    """u of z < 0 under point forces at z = 0, as three functions."""
    places, forces = (array[:, None, :] for array in loads)
    known = {}

    def everything(*at):
        key = np.array(at).tobytes()
        if key not in known:
            d = np.array(at).T - places
            (a, b, c), (f, g, h) = (
                d.reshape(-1, 3).T,
                np.broadcast_to(forces, d.shape).reshape(-1, 3).T,
            )
            along, across = (
                half_space(a, b, c, (f, h), nu, young),
                half_space(b, -a, c, (g, 0.0 * g), nu, young),
            )
            total = along + np.array([-across[1], across[0], across[2]])
            known[key] = total.reshape(3, *d.shape[:2]).sum(axis=1)
        return known[key]

    return (
        lambda x, y, z: everything(x, y, z)[0],
        lambda x, y, z: everything(x, y, z)[1],
        lambda x, y, z: everything(x, y, z)[2],
    )


def spence_in_space(steps=35, size=0.5, rounds=2):
    """CONTACT's example spence35, a quarter: the force of step k is the last one times (k/steps)³.

    The far faces move as a half space does under the tractions that the round before found, a point
    force in the first one.
    """
    end, load = 7.0, 0.4705
    shares, far = [(k / steps) ** 3 for k in range(1, steps + 1)], ("right", "back", "bottom")
    loads = [(np.zeros((1, 3)), np.array([[0.0, 0.0, -share * load]])) for share in shares]
    for round_ in range(rounds):
        fields = [_under(each, 0.0, 1.0) for each in loads]
        problem = Problem(
            title="Spence: rigid sphere on a half space, µ = 0.2986",
            material=Material(1.0, 0.0),
            geometry=Box((0.0, 0.0, -end), (end, end, 0.0)),
            mesh=MeshOptions(
                1.75, element_sizes={"top": size, "left": 1.0, "front": 1.0}, order=1, exponent=1.0
            ),
            boundary=[
                *(Displacement(part, fields[-1]) for part in far),
                Symmetry("left"),
                Symmetry("front"),
            ],
            obstacle=[
                Obstacle("sphere", displacement=(0.0, 0.0, "free"), force=(0.0, 0.0, -0.25 * load))
            ],
            contact=[
                Pair(
                    "top",
                    secondary="top",
                    primary="sphere",
                    gap="(x**2 + y**2)/243",
                    friction_coefficient=0.2986,
                )
            ],
            step=[
                Step(
                    boundary=[BoundaryChange(part=part, value=field) for part in far],
                    obstacle=[ObstacleChange("sphere", force=(0.0, 0.0, -0.25 * share * load))],
                )
                for share, field in zip(shares, fields, strict=True)
            ],
        )
        if round_ + 1 < rounds:
            loads = [_loads(step.pairs["top"]) for step in petcontact.solve(problem).steps]
    return problem


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
