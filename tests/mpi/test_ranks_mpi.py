"""No rank is left alone: what one rank is given, answers or raises by itself ends the solve on all
ranks, with the reason; the next solve is not touched by it."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import launch

pytestmark = pytest.mark.mpi

PROGRAM = """
import json, os, sys, tomllib
import numpy as np
from examples import example
from mpi4py import MPI
from petcontact import MeshOptions, operators, solve
from petcontact.compare.side_by_side import compare
from petcontact.contact.laws import Tresca
from petcontact.contact.methods.newton import SemismoothNewton
from petcontact.contact.rho_rules import Modified
from petcontact.sweep.design.sweep import build_sweep
from petcontact.sweep.run import run_sweep

world = MPI.COMM_WORLD
rank, told = world.Get_rank(), []

def block(**changes):
    return example(1, mesh=MeshOptions(element_size=0.8)).model_copy(update=changes)

def on_rank_1(value, other=None):
    return value if rank == 1 else other

def fails(error):
    def monitor(state):
        if rank == 1 and len(state.history) == 3:
            raise error
    return monitor

class Broken(Modified):
    def update(self, rho, balance):
        if rank == 1:
            raise RuntimeError("this rule is broken")
        return super().update(rho, balance)

class Drifting(Modified):
    def update(self, rho, balance):
        return super().update(rho, balance) * (1.0 + 0.5 * rank)

class BrokenLaw(Tresca):
    def project(self, sigma):
        if rank == 1 and np.abs(sigma).max() > 0.0:
            raise RuntimeError("this law is broken")
        return super().project(sigma)

def lost(system, law, iteration):
    if rank == 1:
        raise RuntimeError("this method is lost")
    return SemismoothNewton()(system, law, iteration)

SWEEP = build_sweep("sweep.toml", {"problems": ["block.toml"]}, {"block.toml": tomllib.loads(block().toml())})

def impatient():
    os.environ["PETCONTACT_PATIENCE"] = "0.5"
    try:
        return solve(block())
    finally:
        del os.environ["PETCONTACT_PATIENCE"]

def makes(kind):
    return lambda nodes: kind(np.full(len(nodes.x), 150.0))

def wrong_mesh(nodes):
    if rank == 1:
        raise ZeroDivisionError("no such law")
    return nodes.law

CASES = {
    "reason": lambda: solve(block(), monitor=lambda state: on_rank_1("rank one is tired")),
    "monitor on one rank": lambda: solve(block(), monitor=on_rank_1(lambda state: None)),
    "ValueError": lambda: solve(block(), monitor=fails(ValueError("boom"))),
    "SystemExit": lambda: solve(block(), monitor=fails(SystemExit(7))),
    "KeyboardInterrupt": lambda: solve(block(), monitor=fails(KeyboardInterrupt())),
    "MemoryError": lambda: solve(block(), monitor=fails(MemoryError())),
    "rule raises": lambda: solve(block(), rule=Broken()),
    "rule differs": lambda: solve(block(), rule=Drifting()),
    "law raises": lambda: solve(block(), law=makes(BrokenLaw)),
    "law function raises": lambda: solve(block(), law=wrong_mesh),
    "method raises": lambda: solve(block(), method=lost),
    "other method": lambda: solve(block(), method=on_rank_1("projection", "semismooth-newton")),
    "other rule": lambda: solve(block(), rule=on_rank_1("fixed", "modified")),
    "other material": lambda: solve(block(material=block().body[0].material.model_copy(update={"young_modulus": 5000.0 + rank}))),
    "other mesh": lambda: solve(block(mesh=MeshOptions(element_size=0.4 + 0.1 * rank))),
    "other options": lambda: solve(block(), petsc_options=on_rank_1({"ksp_type": "gmres"}, {})),
    "operators of another mesh": lambda: operators(block(mesh=MeshOptions(element_size=0.4 + 0.1 * rank))) and None,
    "compared with another rho": lambda: compare([("block", block())], rhos=[1.0 + rank]) and None,
    "another folder": lambda: run_sweep(SWEEP, f"out-{rank}", world),
    "no problem": lambda: solve(on_rank_1("nowhere.toml", block())),
    "adaptive": lambda: solve(block(mesh=MeshOptions()), monitor=fails(ValueError("boom"))),
    "alone": lambda: on_rank_1(lambda: None, impatient)(),
    "itself": lambda: solve(block(), comm=MPI.COMM_SELF),
    "split": lambda: solve(block(), comm=world.Split(rank)),
    "no communicator": lambda: solve(block(), comm=3),
}
expected = solve(block()).pairs["bottom"].force.tolist()
for name, case in CASES.items():
    try:
        outcome = case()
        text = outcome if outcome is None else f"{outcome.status}: {outcome.reason}"
    except BaseException as error:
        text = f"{type(error).__name__}: {error}"
    world.Barrier()
    after = solve(block()).pairs["bottom"].force.tolist()
    assert after == expected, (name, after)
    told.append((name, world.allgather(text)))
