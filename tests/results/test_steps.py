"""Load steps: what h5py shows of them, and increments that failed."""

from __future__ import annotations

import json

import h5py
import numpy as np
import pytest
from shapes import closing, elastic, moved, problem, rectangle

from petcontact import read_result, solve
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.results.hdf5 import write_solution

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

NEWTON = SemismoothNewton()


def pressed(pressure=1.0, plane="strain", gap="where(x < 1.5, 0, 1)", **more):
    """A block on a floor between rollers, pressed by its top."""
    return problem(
        material=elastic(100.0, 0.3) | {"plane": plane},
        geometry=rectangle([0.0, 0.0], [2.0, 1.0]),
        mesh={"element_size": 0.25, "order": 1},
        boundary=[
            closing("bottom", normal="unilateral", gap=gap),
            *(moved(side, [0.0, "free"]) for side in ("left", "right")),
            {"part": "top", "condition": "traction", "pressure": pressure},
        ],
        petsc={"ksp_rtol": 1e-9},
        **more,
    )


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_a_block_on_a_floor_as_h5py_shows_it(tmp_path, plane):
    """One body in unilateral contact: uniform pressure on a whole floor; open nodes carry 0.0, not
    -0.0, and are no zone."""
    write_solution(tmp_path / "whole.h5", solve(pressed(plane=plane, gap=0.0)))
    write_solution(tmp_path / "broken.h5", solve(pressed(plane=plane)))
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
    solution = solve(pressed(-1.0))
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
    lift = {"name": "lift", "boundary": [{"part": "top", "pressure": -1.0}]}
    units = {"length": "mm", "stress": "MPa"}
    solution = solve(pressed(units=units, step=[{"name": "press"}, lift]))
    assert solution.status == "not converged"
    assert "error of p and q not known: a solve that fails" in solution.verdict()
    assert all(step.status == "converged" for step in solution.steps)
    assert solution.failed is not None and solution.failed.step == 2
    assert solution.last is solution.steps[-1]
    write_solution(tmp_path / "r.h5", solution)
    with h5py.File(tmp_path / "r.h5") as file:
        assert len(file["steps"]) == len(solution.steps)
        assert file["failed"].attrs["status"] == "not converged"
        assert len(file["increments/step"]) == len(solution.steps) + 1
        file.visititems(lambda path, item: check_described(path, item))
        assert file["contact/sigma_t"].attrs["unit"] == "MPa"
        assert file["history/rho"].attrs["unit"] == "MPa/mm"
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

    solution = solve(pressed(), method=beyond)
    assert solution.status == "not converged" and "exceed what contact allows" in solution.reason
