"""Faults of one rank end the whole job within seconds, in one line that names them; nothing
hangs."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import h5py
import pytest
from problems import block, load_step

sys.path.insert(0, str(Path(__file__).parent))
import launch

pytestmark = pytest.mark.mpi

CONFIG = str(Path(__file__).parents[2] / "configs" / "example1.toml")
COARSE = "element_size = 0.5, order = 1"
SOON = 120.0  # seconds: only a job that hangs takes so long, however loaded the machine is

# one rank fails in the middle of the iteration, while the others wait for it in a reduction
ONE_RANK = """
import os, signal, sys
from petcontact.commands import main as cli
from petcontact.runtime.petsc import petsc
from petcontact.commands import solve
def fail(state, tolerance):
    if len(state.history) == 4 and petsc().COMM_WORLD.getRank() == {rank}:
        {fault}
    return ""
solve.iteration_line = fail
sys.argv[0] = "petcontact"
cli.entry()
"""


def solve(folder, *words, program=("-m", "petcontact"), ranks=2):
    began = time.monotonic()
    given = "solve", CONFIG, "--set", "mesh.element_size=0.5", "--no-figures"
    output = "-o", str(folder / "r.h5")
    done = launch.run(ranks, *program, *given, *output, *words, timeout=SOON, cwd=folder)
    assert time.monotonic() - began < SOON
    assert "Traceback" not in done.stderr, done.stderr
    return done, [line for line in done.stderr.splitlines() if line.startswith("petcontact:")]


def test_a_rank_that_fails_alone_ends_the_job(tmp_path):
    fault = "raise ValueError('broken here')"
    done, lines = solve(tmp_path, program=("-c", ONE_RANK.format(rank=1, fault=fault)))
    assert done.returncode != 0
    told = "petcontact: rank 1: ValueError: broken here"
    assert any(line.startswith(told) for line in lines), done.stderr
    assert os.listdir(tmp_path) == []


def test_a_rank_that_is_killed_ends_the_job(tmp_path):
    done, _ = solve(
        tmp_path, program=("-c", ONE_RANK.format(rank=1, fault="os.kill(os.getpid(), 9)"))
    )
    assert done.returncode != 0 and os.listdir(tmp_path) == []


def test_a_mistake_that_all_ranks_see_is_told_once(tmp_path):
    done, lines = solve(
        tmp_path, *["-ksp_type", "richardson", "-pc_type", "none", "-ksp_max_it", "2"]
    )
    assert done.returncode in (1, 2) and len(lines) == 1, done.stderr
    assert "KSP richardson ended with DIVERGED_" in lines[0]


def test_a_result_that_cannot_be_written_ends_the_job(tmp_path):
    """Only rank 0 writes, and only rank 0 fails."""
    (tmp_path / "out").mkdir()
    program = ONE_RANK.format(rank=0, fault="os.rmdir('out')")
    done, lines = solve(tmp_path, "-o", "out/r.h5", program=("-c", program))
    assert done.returncode != 0 and any("out/r.h5: cannot be written" in line for line in lines), (
        done.stderr
    )
    assert os.listdir(tmp_path) == []


# a file of each rank says that it iterates: output without end would fill the pipe that Open MPI
# stops reading once it gets a signal, and lines of two ranks may run into one another
ITERATING = """
import pathlib, sys
from petcontact.commands import main as cli
from petcontact.runtime.petsc import petsc
from petcontact.commands import solve
def told(state, tolerance):
    if len(state.history) == 4:
        pathlib.Path(f"iterating-{petsc().COMM_WORLD.getRank()}").touch()
    return ""
