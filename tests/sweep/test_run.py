"""Sweep files, groups, the board, and whole sweeps on one rank."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import threading
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi4py import MPI

from petcontact.errors import InputError, ResultError, SolverError
from petcontact.pipeline import run as pipeline
from petcontact.pipeline.prepare import prepare
from petcontact.pipeline.run import solve
from petcontact.results.hdf5 import read_solution
from petcontact.sweep import cost as sweep_plan
from petcontact.sweep import folder as sweep_folder
from petcontact.sweep.cases import build_sweep, load_sweep, read_files, short_number
from petcontact.sweep.claims import Board, State, most_useful
from petcontact.sweep.cost import Group, describe, estimate, group_cases
from petcontact.sweep.folder import SweepFolder
from petcontact.sweep.progress import Progress
from petcontact.sweep.run import run_sweep

CONFIGS = Path(__file__).parents[2] / "configs"
SMALL = """
title = "small"
problems = ["example1.toml"]
[set]
max_iterations = {limit}
[cross]
rule = ["self-adaptive", "modified"]
rho = [1.0, 1e3]
element_size = [0.8, 0.4]
"""


def sweep_file(folder: Path, text: str, name: str = "small.toml") -> Path:
    for example in ("example1.toml", "example2.toml"):
        (folder / example).write_text((CONFIGS / example).read_text())
    path = folder / name
    path.write_text(text)
    return path


@pytest.fixture
def small(tmp_path):
    return load_sweep(sweep_file(tmp_path, SMALL.format(limit=1000)))


def quietly(sweep, folder, **options):
    return run_sweep(sweep, folder, MPI.COMM_SELF, say=lambda line: None, **options)


# -- sweep files ----------------------------------------------------------------------------------------------------


def test_the_papers_tables_have_128_cases_with_readable_ids():
    sweep = load_sweep(CONFIGS / "tables.toml")
    ids = [case.id for case in sweep.cases]
    assert len(set(ids)) == 128
    assert ids[0] == "example1-self-adaptive-rho1-h0.4"
    assert "example1-modified-rho1e3-h0.05" in ids
    assert ids == [case.id for case in load_sweep(CONFIGS / "tables.toml").cases]
    case = next(c for c in sweep.cases if c.id == "example2-modified-rho1e7-h0.2")
    assert case.coordinates == {"problem": "example2", "rule": "modified", "rho": 1e7, "element_size": 0.2}
    assert (case.case.method.rho, case.case.method.rule, case.case.mesh.element_size) == (1e7, "modified", 0.2)


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(10**15), 10**15))
def test_a_number_in_an_id_reads_back(value):
    assert float(short_number(value)) == value


@pytest.mark.parametrize(("value", "text"), [(1.0, "1"), (100, "100"), (1000.0, "1e3"), (0.05, "0.05"), (1e-6, "1e-6")])
def test_numbers_in_ids_are_short(value, text):
    assert short_number(value) == text


def test_dotted_keys_and_variants(tmp_path):
    path = sweep_file(tmp_path, """
problems = ["example1.toml", "example2.toml"]
[set]
omega = 1.5
[cross]
"material.poisson_ratio" = [0.2, 0.3]
tau = [1.0]
[[variant]]
name = "as is"
[[variant]]
name = "other start"
start = "frictionless"
omega = 0.9
""")  # fmt: skip
    cases = load_sweep(path).cases
    assert [case.id for case in cases[:4]] == [
        "example1-as-is-poissonratio0.2-tau1", "example1-as-is-poissonratio0.3-tau1",
        "example1-other-start-poissonratio0.2-tau1", "example1-other-start-poissonratio0.3-tau1",
    ]  # fmt: skip
    assert [(c.case.method.omega, c.case.method.start) for c in cases[::2]] == [(1.5, "zero"), (0.9, "frictionless")] * 2
    assert cases[3].coordinates == {"problem": "example1", "variant": "other start", "poisson_ratio": 0.3, "tau": 1.0}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("problems = []", "problems"),
        ('problems = ["example1.toml"]\n[cross]\nrhoo = [1.0]', "rhoo"),
        ('problems = ["example1.toml"]\n[cross]\nrho = []', "rho"),
        ('problems = ["example1.toml"]\n[cross]\nrho = [1.0, 1]', "twice"),
        ('problems = ["example1.toml"]\n[cross]\nrho = [-1.0]', "method.rho"),
        ('problems = ["example1.toml"]\n[cross]\n"method.omegaa" = [1.0]', "omega"),
        ('problems = ["example1.toml"]\n[set]\nrho = 2.0\n[cross]\nrho = [1.0]', "elsewhere"),
        ('problems = ["example1.toml"]\n[[variant]]\nomega = 1.0', "name"),
        ('problems = ["example1.toml", "./example1.toml"]', "twice"),
        ('problems = ["example1.toml", "other/example1.toml"]', "differ in more than their folders"),
        ('problems = ["missing.toml"]', "missing.toml"),
        ('problem = ["example1.toml"]', "problems"),
    ],
)
def test_mistakes_are_one_line_that_names_the_key(tmp_path, text, message):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "example1.toml").write_text((CONFIGS / "example1.toml").read_text())
    with pytest.raises(InputError) as caught:
        load_sweep(sweep_file(tmp_path, text))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_only(small):
    assert [case.id for case in small.only(["*-rho1-h0.4", "*modified-rho1e3-h0.8"]).cases] == [
        "example1-self-adaptive-rho1-h0.4", "example1-modified-rho1-h0.4", "example1-modified-rho1e3-h0.8",
    ]  # fmt: skip
    with pytest.raises(InputError, match="no case"):
        small.only(["*-h0.3"])


# -- plan -----------------------------------------------------------------------------------------------------------


def test_cases_that_differ_in_the_method_alone_share_a_group():
    sweep = load_sweep(CONFIGS / "tables.toml")
    groups = group_cases(sweep.cases, range(128))
    assert sorted(len(group) for group in groups) == [16] * 8
    for group in groups:
        coordinates = [sweep.cases[place].coordinates for place in group]
        assert len({(c["problem"], c["element_size"]) for c in coordinates}) == 1


def test_formulation_and_petsc_options_make_groups(tmp_path):
    path = sweep_file(tmp_path, """
