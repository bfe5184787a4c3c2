"""Random contact problems by seed, each posed in ways that must not matter: moved, mirrored, in
other units, with loads off by round-off, nodes in another order."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from petcontact import Problem
from petcontact.given.tables.base import parse

SIDES = ("bottom", "right", "top", "left")
KINDS = ("pressed", "light", "touching", "stick", "slip", "weight", "auto", "force")
TIGHT = 1e-7
"""Of the largest, by which numbers of one mesh may differ."""
NOTHING = 1e-12
"""Traction over the modulus, displacement over the size, that is none."""


@dataclass(frozen=True)
class Variant:
    """How a problem is posed: turned by an angle, mirrored, shifted by so many of its sizes, in
    units of so much length and stress, with its loads times a factor, first corner `first`."""

    angle: float = 0.0
    mirrored: bool = False
    shift: float = 0.0
    length: float = 1.0
    stress: float = 1.0
    load: float = 1.0
    first: int = 0

    def vector(self, v: Any) -> np.ndarray:
        """Vectors (..., d), about the last axis in space."""
        v = np.array(v, dtype=float)
        if self.mirrored:
            v[..., 0] = -v[..., 0]
        # of right angles, too, without round-off: a box stays one
        c, s = (round(f, 15) for f in (math.cos(self.angle), math.sin(self.angle)))
        v[..., :2] = v[..., :2] @ np.array([[c, s], [-s, c]])
        return v

    def point(self, x: Any) -> np.ndarray:
        return np.asarray(self.length * (self.vector(x) + self.shift))

    def polygon(self, vertices: Any) -> dict:
        """A quadrilateral whose sides are named as those of a rectangle, counter-clockwise."""
        points, parts = self.point(vertices).tolist(), list(SIDES)
        if self.mirrored:
            points, parts = points[::-1], [*parts[2::-1], parts[3]]
        turned = [each[self.first :] + each[: self.first] for each in (points, parts)]
        return {"shape": "polygon", "vertices": turned[0], "parts": turned[1]}

    def along(self) -> str:
        """The first coordinate of the problem as drawn, as an expression [drawn length]."""
        c, s = float(self.vector([1.0, 0.0])[0]), float(self.vector([1.0, 0.0])[1])
        shift = self.length * self.shift
        return f"(({c!r})*(x - ({shift!r})) + ({s!r})*(y - ({shift!r})))/{self.length!r}"


VARIANTS = {
    "loads times 1 + 1e-13": Variant(load=1.0 + 1e-13),
    "mirrored": Variant(mirrored=True),
    "turned by 90 degrees": Variant(angle=0.5 * math.pi),
    "turned by 37 degrees": Variant(angle=math.radians(37.0)),
    "shifted by a body": Variant(shift=3.0),
    "units times 2^10": Variant(length=2.0**10, stress=2.0**-10),
    "units times 1e-3": Variant(length=1e-3, stress=1e3),
    "nodes in another order": Variant(first=2),
}
SAMPLE = ("loads times 1 + 1e-13", "mirrored", "turned by 37 degrees", "shifted by a body")
SAMPLE += ("units times 1e-3", "nodes in another order")


def drawn(seed: int, number: int, variant: Variant, space: bool = False) -> Problem:
    """Problem `number` of a seed: a body on another one, of a kind that its number says."""
    random = np.random.default_rng([seed, number, space])
    kind = KINDS[number % len(KINDS)]
    mu = {"stick": 3.0, "slip": 0.05}.get(kind, float(random.choice([0.0, random.uniform(0, 1)])))
    if kind in ("weight", "force"):
        mu = random.uniform(0.2, 0.9)
    moduli, ratios = 10.0 ** random.uniform(0.0, 2.0, 2), random.uniform(0.0, 0.45, 2)
    gap = 0.05 if kind in ("touching", "auto") else float(random.choice([0.0, 0.01]))
    depth = {"light": 1e-9, "touching": 0.0}.get(kind, random.uniform(0.003, 0.02))
    aside = random.uniform(-1.0, 1.0) * (0.1 if kind == "stick" else 1.0) * depth
    aside = 3.0 * depth if kind == "slip" else aside
    if kind == "auto" and number // len(KINDS) % 2 == 0:
        aside = 0.0  # before bodies touch tangential displacements are round-off
    push = np.array([aside, *[0.0] * space, -gap - depth])
    bent = random.uniform(0.02, 0.2) * (kind in ("pressed", "auto"))
    geometries = (_boxes if space else _quadrilaterals)(random, variant)
    size = 0.5 if space else 0.2
    bodies, held = [], [0.0] * (2 + space)
    for k, name in enumerate(("upper", "lower")):
        bodies.append(
            {
                "name": name,
                "material": {
                    "young_modulus": float(moduli[k]) * variant.stress,
                    "poisson_ratio": float(ratios[k]),
                },
                "geometry": geometries[k],
                "mesh": {"element_size": size * variant.length, "order": 1},
                "boundary": [{"part": "bottom", "condition": "displacement", "value": held}] * k,
            }
        )
    load = variant.load * variant.vector(push)
    top = {"part": "top", "condition": "displacement", "value": (variant.length * load).tolist()}
    if kind == "force":
        pressure = 0.01 * float(moduli[0]) * variant.stress
        pull = [0.4 * mu * pressure, *[0.0] * space, -pressure]
        value = variant.load * variant.vector(pull)
        top = {"part": "top", "condition": "traction", "value": value.tolist()}
    if kind == "weight":
        down = variant.vector([0.3 * mu, *[0.0] * space, -1.0])
        weight = variant.load * 0.01 * float(moduli[0]) * variant.stress / variant.length * down
        bodies[0]["loads"] = {"force": weight.tolist()}
    else:
        bodies[0]["boundary"] = [top]
    along = "x" if space else variant.along()
    contact = {
        "name": "pair",
        "secondary": "upper.bottom",
        "primary": "lower.top",
        "friction_coefficient": mu,
        "gap": gap * variant.length
        if space
        else f"{variant.length!r}*({gap!r} + {bent!r}*({along} - 0.1)**2)",
    }
    if kind in ("weight", "force"):
        contact["gap"] = "geometry"
    increments = {"increments": "auto"} if kind == "auto" else {}
    data = {"body": bodies, "contact": [contact], "step": [{"name": "press", **increments}]}
    data["method"] = {"tolerance": 1e-10}  # a change of v and σ together is one of units
    return parse(Problem, data, f"{kind} {number} of seed {seed}")


def _quadrilaterals(random: np.random.Generator, variant: Variant) -> list[dict]:
    lean, tall = random.uniform(-0.2, 0.2, 4), random.uniform(0.5, 1.0, 2)
    upper = [[-0.6, 0.0], [0.7, 0.0], [0.7 + lean[0], tall[0]], [-0.6 + lean[1], tall[0]]]
    lower = [[-1.0 + lean[2], -tall[1]], [1.0 + lean[3], -tall[1]], [1.0, 0.0], [-1.0, 0.0]]
    return [variant.polygon(upper), variant.polygon(lower)]


def _boxes(random: np.random.Generator, variant: Variant) -> list[dict]:
    tall = random.uniform(0.5, 1.0, 2)
    corners = [[[-0.5, -0.5, 0.0], [0.6, 0.5, tall[0]]], [[-1.0, -1.0, -tall[1]], [1.0, 1.0, 0.0]]]
    ends = [np.sort(variant.point(each), axis=0).tolist() for each in corners]
    return [{"shape": "box", "lower": low, "upper": high} for low, high in ends]


def observed(solution: Any, variant: Variant) -> dict:
    """What must not depend on a variant, as plain data without units: status, increments, and the
    numbers of all nodes, sorted, with the size that each of them is compared with."""
    found: dict = {"status": solution.status, "increments": len(solution.steps), "numbers": {}}
    young = max(body.material.young_modulus for body in solution.problem.body) / variant.stress
    for step in solution.steps[-1:]:
        moved = max(float(np.abs(body.u).max()) for body in step.bodies.values()) / variant.length
        for name, pair in step.pairs.items():
            sigma_t = np.linalg.norm(pair.sigma_t, axis=1)
            slip = np.linalg.norm(pair.slip, axis=1)
            largest = float(max(np.abs(pair.pressure).max(), sigma_t.max())) / variant.stress
            for key, values, unit, scale in (
                ("p", pair.pressure, variant.stress, largest + NOTHING / TIGHT * young),
                ("q", sigma_t, variant.stress, largest + NOTHING / TIGHT * young),
                ("w", slip, variant.length, moved + NOTHING / TIGHT),
            ):
                found["numbers"][f"{key} of {name}"] = [np.sort(values / unit).tolist(), scale]
    return found


def differences(one: dict, other: dict, allowed: float = TIGHT) -> list[str]:
    """In what two observations differ by more than they may, in words; nothing if they agree."""
    told = [
        f"{key} {one[key]!r}, {other[key]!r}"
        for key in ("status", "increments")
        if one[key] != other[key]
    ]
    if one["numbers"].keys() != other["numbers"].keys():
        return told
    for key, (values, scale) in one["numbers"].items():
        a, b = np.array(values), np.array(other["numbers"][key][0])
        if a.shape != b.shape:
            told.append(f"{key}: {len(a)} and {len(b)} nodes")
        elif (off := float(np.abs(a - b).max(initial=0.0)) / scale) > allowed:
            told.append(f"{key} by {off:.1e} of the largest")
    return told
