"""The command line: words, exit statuses, PETSc's manners; each in a process of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import forked
import h5py
import numpy as np
import pytest
from examples import example

from petcontact import MeshOptions, load
from petcontact import solve as solve_in_python
from petcontact.commands.main import COMMANDS, main, split_arguments
from petcontact.commands.unread import report_ignored, report_unused

pytestmark = pytest.mark.usefixtures("unsampled")

ROOT = Path(__file__).parents[2]
EXAMPLE = (ROOT / "configs" / "example1.toml").read_text()
COARSE = ("--set", "mesh.element_size=0.5")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "case.toml").write_text(EXAMPLE)
    return tmp_path


def petcontact(folder, *words, program=(), **environment):
    """A forked command, or what the words in `program` make of an interpreter."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    start = [sys.executable, *program] if program else [forked.program()]
    done = subprocess.run(
        [*start, *words],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path} | environment,
    )
    assert "Traceback" not in done.stderr, done.stderr
    return done


def solve(folder, *words, **keywords):
    return petcontact(folder, "solve", "case.toml", "--no-figures", *COARSE, *words, **keywords)


WITHOUT_PETSC = """
import sys
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("petsc4py", "mpi4py"):
            raise ImportError(name + " is blocked")
sys.meta_path.insert(0, Blocked())
from petcontact.commands.main import entry, main
"""


def test_help_needs_no_petsc(folder):
    lines = [["--help"], ["-h"], ["--version"], *([name, "--help"] for name in COMMANDS)]
    program = f"""
for words in {lines}:
    try:
        main(words)
    except SystemExit as end:
        print("STATUS", end.code, *words)
"""
    done = petcontact(folder, program=("-c", WITHOUT_PETSC + program))
    assert done.returncode == 0 and done.stderr == ""
    assert [line for line in done.stdout.splitlines() if "STATUS" in line] == [
        f"STATUS 0 {' '.join(w)}" for w in lines
    ]
    assert all(f"usage: petcontact {name}" in done.stdout for name in COMMANDS)
    assert max(map(len, done.stdout.splitlines())) <= 80


