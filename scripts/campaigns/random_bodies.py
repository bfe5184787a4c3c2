"""Random bodies in contact, drawn from a seed: outlines with arcs, reentrant corners and holes,
loads with rough spots."""

from __future__ import annotations

import math

import numpy as np

from petcontact import (
    Circle,
    Contact,
    Displacement,
    InputError,
    Material,
    OutlineSide,
    Problem,
    SideBySide,
    Traction,
)
from petcontact.given.tables.base import parse
from petcontact.mesh.curve_building import build_mesh
from petcontact.pipeline.eliminate import operators_of
from petcontact.pipeline.pose.discretise import discretise

LEAST_ANGLE, LARGEST_ANGLE = math.radians(25.0), math.radians(335.0)


def random_case(seed: int, number: int) -> Problem:
    """Body `number` of a seed; what comes out ill-posed (sides that cross, a body that can move) is
    drawn again."""
    rng = np.random.default_rng([seed, number])
    while True:
        try:
            case = _drawn(rng)
            outline = case.geometry.outline()
            ends = [np.linspace(0.0, 1.0, 9) for _ in outline.sides]
            mesh = build_mesh(outline, ends, [np.zeros(8, dtype=np.int64) for _ in ends])
            _, motions = operators_of(discretise(case, lambda *_, mesh=mesh: mesh), 0)
        except InputError:
            continue
        if motions.shape[2]:
            continue  # friction alone holds it
        return case.model_copy(update={"title": f"random body {number} of seed {seed}"})


def _drawn(rng: np.random.Generator) -> Problem:
    size = 10.0 ** rng.uniform(-2.0, 3.0)
    shift = size * rng.uniform(-2.0, 2.0, 2)
    outer = size * _star(rng, int(rng.integers(4, 9))) + shift
    names = [f"side {k}" for k in range(len(outer))]
    loops: list = [_loop(rng, outer, names, float(rng.choice([0.0, 0.0, 0.25, 0.5])))]
    holes = int(rng.choice([0, 0, 0, 1, 2]))
    for hole in range(holes):
        centre = outer.mean(axis=0) + size * rng.uniform(-0.25, 0.25, 2)
        radius = size * rng.uniform(0.05, 0.2)
        if rng.random() < 0.6:
            loops.append(Circle(part=f"hole {hole}", center=tuple(centre), radius=radius))
        else:
            corners = centre + radius * _star(rng, int(rng.integers(3, 6)))
            loops.append(_loop(rng, corners, [f"hole {hole}"] * len(corners), 0.3))
    stress = 10.0 ** rng.uniform(-3.0, 6.0)
    whole = SideBySide(loops=(loops[0],)).outline()
    lengths = np.array(
        [sum(side.length for side in whole.sides if side.part == name) for name in names]
    )
    conditions = _conditions(rng, names, lengths, stress, size)
    for hole in range(holes):
        pressure = 0.0 if rng.random() < 0.7 else stress * rng.uniform(0.1, 1.0)
        conditions.append(Traction(part=f"hole {hole}", pressure=pressure))
    return Problem(
        material=Material(
            young_modulus=stress * 10.0 ** rng.uniform(1.5, 4.0),
            poisson_ratio=rng.uniform(0.0, 0.45),
            plane=str(rng.choice(["strain", "stress"])),
        ),
        geometry=SideBySide(loops=tuple(loops)),
        boundary=tuple(conditions),
    )


def _star(rng: np.random.Generator, count: int) -> np.ndarray:
    """Corners (count, 2) of a polygon around the origin, stretched and turned."""
    angle = np.cumsum(rng.uniform(0.5, 1.5, count))
    angle *= 2.0 * math.pi / angle[-1]
    radius = rng.uniform(0.45, 1.0, count)
    points = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    points[:, 1] *= rng.choice([1.0, 0.7, 0.35])
    turn = rng.choice([0.0, rng.uniform(0.0, 2.0 * math.pi)])
    turned = points @ np.array(
        [[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]]
    )
    before, after = turned - np.roll(turned, 1, axis=0), np.roll(turned, -1, axis=0) - turned
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    interior = math.pi - np.arctan2(cross, np.sum(before * after, axis=1))
    if interior.min() < LEAST_ANGLE or interior.max() > LARGEST_ANGLE:
        raise InputError("a corner too sharp")
    return np.asarray(turned)


