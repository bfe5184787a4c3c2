"""Every rule and every method over load steps, whichever way a step is divided: the numbers are those
of Newton's method, and no run leaves anything to the next one."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from petcontact import Method, Problem, solve
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.contact.rho_rules import SelfAdaptive
from petcontact.given.tables.base import parse
from petcontact.pipeline.steps import path

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

MATERIAL = {"young_modulus": 10_000.0, "poisson_ratio": 0.3}
TRESCA = {"friction_bound": 150.0}
COULOMB = {"normal": "unilateral", "friction_coefficient": 0.3}
FLAT = {"shape": "rectangle", "lower_left": [0.0, 0.0], "upper_right": [8.0, 4.0]}
RING = {"shape": "rectangle", "lower_left": [1.0, 0.0], "upper_right": [5.0, 3.0]}
CUBE = {"shape": "box", "lower": [0.0, 0.0, 0.0], "upper": [1.0, 1.0, 1.0]}
DOWN, ALONG = [0.0, -0.01], [0.004, -0.01]
KINDS = {
    "tresca": (TRESCA, FLAT, 0.8, "left", [400.0, 0.0], [-400.0, 0.0]),
    "coulomb": (COULOMB, FLAT, 0.8, "top", DOWN, ALONG),
    "axial": (COULOMB, RING, 0.8, "top", DOWN, [0.0, -0.005]),
    "space": (COULOMB, CUBE, 0.5, "top", [0.0, *DOWN], [0.004, 0.002, -0.01]),
}
"""Contact, shape, element size, and what a part is given in the first and in the second step."""
RULES = "fixed", "self-adaptive", "modified", "modified-safeguarded"
METHODS = [{"name": "projection", "rule": rule} for rule in RULES]
METHODS[0]["rho"] = 1e4
METHODS += [{"name": "operator-robin"}]
ONLY_TRESCA = [{"name": "tao"}, {"name": "projection", "formulation": "full"}]
NEWTON = {"name": "semismooth-newton"}
KRYLOV = {"ksp_type": "gmres", "pc_type": "jacobi"}


def posed(kind, increments, method, **petsc):
    contact, shape, size, part, *values = KINDS[kind]
    still = [0.0] * len(values[0])
    free = {"left", "right"} | ({"front", "back"} if kind == "space" else set())
    top = {"part": "top", "condition": "displacement", "value": still}
    table = {
        "material": MATERIAL,
        "geometry": shape,
        "mesh": {"element_size": size, "order": int(kind == "space")},
        "method": method,
        "petsc": petsc,
        "boundary": [{"part": "bottom", "condition": "contact", **contact}, top]
        + [{"part": p, "condition": "traction", "value": still} for p in sorted(free)],
        "step": [
            {"increments": increments, "boundary": [{"part": part, "value": value}]}
            for value in values
        ],
    }
    return parse(Problem, table | ({"symmetry": "axial"} if kind == "axial" else {}), "test")


@functools.cache
def newton(kind, increments):
    return solve(posed(kind, increments, NEWTON))


def assert_numbers_of(expected, found):
    """p, q and the slip at the ends of the steps."""
    assert found.converged, found.reason
    ends = [[s for s in each.steps if s.load_factor == 1.0] for each in (expected, found)]
    for one, other in zip(*ends, strict=True):
        (a,), (b,) = one.pairs.values(), other.pairs.values()
        stress = max(np.abs(a.pressure).max(), np.abs(a.sigma_t).max())
        for key, size in ("pressure", stress), ("sigma_t", stress), ("slip", np.abs(a.slip).max()):
            off = np.abs(getattr(a, key) - getattr(b, key)).max()
            assert off < 2e-3 * size, (key, off, size)


@pytest.mark.parametrize("kind", KINDS)
def test_rules_and_methods_give_newtons_numbers(kind):
    for method in METHODS + ONLY_TRESCA * (kind == "tresca"):
        found = solve(posed(kind, 2, method))
        assert len(found.steps) == 4
        assert_numbers_of(newton(kind, 2), found)


@pytest.mark.parametrize("kind", KINDS)
def test_increments_by_halves_many_increments_and_iterative_solves(kind):
    """What iterates differ by is not taken for an error of the path: no more increments than Newton
    has."""
    for method in METHODS[1:3]:
        auto = solve(posed(kind, "auto", method))
        assert_numbers_of(newton(kind, "auto"), auto)
        assert len(auto.steps) <= len(newton(kind, "auto").steps)
    assert_numbers_of(newton(kind, 8), solve(posed(kind, 8, METHODS[1])))
    assert_numbers_of(newton(kind, 2), solve(posed(kind, 2, METHODS[2], **KRYLOV)))


@pytest.mark.parametrize("kind", KINDS)
def test_restart(kind, tmp_path):
    """From the end of the first step, and by another rule."""
    solve(posed(kind, 2, METHODS[2])).save(tmp_path / "r.h5")
    start = {"start": f"{tmp_path / 'r.h5'}:2"}
    assert_numbers_of(newton(kind, 2), solve(posed(kind, 2, METHODS[1] | start)))


def test_a_rule_and_a_method_are_the_same_after_a_solve():
    """c_k belongs to one run (Lemma 3.1): a rule of the user's that counts counts from its own start
    in each, also in the second solve."""
    begins = []

    class Counting(SelfAdaptive):
        def update(self, rho, balance):
            begins.append(self.changes)
            return super().update(rho, balance)

    problem, rule = posed("tresca", 2, {"max_iterations": 200}), Counting()
    first, second = (solve(problem, rule=rule) for _ in range(2))
    assert rule == Counting()
    assert begins.count(0) >= 8 and max(begins) < 30
    for solution in (first, second):
        assert_numbers_of(newton("tresca", 2), solution)
    assert [s.iterations for s in first.steps] == [s.iterations for s in second.steps]
    method = SemismoothNewton()
    sizes = [solve(posed(kind, 1, {}), method=method) for kind in ("coulomb", "tresca")]
    assert all(s.converged for s in sizes) and vars(method) == vars(SemismoothNewton())


def test_a_rule_that_cannot_be_copied_is_refused():
    class Open(SelfAdaptive):
        def __deepcopy__(self, memo):
            raise TypeError("cannot pickle an open file")

    with pytest.raises(ValueError, match="Open, which cannot be copied"):
        solve(posed("tresca", 1, {}), rule=Open(), method=Method(name="projection"))


def test_a_rho_at_which_nothing_moves():
    """GMRES takes a right-hand side of 1e-300 for zero."""
    method = {"name": "projection", "rho": 1e-300}
    assert_numbers_of(newton("tresca", 2), solve(posed("tresca", 2, method, **KRYLOV)))


@pytest.mark.parametrize("rule", ["modified", "self-adaptive"])
def test_a_body_that_only_contact_holds_in_any_units(rule):
    """A pad that is pressed on a floor and pushed, with E = 1e5, 1e11 and 1e-3. From ρ_0 = 1 or 1e-300, which
    is far off, it is moved by load/ρ_0 at first."""
    for young in 1e5, 1e11, 1e-3:
        free, push = {"condition": "traction", "value": [0.0, 0.0]}, [[0.0, -1e-3], [1e-4, -1e-3]]
        pad = {
            "material": {"young_modulus": young, "poisson_ratio": 0.3},
            "geometry": FLAT | {"lower_left": [-1.0, 0.0], "upper_right": [1.0, 1.0]},
            "mesh": {"element_size": 0.25, "order": 1},
            "boundary": [{"part": part, **free} for part in ("top", "left", "right")],
            "obstacle": [{"name": "floor", "displacement": [0.0, 0.0]}],
            "contact": [{"name": "seat", "secondary": "bottom", "primary": "floor"}],
            "step": [
                {"boundary": [{"part": "top", "value": [young * x for x in each]}]} for each in push
            ],
        }
        pad["contact"][0] |= {"gap": "1e-4*x**2", "friction_coefficient": 0.15}
        pad["step"] = [step | {"increments": 2} for step in pad["step"]]
        expected = solve(parse(Problem, pad, "test"))
        for first, petsc in ({"rho": 1e-300}, {}), ({"rho": 1.0}, {}), ({}, KRYLOV):
            method = {"name": "projection", "rule": rule, **first}
            own = pad | {"method": method, "petsc": petsc}
            assert_numbers_of(expected, solve(parse(Problem, own, "test")))


def test_a_run_ends_where_the_law_holds_in_each_group():
    """Of two blocks that are pressed together shear is a small part of the tractions: a fixed ρ
    leaves it far off while all of them have converged."""
    blocks = []
    for name, young, low, held in ("lower", 1.0, -1.0, "bottom"), ("upper", 10.0, 0.0, "top"):
        blocks.append(
            {
                "name": name,
                "material": {"young_modulus": young, "poisson_ratio": 0.2},
                "geometry": FLAT | {"lower_left": [0.0, low], "upper_right": [2.0, low + 1.0]},
                "mesh": {"element_size": 0.25, "order": 1},
                "boundary": [{"part": held, "condition": "displacement", "value": [0.0, 0.0]}],
            }
        )
    blocks[0]["geometry"]["lower_left"][0], blocks[0]["geometry"]["upper_right"][0] = -0.5, 2.5
    fit = {"name": "fit", "secondary": "upper.bottom", "primary": "lower.top"}
    fit |= {"friction_coefficient": 0.6, "preload": 5e-4}
    pressed = {"body": blocks, "contact": [fit]}
    fixed = {"name": "projection", "rule": "fixed"}
    found = solve(parse(Problem, pressed | {"method": fixed}, "test"))
    assert found.converged and found.last.residuals["tangential"] < 1e-3


def rolled(method, second, **driven):
    """A roller is pressed into a block, then moved to another displacement."""
    roller = {"name": "roller", "shape": "circle", "centre": [0.0, 2.0], "radius": 2.0}
    roller |= {"displacement": [0.0, "free"], "rotation": 0.0} | driven
    table = {
        "material": {"young_modulus": 1000.0, "poisson_ratio": 0.3},
        "geometry": FLAT | {"lower_left": [-3.0, -3.0], "upper_right": [3.0, 0.0]},
        "mesh": {"element_size": 0.5, "order": 1},
        "boundary": [
            {"part": "bottom", "condition": "displacement", "value": [0.0, 0.0]},
            {"part": "left", "condition": "traction", "value": [0.0, 0.0]},
            {"part": "right", "condition": "traction", "value": [0.0, 0.0]},
        ],
        "obstacle": [roller],
        "contact": [
            {"name": "c", "secondary": "top", "primary": "roller", "friction_coefficient": 0.3}
        ],
        "step": [
            {"increments": 1},
            {"increments": 1, "obstacle": [{"name": "roller", "displacement": second}]},
        ],
    }
    return solve(parse(Problem, table | {"method": method}, "test"))


@pytest.mark.parametrize("driven", [{"displacement": [0.0, -0.02]}, {"force": [0.0, -20.0]}])
def test_a_fixed_rho_is_that_of_every_step_and_its_slow_steps_come_near(driven):
    """Newton steps to the equilibrium of a free roller gave the next step a ρ of their own; a change
    of 1e-6 at a rate near 1 was 1e-4 away from the end."""
    aside = [0.01, driven.get("displacement", ["", "free"])[1]]
    fixed = {"name": "projection", "rule": "fixed", "rho": 8000.0}
    newton, found = (rolled(method, aside, **driven) for method in (NEWTON, fixed))
    assert [step.history.rho[0] for step in found.steps] == [8000.0, 8000.0]
    for own, other in zip(newton.steps, found.steps, strict=True):
        q, p = own.pairs["c"].sigma_t, own.pairs["c"].pressure
        assert other.pairs["c"].sigma_t == pytest.approx(q, abs=1e-5 * p.max())


@pytest.mark.parametrize("method", [NEWTON, *METHODS], ids=str)
def test_a_step_that_moves_nothing_keeps_all_states_and_is_told(method):
    """Newton's method leaves round-off of it, others the tolerance of a change."""
    solution = rolled(method, [0.0, "hold"], force=[0.0, -20.0])
    first, second = (step.pairs["c"].state.tolist() for step in solution.steps)
    assert first == second and 1 in first
    assert any("it moves no body" in warning for warning in solution.warnings)