if rank == 0:
    print("RESULT", json.dumps(told))
"""
ENDED = {
    "ValueError": "ValueError: boom",
    "SystemExit": "SystemExit: 7",
    "KeyboardInterrupt": "KeyboardInterrupt: ",
    "MemoryError": "MemoryError: ",
    "rule raises": "RuntimeError: this rule is broken",
    "law raises": "RuntimeError: this law is broken",
    "law function raises": "ZeroDivisionError: no such law",
    "method raises": "RuntimeError: this method is lost",
    "adaptive": "ValueError: boom",
}
"""What rank 1 raises; rank 0 tells that rank 1 has."""
DIFFER = {
    "other method": "rank 1 has another method.name: projection, where rank 0 has semismooth-newton",
    "other rule": "rank 1 has another rule: fixed, where rank 0 has modified",
    "other material": "rank 1 has another material.young_modulus: 5001.0, where rank 0 has 5000.0",
    "other mesh": "rank 1 has another mesh.element_size: 0.5, where rank 0 has 0.4",
    "operators of another mesh": "rank 1 has another mesh.element_size: 0.5, where rank 0 has 0.4",
    "compared with another rho": "rank 1 has another rhos.0: 2.0, where rank 0 has 1.0",
    "another folder": "rank 1 has another folder: out-1, where rank 0 has out-0",
    "other options": "rank 1 has another petsc.ksp_type: gmres, where rank 0 has nothing",
}


def test_what_one_rank_does_alone_ends_the_solve_on_both():
    told = dict(map(tuple, launch.result(2, PROGRAM)))
    for name, text in ENDED.items():
        assert told.pop(name) == [f"RanksError: rank 1: {text}", text], name
    for name, text in DIFFER.items():
        assert told.pop(name) == [f"InputError: {text}"] * 2, name
    assert told.pop("no problem")[0].startswith(
        "InputError: rank 1 has another outcome: InputError"
    )
    assert told.pop("reason") == ["failed: rank one is tired"] * 2
    first, second = told.pop("alone")
    assert (
        first.startswith("RanksError: not all 2 ranks have begun within 0.5 s") and second is None
    )
    for name in ("monitor on one rank", "rule differs", "itself", "split"):
        assert all(text.startswith("converged") for text in told.pop(name)), name
    assert all(
        "comm: a communicator of mpi4py or petsc4py" in text for text in told.pop("no communicator")
    )
    assert not told


COMMANDS = (
    ("solve CONFIG", "solve CONFIG --set mesh.order=2", "rank 1 has another command line"),
    ("solve CONFIG", "solve CONFIG -elastic_ksp_type gmres", "rank 1 has another command line"),
    ("solve CONFIG", "help", "rank 1 has another command line: help, where rank 0 has solve"),
    ("doctor", "doctor", "mpiexec is not tried inside mpiexec"),
    ("init own", "init own", "own.toml"),
    ("solve nowhere.toml", "solve nowhere.toml", "nowhere.toml: cannot be read"),
    ("solve CONFIG --nofig", "solve CONFIG --nofig", "unknown option --nofig"),
)
SERIES = """
import contextlib, io, json, sys
from mpi4py import MPI
from petcontact.commands.main import main
rank, found = MPI.COMM_WORLD.Get_rank(), []
for words in json.loads(sys.argv[1]):
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(out):
        try:
            status = main(words[rank].split())
        except SystemExit as end:
            status = end.code
    found.append(MPI.COMM_WORLD.allgather((status, out.getvalue())))
if rank == 0:
    print("RESULT", json.dumps(found))
"""


def test_commands_are_the_same_on_all_ranks_and_are_done_once(tmp_path):
    config = Path(__file__).parents[2] / "configs" / "example1.toml"
    words = [[w.replace("CONFIG", str(config)) for w in pair] for *pair, _ in COMMANDS]
    program = f"import os; os.chdir({str(tmp_path)!r})\n" + SERIES
    for (*pair, text), found in zip(
        COMMANDS, launch.result(2, program, json.dumps(words)), strict=True
    ):
        assert found[0][0] == found[1][0], (pair, found)
        assert "".join(out for _, out in found).count(text) == 1, (pair, found)
