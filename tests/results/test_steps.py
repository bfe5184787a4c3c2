"""Fields of bodies and load steps: equilibrium of a disc under a point force, and the files for
ParaView."""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace

import h5py
import numpy as np
import pytest
from problems import posed

from petcontact import Problem, read_result, solve
from petcontact.bem.kelvin2d.kernel import Kelvin2D
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.model.base import parse
from petcontact.results.hdf5 import write_solution

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

NEWTON = SemismoothNewton()
DISC = """
[[body]]
name = "disc"
material = { young_modulus = 1.0, poisson_ratio = 0.3 }
geometry = { shape = "outline", loops = [{ part = "rim", center = [0.0, 1.0], radius = 1.0 }] }
mesh = { element_size = 0.1, order = 2 }
[[body.point_force]]
name = "weight"
at = [0.0, 1.2]
force = [0.0, -0.01]
[[obstacle]]
name = "floor"
[[contact]]
name = "foot"
secondary = "disc.rim"
primary = "floor"
direction = [0.0, -1.0]
gap = "where(y < 1, y, 9)"
friction_coefficient = 0.3
[[step]]
[[step]]
increments = 2
[[step.point_force]]
name = "weight"
force = [0.0, -0.02]
"""


@pytest.fixture(scope="module")
def disc():
    return solve(posed(DISC))


def test_increments_together_are_those_one_by_one_for_the_integrals_of_one(disc, monkeypatch):
    radius, angle = np.meshgrid([0.3, 0.9, 0.999, 1.0], np.linspace(0.0, 6.0, 7))
    x = np.column_stack([(radius * np.cos(angle)).ravel(), 1.0 + (radius * np.sin(angle)).ravel()])
    counted, whole = [], Kelvin2D.stress_integrals

    def counting(*given):
        counted.append(len(given[1].point))
        return whole(*given)

    monkeypatch.setattr(Kelvin2D, "stress_integrals", counting)
    single = [disc.state_at(x, step=k) for k in (1, 2, 3)]
    one_by_one, counted[:] = sum(counted), []
    together = disc.states_at(x, [1, 2, 3])
    assert 3 * sum(counted) == one_by_one
    for ours, alone in zip(together, single, strict=True):
        size = np.abs(alone.stress).max()
        assert np.allclose(ours.u, alone.u, rtol=0.0, atol=1e-13)
        assert np.allclose(ours.stress, alone.stress, atol=1e-9 * size)
    assert not np.allclose(together[0].stress, together[2].stress, rtol=0.1)


def test_a_verdict_without_numbers_tells_nothing_of_an_obstacle(disc):
    """A signal leaves none."""
    verdicts = disc.verdict(), replace(disc, written=()).verdict()
    assert ["    floor: " in text for text in verdicts] == [True, False]


BLOCK = """
[material]
young_modulus = 100.0
poisson_ratio = 0.3
plane = "PLANE"
[geometry]
shape = "rectangle"
lower_left = [0.0, 0.0]
upper_right = [2.0, 1.0]
[mesh]
element_size = 0.25
order = 1
[[boundary]]
part = "bottom"
condition = "contact"
normal = "unilateral"
gap = "where(x < 1.5, 0, 1)"
[[boundary]]
part = "left"
condition = "displacement"
value = [0.0, "free"]
[[boundary]]
part = "right"
condition = "displacement"
value = [0.0, "free"]
[[boundary]]
part = "top"
condition = "traction"
pressure = 1.0
[petsc]
ksp_rtol = 1e-9
"""


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_a_block_on_a_floor_as_h5py_shows_it(tmp_path, plane):
    """One body in unilateral contact: uniform pressure on a whole floor; open nodes carry 0.0, not
    -0.0, and are no zone."""
    whole = BLOCK.replace("PLANE", plane).replace("where(x < 1.5, 0, 1)", "0")
    broken = BLOCK.replace("PLANE", plane)
    for text, name in ((whole, "whole.h5"), (broken, "broken.h5")):
        solution = solve(posed(text))
        write_solution(tmp_path / name, solution)
    with h5py.File(tmp_path / "whole.h5") as file:
        contact, boundary, x = file["contact"], file["boundary"], file["boundary/x"][()]
        # both sides on rollers: ε_xx = 0, and σ_zz is ν(σ_xx + σ_yy) or none
        strain = (1.0 + 0.3) * (1.0 - 2 * 0.3) / (1.0 - 0.3) if plane == "strain" else 1.0 - 0.3**2
        moved = np.column_stack([0 * x[:, 0], -strain / 100.0 * x[:, 1]])
        assert np.allclose(boundary["u"][()], moved, atol=1e-12)
        assert np.allclose(contact["sigma_n"], -1.0)
        assert contact["u_t"].shape == contact["sigma_t"].shape == (16, 1)
        assert np.allclose(contact["tangent"], [1.0, 0.0])
        assert np.all(contact["friction_bound"][()] == 0.0)
        assert np.allclose(file["steps/1/contact/bottom"].attrs["force"], [0.0, 2.0])
        assert all(file.attrs[key] for key in ("argv", "versions"))
        assert "-ksp_rtol 1e-09" in file.attrs["petsc_options"]
    with h5py.File(tmp_path / "broken.h5") as file:
        contact, zones = file["contact"], file.attrs["zones"]
        assert set(contact["state"][contact["x"][:, 0] > 1.5]) == {2}
        assert not np.signbit(contact["pressure"]).any()
        assert zones.shape[1] == 3 and set(json.loads(file.attrs["zone_parts"])) == {"bottom"}
        assert np.isclose(zones[:, 1].max(), 1.5) and set(zones[:, 2]) <= {-1.0, 0.0, 1.0}


