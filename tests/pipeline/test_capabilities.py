"""What can be done with a problem can be done with every kind of problem; what is yet to come is
refused in one line."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from shapes import elastic, touching

from petcontact import InputError, Solution, read_result, solve
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.contact.rho_rules import SelfAdaptive
from petcontact.model.case import parse_problem
from petcontact.pipeline.pose.discretise import discretise

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

SOFT = elastic(100.0, 0.3)
HARD = elastic(200.0, 0.25)


@dataclass(frozen=True)
class Kind:
    """How a problem that is drawn in x and z is posed: as a box of depth 1, or as a ring
    whose x is the height and whose z is the distance from the middle radius. Of one that turns what
    acts along x acts round the axis.

    Attributes
    ----------
    dim : int
    sides : tuple of str
        Below, beside at both ends, above.
    areas : (float, float)
        Of the side that is pushed, and above; moments of areas where they turn.
    more : dict
        Keys at the top of the problem.
    """

    dim: int
    sides: tuple[str, ...]
    areas: tuple[float, float]
    more: dict
    turns: bool = False

    def vector(self, x, z):
        if self.turns:
            return [z, 0.0, x]
        return [z, x] if self.more else [x, 0.0, z]

    def point(self, x, z, y):
        return [z + 3.0, x] if self.more else [x, y, z]

    @property
    def along(self):
        """The component of x."""
        return self.vector(1, 0).index(1)

    @property
    def components(self):
        """Of displacements."""
        return 3 if self.turns else self.dim

    def body(self, lower, upper, size, material, *conditions):
        names = ("lower_left", "upper_right") if self.dim == 2 else ("lower", "upper")
        shape = "rectangle" if self.dim == 2 else "box"
        corners = self.point(*lower, 0.0), self.point(*upper, 1.0)
        return {
            "material": material,
            "geometry": {"shape": shape, **dict(zip(names, corners, strict=True))},
            "mesh": {"element_size": size, "order": 1},
            "boundary": list(conditions),
        }


SPACE = Kind(3, ("bottom", "left", "right", "top"), (1.0, 2.0), {})
AREAS = np.pi * (4.0**2 - 3.0**2), 2.0 * np.pi * 4.0 * 2.0
AXIAL = Kind(2, ("left", "bottom", "top", "right"), AREAS, {"symmetry": "axial"})
OF_AREAS = 2.0 * np.pi * (4.0**3 - 3.0**3) / 3.0, 2.0 * np.pi * 4.0**2 * 2.0
TORSION = Kind(2, ("left", "bottom", "top", "right"), OF_AREAS, {"symmetry": "axial"}, turns=True)


def condition(part, kind, value):
    return {"part": part, "condition": kind, "value": value}


def one_body(kind):
    """A block that is held at its top and pushed over a foundation of given friction."""
    zero, (below, start, end, above) = kind.vector(0.0, 0.0), kind.sides
    free = (end, "front", "back") if kind.dim == 3 else (end,)
    return kind.more | kind.body(
        (0.0, 0.0),
        (2.0, 1.0),
        0.5,
        SOFT,
        {"part": below, "condition": "contact", "friction_bound": 0.4},
        condition(above, "displacement", zero),
        condition(start, "traction", kind.vector(1.0, 0.0)),
        *(condition(part, "traction", zero) for part in free),
    )


def bodies(kind):
    """A block that is pressed on a larger one and pushed, held by Coulomb friction only, in two
    steps."""
    zero, pressed = kind.vector(0.0, 0.0), kind.vector(0.0, -1.0)
    below, _, _, above = kind.sides
    base = kind.body((-1.0, -1.0), (3.0, 0.0), 1.0, HARD, condition(below, "displacement", zero))
    block = kind.body((0.0, 0.0), (2.0, 1.0), 0.5, SOFT, condition(above, "traction", pressed))
    push = {"body": "block", "part": above, "value": kind.vector(0.1, -1.0)}
    return kind.more | {
        "body": [{"name": "base", **base}, {"name": "block", **block}],
        "contact": [touching("pair", f"block.{below}", f"base.{above}", friction_coefficient=0.4)],
        "step": [{"name": "press"}, {"name": "push", "boundary": [push]}],
    }


KINDS = {
    "axial, bodies and steps": (bodies, AXIAL),
    "torsion, one body": (one_body, TORSION),
    "space, bodies and steps": (bodies, SPACE),
}
"""Bodies of the plane and one body in space are what most other tests solve."""
STEPPED = [kind for kind in KINDS if "steps" in kind]


class Case:
    """A problem of some kind, and its solution.

    Attributes
    ----------
    name : str
    kind : Kind
    single : bool
        Whether it is of one body, without steps.
    """

    def __init__(self, name):
        self.name, (self._make, self.kind) = name, KINDS[name]
        self.single = self._make is one_body
        self.friction = (
            "boundary.0.friction_bound" if self.single else "contact.0.friction_coefficient"
        )

    def problem(self, **changes):
        """With changes, __ for a dot."""
        changes = {key.replace("__", "."): value for key, value in changes.items()}
        return parse_problem(self._make(self.kind), "test", changes, Path())

    @functools.cached_property
    def solution(self):
        return solve(self.problem())


def assert_alike(solution: Solution, other: Solution, tolerance: float):
    assert solution.converged and other.converged, (solution.reason, other.reason)
    for name, pair in solution.pairs.items():
        size = max(np.abs(pair.pressure).max(), np.abs(pair.sigma_t).max())
        for key in ("pressure", "sigma_t"):
            assert (
                np.abs(getattr(other.pairs[name], key) - getattr(pair, key)).max()
                < tolerance * size
            ), key


@pytest.fixture(scope="module")
def case(request):
    return Case(request.param)


def compressed_operators(case, tmp_path):
    kind, tolerance = ("hodlr", 1e-9) if case.kind.dim == 2 else ("hmatrix", 1e-7)
    solution = solve(case.problem(**{"bem.mat_type": kind, f"bem.{kind}_tol": tolerance}))
    assert kind in solution.provenance.solver
    assert_alike(case.solution, solution, 1e-6)


def monitor_ends_the_solve(case, tmp_path):
    assert solve(case.problem(), monitor=lambda state: "enough").reason.startswith("enough")


def rule_of_ones_own(case, tmp_path):
    class Counted(SelfAdaptive):
        calls = 0

        def update(self, rho, balance):
            Counted.calls += 1
            return super().update(rho, balance)

    solution = solve(
        case.problem(method__tolerance=1e-8, method__max_iterations=5000), rule=Counted(2.0)
    )
    assert Counted.calls > 0 and solution.provenance.rule == "Counted"
    assert_alike(case.solution, solution, 1e-3)


def law_of_ones_own(case, tmp_path):
    changed = case.problem(**{case.friction: 0.5})
    assert_alike(solve(changed), solve(case.problem(), law=discretise(changed).law), 1e-12)


def method_of_ones_own(case, tmp_path):
    seen = []

    def method(system, law, iteration):
        seen.append(system.u_0.shape)
        return SemismoothNewton()(system, law, iteration)

    assert_alike(case.solution, solve(case.problem(), method=method), 1e-12)
    nodes = sum(len(pair.x) for pair in case.solution.pairs.values())
    assert set(seen) == {(nodes, case.kind.components - case.single)}


def held_by_friction_only(case, tmp_path):
    loose = condition(case.kind.sides[-1], "traction", case.kind.vector(0.0, 0.0))
    problem = case.problem(
        **{"boundary.1": loose, "boundary.2.value": case.kind.vector(0.5, 0.0)}
        if case.single
        else {}
    )
    solution = solve(problem)
    assert solution.converged and sum(solution.provenance.motions.values()) > 0
    along = [
        pair.moment if case.kind.turns else pair.force[case.kind.along]
        for pair in solution.pairs.values()
    ]
    start, above = case.kind.areas
    assert along == pytest.approx([-0.5 * start if case.single else -0.1 * above], rel=1e-9)


def frictionless_start(case, tmp_path):
    seen = []

    def method(system, law, iteration):
        seen.append((iteration.start, system.u_0))
        return SemismoothNewton()(system, law, iteration)

    assert_alike(
        case.solution, solve(case.problem(method__start="frictionless"), method=method), 1e-6
    )
    (v, sigma), u_0 = seen[0]
    assert np.array_equal(v, u_0) and not sigma.any()


def full_formulation(case, tmp_path):
    solution = solve(
        case.problem(method__formulation="full", method__rule="modified", method__tolerance=1e-9)
    )
    assert "full" in solution.provenance.solver
    assert_alike(case.solution, solution, 1e-6)


def restart(case, tmp_path):
    case.solution.save(tmp_path / "r.h5")
    again = solve(case.problem(method__start=f"{tmp_path / 'r.h5'}{'' if case.single else ':1'}"))
    assert len(again.steps) == len(case.solution.steps)
    assert_alike(case.solution, again, 1e-7)
    assert not case.single or again.iterations < max(case.solution.iterations, 2)


def wear(case, tmp_path):
    """Over cycles where there are steps; what it opens is a gap."""
    if case.single:
        problem = case.problem(**{"boundary.0.wear_coefficient": 1e-2})
    else:
        pull = {
            "name": "pull",
            "boundary": [
                {
                    "body": "block",
                    "part": case.kind.sides[-1],
                    "value": case.kind.vector(-0.1, -1.0),
                }
            ],
        }
        steps = [*bodies(case.kind)["step"], pull]
        problem = case.problem(
            step=steps,
            cycle={"first": "push", "last": "pull", "count": 8},
            contact__0__wear_coefficient=1e-2,
        )
    solution = solve(problem)
    assert solution.converged and solution.wear.cycle[-1] == 8
    depth, weight = solution.wear.depth["pair"], solution.pairs["pair"].weight
    assert np.all(np.diff(depth @ weight) > 0.0)
    assert np.array_equal(depth[-1], solution.pairs["pair"].wear.sum(axis=1))
    solution.save(tmp_path / "r.h5")
    assert read_result(tmp_path / "r.h5").verdict() == solution.verdict()


CAPABILITIES = (
    compressed_operators,
    monitor_ends_the_solve,
    rule_of_ones_own,
    law_of_ones_own,
    method_of_ones_own,
    held_by_friction_only,
    frictionless_start,
    full_formulation,
    restart,
    wear,
)
YET_TO_COME = {
    **{
        (wear, kind): "wear opens a gap, and bilateral parts have none"
        for kind in KINDS
        if "one body" in kind
    },
    **{
        (
            compressed_operators,
            kind,
        ): 'compresses boundaries of plane bodies; choose "auto" or "dense"'
        for kind in KINDS
        if "axial" in kind or "torsion" in kind
    },
    **{
        (full_formulation, kind): '"full" is the paper\'s, for one body that is held'
        for kind in STEPPED
    },
}
"""What is refused, with what it is refused by: the paper's formulation is for its own problem;
contact that cannot open does not wear."""


SLOW = {(capability, kind) for capability in (wear, rule_of_ones_own) for kind in STEPPED}
SLOW |= {
    (capability, "space, bodies and steps")
    for capability in CAPABILITIES
    if capability not in (held_by_friction_only, monitor_ends_the_solve)
}
"""In space nearly all are; what they have in common is left."""


@pytest.mark.parametrize(
    ("case", "capability"),
    [
        pytest.param(
            kind,
            capability,
            id=f"{kind}-{capability.__name__}",
            marks=[pytest.mark.slow] * ((capability, kind) in SLOW),
        )
        for kind in KINDS
        for capability in CAPABILITIES
    ],
    indirect=["case"],
)
def test_every_kind_of_problem(case, capability, tmp_path):
    refusal = YET_TO_COME.get((capability, case.name))
    if refusal is None:
        capability(case, tmp_path)
        return
    with pytest.raises(InputError, match=refusal) as caught:
        capability(case, tmp_path)
    assert "\n" not in str(caught.value)
