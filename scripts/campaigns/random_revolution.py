"""Random bodies of revolution in contact, drawn from a seed."""

from __future__ import annotations

import numpy as np

from petcontact import Problem
from petcontact.given.tables.base import parse

SIDES = ("bottom", "right", "top", "left")


def random_revolution(seed, number):
    """Bodies of revolution in contact with friction, in one or two steps: what presses on a plate,
    a press fit, a seat of cones, a ring on a floor, a seal; some of them hot or in rotation, and
    some turned about the axis in the second step."""
    random = np.random.default_rng([seed, number, 23])
    drawn = (_pressed, _fitted, _seated, _on_floor, _sealed, _pressed)[number % 6](random)
    friction = float(random.choice([0.0, random.uniform(0.05, 1.0)]))
    contact = [{**pair, "friction_coefficient": friction} for pair in drawn.pop("contact")]
    modulus, ratio = 10.0 ** random.uniform(0.0, 2.0, 2), random.uniform(0.0, 0.45, 2)
    for body, e, nu in zip(drawn["body"], modulus, ratio, strict=False):
        more = {"density": 1.0, "thermal_expansion": 1e-3}
        body["material"] = {"young_modulus": float(e), "poisson_ratio": float(nu), **more}
    if random.random() < 0.25:
        drawn["body"][0]["loads"] = [
            {"temperature": f"{random.uniform(1.0, 10.0)}*(1 + 0.3*y)"},
            {"angular_velocity": float(0.05 * np.sqrt(modulus[0]))},
        ][random.integers(2)]
    then, moves = drawn.pop("then"), random.random() < 0.5
    if friction and random.random() < 0.35:
        angle = random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-3.0, -1.5)
        then["value"], moves = [*then["value"], f"{angle}*x"], True
    steps = [{}] + [{"boundary": [then]}] * moves
    data = {"symmetry": "axial", **drawn, "contact": contact, "step": steps}
    return parse(Problem, data, f"revolution {number}")


def random_punch(seed, number):
    """A rounded rigid punch on a cylinder with friction or without, as a problem in space and as a
    body of revolution."""
    random = np.random.default_rng([seed, number, 29])
    wide, tall, radius = random.uniform([1.0, 0.8, 3.0], [1.5, 1.5, 8.0])
    depth = (random.uniform(0.25, 0.6) * wide) ** 2 / radius
    material = {"young_modulus": 1.0, "poisson_ratio": random.uniform(0.0, 0.45)}
    friction = float(random.choice([0.0, random.uniform(0.1, 0.8)]))
    corners = {
        "bottom": [wide, -tall],
        "side": [wide, 0.0],
        "top": [0.0, 0.0],
        "axis": [0.0, -tall],
    }
    loop = [{"part": part, "to": to} for part, to in corners.items()]

    def posed(shape, squared, **more):
        body = {
            "name": "block",
            "material": material,
            "geometry": {"shape": shape, "loops": [loop]},
        }
        pair = {"name": "pair", "secondary": "block.top", "primary": "punch"}
        pair |= {
            "gap": f"({squared})/{2.0 * radius!r} - {depth!r}",
            "friction_coefficient": friction,
        }
        body["boundary"] = [_moved("bottom", *[0.0] * (3 if shape == "revolved" else 2))]
        data = {"body": [body], "obstacle": [{"name": "punch"}], "contact": [pair], **more}
        return parse(Problem, data, f"punch {number}")

    return posed("revolved", "x**2 + y**2"), posed("outline", "x**2", symmetry="axial")


def _part(name, vertices, parts, *conditions):
    shape = {"shape": "polygon", "vertices": np.asarray(vertices).tolist(), "parts": list(parts)}
    return {"name": name, "geometry": shape, "boundary": list(conditions)}


def _moved(part, *value):
    return {"part": part, "condition": "displacement", "value": list(value)}


def _changed(body, part, *value):
    return {"body": body, "part": part, "value": list(value)}


def _plate(random):
    """A plate that is solid or a ring, held below, its top at height 0."""
    inner = random.choice([0.0, 0.3])
    outer = random.uniform(2.0, 4.0)
    high = random.uniform(1.0, 3.0)
    corners = [[inner, -high], [outer, -high], [outer, 0.0], [inner, 0.0]]
    return _part("plate", corners, SIDES, _moved("bottom", 0.0, 0.0))


def _pressed(random):
    """A ball, a cone, a punch with a sharp edge, or a ring on a plate."""
    wide = random.uniform(0.5, 1.8)
    tall = random.uniform(0.5, 2.0)
    down = -random.uniform(2e-3, 2e-2)
    inner = float(random.choice([0.0, 0.5 * wide]))
    if random.random() < 0.35:
        inner, radius = 0.0, random.uniform(2.0, 8.0)
        top = radius - np.sqrt(radius**2 - wide**2)
        sides = [
            {"part": "bottom", "to": [wide, top], "radius": radius},
            {"part": "right", "to": [wide, top + tall]},
            {"part": "top", "to": [0.0, top + tall]},
            {"part": "left", "to": [0.0, 0.0]},
        ]
        punch = {"name": "punch", "geometry": {"shape": "outline", "loops": [sides]}}
    else:
        rise = float(random.choice([0.0, random.uniform(-0.02, 0.05)]))
        low = -min(0.0, rise) * (wide - inner)
        corners = [[inner, 0.0], [wide, rise * (wide - inner)]]
        corners += [[wide * random.uniform(0.8, 1.3), tall], [inner, tall]]
        punch = _part("punch", np.add(corners, [0.0, low]), SIDES)
    punch["boundary"] = [_moved("top", random.choice(["free", 0.0]), down)]
    pair = {"name": "pair", "secondary": "punch.bottom", "primary": "plate.top"}
    then = _changed(
        "punch", "top", punch["boundary"][0]["value"][0], down * random.uniform(0.4, 1.5)
    )
    return {"body": [punch, _plate(random)], "contact": [pair], "then": then}


