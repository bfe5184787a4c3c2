"""What bites users of PETSc, MPI, BLAS, HDF5 and matplotlib: facts of this installation, judged one
by one."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from .. import __version__, native
from ..errors import MissingKernelsError
from ..frozen import frozen
from ..runtime.threads import available_cores, local_ranks
from .probe import PARTS

PACKAGES = (
    "numpy",
    "scipy",
    "h5py",
    "mpi4py",
    "pydantic",
    "simpleeval",
    "meshio",
    "shapely",
    "tomli_w",
    "jinja2",
    "lazy_loader",
    "matplotlib",
    "threadpoolctl",
)
EXTRAS = {"gmsh": ("cad", "STEP, IGES and BREP files")}
"""Packages that petcontact does without, their extra, and what they are for."""
VARIABLES = ("PETSC_DIR", "MPLBACKEND", "DISPLAY", "WAYLAND_DISPLAY")
RANK_PROGRAM = "from mpi4py import MPI; print(f'size{MPI.COMM_WORLD.Get_size()};', flush=True)"


Level = Literal["ok", "warning", "error"]
WINDOWED = ("qtagg", "qt5agg", "tkagg", "gtk3agg", "gtk4agg", "wxagg", "macosx")
"""Ends of the names of matplotlib's backends that open windows."""


@frozen
class Finding:
    """One line of the doctor: what was looked at, how it is, and what to do about it."""

    subject: str
    level: Level
    text: str
    advice: str = ""


def examine() -> list[Finding]:
    """All findings about this installation, gathered in processes of their own."""
    return list(judge(gather()))


def gather() -> dict[str, Any]:
    """Facts of this installation: versions, libraries, launcher, environment, current folder."""
    facts: dict[str, Any] = {
        "python": platform.python_version(),
        "missing": [p for p in PACKAGES if importlib.util.find_spec(p) is None],
        "versions": {name: _version(name) for name in PACKAGES},
        "extras": {name: _version(name) for name in EXTRAS},
        "cores": available_cores(),
        "ranks": local_ranks(),
        "environment": {name: os.environ.get(name, "") for name in VARIABLES},
        "errors": {},
        "launcher": _launcher(),
        "folder": _folder(Path.cwd()),
        "kernels": "",
    }
    try:
        facts["kernels"] = native.describe()
    except MissingKernelsError as error:
        facts["errors"]["kernels"] = str(error)
    for part in PARTS:
        found = _probe(part)
        facts["errors"] |= found.pop("errors", {})
        facts |= found
    if facts["launcher"] and facts["ranks"] == 1 and "mpi" in facts:
        facts |= _launch(facts["launcher"])
    return facts