def test_a_missing_petsc_is_one_line(folder):
    done = petcontact(folder, "solve", "case.toml", program=("-c", WITHOUT_PETSC + "entry()"))
    assert done.returncode == 1
    assert re.fullmatch(
        r"petcontact: petsc4py cannot be loaded \(.*\); install python3-petsc4py, or .*\n",
        done.stderr,
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("solv case.toml", "unknown command 'solv', did you mean 'solve'?"),
        ("solve case.toml --figure x", "unknown option --figure, did you mean --figures?"),
        ("solve case.toml --qqq", "unknown option --qqq"),
        ("solve case.toml two.toml", "unknown argument two.toml (see"),
        ("--hlep", "unknown option --hlep, did you mean --help?"),
        ("solve", "CONFIG.toml"),
        ("case.toml", "did you mean `petcontact solve case.toml`?"),
        ("run case.toml", "unknown command 'run', did you mean 'solve'?"),
        ("solve case", "did you mean case.toml?"),
        ("solve case.tml", "did you mean case.toml?"),
        ("solve case.toml -adapt", "-adapt: one dash is PETSc's, did you mean --adapt?"),
        ("solve case.toml --element-size 1", "--set mesh.element_size=VALUE gives it"),
        ("solve case.toml -n 2", "ranks come from MPI: mpiexec -n 2 petcontact solve"),
        ("show case.h5 --step 1", "unknown option --step (see"),
        ("solve missing.toml", "missing.toml: cannot be read (No such file or directory)"),
        ("solve case.toml --set method.rho", "--set method.rho: expected KEY=VALUE"),
        ("solve case.toml --set method.rhho=3", "method.rhho: unknown key, did you mean 'rho'?"),
        ("solve case.toml -o no/folder/r.h5", "the folder no/folder does not exist"),
        (
            "solve case.toml --figures case.toml",
            "--figures case.toml: is a file, and figures need a folder",
        ),
        ("plot case.toml", "case.toml: a config; solve it first: petcontact solve case.toml"),
        ("doctor -ksp_type lu", "doctor takes no PETSc options"),
    ],
)
def test_bad_input_is_one_line_and_status_2(folder, words, message, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    try:
        status = main(words.split())
    except SystemExit as end:
        status = end.code
    text = capsys.readouterr().err
    assert status == 2 and message in text and text.count("\n") == 1
    assert sorted(os.listdir(folder)) == ["case.toml"]


@pytest.mark.parametrize(
    ("words", "status", "out", "err"),
    [
        ("-ksp_type gmress", 2, "", "Unable to find requested KSP type gmress"),
        ("-ksp_type gmres -ksp_rtol abc", 2, "", "abc has no numeric value"),
        ("--set method.max_iterations=4", 3, "max_iterations = 4 reached", ""),
        # where options come from: [petsc] table < -options_file < command line, in any order
        ("-options_file options -ksp_type gmres --set petsc.b=1", 0, "KSP gmres", "nix b"),
        ("-options_file options --set petsc.ksp_type=gmres", 0, "KSP bcgs", "nix"),
        # Newton factors the block of the sticking nodes by LAPACK: no KSP, and none in the verdict
        (
            "-ksp_type gmres -pc_type none -ksp_max_it 1 --set method.name=semismooth-newton",
            0,
            "",
            "ksp_max_it ksp_type pc_type",
        ),
        # a wrong elastic solve is told by the option that mends it
        (
            "-elastic_ksp_type gmres -elastic_pc_type none -elastic_ksp_rtol 1e-2",
            1,
            "use -elastic_pc_type lu, or a smaller -elastic_ksp_rtol",
            "",
        ),
        (
            "-bem_mat_type hodlr -bem_hodlr_tol 1e-3 -bem_hodlr_leaf 8 --set mesh.element_size=0.02",
            1,
            "use a smaller -bem_hodlr_tol, or -bem_mat_type dense",
            "",
        ),
    ],
)
def test_options_of_petsc_and_statuses(folder, words, status, out, err):
    """Options that nothing used are named; a solve that fails keeps its last iterate."""
    (folder / "options").write_text("-nix 7\n-ksp_type bcgs\n")
    done = solve(folder, "--verbose", *words.split())
    assert done.returncode == status and out in " ".join(done.stdout.split())
    if status == 2:
        assert err in done.stderr and done.stderr.count("\n") == 1
        assert sorted(os.listdir(folder)) == ["case.toml", "options"]
        return
    assert re.findall(r"option -(\S+) was not used", done.stderr) == err.split()
    assert ("KSP" in done.stdout) == ("semismooth" not in words)
    with h5py.File(folder / "case.h5") as file:
        kept = {0: "converged", 1: "failed", 3: "not converged"}[status]
        assert file.attrs["status"] == kept and len(file["history/rho"]) > 0


def test_status_0_and_what_is_written(folder):
    """A result of the same config is replaced, as after an edit; not one that another command
    wrote, or that has a name of its own, unless that is forced."""
    done = solve(folder, "--set", "title='first'", program=("-m", "petcontact"))
    assert done.returncode == 0 and done.stderr == ""
    assert sorted(os.listdir(folder)) == ["case.h5", "case.toml"]
    assert solve(folder, "--set", "title='second'").returncode == 0
    with h5py.File(folder / "case.h5", "a") as file:
        assert "second" in file.attrs["config"]
        file.attrs["argv"] = "petcontact solve other.toml"
    for words in ((), ("-o", "case.h5")):
        done = solve(folder, *words)
        assert done.returncode == 2 and "--force replaces it" in done.stderr
    assert ".h5 (replaced)" in solve(folder, "--force").stdout


# --- PETSc's manners
# -----------------------------------------------------------------------------------------------
def test_view_monitor_log_and_help(folder):
    done = solve(folder, "-ksp_view", "-ksp_monitor", "-log_view", "-help")
    assert done.returncode == 0 and done.stderr == ""
    assert "type: preonly" in done.stdout and "type: lu" in done.stdout
    assert "KSP Residual norm" in done.stdout
    stages = re.findall(r"^ *\d+: +(\w+):", done.stdout, re.MULTILINE)
    assert [name for name in stages if name in ("assemble", "factor", "iterate")] == [
        "assemble",
        "factor",
        "iterate",
    ]
    # the options of the objects that are really built, both prefixes
    assert all(
        f"-{name}" in done.stdout
        for name in ("ksp_type", "pc_type", "elastic_ksp_type", "elastic_pc_type")
    )


def test_unused_options_are_compared_with_those_of_the_manual(monkeypatch, capsys):
    words = ["-ksp_tpye", "-ksp_type", "-bem_mat_tpye"]
    monkeypatch.setattr("petcontact.runtime.petsc.unused_options", lambda: words)
    report_unused(True)
    assert re.findall(r"did you mean (\S+)\?", capsys.readouterr().err) == [
        "-ksp_type",
        "-bem_mat_type",
    ]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"method.rule": "fixed", "method.tau": 1.5},
            "petcontact: note: projection with rule fixed does not use method.tau, method.max_changes\n",
        ),
        ({"method.rule": "modified"}, ""),
    ],
)
def test_keys_that_are_not_read_are_named(changes, said, capsys):
    report_ignored(load(ROOT / "configs" / "example1.toml", changes), False, quiet=False)
    assert capsys.readouterr().err == said


