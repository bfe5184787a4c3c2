"""Start a Python program under mpiexec with a hard timeout, with the launcher that belongs to this interpreter."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path


def mpiexec() -> str:
    """The launcher beside the interpreter (a wheel's MPICH), else the one on the PATH."""
    beside = Path(sys.executable).parent / "mpiexec"
    return str(beside) if beside.exists() else shutil.which("mpiexec") or "mpiexec"


def command(ranks: int, *words: str) -> list[str]:
    """mpiexec -n RANKS python WORDS; Open MPI is told that there may be more ranks than cores."""
    launcher = mpiexec()
    version = subprocess.run([launcher, "--version"], capture_output=True, text=True, timeout=30).stdout
    flags = ["--oversubscribe"] if "Open MPI" in version or "OpenRTE" in version else []
    return [launcher, *flags, "-n", str(ranks), sys.executable, *words]


def environment() -> dict[str, str]:
    """This environment with what root needs under Open MPI, and the tests' own modules importable."""
    root = Path(__file__).resolve().parents[2]
    path = os.pathsep.join([str(root), str(root / "tests"), os.environ.get("PYTHONPATH", "")])
    allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    return {**os.environ, **allow, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}


def start(ranks: int, *words: str, **keywords) -> subprocess.Popen:
    """The job in a process group of its own, its output captured as text."""
    arguments = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | keywords
    return subprocess.Popen(command(ranks, *words), env=environment(), start_new_session=True, **arguments)


def run(ranks: int, *words: str, timeout: float = 120.0, **keywords) -> subprocess.CompletedProcess:
    """Run the job to its end; past the timeout its whole process group is killed and the test fails."""
    job = start(ranks, *words, **keywords)
    try:
        out, err = job.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        os.killpg(job.pid, signal.SIGKILL)
        out, err = job.communicate()
        raise AssertionError(f"mpiexec still ran after {timeout} s\n{out}\n{err}") from None
    return subprocess.CompletedProcess(job.args, job.returncode, out, err)
