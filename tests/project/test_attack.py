"""scripts/attack: a sample of its attacks; all that a seed draws is judged alike, however fast the
machine is."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from importlib.machinery import SourceFileLoader
from pathlib import Path

import h5py
import pytest
from marks import slow

from petcontact import solve, write_solution

SCRIPT = Path(__file__).parents[2] / "scripts" / "attack"


@pytest.mark.parametrize("count", [4, slow(200)])
def test_attacks_end_in_a_line_or_a_right_result(count):
    words = [sys.executable, str(SCRIPT), "--count", str(count)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=1800)
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stdout + done.stderr
    rows = [line.strip("| ").split(" | ") for line in done.stdout.splitlines()[2:]]
    assert sum(int(tried) for _, tried, _ in rows) == count
    assert {failed for *_, failed in rows} == {"0"}


@pytest.fixture
def judge(monkeypatch):
    """The script's own judgement of a result file."""
    monkeypatch.setattr(os, "environ", os.environ.copy())
    monkeypatch.setattr(sys, "path", [*sys.path])
    loader = SourceFileLoader("attack", str(SCRIPT))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("attack", loader))
    loader.exec_module(module)
    return module


def test_a_wrong_result_is_found(judge, tmp_path):
    """The judge can fail: a right file passes, and one that is changed does not."""
    path = tmp_path / "r.h5"
    (tmp_path / "case.toml").write_text(judge.tomli_w.dumps(judge.BASES["tresca"]))
    solution = solve(tmp_path / "case.toml")
    write_solution(path, solution)
    assert judge.judged_file(path) == []
    for key, factor, fault in (
        ("boundary/traction", -1.0, "add up to"),
        ("contact/sigma_t", 3.0, "beyond"),
        ("boundary/traction", float("nan"), "not finite"),
    ):
        write_solution(path, solution)
        with h5py.File(path, "r+") as file:
            values = file[key][()]
            values[: len(values) // 3] *= factor
            file[key][...] = values
        assert any(fault in line for line in judge.judged_file(path))
