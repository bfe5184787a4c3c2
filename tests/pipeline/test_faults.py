"""Signals, kills, lack of memory and failing mathematics: nothing hangs, nothing finished is lost,
nothing is misjudged."""

from __future__ import annotations

import itertools
import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

import forked
import numpy as np
import pytest
from examples import example
from problems import block, contact_pair, load_step

from petcontact import (
    MeshOptions,
    SolverError,
    load,
    read_result,
    solve,
    write_solution,
)
from petcontact.commands import progress
from petcontact.commands.main import main
from petcontact.compliance.body.dense import DenseRows
from petcontact.contact.active_set import pivots as newton
from petcontact.pipeline.adapt import level_solver
from petcontact.pipeline.run import prepare, run
from petcontact.pipeline.steps import path as paths
from petcontact.pipeline.steps import step_loop
from petcontact.results import data
from petcontact.results import solution as solutions
from petcontact.runtime.signals import Interrupted, deferred, install

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

CONFIGS = Path(__file__).parents[2] / "configs"
SIZE = "mesh.element_size=0.5"
COARSE = MeshOptions(element_size=0.5)
# ρ far too small and fixed: hundreds of thousands of iterations
ENDLESS = f"""--set {SIZE} --set method.rule=fixed --set method.rho=1e-6
--set method.max_iterations=1000000000 --set method.tolerance=1e-15 --no-figures -ksp_monitor""".split()


def start(folder, *words, program=(), **keywords):
    (folder / "case.toml").write_text((CONFIGS / "example1.toml").read_text())
    return subprocess.Popen(
        [*(program or [forked.program()]), "solve", "case.toml", *words],
        cwd=folder,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        **keywords,
    )


def wait_for_iterations(job):
    """Until a dozen Robin solves have been seen (`-ksp_monitor` prints two lines for each)."""
    norms = (line for line in job.stdout if "KSP Residual norm" in line)
    assert len(list(itertools.islice(norms, 24))) == 24, job.stderr.read()


# --- signals
# --------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGHUP, 129)])
def test_a_signal_keeps_the_last_iterate(tmp_path, number, status):
    # tests that run under nohup hand on that hang-ups are ignored, as they then are
    job = start(tmp_path, *ENDLESS, preexec_fn=lambda: signal.signal(number, signal.SIG_DFL))
    wait_for_iterations(job)
    job.send_signal(number)
    out, err = job.communicate(timeout=300)
    assert job.returncode == status, err
    assert f"interrupted by {number.name}; the last iterate is saved in case.h5" in err
    assert err.count("interrupted") == 1
    assert f"interrupted by {number.name}" in out
    solution = read_result(tmp_path / "case.h5")
    assert solution.status == "failed" and solution.iterations > 0
    assert np.all(np.isfinite(solution.u))
    assert sorted(os.listdir(tmp_path)) == ["case.h5", "case.toml"]


def test_a_signal_during_a_write_waits_for_it(tmp_path, comm):
    solution = solve(example(1, mesh=COARSE), comm=comm)
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    install()
    try:
        with pytest.raises(Interrupted, match="SIGTERM") as caught, deferred():
            os.kill(os.getpid(), signal.SIGTERM)
            write_solution(tmp_path / "r.h5", solution)
    finally:
        for number, handler in zip((signal.SIGINT, signal.SIGTERM), before, strict=True):
            signal.signal(number, handler)
    assert caught.value.exit_status == 143
    assert read_result(tmp_path / "r.h5").converged


def test_an_interrupt_goes_through_and_a_stop_is_kept(comm):
    """A sweep must not take an interrupted case for a finished one."""

    def interrupt(state):
        if len(state.history) == 3:
            raise Interrupted(signal.SIGTERM)

    prepared = prepare(example(1, mesh=COARSE), comm)
    try:
        with pytest.raises(Interrupted):
            run(prepared, monitor=interrupt)
        solution = run(prepared, monitor=lambda state: "enough" * (len(state.history) == 3))
    finally:
        prepared.close()
    assert (solution.status, solution.reason, solution.iterations) == ("failed", "enough", 3)


BLOCKS = (
    block("upper", [0.5, 1], [1.5, 2], 100.0, top=[0.0, -0.01])
    + block("lower", [0, 0], [2, 1], 100.0, bottom=[0.0, 0.0])
    + contact_pair("pair", "upper.bottom", "lower.top", 0.3)
    + load_step(increments=2)
)


def signals(monkeypatch, module, where, before=lambda: True, ends=False):
    """SIGTERM when a function is called, if `before` says so; what `ends` with it does not return."""
    original = getattr(module, where)

    def signalled(*words, **keys):
        if before():
            os.kill(os.getpid(), signal.SIGTERM)
            assert not ends, "the signal waits"
        return original(*words, **keys)

    monkeypatch.setattr(module, where, signalled)


