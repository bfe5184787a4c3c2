"""Compressed operators over several ranks do what they do on one."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import launch

pytestmark = pytest.mark.mpi

PROGRAM = """
import json, sys
import numpy as np
from mpi4py import MPI
from hodlr_kernels import Mixed, Partial, case, dense
from petcontact.compression.hodlr import Stretch, compress, factor

comm = MPI.COMM_WORLD
rng = np.random.default_rng(3)
nodes = case("star", rng)
chosen = np.arange(len(nodes)) // 50 % 3 == 1
errors = {}

def gathered(local):
    return np.concatenate(comm.allgather(local))

kinds = ("square", Mixed(nodes)), ("rectangular", Partial(nodes, chosen))
for threads, (name, operator) in ((int(word), kind) for word in sys.argv[1:] for kind in kinds):
    run = f"{threads} threads, {name},"
    sides = [Stretch(int(b), int(b) + 60) for b in nodes.breaks] if name == "square" else []
    matrix = compress(operator, nodes.points, operator.row_offsets, operator.col_offsets, 1e-9, 8 if sides else 20,
                      breaks=nodes.breaks, threads=threads, comm=comm, stretches=sides)
    exact = dense(operator)
    first, last = matrix.first_node, matrix.last_node
    assert gathered(np.arange(first, last)).tolist() == list(range(len(nodes)))
    rows = slice(*operator.row_offsets[[first, last]])
    columns = slice(*operator.col_offsets[[first, last]])
    x, y = rng.standard_normal((exact.shape[1], 3)), rng.standard_normal(exact.shape[0])
    scale = np.linalg.norm(exact, 2)
    errors[run, "product"] = np.linalg.norm(gathered(matrix @ x[columns]) - exact @ x) / scale / np.linalg.norm(x)
    estimate = matrix.error_estimate(operator, np.random.default_rng(comm.Get_rank()))
    errors[run, "estimate"] = estimate
    errors[run, "agree"] = float(len(set(comm.allgather(estimate))) - 1)
    if name == "square":
        solver = factor(matrix)
        b = y[rows]
        errors[run, "solve"] = np.linalg.norm(gathered(matrix @ solver(b) - b)) / np.linalg.norm(y)
if comm.Get_rank() == 0:
    print("RESULT", json.dumps({" ".join(key): value for key, value in errors.items()}))
"""


def test_ranks_agree_with_the_dense_operator(ranks=2, threads="12"):
    errors = launch.result(ranks, PROGRAM, *threads)
    assert len(errors) == 7 * len(threads)
    assert {name: error for name, error in errors.items() if not error <= 5e-9} == {}
