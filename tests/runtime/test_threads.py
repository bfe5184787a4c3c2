"""BLAS threads: nothing happens on import; starting PETSc or the command line leaves each rank its
share of the cores."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from petcontact.runtime.threads import VARIABLES

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
    environment |= {"MPI_LOCALNRANKS": "512", **given}
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