def interrupted(folder, monkeypatch, capsys, config, *words):
    """The result of a solve that a signal ends, and what is said of it."""
    monkeypatch.chdir(folder)
    settings = [word for setting in words for word in ("--set", setting)]
    assert main(["solve", str(config), "-o", "r.h5", "--no-figures", *settings]) == 143
    return read_result("r.h5"), capsys.readouterr().err


@pytest.mark.parametrize(("module", "where"), [(step_loop, "step_result"), (solutions, "verdict")])
def test_a_signal_after_the_iteration_keeps_the_solution(
    tmp_path, monkeypatch, capsys, module, where
):
    """Numbers that it left are computed by a reader: they take seconds, and Open MPI kills what has
    not ended one second after the signal."""
    with monkeypatch.context() as patch:
        signals(patch, module, where)
        if module is step_loop:
            patch.setattr(data, "with_errors", lambda _: pytest.fail("numbers"))
        kept, said = interrupted(tmp_path, patch, capsys, CONFIGS / "example1.toml", SIZE)
    assert "interrupted by SIGTERM; the solution is saved in r.h5" in said
    assert kept.converged and kept.numbers


def test_a_signal_breaks_off_another_path(tmp_path, monkeypatch, capsys):
    """Of which nothing is kept: the solution is there, and its error of the path is not known."""
    signals(monkeypatch, paths, "increments", ends=True)
    coarse = [f"body.{b}.mesh={{element_size=0.5}}" for b in (0, 1)]
    few = [f"step.{k}.increments=2" for k in (2, 3)]
    config = CONFIGS / "fretting.toml"
    kept, said = interrupted(tmp_path, monkeypatch, capsys, config, *coarse, *few)
    assert "interrupted by SIGTERM; the solution is saved in r.h5" in said and kept.converged
    assert any("before the error of the path was known" in text for text in kept.warnings)


def test_an_error_without_an_iterate_keeps_the_increments_before_it(monkeypatch):
    original, made = step_loop.with_wear, []

    def failing(*words, **keys):
        if len(made) == 3:
            raise SolverError("iterate", "nothing to keep", "try again")
        made.append(original(*words, **keys))
        return made[-1]

    monkeypatch.setattr(step_loop, "with_wear", failing)
    coarse = {f"body.{b}.mesh": {"element_size": 0.5} for b in (0, 1)}
    solution = solve(load(CONFIGS / "fretting.toml", coarse))
    assert solution.status == "failed" and "nothing to keep" in solution.reason
    assert [step.load_factor for step in solution.steps] == [1.0, 0.25, 0.5]


def test_a_signal_in_the_elimination_of_a_later_step_keeps_the_steps_before(
    tmp_path, monkeypatch, capsys
):
    """At once: what is built has nothing to keep."""
    signals(monkeypatch, step_loop, "eliminated", ends=True)
    # the second step frees what the first one held
    steps = load_step("press") + load_step("let go", upper={"top": ["free", -0.02]})
    (tmp_path / "stack.toml").write_text(BLOCKS[: BLOCKS.index("[[step]]")] + steps)
    coarse = [f"body.{b}.mesh={{element_size=0.5}}" for b in (0, 1)]
    kept, said = interrupted(tmp_path, monkeypatch, capsys, "stack.toml", *coarse)
    assert "the last iterate is saved in r.h5" in said
    assert kept.status == "failed" and [step.name for step in kept.steps] == ["press"]


@pytest.mark.parametrize(
    ("where", "level", "asked"),
    [
        ("elimination", 2, []),
        ("iteration", 3, [f"body.{b}.mesh.accuracy=1e-5" for b in (0, 1)]),
    ],
)
def test_a_signal_in_an_adaptive_solve_keeps_the_mesh_before(
    tmp_path, monkeypatch, capsys, where, level, asked
):
    """At once in an elimination, which may take long, and after the iteration under way: all steps
    of the mesh before."""
    made = []

    def begins():
        made.append(1)
        return where == "elimination" and len(made) == level

    signals(monkeypatch, level_solver, "prepare", begins, ends=True)
    if where == "iteration":
        signals(monkeypatch, newton, "linear_solve", lambda: len(made) == level)
    (tmp_path / "stack.toml").write_text(BLOCKS)
    kept, said = interrupted(tmp_path, monkeypatch, capsys, "stack.toml", *asked)
    assert "interrupted by SIGTERM; the solution is saved in r.h5" in said
    assert kept.status == "not converged" and "interrupted by SIGTERM" in kept.reason
    assert kept.reason.endswith("(on the mesh after the last)")
    assert len(kept.steps) == 2 and all(step.status == "converged" for step in kept.steps)
    assert len(made) == level


