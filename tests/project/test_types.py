"""What a type checker and an editor know of `from petcontact import ...`, and that importing it stays cheap."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import petcontact

ROOT = Path(__file__).parents[2]
SCRIPT = """\
import petcontact
from petcontact import Case, Solution, load, solve

reveal_type(solve)
solution = solve(load("case.toml"), petsc_options={"ksp_type": "gmres"})
assert isinstance(solution, Solution)
reveal_type(solution.contact.u_t)
reveal_type(petcontact.__version__)
solve("case.toml")
solution.no_such_field
"""


def test_mypy_knows_the_signatures_in_a_users_script(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache"), "script.py"],
        cwd=tmp_path, env=os.environ | {"MYPYPATH": str(ROOT)}, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    by_line = {int(line.split(":")[1]): line for line in done.stdout.splitlines() if line.startswith("script.py")}
    assert set(by_line) == {4, 7, 8, 9, 10}, done.stdout + done.stderr
    case, problem, solution = ("model.case.Case", "model.problem.Problem", "results.solution.Solution")
    assert f"case: petcontact.{case} | petcontact.{problem}" in by_line[4] and f"-> petcontact.{solution}" in by_line[4]
    assert "numpy.ndarray" in by_line[7]
    assert "str" in by_line[8]
    assert "incompatible type" in by_line[9] and "no_such_field" in by_line[10]


def test_every_typed_name_is_there_and_none_else():
    stub = (ROOT / "petcontact" / "__init__.pyi").read_text()
    named = re.findall(r"^from \.\S+ import (\w+) as \1$", stub, re.MULTILINE)
    assert len(named) > 30 and sorted(named) == sorted(petcontact.__all__)
    for name in named:
        assert getattr(petcontact, name).__name__ == name


def test_nothing_heavy_is_imported_before_it_is_used():
    program = (
        "import sys, petcontact; dir(petcontact)\n"
        "print(sorted({'numpy', 'scipy', 'pydantic', 'h5py', 'petsc4py', 'mpi4py', 'shapely'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert done.stdout.strip() == "[]", done.stdout + done.stderr
