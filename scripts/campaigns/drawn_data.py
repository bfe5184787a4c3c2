"""Blocks in space with gaps and loads that vary as no panels do, drawn from a seed, and their
pressure by sums of cosines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from cosine_blocks import Block

from petcontact import Box, Displacement, Material, Obstacle, Pair, Problem, Symmetry, Traction
from petcontact.given.sites import Sites
from petcontact.given.values import as_given

SIDE, FINER = 2.0, 4
"""Of the face, and how many points along each side of a cell its mean is of."""
SMOOTH = tuple(Symmetry(part) for part in ("left", "right", "front", "back"))
KINDS = (
    "waves",
    "waves both ways",
    "bumps",
    "two bumps in a panel",
    "disc",
    "strip",
    "least of paraboloids",
    "greatest of cones",
    "load on a disc",
    "load on a strip",
    "narrow load",
    "narrow displacement",
)


@dataclass(frozen=True)
class Drawn:
    """A block under a rigid punch (its back held), or on a floor (its back loaded or moved).

    Attributes
    ----------
    kind, gap, back : str
        Expressions in x and y, "0" where there is nothing.
    height, depth, force : float
        How far the punch moves; or its force, 0 where it is moved.
    jumps : bool
        Whether the gap does: p is infinite there, and has no norm in L2.
    """

    kind: str
    gap: str
    back: str
    height: float
    depth: float
    force: float
    jumps: bool

    @property
    def on_floor(self) -> bool:
        return self.back != "0"

    def problem(self, **changes) -> Problem:
        """To be solved; `changes` are options of meshes and the like."""
        low, high = (0.0, self.height) if self.on_floor else (-self.height, 0.0)
        moved = (0.0, 0.0, -self.depth)
        if self.on_floor:
            given = (0.0, 0.0, f"-({self.back})")
            back = (Displacement if "displacement" in self.kind else Traction)("top", given)
            obstacle, face = Obstacle("floor"), "bottom"
        else:
            back, face = Displacement("bottom", (0.0, 0.0, 0.0)), "top"
            motion = (
                {"displacement": (0.0, 0.0, "free"), "force": (0.0, 0.0, -self.force)}
                if self.force
                else {"displacement": moved}
            )
            obstacle = Obstacle("punch", **motion)
        return Problem(
            title=self.kind,
            material=Material(1.0, 0.3),
            geometry=Box((0.0, 0.0, low), (SIDE, SIDE, high)),
            boundary=[*SMOOTH, back],
            obstacle=[obstacle],
            contact=[Pair("c", face, obstacle.name, gap=self.gap)],
            **changes,
        )

    def pressure(self, count: int) -> tuple[Block, np.ndarray]:
        """p at so many cells along each side."""
        held = not self.on_floor or "displacement" in self.kind
        block = Block(SIDE, self.height, count, held)
        line = SIDE / (FINER * count) * (np.arange(FINER * count) + 0.5)
        x, y = (each.ravel() for each in np.meshgrid(line, line, indexing="ij"))
        gap, back = (
            as_given(text, "drawn")
            .at(Sites(np.column_stack([x, y])))
            .reshape(count, FINER, count, FINER)
            .mean(axis=(1, 3))
            for text in (self.gap, self.back)
        )
        gap = gap - self.depth - block.from_back(back)
        loaded = self.on_floor and not held
        force = float(back.sum()) * block.size**2 if loaded else self.force or None
        return block, block.pressure(gap, force)


def distance_squared(x: float, y: float) -> str:
    """Of a point of the face from a place, as an expression."""
    return f"((x - {x:.4f})**2 + (y - {y:.4f})**2)"


def drawn(seed: int, number: int) -> Drawn:
    """Problem `number` of a seed, of each kind in turn."""
    kind = KINDS[number % len(KINDS)]
    random = np.random.default_rng([seed, number])
    height, depth = (float(random.uniform(*bounds)) for bounds in ((1.0, 2.0), (0.005, 0.02)))
    x, y = (float(value) for value in random.uniform(0.3, 1.7, 2))
    wide = float(10.0 ** random.uniform(-1.2, -0.5))
    share = float(random.uniform(0.2, 0.9))
    turned = random.random() < 0.5
    n, m = (int(value) for value in random.integers(1, 9, 2))
    along, place = ("y", y) if turned else ("x", x)
    gap, back = "0", "0"
    square = distance_squared(x, y)
    if kind == "waves":
        # closed all over at a mean pressure of E* k a/2 of a half space
        high = depth * share / (0.5 * np.pi * n)
        gap = f"{high:.6f}*(1 - cos({n}*pi*{along}))"
    elif kind == "waves both ways":
        high = depth * share / (0.5 * np.pi * np.hypot(n, m))
        gap = f"{high:.6f}*(1 - cos({n}*pi*x)*cos({m}*pi*y))"
    elif kind == "bumps":
        more = random.uniform(0.2, 1.8, 2)
        gap = f"{depth:.6f} - {depth * (1.0 + share):.6f}*exp(-{square}/{wide**2:.6f})"
        gap += f" - {0.8 * depth:.6f}*exp(-{distance_squared(*more)}/0.02)"
    elif kind == "two bumps in a panel":
        gap = f"{depth:.6f} - {1.5 * depth:.6f}*max(exp(-{square}/0.004), "
        gap += f"exp(-{distance_squared(x + 0.17, y - 0.11)}/0.003))"
    elif kind == "disc":
        gap = f"where({square} < {wide**2:.6f}, 0, {2.0 * depth:.6f})"
    elif kind == "strip":
        gap = f"where(abs({along} - {place:.4f}) < {wide:.4f}, 0, {depth * (1.0 + share):.6f})"
    elif kind == "least of paraboloids":
        more = random.uniform(0.2, 1.8, 2)
        gap = f"min({square}/{2.0 * share:.4f}, {0.4 * depth:.6f} + "
        gap += f"{distance_squared(*more)}/{4.0 * wide:.4f})"
    elif kind == "greatest of cones":
        gap = f"{0.05 * share:.4f}*max(sqrt({square}) - {wide:.4f}, 0)"
    elif kind == "load on a disc":
        back = f"where({square} < {wide**2:.6f}, {depth:.6f}, 0)"
    elif kind == "load on a strip":
        back = f"{depth:.6f}*where(abs({along} - {place:.4f}) < {wide:.4f}, 1, 0)"
    elif kind == "narrow load":
        back = f"{depth:.6f}*exp(-{square}/{wide**2:.6f})"
    else:
        back = f"{0.1 * depth:.6f} + {depth:.6f}*exp(-{square}/{wide**2:.6f})"
    moved = 0.0 if back != "0" else depth
    force = 0.0
    if moved and random.random() < 0.3:
        moved, force = 0.0, depth * share
    return Drawn(kind, gap, back, height, moved, force, kind in ("disc", "strip"))


def compared(one: Drawn, solution, count: int) -> tuple[float, float, float, float]:
    """True errors of p in L2 and of the force, and what the truth on half as many cells is off
    by."""
    block, exact = one.pressure(count)
    coarse, half = one.pressure(count // 2)[1], count // 2
    force, found = block.size**2 * exact.sum(), abs(solution.pairs["c"].force[2])
    left = _pressure_at(solution, block.x.ravel(), block.y.ravel()) - exact.ravel()
    rough = exact.reshape(half, 2, half, 2).mean(axis=(1, 3)) - coarse
    p, own = (float(np.sqrt((each**2).mean() / (exact**2).mean())) for each in (left, rough))
    return p, abs(found / force - 1.0), own, abs(coarse.mean() / exact.mean() - 1.0)


def _pressure_at(solution, x, y):
    """p of a solution at points of its flat face."""
    pair, nodes, (body, part) = solution.pairs["c"], solution.nodes["c"], solution.sides["c"]
    mesh = solution.meshes[body]
    numbers, faces = mesh.faces(part)
    normal = np.broadcast_to(mesh.normal[nodes[0]], (len(x), 3))
    points = np.column_stack([x, y, np.full(len(x), mesh.x[nodes[0], 2])])
    there, back = faces.cast(points, normal), faces.cast(points, -normal)
    hit = there.face >= 0
    face = np.where(hit, there.face, back.face)
    place = np.where(hit[:, None], there.place, back.place)
    assert np.all(face >= 0)
    return mesh.basis_at(numbers[face], place)[:, nodes] @ pair.pressure