problems = ["example1.toml"]
[cross]
formulation = ["condensed", "full"]
"petsc.ksp_type" = ["preonly", "gmres"]
tolerance = [1e-5, 1e-6]
""")  # fmt: skip
    sweep = load_sweep(path)
    assert sorted(map(len, group_cases(sweep.cases, range(8)))) == [2, 2, 2, 2]


def test_the_plan_knows_the_size_and_memory_of_what_is_assembled(small, comm):
    case = next(c.case for c in small.cases if c.case.mesh.element_size == 0.4)
    group = estimate((0,), case, 1)
    prepared = prepare(case, comm)
    mesh, data = prepared.operators.mesh, prepared.operators.data
    assert (group.nodes, group.contact_nodes) == (mesh.n_nodes, len(data.contact_nodes))
    n, m = 2 * mesh.n_nodes, len(data.contact_nodes)
    assert 8 * n * n <= group.memory <= 8 * (n + 2 * m) ** 2
    prepared.close()
    lines = describe([group], "small", 3, 2, 2, 4)
    assert "3 cases, 2 finished already, 1 to compute in 1 group" in lines[0]
    assert f"{n} unknowns, {m} contact nodes" in lines[2]


def test_a_body_that_cannot_be_meshed_costs_nothing(small, monkeypatch):
    def refuse(*arguments):
        raise InputError("no mesh")

    monkeypatch.setattr(sweep_plan, "mesh_of", refuse)
    group = estimate((0,), small.cases[0].case, 1)
    assert (group.nodes, group.memory) == (0, 0.0)


def make_group(cases, prepare=0.0, case=1.0):
    return Group(tuple(cases), 10, 5, prepare, case, 0.0)


def test_the_group_that_would_end_last_comes_first():
    groups = [make_group(range(3)), make_group(range(3, 10)), make_group(range(10, 14))]
    state = State()
    assert most_useful(groups, state) == 1
    state.workers[1] += 1
    assert most_useful(groups, state) == 2
    state.workers[2] += 1
    # 7 cases with one worker end after those 3 of nobody: joining it would end it after 3.5
    assert most_useful(groups, state) == 1


def test_nobody_joins_a_group_that_ends_before_it_is_prepared():
    group = make_group(range(4), prepare=2.5)
    state = State(claimed={0})
    state.workers[0] = 1
    assert most_useful([group], state) == 0
    state.claimed |= {1}
    assert most_useful([group], state) is None
    assert most_useful([make_group([])], State()) is None


def test_every_case_is_claimed_exactly_once(tmp_path):
    board = Board(tmp_path)
    won: list[int] = []

    def work():
        won.extend(place for place in range(200) if board.claim(place))

    threads = [threading.Thread(target=work) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(won) == list(range(200))
    assert board.read().claimed == set(range(200))


def test_the_progress_line_counts_what_is_on_the_board(tmp_path):
    board = Board(tmp_path)
    progress = Progress(board, [make_group(range(8))], enabled=False)
    assert progress.line(1.0) == "0 of 8 cases done, 0 running, 0 failed"
    for place in range(3):
        board.claim(place)
    board.finish(0, failed=False)
    board.finish(1, failed=True)
    assert progress.line(10.0) == "2 of 8 cases done, 1 running, 1 failed, 30 s left"
    assert progress.line(3600.0).endswith("3 h 00 min left")


# -- whole sweeps ---------------------------------------------------------------------------------------------------


def stamps(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in (folder / "cases").iterdir()}


def test_a_sweep_computes_each_case_once_and_prepares_each_group_once(small, tmp_path, monkeypatch, comm):
    calls = []
    monkeypatch.setattr(
        "petcontact.sweep.run.prepare", lambda case, comm, cases: calls.append(cases) or prepare(case, comm, cases)
    )
    folder = tmp_path / "new" / "out"
    summary = quietly(small, folder)
    assert (summary.computed, summary.reused, summary.failed, summary.exit_status) == (8, 0, {}, 0)
    assert calls == [4, 4]
    monkeypatch.undo()
    for chosen in small.cases:
        alone = solve(chosen.case, comm=comm)
        kept = read_solution(folder / "cases" / f"{chosen.id}.h5")
        assert kept.iterations == alone.iterations
        np.testing.assert_allclose(kept.contact.sigma_t, alone.contact.sigma_t, rtol=1e-9, atol=1e-9)

    before = stamps(folder)
    again = quietly(small, folder)
    assert (again.computed, again.reused, again.exit_status) == (0, 8, 0)
    assert stamps(folder) == before
    assert quietly(small, folder, force=True, only=["*-h0.4"]).computed == 4
    assert sum(stamps(folder)[name] != before[name] for name in before) == 4


def tree(group) -> dict:
    found = {("@", name): np.asarray(value).tolist() for name, value in group.attrs.items()}
    group.visititems(lambda name, item: found.update({name: item[()].tolist()} if isinstance(item, h5py.Dataset) else {}))
    return found


def test_results_hold_every_case_whole(small, tmp_path):
    quietly(small, tmp_path / "out")
    with h5py.File(tmp_path / "out" / "results.h5") as results:
        assert [name for name in results if not name.startswith(".")] == sorted(case.id for case in small.cases)
        for case in small.cases:
            with h5py.File(tmp_path / "out" / "cases" / f"{case.id}.h5") as single:
                assert tree(results[case.id]) == tree(single)
    solution = read_solution(tmp_path / "out" / "results.h5", small.cases[3].id)
    assert solution.converged


def test_only_leaves_the_rest_and_the_results_grow(small, tmp_path):
    first = quietly(small, tmp_path / "out", only=["*-rho1-*"])
    assert (first.computed, first.reused) == (4, 0)
    second = quietly(small, tmp_path / "out", only=["*modified*"])
    assert (second.computed, second.reused) == (2, 2)
    with h5py.File(tmp_path / "out" / "results.h5") as results:
        assert len([name for name in results if not name.startswith(".")]) == 6


@pytest.mark.parametrize("damage", ["truncated", "no HDF5", "empty", "other version", "other config", "failed"])
def test_a_file_that_does_not_count_is_computed_again(small, tmp_path, damage):
    quietly(small, tmp_path)
    path = tmp_path / "cases" / f"{small.cases[5].id}.h5"
    if damage == "truncated":
        path.write_bytes(path.read_bytes()[:5000])
    elif damage == "no HDF5":
        path.write_text("something else")
    elif damage == "empty":
        with h5py.File(path, "w"):
            pass
    else:
        key, value = {
            "other version": ("format_version", 99),
            "other config": ("config", "title = 'x'"),
            "failed": ("status", "failed"),
        }[damage]
        with h5py.File(path, "a") as file:
            file.attrs[key] = value
    summary = quietly(small, tmp_path)
    assert (summary.computed, summary.reused, summary.exit_status) == (1, 7, 0)
    assert read_solution(path).converged


def test_another_tolerance_is_another_case(small, tmp_path):
    quietly(small, tmp_path / "out")
    file, data, problems = read_files(tmp_path / "small.toml")
    data["set"] = {"tolerance": 1e-5}
    assert quietly(build_sweep(file, data, problems), tmp_path / "out").computed == 8


def test_a_failing_case_is_recorded_and_redone(small, tmp_path, monkeypatch):
    run = pipeline.run
    errors = {"modified": SolverError("iterate", "made to fail", "nothing"), "self-adaptive": ZeroDivisionError("oh")}

    def failing(prepared, case):
        if case.method.rho == 1e3 and case.mesh.element_size == 0.4:
            raise errors[case.method.rule]
        return run(prepared, case)

    monkeypatch.setattr(pipeline, "run", failing)
    summary = quietly(small, tmp_path / "out")
    assert summary.exit_status == 1
    assert summary.failed == {
        "example1-modified-rho1e3-h0.4": "iterate: made to fail; nothing",
        "example1-self-adaptive-rho1e3-h0.4": "ZeroDivisionError: oh",
    }
    path = tmp_path / "out" / "cases" / "example1-modified-rho1e3-h0.4.h5"
    with h5py.File(path) as file:
        assert (file.attrs["status"], file.attrs["reason"]) == ("failed", "iterate: made to fail; nothing")
    with pytest.raises(ResultError, match="made to fail"):
        read_solution(path)
    assert any("failed: example1-modified-rho1e3-h0.4: iterate: made to fail" in line for line in summary.lines())
    monkeypatch.setattr(pipeline, "run", run)
    again = quietly(small, tmp_path / "out")
    assert (again.computed, again.reused, again.exit_status) == (2, 6, 0)


def test_a_group_that_cannot_be_prepared_fails_case_by_case(small, tmp_path, monkeypatch):
    def failing(case, comm, cases):
        if case.mesh.element_size == 0.8:
            raise SolverError("factor", "zero pivot", "fix the body")
        return prepare(case, comm, cases)

    monkeypatch.setattr("petcontact.sweep.run.prepare", failing)
    summary = quietly(small, tmp_path)
    assert len(summary.failed) == 4
    assert all(id_.endswith("h0.8") and "zero pivot" in reason for id_, reason in summary.failed.items())


def test_a_case_that_does_not_converge_ends_with_status_3_and_is_kept(tmp_path):
    sweep = load_sweep(sweep_file(tmp_path, SMALL.format(limit=30)))
    summary = quietly(sweep, tmp_path / "out")
    assert summary.exit_status == 3
    assert 0 < len(summary.not_converged) < 8
    assert "max_iterations = 30" in next(iter(summary.not_converged.values()))
    again = quietly(sweep, tmp_path / "out")
    assert (again.computed, again.reused, again.exit_status) == (0, 8, 3)


def test_leftovers_of_a_killed_run_are_removed(small, tmp_path):
    (tmp_path / "cases").mkdir()
    leftovers = [tmp_path / "cases" / ".a.h5.x7.tmp", tmp_path / ".results.h5.collected.tmp", tmp_path / ".running"]
    leftovers[0].write_text("")
    leftovers[1].write_text("")
    leftovers[2].mkdir()
    (leftovers[2] / "claim-0").write_text("")
    assert quietly(small, tmp_path).computed == 8
    assert not any(path.exists() for path in leftovers)


def test_two_sweeps_do_not_share_a_folder(small, tmp_path, monkeypatch):
    monkeypatch.setattr(sweep_folder, "LOCK_PATIENCE", 0.2)
    folder = SweepFolder(tmp_path)
    folder.open()
    with pytest.raises(InputError, match="another sweep"):
        quietly(small, tmp_path)
    folder.close()
    assert quietly(small, tmp_path).computed == 8
    with open(tmp_path / ".lock") as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


def test_a_folder_that_cannot_be_made(small, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file/out"):
        quietly(small, tmp_path / "file" / "out")


# -- command line ---------------------------------------------------------------------------------------------------


def command(*words: str, cwd: Path) -> subprocess.CompletedProcess:
    root = Path(__file__).parents[2]
    return subprocess.run([sys.executable, "-m", "petcontact", "sweep", *words], cwd=cwd, capture_output=True, text=True,
                          timeout=120, env={**os.environ, "PYTHONPATH": str(root)})  # fmt: skip


def test_the_command_lists_computes_and_says_what_it_did(tmp_path):
    sweep_file(tmp_path, SMALL.format(limit=1000))
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
    bad = command("small.toml", "--only", "nothing", cwd=tmp_path)
    assert (bad.returncode, bad.stderr.count("\n")) == (2, 1)
    assert command("small.toml", "--ranks-per-case", "2", cwd=tmp_path).returncode == 2


def test_results_that_do_not_fit_the_disk_end_in_one_line_and_lose_no_case(small, tmp_path):
    """A limit on the size of a file stands for a full disk: the cases fit it, what collects them does not."""
    program = (
        "import resource, sys\nfrom petcontact.commands import main as cli\n"
        "from petcontact.runtime.petsc import initialise\n"
        "initialise()\nresource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n"
        "sys.argv[0] = 'petcontact'\ncli.entry()\n"
    )
    words = [sys.executable, "-c", program, "sweep", str(tmp_path / "small.toml"), "-o", str(tmp_path / "out")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("petcontact:")]
    assert "results.h5: cannot be written (File too large); the finished cases are whole" in line
    kept = stamps(tmp_path / "out")
    assert kept and all(read_solution(tmp_path / "out" / "cases" / name).converged for name in kept)
    assert not (tmp_path / "out" / "results.h5").exists() and not list((tmp_path / "out").glob("*.tmp"))
    again = quietly(small, tmp_path / "out")
    assert (again.computed, again.reused, again.exit_status) == (8 - len(kept), len(kept), 0)