def _loop(
    rng: np.random.Generator, corners: np.ndarray, names: list[str], arcs: float
) -> tuple[OutlineSide, ...]:
    """Sides from each corner to the next, some of them arcs."""
    sides = []
    for start, end, name in zip(corners, np.roll(corners, -1, axis=0), names, strict=True):
        radius = None
        if rng.random() < arcs:
            radius = float(
                rng.choice([-1.0, 1.0]) * np.hypot(*(end - start)) * rng.uniform(0.6, 3.0)
            )
        sides.append(OutlineSide(part=name, to=tuple(end), radius=radius))
    return tuple(sides)


def _conditions(
    rng: np.random.Generator, names: list[str], lengths: np.ndarray, stress: float, size: float
) -> list:
    count = len(names)
    contacts = int(rng.choice([1, 1, 1, 2, 2, 3]))
    kinds = np.array(["traction"] * count, dtype=object)
    order = rng.permutation(count)
    kinds[order[:contacts]] = "contact"
    held = max(1, min(int(rng.choice([1, 1, 2])), count - contacts - 1))
    kinds[order[contacts : contacts + held]] = "displacement"
    result: list = []
    young = 10.0 ** rng.uniform(-4.0, -2.0)  # a displacement, relative to the body
    for k, (name, kind, length) in enumerate(zip(names, kinds, lengths, strict=True)):
        alone = all(kinds[(k + step) % count] == "traction" for step in (-1, 1))
        if kind == "contact":
            bound = stress * 10.0 ** rng.uniform(-1.0, 0.5)
            result.append(Contact(part=name, friction_bound=_bound(rng, bound, length)))
        elif kind == "displacement":
            result.append(
                Displacement(part=name, value=_displacement(rng, alone, young * size, length))
            )
        elif rng.random() < 0.35:
            result.append(Traction(part=name, value=(0.0, 0.0)))
        elif rng.random() < 0.3:
            result.append(Traction(part=name, pressure=_load(rng, stress * rng.normal(), length)))
        else:
            result.append(
                Traction(
                    part=name,
                    value=(
                        _load(rng, stress * rng.normal(), length),
                        _load(rng, stress * rng.normal(), length),
                    ),
                )
            )
    return result


def _bound(rng: np.random.Generator, bound: float, length: float) -> float | str:
    """g >= 0: constant, linear, kinked, jumping, or with a bump."""
    at, b = rng.uniform(0.1, 0.9) * length, f"{bound}"
    return [
        bound,
        bound,
        bound,
        f"{b}*(1 + s/{length})",
        f"{b}*(0.3 + abs(s - {at})/{length})",
        f"{b}*where(s < {at}, 1, {rng.uniform(0.2, 4.0)})",
        f"max({0.2 * bound}, {b}*(1 - 2*s/{length}))",
        f"{b}*(0.5 + exp(-((s - {at})/{_width(rng, length)})**2))",
        f"{b}*(1 + 0.5*sin({rng.uniform(2.0, 20.0) / length}*s))",
    ][rng.integers(9)]


def _load(rng: np.random.Generator, load: float, length: float) -> float | str:
    """A traction: constant, linear, a wave, a step, a hat, or a narrow peak of the same
    resultant."""
    at, t = rng.uniform(0.1, 0.9) * length, f"{load}"
    width = _width(rng, length)
    peak = load * min(length / width, 1e3)
    return [
        load,
        load,
        load,
        f"{t}*(1 - s/{length})",
        f"{t}*sin({rng.uniform(2.0, 20.0) / length}*s)",
        f"{t}*(s > {at})",
        f"{t}*max(0, 1 - abs(s - {at})/{0.2 * length})",
        f"{peak}*exp(-((s - {at})/{width})**2)",
        f"{peak}/(1 + ((s - {at})/{width})**2)",
        f"{t}*sqrt(abs(s - {at})/{length})",
    ][rng.integers(10)]


