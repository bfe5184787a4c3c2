"""Quantities against hand counts, against equilibrium, and of several bodies."""

from __future__ import annotations

import numpy as np
import pytest
from examples import example
from problems import block, contact_pair, load_step, obstacle, posed
from sweep_files import CONFIGS, quietly, sweep_of

from petcontact import load_case
from petcontact.fields.interior import field_at
from petcontact.pipeline.solve import solve
from petcontact.sweep.quantities import contact_quantities, over_steps, resultants, von_mises_at
from petcontact.sweep.store.case_table import read_case_table


@pytest.fixture(scope="module")
def solution(comm):
    return solve(example(1), comm=comm)


def test_of_example_1(solution):
    found = contact_quantities(solution)
    c = solution.contact
    assert found["max_displacement"] == np.sqrt((solution.u**2).sum(axis=1)).max()
    assert found["max_u_t"] == pytest.approx(np.abs(c.u_t).max(), rel=1e-12)
    # 80 nodes of weight 0.1
    assert found["slip_length"] == pytest.approx(0.1 * (c.state == 1).sum(), rel=1e-12)
    assert found["slip_share"] == pytest.approx((c.state == 1).mean(), rel=1e-12)
    assert found["contact_area"] == pytest.approx(8.0, rel=1e-12)
    assert found["tension_share"] == pytest.approx((c.sigma_n > 0).mean(), rel=1e-12)
    # where it slips |σ_t| = g, elsewhere u_t = 0
    assert found["dissipated_energy"] == pytest.approx(
        0.1 * 150.0 * np.abs(c.u_t[c.state == 1]).sum(), rel=1e-4
    )


def test_von_mises_at_points(solution):
    points = [(4.0, 2.0), (1.0, 3.0)]
    found = von_mises_at(solution, points)
    _, stress = field_at(
        solution.mesh, solution.u, solution.traction, solution.problem.material, np.array(points)
    )
    for (xx, yy, xy), value in zip(stress, found.values(), strict=True):
        s = np.array([[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, 0.3 * (xx + yy)]])
        deviator = s - np.trace(s) / 3.0 * np.eye(3)
        assert value == pytest.approx(np.sqrt(1.5 * (deviator**2).sum()), rel=1e-12)
    assert von_mises_at(solution, []) == {}


@pytest.mark.usefixtures("unestimated", "unsampled")
def test_of_a_step_that_ends_where_the_contact_slides():
    """The friction of a block is its coefficient times the weight of 4."""
    text = block("block", [0.0, 0.0], [4.0, 1.0], mesh="element_size = 0.5")
    free = '[[body.boundary]]\npart = "{}"\ncondition = "traction"\nvalue = [0.0, {}]\n'
    text += free.format("top", -1.0) + free.format("left", 0.0) + obstacle("floor", [0.0, 0.0])
    text += contact_pair("seat", "block.bottom", "floor", 0.3) + load_step("press")
    push = '[[step]]\nname = "push"\n{}[[step.boundary]]\npart = "left"\nvalue = [{}, 0.0]\n'
    solution = solve(posed(text + push.format('until = "sliding"\n', 2.0) + push.format("", -0.5)))
    found = over_steps(solution)
    assert found["load_factor"] == pytest.approx(0.6, rel=2e-4)
    assert found["peak_force_x"] == pytest.approx(-1.2, rel=2e-4)
    assert found["peak_force_y"] == pytest.approx(4.0)
    assert resultants(solution)["force_x"] == pytest.approx(0.5)


PUNCH = (
    block("block", [-2.0, -2.0], [2.0, 0.0], mesh="element_size = 0.25", bottom=[0.0, 0.0])
    + obstacle("punch", [0.0, -0.05])
    + contact_pair("top", "block.top", "punch", 0.3, "x**2/8")
    + load_step("press")
    + load_step("shift", punch={"displacement": [0.03, -0.05]})
)


@pytest.mark.usefixtures("unsampled")
def test_a_sweep_of_bodies_and_load_steps(tmp_path):
    (tmp_path / "punch.toml").write_text(PUNCH)
    crossed = {"contact.0.friction_coefficient": [0.1, 0.3], "tolerance": [1e-8]}
    sweep = sweep_of(tmp_path, problems=["punch.toml"], keep="contact", cross=crossed)
    summary = quietly(sweep, tmp_path / "out")
    assert summary.exit_status == 0, summary.lines()
    assert quietly(sweep, tmp_path / "out").reused == 2
    table = read_case_table(tmp_path / "out")
    mu = table.numbers("friction_coefficient")
    # all slides in the end: the shear force is µ times the normal force, more friction takes more
    assert np.allclose(
        np.abs(table.numbers("force_x")) <= mu * np.abs(table.numbers("force_y")) * (1 + 1e-9), True
    )
    area = table.numbers("contact_area")
    assert np.all((area > 0.5) & (area < 4.0)) and np.all(table.numbers("dissipated_energy") > 0.0)
    kept = load_case(tmp_path / "out", sweep.ids[1])
    assert set(kept["interface"]) == {"top"} and set(kept["history_step"]) == {1.0, 2.0}
    assert kept["weight"][kept["state"] != 2].sum() == pytest.approx(area[1], rel=1e-12)


MESH = "element_size = 0.5\nelement_sizes = { top = 0.05 }\norder = 2\n"
HERTZ = (CONFIGS / "hertz.toml").read_text().replace(MESH, "")


@pytest.mark.slow
def test_a_case_without_a_mesh_is_what_a_solve_gives(tmp_path, comm):
    (tmp_path / "round.toml").write_text(HERTZ)
    sweep = sweep_of(
        tmp_path,
        problems=["round.toml"],
        keep="all",
        quantities=["petcontact.sweep.quantities:peak_von_mises"],
        cross={"accuracy": [5e-2, 2e-2]},
    )
    lines = list[str]()
    assert quietly(sweep, tmp_path / "out", say=lines.append).exit_status == 0
    assert "share" not in lines[0] and "on a first mesh" in lines[2]
    table = read_case_table(tmp_path / "out")
    assert np.all(table.numbers("estimated_error") <= [5e-2, 2e-2])
    alone, kept = solve(sweep[0], comm=comm), load_case(tmp_path / "out", sweep.ids[0])
    assert kept.verdict().split("time")[0] == alone.verdict().split("time")[0]
    assert table.numbers("estimated_error")[0] == alone.accuracy.error
    assert table.numbers("warnings")[0] == len(alone.warnings)
    assert table.numbers("max_pressure")[0] == alone.last.pairs["top"].pressure.max()
    peak = f"{table.numbers('peak_von_mises')[0]:.3g}"
    assert f"largest von Mises stress: {peak}" in alone.verdict()
