"""Too little memory to start ends the program at once, in one line."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest

CONFIG = Path(__file__).parents[2] / "configs/example1.toml"


@pytest.mark.parametrize("megabytes", [100, 250, 400])
def test_a_limit_that_the_libraries_exceed(megabytes, tmp_path):
    limit = megabytes * 2**20
    done = subprocess.run(
        [sys.executable, "-m", "petcontact", "solve", str(CONFIG), "--no-figures"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert "out of memory" in done.stderr and done.stderr.count("\n") == 1, done.stderr
