"""Sweeps over ranks: shared out, killed at any moment, resumed; failing cases and failing ranks."""

from __future__ import annotations

import contextlib
import os
import pty
import random
import re
import signal
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import launch

from petcontact.results.hdf5 import read_solution

pytestmark = pytest.mark.mpi
CONFIGS = Path(__file__).parents[2] / "configs"
TABLES = str(CONFIGS / "tables.toml")
KILLS = 20
TOTAL = 280
WAIT = 60.0
RHOS = [float(f"{10.0 ** (k / 10):.4g}") for k in range(70)]


def sweep(ranks, *words, **keywords):
    return launch.run(ranks, "-m", "petcontact", "sweep", *map(str, words), **keywords)


def counts(job) -> tuple[int, int, int]:
    """Computed, reused, failed."""
    found = re.search(r"computed (\d+), reused (\d+), failed (\d+)", job.stdout)
    assert found, job.stdout + job.stderr
    return tuple(map(int, found.groups()))


def cases(folder) -> list[Path]:
    return sorted((folder / "cases").glob("*.h5"))


def write_sweep(folder, text) -> Path:
    (folder / "example1.toml").write_text((CONFIGS / "example1.toml").read_text())
    path = folder / "sweep.toml"
    path.write_text('problems = ["example1.toml"]\n' + text)
    return path


def test_two_ranks_share_the_work_and_find_what_one_finds(tmp_path):
    path = write_sweep(tmp_path, "[cross]\nrho = [1.0, 1e2, 1e4]\nelement_size = [0.8, 0.4, 0.2]\n")
    for ranks in (1, 2):
        done = sweep(ranks, path, "-o", tmp_path / str(ranks))
        assert done.returncode == 0, done.stderr
        assert counts(done) == (9, 0, 0)
        assert done.stdout.count("9 cases") == 1
    for one, two in zip(cases(tmp_path / "1"), cases(tmp_path / "2"), strict=True):
        a, b = read_solution(one), read_solution(two)
        assert one.name == two.name
        assert a.iterations == b.iterations
        np.testing.assert_array_equal(a.contact.u_t, b.contact.u_t)
    with h5py.File(tmp_path / "2" / "results.h5") as results:
        assert len([name for name in results if not name.startswith(".")]) == 9


# -- killed and resumed ---------------------------------------------------------------------------------------------


def descendants(process: int) -> list[int]:
    """Children of a process, their children, and so on."""
    parents = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError):
                parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
    found, queue = [], [process]
    while queue:
        parent = queue.pop()
        children = [child for child, above in parents.items() if above == parent]
        found += children
        queue += children
    return found


def ranks_of(job) -> list[int]:
    """Processes of the job that run petcontact."""
    found = []
    for process in descendants(job.pid):
        with contextlib.suppress(OSError):
            if b"petcontact" in Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0"):
                found.append(process)
    return sorted(found)


def kill(job, whom: str) -> None:
    everybody = [job.pid, *descendants(job.pid)]
    ranks = ranks_of(job)
    assert len(ranks) == 2
    victims = {"launcher": [job.pid], "job": everybody, "first rank": ranks[:1], "last rank": ranks[1:]}[whom]
    for process in victims:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    job.communicate(timeout=WAIT)
    deadline = time.monotonic() + WAIT
    while any(alive(process) for process in everybody):
        assert time.monotonic() < deadline, f"ranks live on after the {whom} was killed"
        time.sleep(0.02)


def alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def finished(folder) -> int:
    """Number of case files, cheaply."""
    try:
        return sum(name.endswith(".h5") for name in os.listdir(folder / "cases"))
    except FileNotFoundError:
        return 0


def until(condition, job) -> None:
    deadline = time.monotonic() + WAIT
    while not condition():
        assert time.monotonic() < deadline
        if job.poll() is not None:
            return
        time.sleep(0.005)


