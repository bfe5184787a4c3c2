"""One problem over several ranks gives what one rank gives."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import launch

pytestmark = pytest.mark.mpi
CONFIGS = Path(__file__).parents[2] / "configs"

PROGRAM = """
import json, sys
from examples import example
from petcontact import MeshOptions, solve
from petcontact.runtime.petsc import petsc
result = []
for options in json.loads(sys.argv[1]):
    for formulation in ("condensed", "full"):
        # neither 23 contact nodes nor 140 unknowns divide evenly over 3 ranks
        problem = example(1, mesh=MeshOptions(element_size=8 / 23), formulation=formulation, tolerance=1e-11)
        solution = solve(problem.model_copy(update={"petsc": options}))
        assert solution.converged, solution.reason
        error = [solution.accuracy.error]
        result.append(error + solution.contact.u_t[:, 0].tolist() + solution.u.ravel().tolist())
if petsc().COMM_WORLD.getRank() == 0:
    print("RESULT", json.dumps(result))
"""
SMALL = """
import json
import numpy as np
from petcontact.compliance.contact_compliance import DenseCompliance
from petcontact.contact.system import Modes
from petcontact.runtime.petsc import petsc
worst = 0.0
for n, r in ((n, r) for r in (0, 1, 3, 6) for n in range(max(r, 1), 12)):
    rng = np.random.default_rng(100 * n + r)
    factor, motion = rng.standard_normal((n, n)), rng.standard_normal((n, r))
    compliance = factor @ factor.T + np.eye(n)
    modes = Modes(motion[:, None], motion.T[:, :, None], np.zeros(r)) if r else None
    rhs, work, rho = rng.standard_normal((n, 1)), rng.standard_normal(r), rng.uniform(0.5, 2.0, (n, 1))
    operator = DenseCompliance(compliance, petsc().COMM_WORLD, lambda: None)
    v, sigma = operator.robin(rho, rhs, modes, work)
    operator.close()
    rest = v - compliance @ sigma
    alpha = np.linalg.lstsq(motion, rest, rcond=None)[0]
    for defect in (sigma + rho * v - rhs, motion.T @ sigma - work[:, None], rest - motion @ alpha):
        worst = max(worst, float(np.abs(defect).max(initial=0.0)) / (1.0 + float(np.abs(sigma).max())))
if petsc().COMM_WORLD.getRank() == 0:
    print("RESULT", json.dumps(worst))
"""
SHARED = """
import json
import numpy as np
from petcontact.contact.active_set.block_factors import BlockFactors
from petcontact.linalg.blocked_lu import BlockedLU
from petcontact.linalg.dense_elimination import Elimination
from petcontact.linalg.row_layout import even_ranges
from petcontact.runtime.petsc import petsc
comm, random, set_up, times = petsc().COMM_WORLD, np.random.default_rng(3), BlockedLU.setUp, []
BlockedLU.setUp = lambda self, pc: (times.append(self), set_up(self, pc))[1]
n, kept = 1500, np.arange(100, 1000)
whole, contact = random.standard_normal((n, n)) + 40.0 * np.eye(n), random.standard_normal((n, len(kept)))
own = slice(*even_ranges(n, comm.getSize())[comm.getRank()])
given = [np.array(matrix[own].T, order="C") for matrix in (whole, contact, contact[:, :1])]
made = Elimination(*given, kept, comm)
apart = [made.influence - np.linalg.solve(whole, contact)[kept]]
apart.append(made.solve(contact[own, 0]) - np.linalg.solve(whole, contact[:, 0]))
left = [np.count_nonzero(matrix) / matrix.size for matrix in given[:2]]
factors, marks = BlockFactors(comm), np.zeros((700, 1))
for active in (np.arange(600), np.arange(5, 605)):
    block, rhs = whole[np.ix_(active, active)], contact[active, 0]
    apart.append(factors.solve(whole, active, marks[active], block, rhs) - np.linalg.solve(block, rhs))
if comm.getRank() == 0:
    print("RESULT", json.dumps([max(float(np.abs(a).max()) for a in apart), max(left), len(times)]))
"""
DIGEST = """
import json
from petcontact.runtime.petsc import petsc
from digests import digest
value = digest(1, "condensed", petsc().COMM_WORLD)
if petsc().COMM_WORLD.getRank() == 0:
    print("RESULT", json.dumps(value))
"""
LAPACK = {"pc_type": "lu", "elastic_pc_type": "lu"}
GMRES = {"ksp_type": "gmres", "pc_type": "jacobi", "ksp_rtol": 1e-12, "ksp_gmres_restart": 200}


def test_ranks_agree():
    """By LU of all ranks, by GMRES on their rows, by an LU of each, and with an elastic solve that is iterative; two
    formulations each."""
    options = [{}, GMRES, LAPACK, {"elastic_ksp_type": "gmres", "elastic_pc_type": "none"}]
    # MPICH's ranks spin: Krylov methods of more ranks than cores take minutes
    one_rank = launch.result(1, PROGRAM, "[{}]")[0]
    found = launch.result(2, PROGRAM, json.dumps(options))
    found += launch.result(3, PROGRAM, "[{}]")
    scale = max(abs(value) for value in one_rank)
    assert len(found) == 2 * len(options) + 2
    for values in found:
        assert max(abs(a - b) for a, b in zip(values, one_rank, strict=True)) <= 1e-9 * scale


def test_systems_of_few_rows():
    """Down to fewer rows than ranks, and borders that more than one rank has rows of: the equations
    hold."""
    assert launch.result(4, SMALL) <= 1e-9


def test_ranks_share_factors_that_are_computed_once():
    """Of an elimination, whose memory before the exchange is given back, and of a block and one near
    it."""
    apart, left, times = launch.result(2, SHARED)
    assert apart <= 1e-10 and left <= 0.2
    assert times == 2


def test_the_same_bits_on_the_same_ranks():
    assert launch.result(2, DIGEST) == launch.result(2, DIGEST)


def test_solve_command_under_mpiexec(tmp_path):
    """The verdict is printed once, and PETSc's views are of matrices of all ranks."""
    config, output = CONFIGS / "example1.toml", tmp_path / "result.h5"
    words = f"solve {config} -o {output} --set mesh.element_size=0.2 --no-figures -elastic_ksp_view"
    done = launch.run(2, "-m", "petcontact", *words.split())
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("converged:") == 1
    assert "type: mpidense" in done.stdout and "type: petcontact" in done.stdout
    assert output.exists()