def test_monitor_prints_a_line_an_iteration(folder):
    done = solve(folder, "--monitor")
    with h5py.File(folder / "case.h5") as file:
        rows = re.findall(
            r"^ +(\d+): change (\S+), \|R_rho\| (\S+), (.*)$", done.stdout, re.MULTILINE
        )
        assert [int(row[0]) for row in rows] == list(range(1, file.attrs["iterations"] + 1))
        assert [float(row[1]) for row in rows] == pytest.approx(
            file["history/change"][()], rel=1e-3
        )
        stick, slip = (
            int(np.count_nonzero(file["contact/state"][()] == state)) for state in (0, 1)
        )
        assert rows[-1][3] == f"stick {stick}, slip {slip}, KSP 1"


def test_words_are_ours_or_petscs():
    words = (
        "solve a.toml -ksp_monitor b.toml -ksp_type gmres --force -x -1.5 -ksp_rtol -1e-3 -o "
        "c.h5 -- -d"
    )
    ours, theirs = split_arguments(words.split(" "))
    assert ours == ["solve", "a.toml", "b.toml", "--force", "-x", "-1.5", "-o", "c.h5", "-d"]
    assert theirs == ["-ksp_monitor", "-ksp_type", "gmres", "-ksp_rtol", "-1e-3"]


def test_an_unexpected_exception_is_one_line(folder, monkeypatch, capsys):
    monkeypatch.setattr("petcontact.model.case.read_toml", lambda *words: 1 / 0)
    assert main(["solve", str(folder / "case.toml")]) == 1
    text = capsys.readouterr().err
    assert text.count("\n") == 1 and "ZeroDivisionError: division by zero (test_main.py:" in text
    monkeypatch.setenv("PETCONTACT_TRACEBACK", "1")
    assert main(["solve", str(folder / "case.toml")]) == 1
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("solve no.toml --figures out --no-figures", "--figures: --no-figures draws nothing"),
        ("plot no.h5 --animate a.gif -o out", "--figures: is not used by --animate"),
        ("plot no.h5 --animate a.gif --format pdf", "--format: is not used by --animate"),
        ("plot no.h5 --animate a.gif --html", "--html: is not used by --animate"),
        ("plot no.h5 --html --format pdf", "--format: is not used by --html"),
        ("export no.h5 --vtkhdf a.vtkhdf --table pairs", "--table: is of --csv"),
        ("export no.h5 --vtkhdf a.vtkhdf --step 1", "--step: is of --csv"),
        ("export no.h5 --csv out --grid 8x8", "--grid: is of --vtkhdf"),
        ("export no.h5 --csv out --body lower", "--body: is of --superelement"),
        ("report no --figures out", "--figures: is the folder of --plot"),
        (
            "init a --kind gmsh --from part.inp",
            "--kind is a starter's, --from takes the problem from a file",
        ),
    ],
)
def test_an_option_that_nothing_reads_is_refused(words, message, capsys):
    assert main(words.split()) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1


def test_petsc_options_that_nothing_uses_are_named_in_python():
    problem = example(1, mesh=MeshOptions(element_size=0.8))
    with pytest.warns(UserWarning, match=r"petsc_options that nothing used: nix, -ksp_type"):
        solve_in_python(
            problem,
            petsc_options={"ksp_type": "gmres", "pc_type": "jacobi", "nix": 1, "-ksp_type": "cg"},
        )