def test_killed_at_random_moments_nothing_is_lost_or_computed_again(tmp_path, monkeypatch):
    # Open MPI waits a second or two before it kills what a dead rank leaves behind; here the worst is wanted
    monkeypatch.setenv("OMPI_MCA_odls_base_sigkill_timeout", "0")
    chance = random.Random(2019)
    crossed = f'rule = ["self-adaptive", "modified"]\nrho = {RHOS}\nelement_size = [0.1, 0.05]\n'
    path = write_sweep(tmp_path, f"[cross]\n{crossed}")
    folder, kills, rounds = tmp_path / "0", 0, 0
    seen: dict[str, int] = {}
    while kills < KILLS:
        job = launch.start(2, "-m", "petcontact", "sweep", str(path), "-o", str(folder))
        target = len(seen) + chance.randint(0, 7)
        until(lambda goal=target, at=folder: finished(at) >= goal and any((at / ".running").glob("claim-*")), job)
        time.sleep(chance.uniform(0.0, 0.03))
        reported = {path.name: path.stat().st_mtime_ns for path in cases(folder)}
        if job.poll() is None and len(ranks_of(job)) == 2:
            # the ranks outlive their launcher for a second, and the folder is theirs as long
            kill(job, ("first rank", "last rank", "job", "job", "launcher")[kills % 5])
            kills += 1
        else:
            job.communicate(timeout=WAIT)
        after = {path.name: path.stat().st_mtime_ns for path in cases(folder)}
        for earlier in (seen, reported):
            assert {name: after.get(name) for name in earlier} == earlier
        for result in cases(folder):
            with h5py.File(result) as file:
                assert file.attrs["status"] == "converged"
        seen = after
        if len(seen) == TOTAL:
            finish(path, folder, seen)
            rounds += 1
            folder, seen = tmp_path / str(rounds), {}
    finish(path, folder, seen)


def finish(config: Path, folder: Path, seen: dict[str, int]) -> None:
    """Resume a last time: what was there is reused, the rest computed, all of it readable."""
    done = sweep(2, config, "-o", folder)
    assert done.returncode == 0, done.stderr
    assert counts(done) == (TOTAL - len(seen), len(seen), 0)
    assert {path.name: path.stat().st_mtime_ns for path in cases(folder) if path.name in seen} == seen
    with h5py.File(folder / "results.h5") as results:
        for path in cases(folder):
            assert read_solution(path).converged
            assert results[path.stem].attrs["status"] == "converged"
    assert [path.name for path in folder.rglob("*.tmp")] == []


def test_sigterm_ends_the_job_and_keeps_what_is_finished(tmp_path):
    crossed = f'rho = {RHOS}\nelement_size = [0.1, 0.05]\n"method.tau" = [1.0, 1.5, 2.0, 2.5]\n'
    path = write_sweep(tmp_path, f"[cross]\n{crossed}")
    job = launch.start(2, "-m", "petcontact", "sweep", str(path), "-o", str(tmp_path / "out"))
    until(lambda: finished(tmp_path / "out") >= 10, job)
    job.terminate()
    job.communicate(timeout=WAIT)
    assert job.returncode != 0
    kept = len(cases(tmp_path / "out"))
    assert 10 <= kept < 560
    done = sweep(2, path, "-o", tmp_path / "out", "--only", "*")
    assert counts(done) == (560 - kept, kept, 0)


# -- failing cases and ranks ----------------------------------------------------------------------------------------


FAILING = """
[cross]
rho = [1.0, 1e2]
element_size = [0.8, 0.4]
[[variant]]
name = "good"
[[variant]]
name = "bad"
"petsc.ksp_type" = "gmres"
"petsc.ksp_max_it" = 1
"petsc.pc_type" = "none"
"""
DIVERGED = re.compile("KSP gmres ended with DIVERGED_(ITS|MAX_IT)")


@pytest.mark.parametrize("team", [1, 2])
def test_cases_that_fail_are_recorded_and_the_rest_goes_on(tmp_path, team):
    path = write_sweep(tmp_path, FAILING)
    for computed, reused in ((8, 0), (4, 4)):
        done = sweep(2, path, "-o", tmp_path / "out", "--ranks-per-case", team)
        assert done.returncode == 1, done.stderr
        assert counts(done) == (computed, reused, 4)
        assert len(DIVERGED.findall(done.stdout)) == 4
    for file in cases(tmp_path / "out"):
        with h5py.File(file) as result:
            assert result.attrs["status"] == ("failed" if "-bad-" in file.name else "converged")
            assert (DIVERGED.search(result.attrs["reason"]) is not None) == ("-bad-" in file.name)


RAISING = """
import sys
from petcontact.commands import main as cli
from petcontact.sweep import run as sweep
from petcontact.pipeline import run as pipeline
from petcontact.errors import OutputError
where, *arguments = sys.argv[1:]
from petcontact.runtime.petsc import petsc
rank, calls = petsc().COMM_WORLD.getRank(), []

def on_the_last_rank(function, error):
    def replaced(*arguments):
        calls.append(None)
        if rank == 1 and len(calls) == 2:
            raise error
        return function(*arguments)
    return replaced

if where == "write":
    sweep.write_solution = on_the_last_rank(sweep.write_solution, OutputError("case.h5: cannot be written (disk full)"))
else:
    pipeline.run = on_the_last_rank(pipeline.run, ZeroDivisionError("a defect"))
sys.exit(cli.main(["sweep", *arguments]))
"""