def test_the_verdict_of_an_increment_that_failed():
    """A load that pulls the block off the floor: where it failed is not called reached, and nothing
    that is 0 has a sign."""
    text = BLOCK.replace("PLANE", "strain").replace("pressure = 1.0", "pressure = -1.0")
    solution = solve(posed(text))
    verdict = " ".join(solution.verdict().split())
    assert solution.status == "not converged"
    assert "along +y beyond what contact and friction allow; give it a displacement" in verdict
    assert "failed at" in verdict and "reached" not in verdict
    assert "-0" not in verdict.replace("e-0", "")


def check_described(path, item):
    assert isinstance(item, h5py.Group) or {"unit", "description"} <= set(item.attrs), path


def test_what_failed_is_kept_apart(tmp_path):
    """/steps has the increments that were solved alone, /failed the one that was not; /history a
    row an iteration."""
    data = tomllib.loads(BLOCK.replace("PLANE", "strain"))
    data["step"] = [
        {"name": "press"},
        {"name": "lift", "boundary": [{"part": "top", "pressure": -1.0}]},
    ]
    solution = solve(parse(Problem, data, "test"))
    assert solution.status == "not converged"
    assert all(step.status == "converged" for step in solution.steps)
    assert solution.failed is not None and solution.failed.step == 2
    assert solution.last is solution.steps[-1]
    write_solution(tmp_path / "r.h5", solution)
    with h5py.File(tmp_path / "r.h5") as file:
        assert len(file["steps"]) == len(solution.steps)
        assert file["failed"].attrs["status"] == "not converged"
        assert len(file["increments/step"]) == len(solution.steps) + 1
        file.visititems(lambda path, item: check_described(path, item))
        rows, counts = file["history"], file["increments/iterations"][()]
        assert np.array_equal(np.bincount(rows["increment"][()])[1:], counts)
        assert all(
            len(rows[key]) == counts.sum()
            for key in ("rho", "w", "change", "residual", "ksp_iterations")
        )
        # one body: /contact is that of the last increment that was solved
        assert np.array_equal(file["contact/pressure"], solution.last.pairs["bottom"].pressure)
    back = read_result(tmp_path / "r.h5")
    assert back.failed.reason == solution.failed.reason and back.iterations == solution.iterations
    assert vars(back.steps[0].history) == vars(solution.steps[0].history)


def test_tractions_beyond_the_law_are_not_converged():
    """Whatever a method calls converged."""

    def beyond(system, law, iteration):
        state = NEWTON(system, law, iteration)
        state.sigma[:, 0] = 1.01 * np.abs(state.sigma[:, 1]) + 1e-3
        return state

    solution = solve(posed(BLOCK.replace("PLANE", "strain")), method=beyond)
    assert solution.status == "not converged" and "exceed what contact allows" in solution.reason