@pytest.mark.parametrize("rule", ["modified", "self-adaptive"])
def test_a_body_that_rests_on_two_nodes(rule):
    """ρ of smooth tractions is 500 times less than that of forces on two nodes. The rule went beyond it,
    and spent its changes: no convergence in 1000 iterations at any load."""
    beam = {
        "material": MATERIAL,
        "geometry": FLAT | {"upper_right": [6.0, 1.0]},
        "mesh": {"element_size": 0.2, "order": 1},
        "boundary": [
            {"part": "top", "condition": "traction", "pressure": "where(abs(x - 3) < 0.5, 40, 0)"},
            *(
                {"part": part, "condition": "traction", "value": [0.0, 0.0]}
                for part in ("left", "right")
            ),
        ],
        "obstacle": [
            {"name": name, "shape": "circle", "centre": [x, -0.5], "radius": 0.5}
            for name, x in (("a", 1.0), ("b", 5.0))
        ],
        "contact": [{"name": "seat", "secondary": "bottom", "primary": ["a", "b"]}],
    }
    beam["contact"][0]["friction_coefficient"] = 0.2
    expected = solve(parse(Problem, beam, "test"))
    method = {"name": "projection", "rule": rule}
    found = solve(parse(Problem, beam | {"method": method}, "test"))
    assert found.converged and found.iterations < 250
    for name, pair in expected.pairs.items():
        assert np.allclose(found.pairs[name].force, pair.force, rtol=0, atol=1e-5)


