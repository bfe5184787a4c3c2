"""The shell scripts: what they do with their arguments, and how they fail where they cannot work.

They run in a copy of the project whose environment, package manager and launchers are small
recorders, so nothing is installed; only the tests marked slow set up a real environment.
"""

from __future__ import annotations

import os
import re
import runpy
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import forked
import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "scripts"
SHELL_SCRIPTS = ["setup", "run", "test", "slurm.sh", "manual"]
# What scripts/setup needs of a machine beside its package manager.
TOOLS = (
    *("bash", "cat", "cut", "dirname", "env", "flock", "grep", "id", "mktemp", "readlink"),
    *("rm", "sed", "sha256sum", "sleep", "sort", "tac", "tail", "tr", "tput"),
)
DEBIAN_PETSC = Path("/usr/lib/petscdir").is_dir() and shutil.which("dpkg-query") is not None
needs_debian_petsc = pytest.mark.skipif(
    not DEBIAN_PETSC, reason="Debian's PETSc is not installed here"
)


def program(path: Path, body: str) -> Path:
    """An executable shell script."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/bash\n{body}\n")
    path.chmod(0o755)
    return path


def call(*words: object, **keywords) -> subprocess.CompletedProcess:
    arguments = {
        "capture_output": True,
        "text": True,
        "timeout": 60,
        "stdin": subprocess.DEVNULL,
    } | keywords
    return subprocess.run([str(word) for word in words], **arguments)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """The scripts in an otherwise empty project, in a folder with a space in its name."""
    root = tmp_path / "a project"
    (root / "configs").mkdir(parents=True)
    shutil.copytree(SCRIPTS, root / "scripts")
    shutil.copytree(ROOT / ".ci", root / ".ci")
    shutil.copy(ROOT / "pyproject.toml", root)
    return root


@pytest.fixture
def ready(project: Path) -> Path:
    """A project whose set-up is done, with recorders for petcontact and mpiexec in both
    environments."""
    program(project / "scripts/setup", 'echo "setup $*" >>"$(dirname "$0")/../calls"')
    for name in (".venv", ".venv-pypi"):
        program(project / name / "bin/petcontact", f'printf "%s\\n" {name} "$PWD" "$@"; exit 3')
        program(project / name / "bin/mpiexec", 'printf "%s\\n" mpiexec "$@"')
    return project


@pytest.fixture
def machine() -> Iterator[Path]:
    """A folder for the PATH that holds only the tools, and that any user may read."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o777)
        for tool in TOOLS:
            (folder / tool).symlink_to(shutil.which(tool) or f"/usr/bin/{tool}")
        yield folder


def one_line(text: str) -> str:
    assert text.count("\n") == 1 and text.endswith("\n"), text
    return text


# --- all of them