def raising(where, *words):
    began = time.monotonic()
    done = launch.run(2, "-c", RAISING, where, *map(str, words), timeout=WAIT)
    return done, time.monotonic() - began


def test_a_rank_that_cannot_write_ends_the_job(tmp_path):
    done, _ = raising("write", TABLES, "-o", tmp_path)
    assert done.returncode != 0
    assert "rank 1: case.h5: cannot be written (disk full)" in done.stderr
    assert 0 < len(cases(tmp_path)) < 128
    assert all(read_solution(path).converged for path in cases(tmp_path))


def test_a_rank_that_raises_in_a_case_records_it_and_goes_on(tmp_path):
    path = write_sweep(tmp_path, "[cross]\nrho = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5]\nelement_size = [0.1, 0.05]\n")
    done, _ = raising("run", path, "-o", tmp_path / "out")
    assert done.returncode == 1
    assert counts(done) == (12, 0, 1)
    assert "ZeroDivisionError: a defect" in done.stdout
    again = sweep(2, path, "-o", tmp_path / "out")
    assert (again.returncode, counts(again)) == (0, (1, 11, 0))


def test_a_rank_that_leaves_its_team_in_the_middle_of_a_solve_ends_the_job(tmp_path):
    path = write_sweep(tmp_path, "[cross]\nrho = [1.0, 1e1, 1e2, 1e3]\nelement_size = [0.4]\n")
    done, seconds = raising("run", path, "-o", tmp_path / "out", "--ranks-per-case", "2")
    assert done.returncode != 0
    assert "failed alone: ZeroDivisionError: a defect" in done.stderr
    assert seconds < 40.0
    assert len(cases(tmp_path / "out")) == 1


def test_bad_input_is_said_once(tmp_path):
    path = write_sweep(tmp_path, "[cross]\nrho = [-1.0]\n")
    for words in ((path,), (TABLES, "--only", "nothing"), (TABLES, "--ranks-per-case", "3")):
        done = sweep(2, *words, "-o", tmp_path / "out")
        assert done.returncode == 2
        assert done.stderr.count("petcontact: ") == 1
    assert not (tmp_path / "out").exists()


# -- teams and terminals --------------------------------------------------------------------------------------------


GMRES = ("-ksp_type", "gmres", "-pc_type", "jacobi", "-ksp_rtol", "1e-12")


@pytest.mark.parametrize("options", [(), GMRES], ids=["LU", "GMRES"])
def test_two_ranks_solve_a_case_together(tmp_path, options):
    path = write_sweep(tmp_path, "[cross]\nrho = [1.0, 1e3]\nelement_size = [0.4, 0.2]\ntolerance = [1e-10]\n")
    alone = sweep(1, path, "-o", tmp_path / "alone")
    done = sweep(4, path, "-o", tmp_path / "teams", "--ranks-per-case", 2, *options)
    assert (alone.returncode, done.returncode) == (0, 0), done.stderr
    assert counts(done) == (4, 0, 0)
    assert "2 teams of 2 ranks each" in done.stdout
    for one, two in zip(cases(tmp_path / "alone"), cases(tmp_path / "teams"), strict=True):
        a, b = read_solution(one), read_solution(two)
        assert b.info["ranks"] == 2
        np.testing.assert_allclose(b.contact.u_t, a.contact.u_t, atol=1e-7 * np.abs(a.contact.u_t).max())


def test_progress_is_shown_on_a_terminal_and_only_there(tmp_path):
    controller, terminal = pty.openpty()
    job = launch.start(2, "-m", "petcontact", "sweep", TABLES, "-o", str(tmp_path / "seen"), stderr=terminal)
    os.close(terminal)
    shown = b""
    # the other end of a terminal that everybody has closed is an input/output error
    with contextlib.suppress(OSError):
        while part := os.read(controller, 4096):
            shown += part
    job.communicate(timeout=WAIT)
    os.close(controller)
    assert job.returncode == 0
    assert re.search(rb"\r\d+ of 128 cases done, \d running, 0 failed", shown)
    piped = sweep(2, TABLES, "-o", tmp_path / "piped")
    assert "\r" not in piped.stdout + piped.stderr
    assert "cases done" not in piped.stdout + piped.stderr