def _fitted(random):
    """A hub, which may have a shoulder, on a shaft that is solid or hollow, then pushed along."""
    r, inner, half = random.uniform(1.0, 2.0), random.choice([0.0, 0.4]), random.uniform(1.5, 3.0)
    long, thick = half * random.uniform(0.3, 0.7), random.uniform(0.5, 2.0)
    lean = random.uniform(-0.5, 0.5) * thick
    shaft = [[inner, -half], [r, -half], [r, half], [inner, half]]
    hub = [[r, -long], [r + thick, -long], [r + thick + lean, long], [r, long]]
    overlap = random.uniform(1e-3, 1e-2)
    bent = f"{-overlap}*(1 + {random.uniform(-0.3, 0.3)}*y/{long})"
    pair = {"name": "pair", "secondary": "hub.left", "primary": "shaft.right", "gap": bent}
    pushed = random.uniform(-2e-2, 2e-2)
    return {
        "body": [
            _part("hub", hub, SIDES, _moved("top", "free", 0.0)),
            _part("shaft", shaft, SIDES, _moved("bottom", random.choice(["free", 0.0]), 0.0)),
        ],
        "contact": [pair],
        "then": _changed("hub", "top", "free", pushed),
    }


def _seated(random):
    """A valve in a seat, both cones, its angle a little off."""
    slope, off = random.uniform(0.4, 2.0), random.choice([0.0, random.uniform(-0.02, 0.02)])
    r, wide, tall = random.uniform(0.8, 1.5), random.uniform(0.3, 0.8), random.uniform(0.5, 1.5)
    rise = wide * slope
    valve = [[0.0, 0.0], [r, 0.0], [r + wide, rise + off * wide], [r + wide, rise + tall]]
    valve = np.add([*valve, [0.0, rise + tall]], [0.0, max(0.0, -off * wide)])
    out, low = r + wide + random.uniform(0.5, 1.5), -random.uniform(0.5, 1.5)
    seat = [[r - 0.2, low], [out, low], [out, rise + 0.2 * slope]]
    seat += [[r + wide + 0.2, rise + 0.2 * slope], [r - 0.2, -0.2 * slope]]
    down = -random.uniform(2e-3, 2e-2)
    return {
        "body": [
            _part(
                "valve", valve, ("below", "cone", "rim", "top", "axis"), _moved("top", "free", down)
            ),
            _part(
                "seat", seat, ("bottom", "right", "top", "cone", "bore"), _moved("bottom", 0.0, 0.0)
            ),
        ],
        "contact": [{"name": "pair", "secondary": "valve.cone", "primary": "seat.cone"}],
        "then": _changed("valve", "top", "free", down * random.uniform(0.4, 1.5)),
    }


def _on_floor(random):
    """A cylinder or a ring under pressure or moved, on a rigid floor that is flat or bent."""
    inner, wide = random.choice([0.0, random.uniform(0.5, 3.0)]), random.uniform(0.5, 2.0)
    lean, tall = random.uniform(-0.3, 0.3, 2), random.uniform(0.5, 2.0)
    corners = [[inner, 0.0], [inner + wide, 0.0], [inner + wide + lean[0], tall]]
    corners += [[inner + (lean[1] if inner else 0.0), tall]]
    bend = random.choice([0.0, random.uniform(0.0, 0.1)])
    place = inner + wide * random.uniform(0, 1)
    down = -random.uniform(2e-3, 2e-2)
    across = random.choice(["free", 0.0])
    return {
        "body": [_part("ring", corners, SIDES, _moved("top", across, down))],
        "obstacle": [{"name": "floor"}],
        "contact": [
            {
                "name": "pair",
                "secondary": "ring.bottom",
                "primary": "floor",
                "gap": f"y + {0.5 * bend}*(x - {place})**2",
            }
        ],
        "then": _changed("ring", "top", across, down * random.uniform(0.4, 1.5)),
    }


def _sealed(random):
    """A torus that lies on a plate and is squeezed at its upper half."""
    middle, r = random.uniform(1.5, 4.0), random.uniform(0.4, 1.0)
    ends = [[middle + r, r], [middle - r, r]]
    loop = [
        {"part": "lower", "to": ends[0], "through": [middle, 0.0]},
        {"part": "flat", "to": ends[1]},
    ]
    down = -random.uniform(2e-3, 2e-2)
    seal = {"name": "seal", "geometry": {"shape": "outline", "loops": [loop]}}
    seal["boundary"] = [_moved("flat", random.choice(["free", 0.0]), down)]
    corners = [[middle - 1.5, -1.0], [middle + 1.5, -1.0], [middle + 1.5, 0.0], [middle - 1.5, 0.0]]
    return {
        "body": [seal, _part("plate", corners, SIDES, _moved("bottom", 0.0, 0.0))],
        "contact": [{"name": "pair", "secondary": "seal.lower", "primary": "plate.top"}],
        "then": _changed("seal", "flat", seal["boundary"][0]["value"][0], 1.3 * down),
    }
