"""scripts/attack: a sample of its attacks."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from marks import slow

SCRIPT = Path(__file__).parents[2] / "scripts" / "attack"


@pytest.mark.parametrize("count", [4, slow(200)])
def test_attacks_end_in_a_line_or_a_right_result(count):
    words = [sys.executable, str(SCRIPT), "--count", str(count)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=1800)
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stdout + done.stderr
    rows = [line.strip("| ").split(" | ") for line in done.stdout.splitlines()[2:]]
    assert sum(int(tried) for _, tried, _ in rows) == count
    assert {failed for *_, failed in rows} == {"0"}
