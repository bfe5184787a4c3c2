"""Interference, clearance, preload and friction of contacts, reached in steps: two stacked columns
without lateral contraction, whose forces are known."""

from __future__ import annotations

import json

import numpy as np
import pytest
from problems import block, posed

from petcontact import read_result, solve
from petcontact.errors import InputError

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

E, LENGTH, OVERLAP, FORCE = 1000.0, 2.0, 0.01, 3.0
MESH = "element_size = 1.0, order = 1"
KINDS = {"plane": 2, "axial": 2, "space": 3}
AREAS = {"plane": 1.0, "axial": np.pi, "space": 1.0}
STIFFNESS = E / (2.0 * LENGTH)
"""Stress over overlap, of two columns that are held at their far ends."""


def columns(kind: str, contact: str, mesh: str = MESH, material: str = "") -> str:
    """Two columns of half width 1 or side 1, held at the top and at the bottom."""
    d = KINDS[kind]
    text = 'symmetry = "axial"\n' if kind == "axial" else ""
    for name, base in (("lower", 0.0), ("upper", LENGTH)):
        low, high = [0.0] * (d - 1) + [base], [1.0] * (d - 1) + [base + LENGTH]
        text += block(
            name, low, high, E, 0.0, mesh, **{("bottom" if base == 0.0 else "top"): [0.0] * d}
        )
    text = text.replace("poisson_ratio = 0.0 }", f"poisson_ratio = 0.0{material} }}")
    pair = '[[contact]]\nname = "pair"\nsecondary = "upper.bottom"\nprimary = "lower.top"\n'
    return text + pair + contact + "\n"


def change(**keys: object) -> str:
    """A step that changes the contact."""
    given = "".join(f"{key} = {json.dumps(value)}\n" for key, value in keys.items())
    return f'[[step]]\n[[step.contact]]\nname = "pair"\n{given}'


def pressures(solution, name="pair"):
    assert solution.converged, solution.reason
    return [step.pairs[name].pressure for step in solution.steps]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("normal", ["unilateral", "bilateral", "bonded"])
def test_an_overlap_is_taken_up(kind, normal):
    given = f'normal = "{normal}"\ninterference = {OVERLAP}\nclearance = {0.4 * OVERLAP}'
    steps = "[[step]]\nincrements = 2\n" + change(interference=f"{2.0 * OVERLAP} + 0*x")
    solution = solve(posed(columns(kind, given) + steps))
    found = np.array([p.mean() for p in pressures(solution)])
    overlap = OVERLAP * np.array([0.1, 0.6, 1.6])
    assert np.allclose(found, STIFFNESS * overlap, rtol=1e-7)
    assert np.allclose([step.pairs["pair"].overlap for step in solution.steps], overlap)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("normal", ["unilateral", "bonded"])
def test_a_preload_is_reached_and_locked(kind, normal, tmp_path):
    """Of a bonded pair it is tension; what is locked carries more when the far end moves."""
    way = -1.0 if normal == "bonded" else 1.0
    d, area = KINDS[kind], AREAS[kind]
    given = f'normal = "{normal}"\npreload = {FORCE * area}\nclearance = {OVERLAP}'
    moved = [0.0] * (d - 1) + [-OVERLAP]
    steps = "[[step]]\nincrements = 2\n" + change(preload="locked")
    steps += f'[[step.boundary]]\nbody = "upper"\npart = "top"\nvalue = {json.dumps(moved)}\n'
    steps += change(preload=2.0 * FORCE * area)
    solution = solve(posed(columns(kind, given) + steps))
    found = np.array([p.mean() for p in pressures(solution)])
    added = STIFFNESS * OVERLAP
    wanted = np.array([0.5 * way * FORCE, way * FORCE, way * FORCE + added, 2.0 * way * FORCE])
    assert np.allclose(found, wanted, rtol=1e-7)
    approach = np.array([0.0, 0.0, OVERLAP, OVERLAP])
    overlaps = [step.pairs["pair"].overlap for step in solution.steps]
    assert np.allclose(overlaps, wanted / STIFFNESS - approach)
    solution.save(tmp_path / "r.h5")
    assert [s.pairs["pair"].overlap for s in read_result(tmp_path / "r.h5").steps] == overlaps
    method = solution.problem.method.model_copy(update={"start": f"{tmp_path / 'r.h5'}:2"})
    again = solve(solution.problem.model_copy(update={"method": method}))
    assert np.allclose([p.mean() for p in pressures(again)], wanted, rtol=1e-7)