def judge(facts: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield findings from facts.

    No process is started here, so that tests can invent an installation.
    """
    yield Finding("petcontact", "ok", f"{__version__}, Python {facts['python']}")
    names = ", ".join(f"{name} {version}" for name, version in facts["versions"].items() if version)
    yield Finding("packages", "ok", names)
    for name in facts["missing"]:
        yield Finding("packages", "error", f"{name} is missing", f"pip install {name}")
    for name, version in facts["extras"].items():
        extra, purpose = EXTRAS[name]
        advice = "" if version else f"pip install 'petcontact[{extra}]'"
        yield Finding(
            "extras", "ok", f"{name} {version or 'is not installed'}, for {purpose}", advice
        )
    if facts["kernels"]:
        yield Finding("kernels", "ok", facts["kernels"])
    for part, error in facts["errors"].items():
        petsc = "install python3-petsc4py, or pip install 'petcontact[petsc]'"
        yield Finding(part, "error", error, petsc if part == "petsc" else "reinstall it")
    for key, judged in JUDGED.items():
        if key in facts:
            yield from judged(facts)


def _first(subject: str, *cases: tuple[object, Level, str, str]) -> Finding:
    """Return the finding of the first case that holds.

    A case is a condition, a level, a text and an advice.
    """
    return next(Finding(subject, *case[1:]) for case in cases if case[0])


def _judge_petsc(facts: Mapping[str, Any]) -> list[Finding]:
    text = (
        f"PETSc {facts['petsc']}, petsc4py {facts['petsc4py']}, {facts['scalar']}, "
        f"{facts['integer']}"
    )
    releases = [facts[key].split(".")[:2] for key in ("petsc", "petsc4py")]
    given, used = facts["environment"]["PETSC_DIR"], facts["petsc_dir"]
    apart = given and used and os.path.realpath(given) != os.path.realpath(used)
    return [
        _first(
            "petsc",
            (
                releases[0] != releases[1],
                "error",
                f"{text}: releases differ",
                "install the petsc4py of the same release as PETSc",
            ),
            (
                facts["scalar"] != "float64",
                "error",
                f"{text}: not a real double-precision build",
                "use a PETSc built with real scalars",
            ),
            (
                True,
                "ok",
                f"{text}, with {', '.join(facts['packages']) or 'no external packages'}",
                "",
            ),
        ),
        *[
            Finding(
                "petsc",
                "warning",
                f"PETSC_DIR is {given}, but petsc4py uses {used}",
                "unset PETSC_DIR",
            )
        ]
        * bool(apart),
        *_judge_mpi(facts),
    ]


def _judge_mpi(facts: Mapping[str, Any]) -> list[Finding]:
    mpi, launcher, size = facts["mpi"], facts["launcher"], facts.get("launched_size")
    several = Finding(
        "mpi",
        "error",
        f"two MPI libraries in one process: {', '.join(facts['mpi_libraries'])}",
        "install mpi4py and petsc4py built with the same MPI",
    )
    return [
        *[several] * (len(facts["mpi_libraries"]) > 1),
        _first(
            "mpi",
            (
                not launcher,
                "warning",
                f"{mpi}, but no mpiexec on the PATH",
                "install the launcher of this MPI",
            ),
            (
                size is None,
                "ok",
                f"{mpi}, already {facts['ranks']} ranks (mpiexec is not tried inside mpiexec)",
                "",
            ),
            (
                size != 2,
                "error",
                f"{launcher} -n 2 does not start 2 ranks of {mpi} "
                f"({size or facts.get('launched_error')})",
                "use the mpiexec of the same MPI; as root set OMPI_ALLOW_RUN_AS_ROOT",
            ),
            (True, "ok", f"{mpi}, {launcher} starts 2 ranks of it", ""),
        ),
    ]


def _judge_blas(facts: Mapping[str, Any]) -> list[Finding]:
    cores, ranks = facts["cores"], facts["ranks"]
    share = max(1, cores // ranks)
    pools = [f"{name} {version} with {count} threads" for name, version, count in facts["blas"]]
    text = f"{', '.join(pools) or 'unknown'} on {cores} cores"
    many = any(threads > share for *_, threads in facts["blas"])
    advice = f"export OPENBLAS_NUM_THREADS={share}"
    return [
        _first(
            "blas",
            (many, "warning", f"{text} for {ranks} ranks", advice),
            (True, "ok", text, ""),
        )
    ]


def _judge_hdf5(facts: Mapping[str, Any]) -> list[Finding]:
    flavour = "parallel" if facts["hdf5_mpi"] else "serial"
    text = f"h5py {facts['h5py']}, HDF5 {facts['hdf5']} ({flavour} flavour)"
    paths = facts["hdf5_libraries"]
    versions = {Path(path).name.split(".so")[-1] for path in paths if "_hl" not in path}
    several = f"{text}; several HDF5 libraries: {', '.join(paths)}"
    return [
        _first(
            "hdf5",
            (len(versions) > 1, "warning", several, "install h5py and PETSc with one HDF5"),
            (True, "ok", text, ""),
        )
    ]


def _judge_plots(facts: Mapping[str, Any]) -> list[Finding]:
    backend = facts["environment"]["MPLBACKEND"].lower()
    display = facts["environment"]["DISPLAY"] or facts["environment"]["WAYLAND_DISPLAY"]
    font = "the font DejaVu Sans is missing"
    unseen = backend.endswith(WINDOWED) and not display
    text = f"matplotlib {facts['matplotlib']}, files only: no display is needed"
    no_display = f"MPLBACKEND={backend} without a display"
    return [
        *[Finding("figures", "warning", font, "install fonts-dejavu-core")] * (not facts["font"]),
        *[Finding("figures", "warning", no_display, "unset MPLBACKEND")] * unseen,
        Finding("figures", "ok", text),
    ]


def _judge_folder(facts: Mapping[str, Any]) -> list[Finding]:
    writable, free = facts["folder"]
    no_place = "the current folder cannot be written to"
    little = f"{free / 1e6:.0f} MB left in the current folder"
    return [
        _first(
            "folder",
            (not writable, "error", no_place, "go elsewhere, or use -o FILE"),
            (free < 100e6, "warning", little, "make room for results"),
            (True, "ok", f"writable, {free / 1e9:.0f} GB left", ""),
        )
    ]


JUDGED = {
    "petsc": _judge_petsc,
    "blas": _judge_blas,
    "hdf5": _judge_hdf5,
    "matplotlib": _judge_plots,
    "folder": _judge_folder,
}
"""What judges facts, by the key of a fact that must be known."""


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name.replace("_", "-"))
    except importlib.metadata.PackageNotFoundError:
        return ""


def _launcher() -> str:
    """mpiexec of this interpreter's environment, else the one on the PATH."""
    beside = Path(sys.executable).parent / "mpiexec"
    return str(beside) if beside.exists() else shutil.which("mpiexec") or ""


def _environment() -> dict[str, str]:
    here = str(Path(__file__).resolve().parents[1])
    path = os.pathsep.join(filter(None, [here, os.environ.get("PYTHONPATH", "")]))
    return {**os.environ, "PYTHONPATH": path}


def _run(words: list[str]) -> tuple[int, str, str]:
    try:
        done = subprocess.run(
            words, capture_output=True, text=True, timeout=60.0, env=_environment()
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return -1, "", f"{type(error).__name__}: {error}"
    return done.returncode, done.stdout, done.stderr


def _probe(part: str) -> dict[str, Any]:
    status, out, err = _run([sys.executable, "-m", "petcontact.doctor.probe", part])
    line = next((line for line in reversed(out.splitlines()) if line.startswith("{")), "")
    if status or not line:
        reason = err.strip().splitlines()[-1] if err.strip() else "no output"
        return {"errors": {part: f"loading it ends with status {status} ({reason})"}}
    facts: dict[str, Any] = json.loads(line)
    return facts


def _launch(launcher: str) -> dict[str, Any]:
    """How many ranks see each other when two are started."""
    _, version, _ = _run([launcher, "--version"])
    oversubscribe = ["--oversubscribe"] if "Open MPI" in version or "OpenRTE" in version else []
    _, out, err = _run([launcher, *oversubscribe, "-n", "2", sys.executable, "-c", RANK_PROGRAM])
    sizes = [int(number) for number in re.findall(r"size(\d+);", out)]
    reasons = [line.strip() for line in err.splitlines() if line.strip(" -")]
    return {
        "launched_size": max(sizes, default=0),
        "launched_error": reasons[0] if reasons else "no output",
    }


def _folder(path: Path) -> tuple[bool, int]:
    """Whether a folder takes a file, and the bytes left in it."""
    try:
        with tempfile.TemporaryFile(dir=path):
            return True, shutil.disk_usage(path).free
    except OSError:
        return False, 0
