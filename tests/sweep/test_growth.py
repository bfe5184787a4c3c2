"""What a sweep costs besides its cases: no more for a case of many than for one of few; and the
benchmark that says so."""

from __future__ import annotations

import time

import pytest
from sweep_files import quietly, sweep_file

from petcontact.sweep.design.sweep import read_sweep

SAMPLED = """
problems = ["example1.toml"]
keep = "scalars"
[set]
element_size = 0.8
order = 0
rule = "modified"
[sample]
method = "sobol"
points = {cases}
log = ["rho"]
range = {{ rho = [1.0, 1e5] }}
"""


@pytest.mark.slow
def test_a_case_of_ten_thousand_costs_what_one_of_a_thousand_does(tmp_path):
    seconds = {}
    for cases in (1_000, 10_000):
        path = sweep_file(tmp_path, SAMPLED.format(cases=cases), f"{cases}.toml")
        began = time.process_time()
        for computed in (cases, 0):  # once more: all of them are found finished
            assert quietly(read_sweep(path), tmp_path / str(cases)).computed == computed
        seconds[cases] = (time.process_time() - began) / cases
    assert seconds[10_000] <= 1.2 * seconds[1_000]