@pytest.mark.parametrize("script", SHELL_SCRIPTS)
def test_help_is_usage_on_stdout(script, tmp_path):
    done = call(SCRIPTS / script, "--help", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("usage: ")
    assert f"scripts/{script}" in done.stdout
    assert list(tmp_path.iterdir()) == []


SMALLEST = {
    "attack": "--count 4",
    "benchmark_methods.py": "--quick",
    "verify_data": "--number 1 --cells 64 --size 0.5",
    "verify_files": "--count 4",
    "verify_contact": "--pairs 1 --floors 0",
    "verify_jams": "--number 4",
    "verify_paths": "--number 1",
    "mutate": "--list",
    "verification": "B10",
    "drawings": "-o {folder}",
    "config_reference": "",
    "benchmark_contact": "--quick --here",
    "benchmark_accuracy": "--quick --example 1",
    "readability": f"{ROOT / 'README.md'}",
}
"""Scripts in Python, and the words for their smallest size."""
LONG = {
    "attack": "--count 200",
    "mutate": "projection-sign rule-shrink robin-shift free-term",
    "benchmark": "--quick refactoring assembly steps",
    "benchmark_rings": "",
    "verify_moved": "--places 0 1000",
    "verify_random": "--number 1 --accuracy 1e-2 --processes 1",
    "verify_axial": "--number 1 --accuracy 5e-2",
    "verify_processors": "--problems 1 --space 0 --processors Prescott",
    "benchmark_space": "--quick",
    "benchmark_hertz": "--quick",
    "package": "--build-only",
    "verify": "--h 1.6",
    "verify_space": "--quick --only known lame blocks adaptive drawn others bands",
    "verify_meshes": "--quick",
    "assemblies": "solve hip --set body.0.mesh.order=1 --set body.1.mesh.order=1",
}
APART = {"gallery", "verify_manual"}
"""Have tests of their own: tests/manual/test_gallery.py and test_manual.py."""
NEED_MORE = {"docs", "compare_versions", "benchmark_sweep"}
"""What needs other packages, solvers or checkouts, or takes long at any size: their modules and
words are looked at."""


RUN = "import runpy, sys; del sys.argv[0]; runpy.run_path(sys.argv[0], run_name='__main__')"


def measured(script: str, words: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = call(
        forked.program(), "-c", RUN, SCRIPTS / script, *words.split(), timeout=1800, env=environment
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done.stdout


def test_every_script_has_a_test():
    names = {path.name for path in SCRIPTS.iterdir() if path.is_file()}
    assert names == {*SHELL_SCRIPTS, *SMALLEST, *LONG, *APART, *NEED_MORE}


@pytest.mark.parametrize("script", SMALLEST)
def test_the_smallest_size_runs_to_its_end(script, tmp_path):
    assert measured(script, SMALLEST[script].format(folder=tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize("script", LONG)
def test_the_smallest_size_of_long_ones(script):
    assert measured(script, LONG[script])


def test_versions_are_compared_on_configs_that_exist():
    words = [SCRIPTS / "compare_versions", ROOT, "no_such.toml"]
    done = call(sys.executable, *words)
    assert done.returncode == 2
    assert f"{ROOT}/configs has no no_such.toml" in done.stderr


def test_every_mutation_is_one_place_in_the_source():
    table = runpy.run_path(str(SCRIPTS / "mutate"))["MUTATIONS"]
    assert len(table) >= 20
    for name, (module, old, new, tests) in table.items():
        assert (ROOT / "petcontact" / f"{module}.py").read_text().count(old) == 1, name
        assert old != new and (ROOT / "tests" / tests).exists(), name


@pytest.mark.parametrize("script", sorted(NEED_MORE))
def test_help_of_what_needs_more(script):
    assert "usage: " in measured(script, "--help")


@pytest.mark.slow
def test_the_site_builds_without_a_warning_or_a_broken_link(tmp_path):
    pytest.importorskip("mkdocs")
    assert "0 links or pictures that lead nowhere" in measured("docs", f"-o {tmp_path / 'site'}")


# --- scripts/setup


def test_setup_says_in_one_line_why_it_cannot_work(project, machine):
    done = call(project / "scripts/setup", "--pipy")
    assert done.returncode == 2 and "'--pipy'" in one_line(done.stderr)
    done = call(project / "scripts/setup", env={"PATH": str(machine)})
    assert done.returncode == 1 and "apt-get" in one_line(done.stderr)
    assert not (project / ".venv").exists()


def test_setup_without_rights_names_what_is_missing(machine):
    program(machine / "apt-get", "echo apt-get must not be called >&2")
    program(machine / "dpkg-query", "[[ ${*: -1} != python3-h5py ]] && echo installed || exit 1")
    root = machine / "project"
    shutil.copytree(SCRIPTS, root / "scripts")
    shutil.copy(ROOT / "pyproject.toml", root)
    root.chmod(0o777)
    nobody = {"user": 65534, "group": 65534, "extra_groups": []} if os.geteuid() == 0 else {}
    done = call(root / "scripts/setup", env={"PATH": str(machine)}, **nobody)
    assert done.returncode == 1
    assert (
        one_line(done.stderr) == "setup: cannot install without root rights or sudo: python3-h5py\n"
    )


@pytest.mark.slow
@needs_debian_petsc
def test_setup_mends_resumes_waits_and_follows_a_move(tmp_path):
    """Half a venv, two set-ups at once, a second call, and a project that was moved."""
    root = tmp_path / "pc"
    left_out = shutil.ignore_patterns(".git", ".venv*", "*.h5", "__pycache__")
    shutil.copytree(ROOT, root, ignore=left_out)
    (root / ".venv/bin").mkdir(parents=True)
    (root / ".venv/bin/python").symlink_to("/nowhere")
    words = {"stderr": subprocess.PIPE, "text": True}
    both = [subprocess.Popen([root / "scripts/setup"], **words) for _ in range(2)]
    messages = [job.communicate(timeout=600)[1] for job in both]
    assert [job.returncode for job in both] == [0, 0], messages
    for word in ("ready", "waiting"):
        assert sum(word in message for message in messages) == 1, messages
    again = call(root / "scripts/setup")
    assert (again.returncode, again.stdout, again.stderr) == (0, "", "")
    moved = root.rename(tmp_path / "moved")
    version = call(moved / "scripts/run", "-n", "3", "--version", timeout=600)
    assert version.returncode == 0 and "making" in version.stderr
    assert version.stdout.startswith("petcontact ")


# --- scripts/run


def test_run_passes_words_folder_and_status(ready, tmp_path):
    """Through a link, too, and what follows the dashes as it is."""
    (tmp_path / "pc").symlink_to(ready / "scripts/run")
    words = ["solve", "a b.toml", "-ksp_type", "gmres", ""]
    for name in (ready / "scripts/run", tmp_path / "pc"):
        done = call(name, *words, cwd=tmp_path)
        assert done.returncode == 3
        assert done.stdout.split("\n")[:-1] == [".venv", str(tmp_path), *words]
    assert (ready / "calls").read_text() == "setup \nsetup \n"
    assert call(ready / "scripts/run", "--", "--help").stdout.splitlines()[2:] == ["--help"]
    alone = call(ready / "scripts/run", cwd=tmp_path).stdout.splitlines()
    assert alone[1:4] == [str(tmp_path), "solve", f"{ready}/configs/example1.toml"]


def test_run_with_ranks_starts_the_environments_mpiexec(ready):
    done = call(ready / "scripts/run", "--pypi", "-n", "2", "sweep", "x.toml")
    assert done.returncode == 0
    petcontact = str(ready / ".venv-pypi/bin/petcontact")
    assert done.stdout.splitlines() == ["mpiexec", "-n", "2", petcontact, "sweep", "x.toml"]
    assert (ready / "calls").read_text() == "setup --pypi\n"


@pytest.mark.parametrize("words", [["-n"], ["-n", "0"], ["-n", "two", "solve"]])
def test_run_refuses_a_bad_number_of_ranks(ready, words):
    done = call(ready / "scripts/run", *words)
    assert done.returncode == 2
    assert "-n needs a number of ranks" in one_line(done.stderr)
    assert not (ready / "calls").exists()


def test_run_stops_when_the_setup_fails(ready):
    program(ready / "scripts/setup", "echo what is missing >&2; exit 1")
    done = call(ready / "scripts/run", "solve")
    assert (done.returncode, done.stdout, done.stderr) == (1, "", "what is missing\n")


def test_run_is_replaced_by_petcontact_so_that_signals_reach_it(ready):
    program(
        ready / ".venv/bin/petcontact",
        'trap "exit 143" TERM; echo $$; while :; do sleep 0.05; done',
    )
    job = subprocess.Popen([ready / "scripts/run", "solve"], stdout=subprocess.PIPE, text=True)
    try:
        assert job.stdout is not None
        assert int(job.stdout.readline()) == job.pid
        job.send_signal(signal.SIGTERM)
        assert job.wait(timeout=300) == 143
    finally:
        job.kill()
        job.communicate()


# --- scripts/test and .ci/run


@pytest.fixture
def checks(ready: Path) -> Path:
    """A project whose ruff fails and whose other checks pass; every tool records its words."""
    for name, body in {
        "ruff": "exit 1",
        "mypy": "exit 0",
        "coverage": "exit 0",
        "python": "echo == 4 passed ==",
    }.items():
        program(ready / ".venv/bin" / name, f'echo "{name} $*" >>calls; {body}')
    return ready


def test_test_runs_every_step_and_names_the_failed_one(checks, tmp_path):
    (checks / "tests").mkdir()
    (checks / "tests/test_x.py").write_text("@pytest.mark.mpi\n")
    (checks / "tests/test_y.py").write_text("\n")
    done = call(checks / "scripts/test", cwd=tmp_path)
    assert done.returncode == 1
    assert done.stdout.splitlines()[-3:] == [*["== 4 passed =="] * 2, "FAILED: ruff, ruff format"]
    *before, serial, parallel = (checks / "calls").read_text().splitlines()
    assert before == ["setup --test", "ruff check", "ruff format --check", "mypy "]
    assert serial.startswith("python -m pytest -n ") and serial.endswith("-m not mpi and not slow")
    assert re.fullmatch(
        r"python -m pytest -n \d+ --dist worksteal -m mpi and not slow tests/test_x\.py", parallel
    )
    program(checks / ".venv/bin/ruff", "exit 0")
    program(checks / ".venv/bin/python", '[[ "$*" == *"not mpi"* ]]')
    done = call(checks / "scripts/test")
    assert (done.returncode, done.stdout.splitlines()[-1]) == (1, "FAILED: MPI tests")


def test_test_passes_on_what_it_is_given(checks):
    """Words are those of pytest alone, and --slow and --coverage of both runs."""
    assert call(checks / "scripts/test", "tests/test_mesh.py", "-k", "a or b").returncode == 0
    calls = (checks / "calls").read_text().splitlines()
    assert calls[1:] == ["python -m pytest tests/test_mesh.py -k a or b"]
    program(checks / ".venv/bin/ruff", "exit 0")
    done = call(checks / "scripts/test", "--slow", "--coverage")
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, "== 4 passed ==")
    words = (checks / "calls").read_text().splitlines()[len(calls) :]
    assert words[1] == "coverage erase" and words[-1] == "coverage report"
    assert [line.rpartition(" -m ")[2] for line in words[-3:-1]] == ["not mpi", "mpi"]
    assert all("--cov-append" in line for line in words[-3:-1])


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
def test_test_sanitize_stops_at_an_access_out_of_bounds(checks):
    """A kernel of a few lines, and instead of pytest a program that hands it room for four of five
    numbers."""
    native = checks / "petcontact/native"
    (native / "part").mkdir(parents=True)
    text = "void fill(long n, double *x) { for (long i = 0; i < n; i++) x[i] = 1.0; }\n"
    (native / "part/fill.c").write_text(text)
    (native / "other.c").touch()
    word = "import ctypes, os; library = ctypes.CDLL(os.environ['PETCONTACT_NATIVE'])\n"
    word += "library.fill(4, (ctypes.c_double * 4)()); print('within', flush=True)\n"
    word += "library.fill(5, (ctypes.c_double * 4)())"
    words = '[[ "$*" == "-m pytest -m not mpi and not slow tests/native"* ]]'
    program(checks / ".venv/bin/python", f'{words} && {sys.executable} -c "{word}"')
    done = call(checks / "scripts/test", "--sanitize")
    assert done.returncode == 1, done.stderr
    assert "within" in done.stdout and "heap-buffer-overflow" in done.stdout


def test_ci_calls_the_tests_and_nothing_else(ready, tmp_path, monkeypatch):
    monkeypatch.delenv("OPENBLAS_CORETYPE", raising=False)
    program(ready / "scripts/test", 'echo "test $#"; exit 7')
    done = call(ready / ".ci/run", cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (7, "test 0\n", "")
    program(ready / "scripts/test", 'echo "test $# $OPENBLAS_CORETYPE"; exit ${#OPENBLAS_CORETYPE}')
    done = call(ready / ".ci/run", cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (8, "test 0 \ntest 0 Prescott\n", "")


# --- scripts/slurm.sh


def test_slurm_script_sweeps_over_all_tasks_from_the_spool(ready, tmp_path):
    spooled = shutil.copy(ready / "scripts/slurm.sh", tmp_path / "slurm_script")
    job = {"SLURM_JOB_ID": "1", "SLURM_SUBMIT_DIR": str(ready), "SLURM_NTASKS": "12"}
    task = {"ID": "6", "MIN": "2", "MAX": "10", "STEP": "4"}
    task = {f"SLURM_ARRAY_TASK_{key}": value for key, value in task.items()}

    def submitted(words, **more):
        environment = {**os.environ, **job, **more}
        return call(spooled, *words.split(), env=environment, cwd=tmp_path)

    start = ["mpiexec", "-n", "12", str(ready / ".venv-pypi/bin/petcontact")]
    for given, run in (
        ("tables.toml -o out", "sweep tables.toml -o out"),
        ("solve a.toml -o a.h5", "solve a.toml -o a.h5"),
    ):
        assert submitted(f"--pypi {given}").stdout.splitlines() == [*start, *run.split()]
    array = submitted("--pypi sweep tables.toml", **task)
    assert array.stdout.splitlines()[-3:] == ["tables.toml", "--part", "2/3"]
    for given, more, line in (
        ("tables.toml", dict.fromkeys(job, ""), "sbatch"),
        ("--pypi solve a.toml", task, "a solve is one job"),
        ("tables.toml", {"SLURM_SUBMIT_DIR": str(tmp_path)}, str(tmp_path)),
    ):
        refused = submitted(given, **more)
        assert refused.returncode == 2 and line in one_line(refused.stderr)
