"""Sweeps over ranks: shared out, killed at any moment, resumed; failing cases and failing ranks."""

from __future__ import annotations

import json
import random
import re
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from marks import slow
from sweep_files import CONFIGS

sys.path.insert(0, str(Path(__file__).parent))
import launch

from petcontact import load_case
from petcontact.sweep.store.case_table import read_case_table

pytestmark = pytest.mark.mpi
TABLES = str(CONFIGS / "tables.toml")
TOTAL = 280
WAIT = 120.0
RHOS = [float(f"{10.0 ** (k / 10):.4g}") for k in range(70)]


def sweep(ranks, *words, **keywords):
    return launch.run(ranks, "-m", "petcontact", "sweep", *map(str, words), **keywords)


def counts(job) -> tuple[int, int, int]:
    """Computed, reused, failed."""
    found = re.search(r"computed (\d+), reused (\d+), failed (\d+)", job.stdout)
    assert found, job.stdout + job.stderr
    return tuple(map(int, found.groups()))


def rows(folder) -> dict[str, dict]:
    """What is on the disk of a sweep, by id."""
    table = read_case_table(folder)
    found = zip(*(table.values(name) for name in table.names), strict=True)
    named = (dict(zip(table.names, row, strict=True)) for row in found)
    return {row["id"]: row for row in named if row["status"] != "missing"}


def same_numbers(a: dict[str, dict], b: dict[str, dict]) -> bool:
    """Whether two sweeps found the same, bit for bit, but for the seconds that it took."""
    one, two = (
        {id_: {**row, "iterate_seconds": 0} for id_, row in some.items()} for some in (a, b)
    )
    return one == two


def write_sweep(folder, text, keep="all") -> Path:
    (folder / "example1.toml").write_text((CONFIGS / "example1.toml").read_text())
    path = folder / "sweep.toml"
    path.write_text(f'problems = ["example1.toml"]\nkeep = "{keep}"\n' + text)
    return path


def test_two_ranks_share_the_work_and_find_what_one_finds(tmp_path):
    path = write_sweep(tmp_path, "[cross]\nrho = [1.0, 1e2, 1e4]\nelement_size = [0.8, 0.4, 0.2]\n")
    for ranks in (1, 2):
        done = sweep(ranks, path, "-o", tmp_path / str(ranks))
        assert done.returncode == 0, done.stderr
        assert counts(done) == (9, 0, 0)
        assert done.stdout.count("9 cases") == 1
        assert "\r" not in done.stdout + done.stderr  # progress is for terminals
        assert "cases done" not in done.stdout + done.stderr
    one, two = rows(tmp_path / "1"), rows(tmp_path / "2")
    assert len(one) == 9 and same_numbers(one, two)
    for id_ in one:
        a, b = load_case(tmp_path / "1", id_), load_case(tmp_path / "2", id_)
        np.testing.assert_array_equal(a.contact.u_t, b.contact.u_t)


# -- killed and resumed
# ---------------------------------------------------------------------------------------------


def finished(folder) -> int:
    """Number of records on the disk of a run that has not ended yet, cheaply."""
    return sum(path.read_bytes().count(b' {"digest": ') for path in (folder / "log").glob("*.log"))


def until(condition, job) -> None:
    deadline = time.monotonic() + WAIT
    while not condition():
        assert time.monotonic() < deadline
        if job.poll() is not None:
            return
        time.sleep(0.005)


OFTEN = """
import sys
from petcontact.commands import main as cli
from petcontact.sweep.store import log
log.LONGEST_WAIT = 0.05                 # many more moments at which something is half written
sys.exit(cli.main(sys.argv[2:]))
"""