def test_a_uniform_preload():
    """Equal pressures move the overlap only: ρ came from the round-off of what else they move, 1e18,
    and round-off times that opened a node."""
    blocks = [
        {
            "name": name,
            "material": MATERIAL,
            "geometry": FLAT | {"lower_left": [0.0, low], "upper_right": [2.0, low + 1.0]},
            "mesh": {"element_size": 0.25, "order": 2},
            "boundary": [
                {"part": held, "condition": "displacement", "value": ["free", 0.0]},
                {"part": "left", "condition": "symmetry"},
            ],
        }
        for name, low, held in (("low", 0.0, "bottom"), ("up", 1.0, "top"))
    ]
    seat = {"name": "seat", "secondary": "up.bottom", "primary": "low.top", "preload": 4.0}
    projection = {"name": "projection", "rule": "modified"}
    posed = {"body": blocks, "contact": [seat | {"friction_coefficient": 0.3}]}
    pair = solve(parse(Problem, posed | {"method": projection}, "test")).pairs["seat"]
    assert np.allclose(pair.pressure, 2.0) and not pair.state.any()


def test_operator_robin_lands_a_disc_whose_nodes_are_above_the_floor():
    """A small load closes the two nodes beside the lowest point. Each iteration lowered the disc as if all
    nodes stuck: by 1e-4 of the gap."""
    disc = parse(
        Problem,
        {
            "material": {"young_modulus": 1.0, "poisson_ratio": 0.3},
            "geometry": {
                "shape": "outline",
                "loops": [{"part": "rim", "center": [0.0, 1.0], "radius": 1.0}],
            },
            "mesh": {"element_size": 0.1, "order": 1},
            "point_force": [{"at": [0.0, 1.0], "force": [0.0, -1e-6]}],
            "obstacle": [{"name": "floor", "shape": "plane", "normal": [0.0, 1.0]}],
            "contact": [
                {
                    "name": "line",
                    "secondary": "rim",
                    "primary": "floor",
                    "direction": [0.0, -1.0],
                    "friction_coefficient": 0.2,
                }
            ],
        },
        "test",
    )
    solution = solve(disc, method="operator-robin")
    assert solution.converged, solution.reason
    assert np.abs(solution.pairs["line"].force - [0.0, 1e-6]).max() < 1e-12


