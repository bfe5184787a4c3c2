"""Problems whose field is known: blocks cut out of half planes, with its displacement on the far
sides.

Young's modulus is 1, Poisson's ratio `NU`, half widths of contact 1 where nothing else is said.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import petcontact
from petcontact import (
    Body,
    BoundaryChange,
    Displacement,
    Material,
    MeshOptions,
    Obstacle,
    ObstacleChange,
    Pair,
    Polygon,
    Problem,
    Rectangle,
    Step,
    Traction,
)
from petcontact.mesh.basis import gauss
from petcontact.reference.cattaneo_mindlin import LinePartialSlip
from petcontact.reference.half_plane import elliptic_load
from petcontact.reference.hertz import LineContact, contact_modulus

PUBLISHED = Path(__file__).parent / "published"
NU, L = 0.3, 3.0
G = 0.5 / (1.0 + NU)
STEEL = Material(1.0, NU)
E_STAR = contact_modulus(1.0, NU)
HERTZ = LineContact(0.25 * np.pi * E_STAR / 10.0, 10.0, E_STAR)  # a = 1, R = 10
SIDES = ("left", "bottom", "right")


def half_plane(x, y, where, load):
    """u_x + i u_y at points of y < 0 under forces load (k,) = p + iq, pressure and shear, at
    `where` (k,) of y = 0.

    Muskhelishvili's potentials of a point force, those of `petcontact.reference.half_plane` as the
    load shrinks to a point.
    """
    kappa, z = 3.0 - 4.0 * NU, (x + 1j * np.minimum(y, -1e-300))[:, None] - where
    half = 0.5j * load / np.pi
    # logarithms with their cut outside of the body, symmetric about the force
    u = (
        kappa * half * np.log(1j * z)
        + half * np.log(-1j * z.conj())
        - (z - z.conj()) * (half / z).conj()
    )
    return u.sum(axis=1) / (2.0 * G)


def _held(where, load, parts=SIDES):
    """Displacement conditions with that field."""
    u = (
        lambda x, y: half_plane(x, y, where, load).real,
        lambda x, y: half_plane(x, y, where, load).imag,
    )
    return [Displacement(part, u) for part in parts]


def _points(count=400):
    """Nodes and weights of ∫ f(x) dx over [-1, 1] for f with square roots at its ends: x = sin
    t."""
    nodes, weights = gauss(count)
    t = 0.5 * np.pi * nodes
    return np.sin(t), 0.5 * np.pi * weights * np.cos(t)


def _pressed(title, name, force, pressure, gap):
    """A rigid body that a force presses on a block, whose pressure is known."""
    where, weight = _points()
    return Problem(
        title=title,
        material=STEEL,
        geometry=Rectangle((-L, -L), (L, 0.0)),
        boundary=_held(where, weight * pressure(where)),
        obstacle=[Obstacle(name, displacement=(0.0, "free"), force=(0.0, -force))],
        contact=[Pair("top", secondary="top", primary=name, gap=gap)],
    )


def hertz():
    """A rigid parabola of radius 10."""
    title = "Hertz: rigid parabola on a half plane"
    return _pressed(title, "parabola", HERTZ.load, HERTZ.pressure, "x**2/20")


def hertz_pressure(x):
    return HERTZ.pressure(x[:, 0])


def _outline(far, near, name):
    """A block whose top is free for |x| > near, and has a name between."""
    corners = [(-far, -far), (far, -far), (far, 0.0), (near, 0.0), (-near, 0.0), (-far, 0.0)]
    return Polygon(vertices=corners, parts=["bottom", "right", "free", name, "free", "left"])


def _punched(title, normal, load):
    """A flat punch on |x| < 1 under the force 1; sides of the block beside it are free."""
    where, weight = _points()
    motion = {"displacement": (0.0, "free"), "rotation": 0.0, "force": (0.0, -1.0)}
    return Problem(
        title=title,
        material=STEEL,
        geometry=_outline(L, 1.0, "punch"),
        mesh=MeshOptions(0.4, order=4, grading=0.2, levels=12),
        boundary=[*_held(where, weight * load(where)), Traction("free", (0.0, 0.0))],
        obstacle=[Obstacle("platen", **motion)],
        contact=[Pair("punch", secondary="punch", primary="platen", normal=normal)],
    )


def flat_punch():
    """Frictionless: p = 1/(π √(1 - x²))."""
    title, load = "Flat punch, frictionless", lambda x: 1.0 / (np.pi * np.sqrt(1.0 - x**2))
    return _punched(title, "unilateral", load)


def adhesive_load(x):
    """p + iq = 2(1-ν)/√(3-4ν) / (π √(1 - x²)) ((1+x)/(1-x))^(iη), η = ln(3-4ν)/(2π)."""
    kappa = 3.0 - 4.0 * NU
    turn = ((1.0 + x) / (1.0 - x)) ** (0.5j * np.log(kappa) / np.pi)
    return 2.0 * (1.0 - NU) / np.sqrt(kappa) / (np.pi * np.sqrt(1.0 - x**2)) * turn


def adhesive_pressure(x):
    return adhesive_load(x[:, 0]).real


def adhesive_shear(x):
    return np.abs(adhesive_load(x[:, 0]).imag)


def adhesive_punch():
    """Rough: nothing slips."""
    return _punched("Flat punch, bonded", "bonded", adhesive_load)


FLAT = np.arcsin(0.5)
"""φ_0 of the rounded punch, sin φ_0 = b/a."""
ROUNDED_LOAD = 0.25 * E_STAR / 10.0 * (np.pi - 2.0 * FLAT - np.sin(2.0 * FLAT))


def rounded_pressure(x):
    """Of a punch that is flat for |x| < 1/2 and has radii 10 beyond; 2PR/(a²E*) = (π - 2φ_0 - sin
    2φ_0)/2."""
    x = x[:, 0] if x.ndim == 2 else x
    phi = np.arcsin(np.clip(x, -1.0 + 1e-15, 1.0 - 1e-15))
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = np.sin(phi) * np.log(np.abs(np.sin(phi + FLAT) / np.sin(phi - FLAT)))
        tangents = np.tan(0.5 * (phi + FLAT)) * np.tan(0.5 * (phi - FLAT))
        logs += np.sin(FLAT) * np.log(np.abs(tangents))
    width = np.pi - 2.0 * FLAT
    scale = 2.0 * ROUNDED_LOAD / (np.pi * (width - np.sin(2.0 * FLAT)))
    return scale * (width * np.cos(phi) + logs) * (np.abs(x) < 1.0)


def rounded_punch():
    title, gap = "Flat punch with rounded edges", "where(abs(x) < 0.5, 0, (abs(x) - 0.5)**2/20)"
    return _pressed(title, "punch", ROUNDED_LOAD, rounded_pressure, gap)


def spence_in_the_plane(steps=24):
    """The parabola, rough (µ = 0.3), in a block of 20: forces (k/steps)², so that the contact grows
    evenly."""
    where, weight = _points()
    load = weight * HERTZ.pressure(where)

    def step(share):
        held = _held(where, share * load)
        changes = [BoundaryChange(part=each.part, value=each.value) for each in held]
        force = ObstacleChange("parabola", force=(0.0, -share * HERTZ.load))
        return Step(boundary=changes, obstacle=[force])

    title = "Spence: rough rigid parabola on a half plane"
    smooth = _pressed(title, "parabola", HERTZ.load, HERTZ.pressure, "x**2/20")
    rough = smooth.contact[0].model_copy(update={"friction_coefficient": 0.3})
    return Problem(
        title=title,
        material=STEEL,
        geometry=_outline(10.0, 1.1, "top"),
        mesh=MeshOptions(1.0, element_sizes={"top": 0.05}, order=2),
        boundary=[*_held(where, load), Traction("free", (0.0, 0.0))],
        obstacle=smooth.obstacle,
        contact=[rough],
        step=[step((k / steps) ** 2) for k in range(1, steps + 1)],
    )


# --- Cattaneo and Mindlin: two blocks, µ = 0.4, c = 0.6, pressed, then pushed to and fro

MU, STICK = 0.4, 0.6
TWO = LineContact(0.125 * np.pi / (1.0 - NU**2), 1.0, contact_modulus(1.0, NU, 1.0, NU))
SHEAR = LinePartialSlip(TWO, MU, MU * TWO.load * (1.0 - STICK**2))


def cattaneo_field(x, push=1.0):
    """u (n, 2), σ_xx, σ_yy, σ_xy of the lower block, q times `push`; those of the upper one are
    those at -x, with -u."""
    sums, peak = [0.0, 0.0, 0.0, 0.0], TWO.peak
    for load, a in ((peak * (1.0 + 1j * push * MU), 1.0), (-1j * push * MU * peak * STICK, STICK)):
        values, origin = elliptic_load(x, load, a, NU), elliptic_load(np.zeros((1, 2)), load, a, NU)
        for k in range(4):
            sums[k] = sums[k] + values[k] - (origin[0] if k == 0 else 0.0)
    return np.column_stack([sums[0].real, sums[0].imag]) / (2.0 * G), *sums[1:]


def _cattaneo(sign, push):
    """u of the lower (sign 1) or upper (-1) block as two functions of x and y."""

    def component(k):
        return lambda x, y: sign * cattaneo_field(sign * np.column_stack([x, y]), push)[0][:, k]

    return component(0), component(1)


def cattaneo():
    """Press, +Q, -Q, +Q."""
    edges = [(x, 0.0) for x in (-1.0, -STICK, STICK, 1.0)]
    graded = MeshOptions(1.0, order=4, grading=0.3, levels=6, graded_points=edges)
    bodies, pushes = [], {"press": 0.0, "push": 1.0, "pull": -1.0, "push again": 1.0}
    changes = {name: [] for name in pushes}
    for name, sign, far, mesh in (
        ("lower", 1.0, "bottom", graded),
        ("upper", -1.0, "top", MeshOptions(1.0, order=4)),
    ):
        low, high = sorted((0.0, -sign * L))
        parts, shape = ("left", far, "right"), Rectangle((-L, low), (L, high))
        held = [Displacement(part, _cattaneo(sign, 0.0)) for part in parts]
        bodies.append(Body(name, STEEL, shape, mesh, boundary=held))
        for step, push in pushes.items():
            value = _cattaneo(sign, push)
            changes[step] += [BoundaryChange(body=name, part=part, value=value) for part in parts]
    sides = {"secondary": "lower.top", "primary": "upper.bottom"}
    return Problem(
        title="Cattaneo and Mindlin: two blocks pushed to and fro",
        body=bodies,
        step=[Step(name, boundary=change) for name, change in changes.items()],
        contact=[Pair("pair", **sides, gap="x**2/2", friction_coefficient=MU)],
    )


def cattaneo_pressure(x):
    return TWO.pressure(x[:, 0])


def cattaneo_shear(x):
    return SHEAR.traction(x[:, 0])


def oblique():
    """The cylinders of B09 under a force of constant direction, Q = 0.1 P: nothing slips, q = 0.1 p
    (Jaeger)."""
    problem = petcontact.load(f"{PUBLISHED}/b09_frictional_cylinders.toml")
    platen = problem.obstacle[0].model_copy(update={"force": (1.0, -10.0)})
    return problem.model_copy(
        update={"obstacle": (platen,), "step": (Step("oblique", increments=32),)}
    )
