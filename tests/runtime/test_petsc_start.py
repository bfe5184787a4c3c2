"""Starting the program and PETSc: what Open MPI need not do for ranks of one machine, nothing left
behind for children, BLAS threads, too little memory, and signals that come at a bad time."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from petcontact.runtime.threads import VARIABLES

PROGRAM = """
import os, subprocess
from pathlib import Path
import petcontact
petcontact.initialise()
children = "".join(path.read_text() for path in Path("/proc/self/task").glob("*/children")).split()
assert len(children) == {children}, children
# a folder of the same name for all would be made and removed by several at once
assert {children} or not list(Path(os.environ["TMPDIR"]).iterdir())
assert {{key: value for key, value in os.environ.items() if key.startswith("OMPI_MCA_ess")}} == {given}
assert not {{"OMPI_MCA_pml", "OMPI_MCA_orte_create_session_dirs"}} & set(os.environ)
seen = subprocess.run(["env", "-0"], capture_output=True, text=True).stdout.split("\\0")
assert {children} or not {{line.partition("=")[0] for line in seen if line}} - set(os.environ), seen
from petsc4py import PETSc
assert PETSc.COMM_WORLD.tompi4py().allreduce(2) == 2
"""


def python(*words, **more):
    """A run of this interpreter."""
    given = {"capture_output": True, "text": True, "timeout": 300} | more
    return subprocess.run([sys.executable, *words], **given)


@pytest.mark.skipif(not os.path.exists("/proc/self/task"), reason="children as Linux lists them")
@pytest.mark.parametrize("given", [{}, {"OMPI_MCA_ess_singleton_isolated": "0"}])
def test_alone(given, tmp_path):
    from mpi4py import MPI

    daemon = bool(given) and MPI.Get_library_version().startswith("Open MPI v4")
    clean = {k: value for k, value in os.environ.items() if not k.startswith(("OMPI", "PMI"))}
    program = PROGRAM.format(children=int(daemon), given=given)
    done = python("-c", program, env=clean | {"TMPDIR": str(tmp_path), **given})
    assert done.returncode == 0, done.stderr


IMPORT = """
import os
import petcontact
from petcontact import Method
assert "OPENBLAS_NUM_THREADS" not in os.environ
"""
FIRST = "import petcontact\n"
NUMPY = "import numpy\n"
TOLD = """
import os, threadpoolctl
petcontact.initialise()
import numpy
pools = [pool["num_threads"] for pool in threadpoolctl.threadpool_info() if pool["user_api"] == "blas"]
assert pools and max(pools) == 1 and os.environ["OPENBLAS_NUM_THREADS"] == "1", pools
assert os.environ["OPENBLAS_THREAD_TIMEOUT"] == "4"
"""
ASKED = """
import os
petcontact.initialise()
assert os.environ["OPENBLAS_NUM_THREADS"] == "2" and os.environ["OMP_NUM_THREADS"] == "1"
"""


# a launcher that announces more ranks than there are cores: one thread for each
@pytest.mark.parametrize(
    ("program", "given"),
    [
        (IMPORT, {}),
        (FIRST + TOLD, {}),
        (NUMPY + FIRST + TOLD, {}),
        (FIRST + ASKED, {"OPENBLAS_NUM_THREADS": "2"}),
    ],
)
def test_threads(program, given):
    environment = {key: value for key, value in os.environ.items() if key not in VARIABLES}
    done = python("-c", program, env=environment | {"MPI_LOCALNRANKS": "512", **given})
    assert done.returncode == 0, done.stderr


SIGNALLED = """
import os, signal
from petcontact.runtime import signals

class Collected:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        for _ in range(10): pass  # where the handler runs

signals.install()
Collected()
try:
    with signals.deferred():
        print("works on")
except signals.Interrupted as interrupted:
    print(interrupted)
"""


def test_a_signal_while_rubbish_is_collected_is_not_lost():
    done = python("-c", SIGNALLED)
    assert done.returncode == 0 and done.stderr == ""
    assert done.stdout.splitlines() == ["works on", "SIGTERM; nothing was written"]


UNANSWERED = """
import os, signal, threading
from concurrent.futures import ThreadPoolExecutor
from petcontact.runtime import failures, signals

class One:
    getSize = lambda self: 1

waiting = threading.Event()

def stuck():
    waiting.wait()
    os.kill(os.getpid(), signal.SIGTERM)
    threading.Event().wait()

def waits():
    saved = signals.rescuing(lambda: "mesh 1 is saved")
    with saved, signals.stopping(One()), ThreadPoolExecutor(1) as pool:
        result = pool.submit(stuck)
        waiting.set()
        result.result()

signals.LATEST = 0.0
failures.guarded(waits)
"""


def test_a_signal_ends_a_program_that_waits_for_its_threads():
    done = python("-c", UNANSWERED)
    assert done.returncode == 143
    assert done.stderr == "petcontact: interrupted by SIGTERM; mesh 1 is saved\n"


CONFIG = Path(__file__).parents[2] / "configs/example1.toml"


@pytest.mark.parametrize("megabytes", [100, 250, 400])
def test_a_limit_of_memory_that_the_libraries_exceed(megabytes, tmp_path):
    limit = megabytes * 2**20, megabytes * 2**20
    words = "-m", "petcontact", "solve", str(CONFIG), "--no-figures"
    limited = lambda: resource.setrlimit(resource.RLIMIT_AS, limit)  # noqa: E731
    done = python(*words, cwd=tmp_path, preexec_fn=limited)
    assert (done.returncode, done.stdout) == (1, "")
    assert "out of memory" in done.stderr and done.stderr.count("\n") == 1, done.stderr