@pytest.mark.parametrize("kills", [1, slow(20)])
def test_killed_at_random_moments_nothing_on_the_disk_is_lost_or_computed_again(tmp_path, kills):
    """What was there is reused, the rest computed, and all is what an uninterrupted run finds."""
    chance = random.Random(2019)
    crossed = f'rule = ["self-adaptive", "modified"]\nrho = {RHOS}\nelement_size = [0.1, 0.05]\n'
    path = write_sweep(tmp_path, f"[cross]\n{crossed}", keep="contact")
    assert sweep(2, path, "-o", tmp_path / "whole").returncode == 0
    whole, contact = rows(tmp_path / "whole"), read_case_table(tmp_path / "whole")
    folder, seen = tmp_path / "out", dict[str, dict]()
    for number in range(kills):
        # children of the launcher: killed with it they write no more
        words = "-c", OFTEN, "petcontact", "sweep", str(path), "-o", str(folder)
        job = launch.start(2, *words, children=True)
        target = max(finished(folder), TOTAL * (number + 1) // (kills + 1))
        until(lambda goal=target: finished(folder) >= goal, job)
        time.sleep(chance.uniform(0.0, 0.05))
        launch.kill(job)
        job.communicate(timeout=WAIT)
        after = rows(folder)
        assert {id_: after.get(id_) for id_ in seen} == seen
        assert all(row["status"] == "converged" for row in after.values())
        seen = after
    done = sweep(2, path, "-o", folder)
    assert done.returncode == 0, done.stderr
    assert counts(done) == (TOTAL - len(seen), len(seen), 0)
    found = rows(folder)
    assert {id_: found[id_] for id_ in seen} == seen
    assert same_numbers(found, whole)
    table = read_case_table(folder)
    for place in range(0, TOTAL, 17):
        mine, theirs = table.kept(place), contact.kept(place)
        assert all(np.array_equal(mine[name], theirs[name]) for name in theirs)
    assert not list(folder.rglob("*.tmp")) and not list(folder.glob(".run-*"))


# -- failing cases and ranks
# ----------------------------------------------------------------------------------------


RAISING = """
import sys
from petcontact.commands import main as cli
from petcontact.sweep.store import log
from petcontact.sweep import problems
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
    log.LONGEST_WAIT = 0.02
    log.Log._append = on_the_last_rank(log.Log._append, OSError(28, "disk full"))
else:
    problems.run = on_the_last_rank(problems.run, ZeroDivisionError("a defect"))
sys.exit(cli.main(["sweep", *arguments]))
"""


def raising(where, *words):
    return launch.run(2, "-c", RAISING, where, *map(str, words), timeout=WAIT)


def test_a_rank_that_cannot_write_ends_the_job(tmp_path):
    done = raising("write", TABLES, "-o", tmp_path)
    assert done.returncode != 0
    assert "cannot be written (disk full)" in done.stderr
    ended = rows(tmp_path)
    # once in about 50 runs the end of the job met a case, which counts as failed and is solved again
    kept = [id_ for id_, row in ended.items() if row["status"] != "failed"]
    assert 0 < len(kept) <= len(ended) < 128 and len(ended) - len(kept) <= 1, ended
    assert all(load_case(tmp_path, id_).converged for id_ in kept)


def test_a_rank_that_leaves_its_team_in_the_middle_of_a_solve_ends_the_job(tmp_path):
    path = write_sweep(tmp_path, "[cross]\nrho = [1.0, 1e1, 1e2, 1e3]\nelement_size = [0.4]\n")
    done = raising("run", path, "-o", tmp_path / "out", "--ranks-per-case", "2")
    assert done.returncode != 0
    assert "failed alone: ZeroDivisionError: a defect" in done.stderr
    assert len(rows(tmp_path / "out")) <= 1


def test_bad_input_is_said_once(tmp_path):
    path = str(write_sweep(tmp_path, "[cross]\nrho = [-1.0]\n"))
    faults = ((path,), (TABLES, "--only", "nothing"), (TABLES, "--ranks-per-case", "3"))
    commands = [("sweep", *words, "-o", str(tmp_path / "out")) for words in faults]
    commands += [("solve", str(CONFIGS / "example1.toml"), "--set", "method.rho=-1")]
    done = launch.run(2, "-c", launch.SERIES, json.dumps(commands))
    assert done.stdout.split() == ["ENDED", "2"] * 4
    lines = done.stderr.splitlines()
    assert sum(line.startswith("petcontact: ") for line in lines) == 4, done.stderr
    assert not (tmp_path / "out").exists()


# -- teams and terminals
# --------------------------------------------------------------------------------------------


SOLVERS = """
[[variant]]
name = "LU"
[[variant]]
name = "GMRES"
"petsc.ksp_type" = "gmres"
"petsc.pc_type" = "jacobi"
"petsc.ksp_rtol" = 1e-12
"""


def test_two_ranks_solve_a_case_together(tmp_path):
    path = write_sweep(
        tmp_path,
        f"[cross]\nrho = [1.0, 1e3]\nelement_size = [0.4]\ntolerance = [1e-10]\n{SOLVERS}",
    )
    alone = sweep(1, path, "-o", tmp_path / "alone")
    done = sweep(4, path, "-o", tmp_path / "teams", "--ranks-per-case", 2)
    assert (alone.returncode, done.returncode) == (0, 0), done.stderr
    assert counts(done) == (4, 0, 0)
    assert "2 teams of 2 ranks each" in done.stdout
    for id_ in rows(tmp_path / "alone"):
        a, b = load_case(tmp_path / "alone", id_), load_case(tmp_path / "teams", id_)
        assert b.provenance.ranks == 2
        np.testing.assert_allclose(
            b.contact.u_t, a.contact.u_t, atol=1e-7 * np.abs(a.contact.u_t).max()
        )