def _width(rng: np.random.Generator, length: float) -> float:
    return float(length * 10.0 ** rng.uniform(-4.5, -0.7))


def _displacement(rng: np.random.Generator, alone: bool, size: float, length: float) -> tuple:
    """Clamped or a roller; other than zero in between where a neighbour holds the body, too, so
    that nothing is torn."""
    along = "" if alone else f"*s*({length} - s)/{0.25 * length**2}"
    value: list = [0.0, 0.0]
    for c in range(2):
        if rng.random() < 0.5:
            value[c] = f"{size * rng.normal()}*(1 + {rng.normal()}*s/{length}){along}"
    if rng.random() < 0.3:
        value[int(rng.integers(2))] = "free"
    return tuple(value)


def random_contact(seed, number):
    """A quadrilateral in unilateral contact with friction, on a rigid floor that is flat or bent,
    or on another one."""
    random = np.random.default_rng([seed, number, 17])
    wide = random.uniform(1.0, 3.0)
    tall = random.uniform(0.5, 2.0, 2)
    lean = random.uniform(-0.3, 0.3, 4)
    low, gap = random.uniform(1.0, 2.5), random.choice([0.0, random.uniform(0.0, 0.01)])
    mu = random.choice([0.0, random.uniform(0.0, 1.0)])
    tilt = random.choice([0.0, random.uniform(-0.02, 0.02)])
    upper = np.array([[0.0, 0.0], [wide, 0.0], [wide + lean[0], tall[0]], [lean[1], tall[0]]]) - [
        0.5 * wide,
        0.0,
    ]
    upper = upper @ [[np.cos(tilt), np.sin(tilt)], [-np.sin(tilt), np.cos(tilt)]]
    upper[:, 0] += 0.3 * low * random.uniform(-1.0, 1.0)
    upper[:, 1] += gap - upper[:2, 1].min()
    lower = np.array(
        [[lean[2] - low, -tall[1]], [low + lean[3], -tall[1]], [low, 0.0], [-low, 0.0]]
    )
    modulus, ratio = 10.0 ** random.uniform(0.0, 2.0, 2), random.uniform(0.0, 0.45, 2)
    push = [random.uniform(-0.03, 0.03), -random.uniform(0.005, 0.05) - gap]
    top = {"part": "top", "condition": "displacement", "value": push}
    if random.random() < 0.4:
        pressure = 0.02 * modulus[0]
        top = {
            "part": "top",
            "condition": "traction",
            "value": [random.uniform(-0.2, 0.2) * mu * pressure, -pressure],
        }
    bodies = [
        {
            "name": name,
            "material": {"young_modulus": float(e), "poisson_ratio": float(nu)},
            "boundary": [condition],
            "geometry": {
                "shape": "polygon",
                "vertices": vertices.tolist(),
                "parts": ["bottom", "right", "top", "left"],
            },
        }
        for name, vertices, e, nu, condition in zip(
            ("upper", "lower"),
            (upper, lower),
            modulus,
            ratio,
            (top, {"part": "bottom", "condition": "displacement", "value": [0.0, 0.0]}),
            strict=True,
        )
    ]
    contact = {
        "name": "pair",
        "secondary": "upper.bottom",
        "primary": "lower.top",
        "friction_coefficient": float(mu),
    }
    data = {
        "body": bodies,
        "contact": [contact],
        "step": [
            {},
            {
                "boundary": [
                    {
                        "body": "upper",
                        "part": "top",
                        "value": [-0.5 * top["value"][0], top["value"][1]],
                    }
                ]
            },
        ][: int(random.choice([1, 2]))],
    }
    if random.random() < 0.5:
        bend = float(random.choice([0.0, random.uniform(0.0, 0.2)]))
        place = random.uniform(-0.3, 0.3)
        data |= {
            "body": bodies[:1],
            "obstacle": [{"name": "floor"}],
            "contact": [
                {**contact, "primary": "floor", "gap": f"y + {0.5 * bend}*(x - {place})**2"}
            ],
        }
    return parse(Problem, data, f"contact {number}")