@pytest.mark.parametrize(
    ("kind", "first"), [("plane", ""), ("space", ""), ("plane", "friction_coefficient = 0.0\n")]
)
def test_friction_changes_linearly_in_a_step(kind, first):
    """A column that is pressed and pushed sideways slides with what friction leaves."""
    d = KINDS[kind]
    given = f"interference = {OVERLAP}\n{first}"
    pushed = [0.5] + [0.0] * (d - 1)
    steps = "[[step]]\n" + change(friction_coefficient=0.2)
    steps += f'[[step.boundary]]\nbody = "upper"\npart = "top"\nvalue = {json.dumps(pushed)}\n'
    steps += '[[step]]\nincrements = 2\n[[step.contact]]\nname = "pair"\n'
    steps += "friction_coefficient = 0.1\n"
    solution = solve(posed(columns(kind, given) + steps))
    shares = [
        np.abs(step.pairs["pair"].sigma_t).max(axis=1) / step.pairs["pair"].pressure
        for step in solution.steps
    ]
    assert solution.converged and shares[0].max() == 0.0
    assert "without friction" not in solution.verdict()
    for share, mu in zip(shares[1:], (0.2, 0.15, 0.1), strict=True):
        assert np.allclose(share, mu, rtol=1e-6)


def test_a_bound_of_a_bilateral_contact_changes():
    """The contact of the paper, with steps: u_n stays known data."""
    text = """
material = { young_modulus = 1000.0, poisson_ratio = 0.0 }
geometry = { shape = "rectangle", lower_left = [0, 0], upper_right = [2, 1] }
mesh = { element_size = 0.5, order = 1 }
[[boundary]]
part = "bottom"
condition = "contact"
normal = "bilateral"
friction_bound = 1.0
interference = 0.01
[[boundary]]
part = "top"
condition = "displacement"
value = [0.5, 0.0]
[[boundary]]
part = "left"
condition = "traction"
value = [0, 0]
[[boundary]]
part = "right"
condition = "traction"
value = [0, 0]
[[step]]
[[step]]
contact = [{ name = "bottom", friction_bound = 0.5 }]
"""
    solution = solve(posed(text))
    assert solution.converged
    for step, bound in zip(solution.steps, (1.0, 0.5), strict=True):
        pair = step.pairs["bottom"]
        assert np.allclose(np.abs(pair.sigma_t), bound) and pair.overlap == 0.01
        assert np.isclose(pair.force[1], 0.01 * 1000.0 * 2.0, rtol=2e-2)


@pytest.mark.parametrize(
    ("given", "steps", "said"),
    [
        ("", change(preload=-1.0), "step.0..contact.0..preload: must be a number from 0"),
        ("", change(preload="lock"), 'or "locked", got'),
        ("", change().replace("pair", "pear"), "no contact 'pear', did you mean 'pair'"),
        ("friction_bound = 1.0", change(friction_coefficient=0.1), "has none until then"),
        ('normal = "bonded"', change(friction_coefficient=0.1), "is bonded and does not slip"),
        ("", change(preload="locked"), "step.0..contact.0..preload: no step before"),
        ("preload = 1.0", change(preload="locked"), "step.0..contact.0..preload: no step before"),
        ("preload = -1.0", "", "preload: must be greater than or equal to 0"),
    ],
)
def test_what_a_contact_cannot_be_given_is_refused(given, steps, said):
    with pytest.raises(InputError, match=said):
        posed(columns("plane", given) + steps)


@pytest.mark.parametrize("value", [0.1, "0.1", "0.1*(1 + 0*x)"])
@pytest.mark.parametrize("later", [False, True])
def test_a_uniform_interference_under_a_preload_is_refused(value, later):
    """However it is written: a preload finds the uniform overlap itself."""
    given = f"preload = 1.0\ninterference = {json.dumps(value)}"
    text = columns("plane", "preload = 1.0") + "[[step]]\n" + change(interference=value)
    said = f"{'step.1.' if later else ''}.?contact.0..interference: a uniform"
    with pytest.raises(InputError, match=said):
        solve(posed(text if later else columns("plane", given)))


def test_changes_of_a_contact_twice_in_a_step_are_refused():
    twice = change(preload=1.0) + '[[step.contact]]\nname = "pair"\npreload = 2.0\n'
    with pytest.raises(InputError, match="contact 'pair' is changed twice"):
        posed(columns("plane", "") + twice)


@pytest.mark.parametrize("given", [f"interference = {OVERLAP}", f"preload = {FORCE}"])
def test_an_overlap_and_a_preload_are_loads_under_which_nothing_jams(given):
    solution = solve(posed(columns("plane", given)))
    assert pressures(solution)[-1].max() > 0.0
    assert not [finding for finding in solution.findings if finding.kind == "jam"]


@pytest.mark.parametrize(
    ("given", "warned"), [("clearance = 0.1", 0), ("interference = 0.1", 0), ("", 1)]
)
def test_an_obstacle_that_fits_a_hole_is_no_surprise_where_its_play_is_given(given, warned):
    text = f"""
material = {{ young_modulus = 1000.0, poisson_ratio = 0.3 }}
mesh = {{ element_size = 0.5 }}
[geometry]
shape = "outline"
exterior = true
loops = [{{ part = "hole", center = [0.0, 0.0], radius = 1.0 }}]
[[obstacle]]
name = "pin"
displacement = [0.0, -0.2]
[[contact]]
name = "pair"
secondary = "hole"
primary = "pin"
{given}
"""
    solution = solve(posed(text))
    assert sum(each.kind == "fitting gap" for each in solution.findings) == warned
