"""Whole sweeps on one rank: computed, resumed, damaged, refused; the command."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import forked
import h5py
import numpy as np
import pytest
from marks import slow
from sweep_files import quietly, sweep_file, sweep_of

from petcontact import load_case, load_sweep
from petcontact.errors import InputError, OutputError, ResultError, SolverError
from petcontact.linalg.dense_elimination import Elimination
from petcontact.pipeline.run import prepare, run
from petcontact.pipeline.solve import solve
from petcontact.sweep import problems
from petcontact.sweep import problems as running
from petcontact.sweep.design.sweep import read_sweep
from petcontact.sweep.schedule import cost as costs
from petcontact.sweep.schedule.cost import estimate
from petcontact.sweep.schedule.groups import describe
from petcontact.sweep.store.case_table import read_case, read_case_table
from petcontact.sweep.store.log import Record, records

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

SECONDS = "iterate_seconds"


@pytest.fixture
def small(tmp_path):
    return read_sweep(sweep_file(tmp_path))


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    """The folder of that sweep, all of it computed: once, each test changes a copy."""
    folder = tmp_path_factory.mktemp("computed")
    quietly(read_sweep(sweep_file(folder)), folder / "out")
    return folder / "out"


def table_of(folder) -> dict:
    """Every row of a sweep by id, without what differs from run to run."""
    table = read_case_table(folder)
    rows = zip(*(table.values(name) for name in table.names), strict=True)
    return {
        row[0]: {n: v for n, v in zip(table.names, row, strict=True) if n != SECONDS}
        for row in rows
    }


# -- plan
# --------------------------------------------------------------------------------------------------


def test_the_plan_knows_the_size_and_memory_of_what_is_assembled(small, comm):
    case = next(c for c in small if c.mesh.element_size == 0.4)
    cost = estimate(case, 1)
    prepared = prepare(case, comm)
    (mesh,), (contact,) = prepared.discrete.meshes, prepared.discrete.interfaces
    assert (cost.nodes, cost.contact_unknowns) == (mesh.n_nodes, len(contact.nodes))
    n, m = 2 * mesh.n_nodes, len(contact.nodes)
    assert 8 * n * n <= cost.memory <= 8 * (n + 2 * m) ** 2
    prepared.close()
    lines = describe(small, [cost], (9, 2, 7, 1), 2, 4)
    assert lines[0].endswith(
        "9 cases, 2 finished already, 7 to compute in 1 group that share assembly and elimination"
    )
    assert describe(small, [cost], (7, 0, 7, 7), 2, 4)[0].endswith("7 to compute")
    assert f"{mesh.n_nodes} nodes, {m} contact unknowns" in lines[2]


def test_a_body_that_cannot_be_meshed_costs_nothing(small, monkeypatch):
    def refuse(*arguments):
        raise InputError("no mesh")

    monkeypatch.setattr(costs, "mesh_of", refuse)
    cost = estimate(small[0], 1)
    assert (cost.nodes, cost.memory) == (0, 0.0)


# -- whole sweeps
# --------------------------------------------------------------------------------------------------


def test_a_sweep_computes_each_case_once_and_prepares_each_group_once(
    small, tmp_path, monkeypatch, comm
):
    calls = []
    monkeypatch.setattr(
        running,
        "prepare",
        lambda *words, cases: calls.append(cases) or prepare(*words, cases=cases),
    )
    folder = tmp_path / "new" / "out"
    summary = quietly(small, folder)
    assert (summary.computed, summary.reused, summary.failed, summary.exit_status) == (8, 0, {}, 0)
    assert calls == [4, 4]
    monkeypatch.undo()
    alone, kept = solve(small[5], comm=comm), load_case(folder, small.ids[5])
    assert kept.iterations == alone.iterations
    np.testing.assert_allclose(kept.contact.sigma_t, alone.contact.sigma_t, rtol=1e-9, atol=1e-9)
    before = table_of(folder)
    again = quietly(small, folder)
    assert (again.computed, again.reused, again.exit_status) == (0, 8, 0)
    assert table_of(folder) == before
    assert quietly(small, folder, force=True, only=["*-rho1e3-h0.8"]).computed == 2
    assert table_of(folder) == before


def test_loads_gaps_and_friction_share_one_elimination(tmp_path, monkeypatch, comm):
    together = {
        "boundary.2.value": [["1/(x - x)", 0.0], [400.0, 0.0], [300.0, "y"], [0.0, 0.0]],
        "boundary.1.value.0": [0.0, 0.0, 1e-3, 1e-3],
        "boundary.0.friction_bound": [150.0, 150.0, "100 + x", 150.0],
        "boundary.0.gap": [0.0, 0.0, "1e-3*x", 0.0],
        "loads.force": [[0.0, 0.0], [0.0, 0.0], [0.0, -1.0], ["x", 0.0]],
    }
    usual = {"element_size": 0.8, "boundary.0.normal": "bilateral"}
    sweep = sweep_of(tmp_path, keep="all", set=usual, zip=together)
    calls, built = [], Elimination.__init__
    monkeypatch.setattr(Elimination, "__init__", lambda *words: calls.append(1) or built(*words))
    summary = quietly(sweep, tmp_path / "out")
    monkeypatch.undo()
    assert len(calls) == 1
    # the one whose load is no number fails, also where it is the first of its group
    assert len(summary.failed) == 1
    for id_, case in zip(sweep.ids, sweep, strict=True):
        if id_ in summary.failed:
            with pytest.raises(InputError) as alone:
                solve(case, comm=comm)
            assert summary.failed[id_] == str(alone.value)
        else:
            alone, kept = solve(case, comm=comm), load_case(tmp_path / "out", id_)
            assert kept.status == alone.status == "converged"
            for one, other in (
                (kept.u, alone.u),
                (kept.contact.sigma_t, alone.contact.sigma_t),
            ):
                np.testing.assert_allclose(one, other, atol=1e-12 * np.abs(other).max())


def test_without_pandas_a_sweep_is_a_dict_of_arrays(small, tmp_path, monkeypatch):
    quietly(small, tmp_path / "out", only=["*-rho1-*"])
    monkeypatch.setitem(sys.modules, "pandas", None)
    columns = load_sweep(tmp_path / "out" / "results.h5")
    assert np.isfinite(columns["max_u_t"]).sum() == 4
    assert set(columns["status"]) == {
        "converged",
        "missing",
    }


@pytest.mark.parametrize("keep", ["scalars", "contact"])
def test_fields_are_kept_where_they_are_asked_for(tmp_path, keep, comm):
    sweep = read_sweep(sweep_file(tmp_path, keep=keep))
    quietly(sweep, tmp_path / "out")
    if keep == "scalars":
        with pytest.raises(ResultError, match="no fields"):
            load_case(tmp_path / "out", sweep.ids[3])
        return
    alone = solve(sweep[3], comm=comm)
    kept = load_case(tmp_path / "out", sweep.ids[3])
    np.testing.assert_allclose(kept["u_t"], alone.contact.u_t, rtol=1e-9, atol=1e-12)
    assert list(kept["part"]) == list(alone.contact.part)
    assert len(kept["history_rho"]) == alone.iterations
    with pytest.raises(ResultError, match="no case"):
        load_case(tmp_path / "out", "nothing")
    for name in ("out", "out/results.h5"):
        with pytest.raises(
            ResultError, match=f"--case ID names one of them, such as {sweep.ids[0]}"
        ):
            read_case(tmp_path / name)


@pytest.mark.slow
def test_parts_share_a_folder_and_its_table(small, tmp_path, computed):
    parts = [quietly(small, tmp_path / "out", part=(k, 3)) for k in (1, 2, 3)]
    assert sum(part.computed for part in parts) == 8
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        assert file["cases/status"][()].tolist() == 8 * [b"converged"]
    last = quietly(small, tmp_path / "out")
    assert (last.computed, last.reused) == (0, 8)
    assert table_of(tmp_path / "out") == table_of(computed)


# -- what does not count is computed again
# ---------------------------------------------------------------------------


def log_of(folder) -> tuple[Path, list[Record]]:
    """The only log of a sweep, and its records."""
    (path,) = (folder / "log").iterdir()
    return path, list(records(path))


@pytest.mark.parametrize("damage", ["truncated", slow("inverted"), "a row"])
def test_damaged_records_are_computed_again(small, tmp_path, computed, damage):
    shutil.copytree(computed, tmp_path / "out")
    before = table_of(tmp_path / "out")
    path, found = log_of(tmp_path / "out")
    content, record, lost = bytearray(path.read_bytes()), found[5], 1
    if damage == "truncated":
        path.write_bytes(content[: record.at + 5000])
        lost = 3
    elif damage == "inverted":
        some = slice(record.at + 6000, record.at + 6400)
        content[some] = bytes(255 - byte for byte in content[some])
        path.write_bytes(content)
        place = read_case_table(tmp_path / "out").values("id").index(record.row["id"])
        with pytest.raises(ResultError, match="damaged"):
            load_case(tmp_path / "out", small.ids[place])
    else:
        iterations = b'"iterations": '
        path.write_bytes(content.replace(iterations, iterations + b"1", 1))
    summary = quietly(small, tmp_path / "out")
    assert (summary.computed, summary.reused, summary.exit_status) == (lost, 8 - lost, 0)
    assert table_of(tmp_path / "out") == before
    assert all(load_case(tmp_path / "out", id_).converged for id_ in small.ids)


def test_a_damaged_table_costs_nothing(small, tmp_path, computed):
    shutil.copytree(computed, tmp_path / "out")
    before, path = table_of(tmp_path / "out"), tmp_path / "out" / "results.h5"
    with h5py.File(path) as file:
        iterations = file["cases/iterations"][()]
    path.unlink()
    path.write_bytes(b"something else")
    # results.h5 is for others: what petcontact reads are the logs
    assert table_of(path) == before
    assert quietly(small, tmp_path / "out").computed == 0
    with h5py.File(path) as file:
        assert np.array_equal(file["cases/iterations"][()], iterations)


@pytest.mark.slow
def test_two_runs_at_once_end_with_one_right_table(small, tmp_path, computed):
    """The same command twice: each computes, one of them remarks it, and the table has every case
    once."""
    said, inner = [], []

    def again(line):
        if not inner:  # the first run has the folder and has computed nothing
            inner.append(None)
            inner.append(quietly(small, tmp_path / "out", say=said.append))

    outer = quietly(small, tmp_path / "out", say=again)
    assert (outer.computed, inner[1].computed) == (8, 8)
    assert any("another run is at work here" in line for line in said)
    assert len(list((tmp_path / "out" / "log").iterdir())) == 2
    assert table_of(tmp_path / "out") == table_of(computed)
    with h5py.File(tmp_path / "out" / "results.h5") as file:
        assert file["cases/id"][()].tolist() == [id_.encode() for id_ in small.ids]
    last = quietly(small, tmp_path / "out", say=lambda line: said.append("alone: " + line))
    assert last.reused == 8 and not any("alone" in line and "another run" in line for line in said)
    assert not list((tmp_path / "out").glob(".run-*"))


# -- failures
# --------------------------------------------------------------------------------------------------


def test_a_failing_case_is_recorded_and_redone(small, tmp_path, monkeypatch):
    errors = {
        "modified": SolverError("iterate", "made to fail", "nothing"),
        "self-adaptive": ZeroDivisionError("oh"),
    }

    def failing(prepared):
        case = prepared.discrete.problem
        if case.method.rho == 1e3 and case.mesh.element_size == 0.4:
            raise errors[case.method.rule]
        return run(prepared)

    monkeypatch.setattr(problems, "run", failing)
    summary = quietly(small, tmp_path / "out")
    assert summary.exit_status == 1
    assert summary.failed == {
        "example1-modified-rho1e3-h0.4": "iterate: made to fail; nothing",
        "example1-self-adaptive-rho1e3-h0.4": "ZeroDivisionError: oh",
    }
    row = table_of(tmp_path / "out")["example1-modified-rho1e3-h0.4"]
    assert (row["status"], row["reason"]) == ("failed", "iterate: made to fail; nothing")
    assert any(
        "failed: example1-modified-rho1e3-h0.4: iterate: made to fail" in line
        for line in summary.lines()
    )
    monkeypatch.setattr(problems, "run", run)
    again = quietly(small, tmp_path / "out")
    assert (again.computed, again.reused, again.exit_status) == (2, 6, 0)


def test_a_quantity_that_raises_fails_its_case_and_no_other(tmp_path):
    (tmp_path / "raising_quantity.py").write_text(
        "def bad(solution):\n    return 1.0 / (solution.problem.method.rho - 1.0)\n"
    )

    def run(module):
        crossed = {"rho": [1.0, 3.0]}
        sweep = sweep_of(tmp_path, quantities=[f"{module}:bad"], cross=crossed)
        return quietly(sweep, tmp_path / module)

    summary = run("raising_quantity")
    assert list(summary.failed) == ["example1-rho1"]
    assert "ZeroDivisionError" in summary.failed["example1-rho1"]
    with pytest.raises(InputError, match="cannot be imported"):
        run("no_such_module")


@pytest.mark.parametrize("name", ["status", "von_mises_1", "rho"])
def test_a_quantity_named_like_a_column_is_refused_at_the_start(tmp_path, name):
    (tmp_path / "clashing_quantity.py").write_text(f"def {name}(solution):\n    return 1.0\n")
    sys.modules.pop("clashing_quantity", None)
    with pytest.raises(InputError, match=f"there is a column {name} already"):
        sweep = sweep_of(tmp_path, quantities=[f"clashing_quantity:{name}"], cross={"rho": [1.0]})
        quietly(sweep, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_case_that_does_not_converge_ends_with_status_3_and_is_kept(tmp_path):
    sweep = read_sweep(sweep_file(tmp_path, limit=30))
    summary = quietly(sweep, tmp_path / "out")
    assert summary.exit_status == 3
    assert 0 < len(summary.not_converged) < 8
    assert "max_iterations = 30" in next(iter(summary.not_converged.values()))
    again = quietly(sweep, tmp_path / "out")
    assert (again.computed, again.reused, again.exit_status) == (0, 8, 3)


def test_a_case_of_a_large_sweep_that_is_invalid_fails_in_its_turn(tmp_path, monkeypatch):
    from petcontact.sweep.design import sweep as module

    monkeypatch.setattr(module, "VALIDATED", 2)
    sweep = sweep_of(tmp_path, set={"element_size": 0.4}, cross={"rho": [1.0, -1.0, 2.0]})
    summary = quietly(sweep, tmp_path / "out")
    assert list(summary.failed) == ["example1-rho-1"]
    assert "method.rho" in summary.failed["example1-rho-1"]


def test_a_table_that_does_not_fit_the_disk_loses_no_case(small, tmp_path, monkeypatch):
    def full(path, fill):
        raise OutputError(f"{path}: cannot be written (No space left on device)")

    chosen = {"only": ["*-h0.8"]}
    with monkeypatch.context() as patch:
        patch.setattr("petcontact.sweep.store.case_table.write_atomically", full)
        with pytest.raises(OutputError, match="the finished cases are whole"):
            quietly(small, tmp_path / "out", **chosen)
    again = quietly(small, tmp_path / "out", **chosen)
    assert (again.computed, again.reused, again.exit_status) == (0, 4, 0)


# -- the folder
# --------------------------------------------------------------------------------------------------


def test_leftovers_of_a_killed_run_are_removed(small, tmp_path):
    folder = tmp_path / "out"
    (folder / ".run-17").mkdir(parents=True)
    leftovers = [folder / ".petcontact-y.tmp", folder / ".run-17", folder / ".run-18"]
    for path in leftovers[::2]:
        path.write_text("")  # .run-18, too: a file in the place of a folder
    assert quietly(small, folder).computed == 8
    assert not any(path.exists() for path in leftovers)


@pytest.mark.parametrize(
    ("name", "said"),
    [("journal", "older petcontact"), ("results.h5", "no folders"), ("sweep.json", "no folders")],
)
def test_a_folder_of_an_older_version_or_in_the_place_of_a_file_is_refused(
    small, tmp_path, name, said
):
    (tmp_path / "out" / name).mkdir(parents=True)
    with pytest.raises(InputError, match=said):
        quietly(small, tmp_path / "out")


def test_a_folder_that_cannot_be_made(small, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file/out"):
        quietly(small, tmp_path / "file" / "out")


# -- command line
# --------------------------------------------------------------------------------------------------


def command(*words: str, cwd: Path) -> subprocess.CompletedProcess:
    return subprocess.run(
        [forked.program(), "sweep", *words], cwd=cwd, capture_output=True, text=True, timeout=300
    )


def test_the_command_lists_computes_and_says_what_it_did(tmp_path):
    sweep_file(tmp_path)
    listed = command("small.toml", "--list", "--only", "*-h0.8", cwd=tmp_path)
    assert listed.returncode == 0
    assert len(listed.stdout.splitlines()) == 4
    assert not (tmp_path / "small").exists()
    done = command("small.toml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "8 cases, 0 finished already, 8 to compute in 2 groups" in done.stdout
    assert "computed 8, reused 0, failed 0" in done.stdout
    assert "\r" not in done.stdout + done.stderr
    assert (tmp_path / "small" / "results.h5").exists()
    for words in (("--only", "nothing"), ("--ranks-per-case", "2"), ("--part", "3/2")):
        bad = command("small.toml", *words, cwd=tmp_path)
        assert (bad.returncode, bad.stderr.count("\n")) == (2, 1)
    # options that change digits are another case
    redone = command("small.toml", "-ksp_type", "gmres", "-ksp_rtol", "1e-10", cwd=tmp_path)
    assert "computed 8, reused 0" in redone.stdout
