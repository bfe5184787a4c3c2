"""scripts/mutate: its mutations are still in the source, and tests do catch them (all of them when
the script is run)."""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "scripts" / "mutate"


def test_every_mutation_is_one_place_in_the_source():
    table = runpy.run_path(str(SCRIPT))["MUTATIONS"]
    assert len(table) >= 20
    for name, (module, old, new, tests) in table.items():
        assert (ROOT / "petcontact" / f"{module}.py").read_text().count(old) == 1, name
        assert old != new and (ROOT / "tests" / tests).exists(), name


@pytest.mark.slow
def test_mutations_are_caught():
    names = ["projection-sign", "rule-shrink", "robin-shift", "free-term"]
    done = subprocess.run(
        [sys.executable, str(SCRIPT), *names], capture_output=True, text=True, timeout=600, cwd=ROOT
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "4 of 4 caught" in done.stdout
