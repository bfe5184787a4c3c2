"""Start Python programs under mpiexec with a hard timeout, with the launcher that belongs to this
interpreter."""

from __future__ import annotations

import contextlib
import functools
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import forked

SHARING = {
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_odls_base_sigkill_timeout": "1",
}
"""Of Open MPI: ranks are bound to no core and give way while they wait; those whose partner has
died wait for it until they are killed."""


@functools.cache
def mpiexec() -> tuple[str, ...]:
    """The launcher beside the interpreter (a wheel's MPICH), else the one on the PATH; more ranks
    than cores are allowed."""
    beside = Path(sys.executable).parent / "mpiexec"
    launcher = str(beside) if beside.exists() else shutil.which("mpiexec") or "mpiexec"
    version = subprocess.run(
        [launcher, "--version"], capture_output=True, text=True, timeout=300
    ).stdout
    return launcher, *(["--oversubscribe"] if "Open MPI" in version or "OpenRTE" in version else [])


def command(ranks: int, *words: str, children: bool = False) -> list[str]:
    """mpiexec -n RANKS python WORDS; one rank needs no launcher. Ranks are forked from a server that
    has imported petcontact, unless they have to be children of the launcher."""
    launcher = [*mpiexec(), "-n", str(ranks)] if ranks > 1 else []
    if children:
        return [*launcher, sys.executable, *words]
    return [*launcher, forked.program(), *(words[2:] if words[0] == "-m" else words)]


def environment() -> dict[str, str]:
    """This environment with what root needs under Open MPI, and the tests' own modules
    importable."""
    root = Path(__file__).resolve().parents[2]
    path = os.pathsep.join([str(root), str(root / "tests"), os.environ.get("PYTHONPATH", "")])
    allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    ours = {"PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}
    return {**SHARING, **os.environ, **allow, **ours}


def start(ranks: int, *words: str, children: bool = False, **keywords) -> subprocess.Popen:
    """The job in a session of its own, its output captured as text."""
    arguments = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | keywords
    words = command(ranks, *words, children=children)
    return subprocess.Popen(words, env=environment(), start_new_session=True, **arguments)


def kill(job: subprocess.Popen) -> None:
    """Kill every process of the job's session, and wait until none is left: a launcher gives its
    children groups of their own."""
    while alive := list(_alive(job.pid)):
        for pid in alive:
            with contextlib.suppress(OSError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(0.01)


def _alive(session: int) -> Iterator[int]:
    """Yield the processes of a session that are not dead."""
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError):
                words = (entry / "stat").read_text().rpartition(")")[2].split()
                if int(words[3]) == session and words[0] not in "ZX":
                    yield int(entry.name)


def run(ranks: int, *words: str, timeout: float = 120.0, **keywords) -> subprocess.CompletedProcess:
    """Run the job to its end; past the timeout all its processes are killed and the test fails."""
    job = start(ranks, *words, **keywords)
    try:
        out, err = job.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        kill(job)
        out, err = job.communicate()
        raise AssertionError(f"mpiexec still ran after {timeout} s\n{out}\n{err}") from None
    return subprocess.CompletedProcess(job.args, job.returncode, out, err)


def result(ranks: int, program: str, *words: str) -> Any:
    """What rank 0 of a program prints as JSON behind RESULT."""
    done = run(ranks, "-c", program, *words)
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    return json.loads(lines[0].removeprefix("RESULT "))


SERIES = """
import json, sys
from petcontact.commands.main import main
from petcontact.runtime.petsc import petsc
world = petsc().COMM_WORLD.tompi4py()
for words in json.loads(sys.argv[1]):
    status = max(world.allgather(main(words)))
    if world.Get_rank() == 0:
        print(f"\\nENDED {status}", flush=True)
"""


def series(ranks: int, *commands: tuple[str, ...], timeout: float = 120.0) -> list[tuple[int, str]]:
    """Commands of petcontact one after another on the same ranks, without options of PETSc: exit
    status and output of each.

    To start ranks takes longer than most of what they compute here.
    """
    done = run(ranks, "-c", SERIES, json.dumps(commands), timeout=timeout)
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stdout + done.stderr
    outputs = done.stdout.split("\nENDED ")
    statuses = [int(output.split("\n", 1)[0]) for output in outputs[1:]]
    assert len(statuses) == len(commands), done.stdout
    return list(zip(statuses, outputs, strict=False))