solve.iteration_line = told
sys.argv[0] = "petcontact"
cli.entry()
"""
FOREVER = [
    word
    for key in ("rule=fixed", "rho=1e-6", "max_iterations=1000000000", "tolerance=1e-15")
    for word in ("--set", f"method.{key}")
]


def test_a_signal_to_mpiexec_keeps_the_last_iterate(tmp_path, monkeypatch):
    # Open MPI kills what has not ended one second after the signal: too soon for a loaded machine
    monkeypatch.setenv("OMPI_MCA_odls_base_sigkill_timeout", "3")
    words = "--set", "mesh.element_size=0.5", "--no-figures", *FOREVER, "-o", "r.h5"
    job = launch.start(2, "-c", ITERATING, "solve", CONFIG, *words, cwd=tmp_path)
    try:
        deadline = time.monotonic() + SOON
        while len(list(tmp_path.glob("iterating-*"))) < 2:
            assert time.monotonic() < deadline and job.poll() is None
            time.sleep(0.01)
        job.terminate()
        _, err = job.communicate(timeout=SOON)
    finally:
        if job.poll() is None:
            launch.kill(job)
    assert job.returncode == 128 + signal.SIGTERM
    # Open MPI's mpiexec may stop forwarding output once it is told to end: what counts is the file
    assert "Traceback" not in err, err
    assert all(
        "the last iterate is saved in r.h5" in line
        for line in err.splitlines()
        if "interrupted" in line
    ), err
    with h5py.File(tmp_path / "r.h5") as file:
        assert file.attrs["status"] == "failed" and "interrupted by SIG" in file.attrs["reason"]
        assert len(file["history/rho"]) == file.attrs["iterations"] > 0


def test_a_signal_to_one_rank_ends_all_of_them(tmp_path):
    done, lines = solve(
        tmp_path,
        program=("-c", ONE_RANK.format(rank=1, fault="os.kill(os.getpid(), signal.SIGTERM)")),
    )
    assert done.returncode != 0
    assert any("interrupted by SIGTERM; the last iterate is saved" in line for line in lines), (
        done.stderr
    )
    with h5py.File(tmp_path / "r.h5") as file:
        assert file.attrs["reason"] == "interrupted by SIGTERM"
        assert file.attrs["iterations"] in (4, 5)


# two blocks on H-matrices, of which the second step frees what the first one held; a signal reaches
# rank 1 in one build
IN_A_BUILD = """
import os, signal, sys
from petcontact.commands import main as cli
from petcontact.compliance.hierarchical import rows
from petcontact.runtime.petsc import petsc
class Signalled(rows.HMatrix):
    count = 0
    def __init__(self, *words, progress, **keys):
        Signalled.count += 1
        if Signalled.count == 3 and petsc().COMM_WORLD.getRank() == 1:
            os.kill(os.getpid(), signal.SIGTERM)
            progress(0.1)
            raise AssertionError("the signal waits")
        super().__init__(*words, progress=progress, **keys)
rows.HMatrix = Signalled
sys.argv[0] = "petcontact"
cli.entry()
"""
LET_GO = (
    block("lower", [0, 0, 0], [1, 1, 1], mesh=COARSE, bottom=[0.0, 0.0, 0.0])
    + block("upper", [0, 0, 1], [1, 1, 2], mesh=COARSE, top=[0.0, 0.0, -0.02])
    + """[[contact]]
name = "pair"
secondary = "upper.bottom"
primary = "lower.top"
"""
    + load_step("press")
    + load_step("let go", upper={"top": ["free", 0.0, -0.02]})
    + '[bem]\nmat_type = "hmatrix"\n'
)


def test_a_signal_to_one_rank_inside_a_build_ends_it_on_all_and_keeps_the_steps_before(tmp_path):
    """In the third build, which is that of the second step."""
    (tmp_path / "blocks.toml").write_text(LET_GO)
    words = ("solve", "blocks.toml", "--no-figures", "-o", "r.h5")
    done = launch.run(2, "-c", IN_A_BUILD, *words, timeout=SOON, cwd=tmp_path)
    assert done.returncode != 0 and "Traceback" not in done.stderr, done.stderr
    assert "SIGTERM" in done.stderr, done.stderr
    with h5py.File(tmp_path / "r.h5") as file:
        assert file.attrs["status"] == "failed"
        assert file.attrs["reason"] == "interrupted by SIGTERM"
        assert list(file["steps"]) == ["1"]
