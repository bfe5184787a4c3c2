"""Closed forms of bodies of revolution: problems cut out of half spaces whose pressure is known, and
bodies under pressure, speed and heat."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ellipe
from shapes import drawn, elastic, moved, problem, rectangle, solid, touching

from petcontact import Problem, Solution

E, NU, SIZE = 1.0, 0.3, 3.0
"""Material and size of the cylinders that are cut out of half spaces; contacts have radius 1."""
POINTS, ANGLES = 12, 10
"""Of the integrals over half of the contact: 5e-10 on the faces of the cylinder."""
MODULUS = E / (1.0 - NU**2)


@dataclass(frozen=True)
class Indented:
    """A half space under a rigid indenter, radius of contact 1.

    Attributes
    ----------
    gap : str
        Of the indenter from the plane, in x.
    depth : float
        By which it is pressed.
    pressure : function of r
    force : float
    """

    gap: str
    depth: float
    pressure: Callable
    force: float


INDENTED = {
    # Hertz, R = 1; Boussinesq; Love, its slope 1 (Johnson, Contact Mechanics, 3.4, 3.8, 5.2)
    "ball": Indented("x**2/2", 1.0, lambda r: 2.0 / np.pi * MODULUS * np.sqrt(1.0 - r**2), 4 / 3),
    "flat": Indented("0", 1.0, lambda r: MODULUS / (np.pi * np.sqrt(1.0 - r**2)), 2.0),
    "cone": Indented("x", np.pi / 2.0, lambda r: 0.5 * MODULUS * np.arccosh(1.0 / r), np.pi / 2.0),
}
"""Forces over the modulus E/(1-ν²)."""


@functools.cache
def _rings(pressure: Callable) -> tuple[np.ndarray, np.ndarray]:
    t, w = np.polynomial.legendre.leggauss(POINTS)
    t, w = 0.5 * (1.0 + t), 0.5 * w
    phi = 0.5 * np.pi * t**3
    ring = np.sin(phi)
    return ring, pressure(ring) * ring * 0.5 * np.pi * 3.0 * t**2 * np.cos(phi) * w


def displacement(pressure: Callable, r: np.ndarray, z: np.ndarray) -> np.ndarray:
    """u_r and u_z of z < 0 under a pressure on r < 1, by Boussinesq's point forces: r = sin φ takes
    away what is infinite at its edge, φ = t³ what a cone has in the middle."""
    ring, load = _rings(pressure)
    theta = np.pi * (np.arange(ANGLES) + 0.5) / ANGLES
    x = r[:, None, None] - ring[:, None] * np.cos(theta)
    y, h = -ring[:, None] * np.sin(theta), -z[:, None, None]
    rho = np.sqrt(x * x + y * y + h * h)
    radial = x * (h / rho**3 - (1.0 - 2.0 * NU) / (rho * (rho + h)))
    down = -(2.0 * (1.0 - NU) / rho + h * h / rho**3)
    factor = 2.0 * np.pi * (1.0 + NU) / (2.0 * np.pi * E * ANGLES)
    return factor * np.array([np.einsum("nqk,q->n", u, load) for u in (radial, down)])


def indented(name: str, scale: float = 1e-2) -> Problem:
    """The cylinder r < 3, -3 < z < 0 under an indenter, all lengths of it times a scale."""
    known = INDENTED[name]
    last: list[np.ndarray] = []  # of places, and what both components are there

    def component(k: int) -> Callable:
        def values(x: np.ndarray, y: np.ndarray) -> np.ndarray:
            if not last or not (np.array_equal(last[0], x) and np.array_equal(last[1], y)):
                last[:] = x, y, scale * displacement(known.pressure, x, y)
            return last[2][k]

        return values

    rim = "free" if name == "flat" else "top"
    return problem(
        symmetry="axial",
        material=elastic(E, NU),
        geometry=cylinder(rim),
        boundary=[
            *(moved(part, (component(0), component(1))) for part in ("right", "bottom")),
            *([drawn("free", (0.0, 0.0))] if rim == "free" else []),
        ],
        obstacle=[{"name": "indenter", "displacement": [0.0, -scale * known.depth]}],
        contact=[touching("pair", "top", "indenter", gap=f"{scale}*({known.gap})")],
    )


def cylinder(rim: str) -> dict:
    """r < 3, -3 < z < 0, of which the top ends at r = 1 and goes on as the part `rim`."""
    ends = [("right", SIZE, 0.0), (rim, 1.0, 0.0), ("top", 0.0, 0.0)]
    ends += [("axis", 0.0, -SIZE), ("bottom", SIZE, -SIZE)]
    return {"shape": "outline", "loops": [[{"part": part, "to": [x, y]} for part, x, y in ends]]}


def indented_errors(name: str, solution: Solution, scale: float = 1e-2) -> tuple[float, float]:
    """Relative errors of the force and, in L2 of the nodes, of the pressure."""
    known, pair = INDENTED[name], solution.pairs["pair"]
    r = pair.x[:, 0]
    exact = scale * np.where(r < 1.0, known.pressure(np.minimum(r, 1.0 - 1e-15)), 0.0)
    force = -pair.force[1] / (scale * MODULUS * known.force) - 1.0
    square = pair.weight @ (pair.pressure - exact) ** 2 / (pair.weight @ exact**2)
    return abs(force), float(np.sqrt(square))


TURN, FRICTION = 1e-3, 0.3
"""Angle by which half spaces are turned [rad], and friction of a ball that does."""
SHEAR = 0.5 * E / (1.0 + NU)


def turned_displacement(
    rings: tuple[np.ndarray, np.ndarray], r: np.ndarray, z: np.ndarray
) -> np.ndarray:
    """u_θ of z < 0 under rings of shear round the axis: that of the load and its image."""
    ring, load = rings
    theta = np.pi * (np.arange(ANGLES) + 0.5) / ANGLES
    x, y = r[:, None, None] - ring[:, None] * np.cos(theta), ring[:, None] * np.sin(theta)
    distance = np.sqrt(x * x + y * y + z[:, None, None] ** 2)
    return np.einsum("nqk,k,q->n", 1.0 / distance, np.cos(theta), load) / (SHEAR * ANGLES)


def disc_shear(r: np.ndarray) -> np.ndarray:
    """Of a disc that is turned by `TURN` (Reissner and Sagoci 1944)."""
    return TURN * 4.0 * SHEAR / np.pi * r / np.sqrt(1.0 - r**2)


def turned_disc() -> Problem:
    """The cylinder of `indented`, of which a disc on the top is turned; nothing else holds it."""
    far = (0.0, 0.0, lambda x, y: turned_displacement(_rings(disc_shear), x, y))
    return problem(
        symmetry="axial",
        material=elastic(E, NU),
        geometry=cylinder("free"),
        boundary=[
            moved("right", far),
            moved("bottom", far),
            drawn("free", (0.0, 0.0)),
            moved("top", ("free", "free", f"{TURN}*x")),
        ],
    )


def disc_error(solution: Solution) -> float:
    """Of the torque 16/3 G φ, relative."""
    mesh, top = solution.mesh, solution.mesh.nodes_of("top")
    torque = mesh.motions.moment(mesh.x[top], mesh.weight[top, None] * solution.traction[top])
    return float(abs(torque / (16.0 / 3.0 * SHEAR * TURN) - 1.0))


@dataclass(frozen=True)
class Lubkin:
    """Two equal balls whose radius of contact is 1, turned against each other until they stick up
    to a radius c (Lubkin 1951).

    The shear is a sum of rigid discs of radii s that turn by B'(s) ds: none where the balls stick,
    and those that make µ p where they slip, B' = -µ p_0/(2G) d(K - E)/ds with k² = 1 - s² by Abel's
    equation.
    """

    c: float
    scale: float = 1e-2

    @functools.cached_property
    def discs(self) -> tuple[np.ndarray, np.ndarray]:
        """Radii s and B' ds of one ball."""
        t, w = np.polynomial.legendre.leggauss(16)
        s = self.c + 0.5 * (1.0 - self.c) * (1.0 + t)
        p = self.scale * 2.0 / np.pi * MODULUS
        # d(K - E)/dk = k E/(1 - k²), dk/ds = -s/k
        slope = FRICTION * p / (2.0 * SHEAR) * ellipe(1.0 - s**2) / s
        return s, 0.5 * (1.0 - self.c) * w * slope

    @property
    def torque(self) -> float:
        s, turns = self.discs
        return float(16.0 / 3.0 * SHEAR * turns @ s**3)

    def shear(self, r: np.ndarray) -> np.ndarray:
        s, turns = self.discs
        slips = FRICTION * self.scale * INDENTED["ball"].pressure(np.minimum(r, 1.0))
        inside = np.minimum(r, self.c)[:, None]
        sticks = 4.0 * SHEAR / np.pi * (inside / np.sqrt(s**2 - inside**2)) @ turns
        return np.where(r < self.c, sticks, slips)

    @functools.cached_property
    def rings(self) -> tuple[np.ndarray, np.ndarray]:
        """Radii and shear times r dr, crowded to c and to the edge."""
        t, w = np.polynomial.legendre.leggauss(POINTS)
        t, w = 0.5 * (1.0 + t), 0.5 * w
        inner, outer = self.c * (1.0 - (1.0 - t) ** 3), t * t * (3.0 - 2.0 * t)
        r = np.concatenate([inner, self.c + (1.0 - self.c) * outer])
        by_t = [self.c * 3.0 * (1.0 - t) ** 2 * w, (1.0 - self.c) * 6.0 * t * (1.0 - t) * w]
        return r, self.shear(r) * r * np.concatenate(by_t)

    def problem(self) -> Problem:
        """Two cylinders cut out of half spaces, with the gap of both balls, pressed and turned."""
        ball, turn = INDENTED["ball"], float(self.discs[1].sum())

        def given(side: float, turned: float) -> tuple[Callable, ...]:
            """On the faces of the upper ball, `side` = 1, or of the lower one."""

            def component(k: int) -> Callable:
                sign, far = (-side, -(1.0 + side) * ball.depth) if k else (1.0, 0.0)
                return lambda x, y: (
                    self.scale * (sign * displacement(ball.pressure, x, -np.abs(y))[k] + far)
                )

            def around(x: np.ndarray, y: np.ndarray) -> np.ndarray:
                own = turned_displacement(self.rings, x, -np.abs(y))
                return turned * (2.0 * turn * x - own if side > 0.0 else own)

            return component(0), component(1), around

        bodies, changes = [], []
        for name, side in (("lower", -1.0), ("upper", 1.0)):
            low, high = sorted((0.0, side * SIZE))
            faces = ("right", "top" if side > 0.0 else "bottom")
            held = [moved(part, given(side, 0.0)) for part in faces]
            shape = rectangle([0.0, low], [SIZE, high])
            bodies.append(solid(name, shape, *held, material=elastic(E, NU)))
            changes += [{"body": name, "part": part, "value": given(side, 1.0)} for part in faces]
        law = {"gap": f"{self.scale}*x**2", "friction_coefficient": FRICTION}
        return problem(
            title="Lubkin: two balls pressed, then turned against each other",
            symmetry="axial",
            body=bodies,
            contact=[touching("pair", "upper.bottom", "lower.top", **law)],
            step=[{"name": "press"}, {"name": "turn", "boundary": changes}],
        )

    def errors(self, solution: Solution) -> tuple[float, float, float]:
        """Of the torque, of the shear in L2 of the nodes, both relative, and of the radius c."""
        pair = solution.pairs["pair"]
        exact = self.shear(pair.x[:, 0])
        around = np.abs(pair.sigma_t[:, 1])
        square = pair.weight @ (around - exact) ** 2 / (pair.weight @ exact**2)
        sticks = np.sqrt(pair.weight[pair.state == 0].sum() / np.pi)
        return (
            abs(abs(pair.moment) / self.torque - 1.0),
            float(np.sqrt(square)),
            float(abs(sticks - self.c)),
        )