def test_a_block_that_nothing_touches_yet_stays_where_it_is():
    """Nothing took back a motion along the floor that the first steps of the projection had left."""
    block = parse(
        Problem,
        {
            "material": MATERIAL,
            "geometry": FLAT,
            "mesh": {"element_size": 0.8},
            "method": METHODS[2],
            "boundary": [
                {"part": "bottom", "condition": "contact", "gap": 0.02, **COULOMB},
                {"part": "top", "condition": "displacement", "value": ["free", -0.01]},
                *(
                    {"part": p, "condition": "traction", "value": [0.0, 0.0]}
                    for p in ("left", "right")
                ),
            ],
        },
        "test",
    )
    solution = solve(block)
    assert solution.converged, solution.reason
    assert np.abs(solution.u[:, 0]).max() < 1e-9


def test_a_method_follows_the_increments_that_newton_needed(monkeypatch):
    """The adaptive solve compares both methods. On equal increments another method was further away from
    Newton's, which grow with the contact, than the accuracy allows."""
    monkeypatch.setattr(path, "UNNAMED", 16)
    table = {
        "material": {"young_modulus": 2.0763, "poisson_ratio": 0.2292},
        "geometry": {**FLAT, "upper_right": [2.4491, 1.272]},
        "boundary": [
            {"part": "bottom", "condition": "contact", "gap": "0.0037*x**2"}
            | {"normal": "unilateral", "friction_coefficient": 0.7918, "friction_bound": 0.0099},
            {"part": "top", "condition": "displacement", "value": ["free", -0.0137]},
            *({"part": p, "condition": "traction", "value": [0.0, 0.0]} for p in ("left", "right")),
        ],
        "step": [
            {},
            {"increments": 2, "boundary": [{"part": "top", "value": [0.0068, "hold"]}]},
        ],
    }
    solution = solve(parse(Problem, table, "test"), method="operator-robin")
    assert solution.converged, solution.reason
    assert solution.accuracy.error < 0.5e-2