def test_kill_9_of_a_solve_leaves_the_old_result(tmp_path, comm):
    write_solution(tmp_path / "case.h5", solve(example(2, mesh=COARSE), comm=comm))
    before = (tmp_path / "case.h5").read_bytes()
    job = start(tmp_path, *ENDLESS, "--force")
    wait_for_iterations(job)
    job.kill()
    job.communicate(timeout=300)
    assert (tmp_path / "case.h5").read_bytes() == before
    assert sorted(os.listdir(tmp_path)) == ["case.h5", "case.toml"]


# --- memory
# --------------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_too_little_memory_is_one_line(tmp_path):
    job = start(
        tmp_path,
        *("--set", "mesh.element_size=0.002", "--set", "bem.mat_type=dense"),
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (2_000_000_000, 2_000_000_000)),
        program=[sys.executable, "-m", "petcontact"],
    )
    _, err = job.communicate(timeout=300)
    assert job.returncode == 1 and "out of memory" in err and "-bem_mat_type hodlr" in err
    # the size is announced first
    assert err.count("\n") == 2
    assert err.startswith("petcontact: 12000 nodes, 24000 unknowns, about ")
    assert sorted(os.listdir(tmp_path)) == ["case.toml"]


# --- failing mathematics
# -------------------------------------------------------------------------------------------
def spoilt(monkeypatch, spoil):
    """Both formulations get an elastic matrix that `spoil` has changed."""
    original = DenseRows.__init__

    def assemble(self, *words):
        original(self, *words)
        spoil(self.system.T)

    monkeypatch.setattr(DenseRows, "__init__", assemble)


def nan(matrix):
    matrix[3, 5] = np.nan


def singular(matrix):
    matrix[:, 4] = 0.0


@pytest.mark.parametrize(("formulation", "spoil"), [("condensed", nan), ("full", singular)])
def test_a_spoilt_operator_is_named_and_never_converged(monkeypatch, comm, formulation, spoil):
    spoilt(monkeypatch, spoil)
    with pytest.raises(
        SolverError, match=r"^(factor|iterate): .*(not finite|zero pivot|DIVERGED|singular)"
    ) as caught:
        solve(example(1, mesh=COARSE, formulation=formulation), comm=comm)
    assert caught.value.advice and "\n" not in str(caught.value)


def test_a_slightly_wrong_operator_is_found_by_the_elastic_residual(monkeypatch, comm):
    def off(matrix):
        matrix[7, 7] *= 1.0 + 1e-4

    spoilt(monkeypatch, off)
    solution = solve(example(1, mesh=COARSE), comm=comm)
    assert solution.status == "failed" and solution.reason.startswith("check: elastic residual")
    assert solution.last.residuals["elastic"] > 1e-7


def test_a_ksp_that_fails_half_way_keeps_what_there_is(comm, tmp_path):
    options = {"ksp_type": "gmres", "pc_type": "none", "ksp_max_it": 6}
    solution = solve(
        example(1, mesh=MeshOptions(element_size=0.2), rho=1e-3), comm=comm, petsc_options=options
    )
    assert solution.status == "failed" and "KSP gmres ended with DIVERGED_" in solution.reason
    assert "try -ksp_type preonly" in solution.reason and solution.iterations > 5
    write_solution(tmp_path / "r.h5", solution)
    again = read_result(tmp_path / "r.h5")
    assert again.reason == solution.reason and len(again.last.history.rho) == solution.iterations


@pytest.mark.parametrize("value", [np.nan, 0.0, None, "far", 1j])
def test_a_rule_that_gives_no_positive_number(comm, value):
    class Broken:
        def update(self, rho, balance):
            return value if balance < 1e4 else rho

    solution = solve(example(1, mesh=COARSE), rule=Broken(), comm=comm)
    assert solution.status == "failed" and "the rule gave" in solution.reason
    assert solution.iterations > 0


def test_a_killed_adaptive_solve_leaves_its_last_mesh(tmp_path, monkeypatch):
    """In the place of kill -9, after which nothing is written either: an exit in the second mesh."""
    solved, count = level_solver.LevelSolver.solved, []

    def killed(*words):
        count.append(words)
        if len(count) == 2:
            raise SystemExit(9)
        return solved(*words)

    monkeypatch.setattr(level_solver.LevelSolver, "solved", killed)
    monkeypatch.setattr(progress, "SOON", 0.0)
    monkeypatch.chdir(tmp_path)
    words = ["solve", str(CONFIGS / "hertz.toml"), "--adapt", "--no-figures", "-o", "r.h5"]
    with pytest.raises(SystemExit):
        main(words)
    left = read_result("r.h5")
    assert left.status == "not converged"
    assert left.reason == "the adaptive solve was ended after mesh 1"
    assert left.pairs["top"].pressure.max() == pytest.approx(98.3, rel=0.05)  # 2P/(πa)
