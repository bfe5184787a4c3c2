"""What a sweep costs besides its cases: no more for a case of many than for one of few; and the
benchmark that says so."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import time

import pytest
from sweep_files import CONFIGS, quietly, sweep_file

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


@pytest.mark.slow
def test_the_benchmark_counts_the_factorisations_of_the_papers_way():
    script = str(CONFIGS.parent / "scripts" / "benchmark")
    loader = importlib.machinery.SourceFileLoader("benchmark_script", script)
    module = importlib.util.module_from_spec(
        importlib.util.spec_from_loader("benchmark_script", loader)
    )
    loader.exec_module(module)
    head, _, row = module.sweeps([[0.8]])
    cells = dict(zip(head.strip("| ").split(" | "), row.strip("| ").split(" | "), strict=True))
    # 32 cases, each of one factorisation at least and of one more for each change of rho
    assert int(cells["LUs, counted"]) >= 32 and float(cells["our sweep [s]"]) > 0.0