@pytest.mark.parametrize("rule", ["modified", "self-adaptive"])
def test_projection_rolls_a_disc_as_fast_as_a_held_one(rule):
    """Four of 252 nodes touch. A step moved the disc as if all did: no end in 1000 iterations."""
    disc = {
        "name": "disc",
        "material": MATERIAL,
        "geometry": {
            "shape": "outline",
            "loops": [{"part": "rim", "center": [0.0, 2.0], "radius": 2.0}],
        },
        "mesh": {"element_size": 0.1},
        "point_force": [{"at": [0.0, 2.0], "force": [0.3, -20.0]}],
    }
    block = {
        "name": "block",
        "material": MATERIAL,
        "geometry": FLAT | {"lower_left": [-4.0, -4.0], "upper_right": [4.0, 0.0]},
        "mesh": {"element_size": 0.1},
        "boundary": [{"part": "bottom", "condition": "displacement", "value": [0.0, 0.0]}],
    }
    pair = {"name": "line", "secondary": "disc.rim", "primary": "block.top"}
    table = {
        "body": [disc, block],
        "contact": [pair | {"friction_coefficient": 0.3}],
        "step": [{"increments": 1}],
    }
    rolls, exact = (solve(parse(Problem, table, "test"), **way) for way in ({"rule": rule}, {}))
    assert_numbers_of(exact, rolls)
    assert rolls.iterations < 60


@pytest.mark.parametrize("way", ["free", -0.01])
def test_operator_robin_slips_along_two_tangents(way):
    """T's problem was solved one component after another, though slip couples two on disks: the
    iteration diverged."""
    plate = {
        "symmetry": "axial",
        "material": {"young_modulus": 1.0, "poisson_ratio": 0.3},
        "geometry": {"shape": "rectangle", "lower_left": [0.0, -2.0], "upper_right": [3.0, 0.0]},
        "mesh": {"element_size": 0.1},
        "boundary": [
            {"part": "bottom", "condition": "displacement", "value": [0.0, 0.0, 0.0]},
            {"part": "right", "condition": "traction", "value": [0.0, 0.0, 0.0]},
        ],
        "obstacle": [
            {"name": "ball", "displacement": [0.0, way], "force": [0.0, -2e-3 * (way == "free")]}
            | {"rotation": 0.0268}
            | {"shape": "sphere", "centre": [0.0, 2.0], "radius": 2.0}
        ],
        "contact": [
            {"name": "line", "secondary": "top", "primary": "ball", "direction": [0.0, 1.0]}
            | {"friction_coefficient": 0.05}
        ],
    }
    newton, other = (
        solve(parse(Problem, plate, "test"), method=name)
        for name in ("semismooth-newton", "operator-robin")
    )
    assert_numbers_of(newton, other)
