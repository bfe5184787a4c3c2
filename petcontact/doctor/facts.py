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
from collections.abc import Iterator
from pathlib import Path
from typing import cast

from .. import __version__, native
from ..errors import MissingKernelsError, installed_by
from ..results.report import Finding
from ..runtime.threads import available_cores, local_ranks
from ..untyped import Keyed
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
OF_RANKS = ("OMPI_COMM_", "OMPI_UNIVERSE_", "OMPI_MCA_ess", "OMPI_MCA_orte", "PMI", "SLURM_PROCID")
"""Beginnings of the variables by which a launcher tells a process that it is a rank."""
RANK_PROGRAM = "from mpi4py import MPI; print(f'size{MPI.COMM_WORLD.Get_size()};', flush=True)"


def gather() -> Keyed:
    """Facts of this installation: versions, libraries, launcher, environment, current folder."""
    facts: Keyed = {
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


def judge(facts: Keyed) -> Iterator[Finding]:
    """Yield findings from facts.

    No process is started here, so that tests can invent an installation.
    """
    yield Finding("petcontact", "ok", f"{__version__}, Python {facts['python']}")
    names = ", ".join(f"{name} {version}" for name, version in facts["versions"].items() if version)
    yield Finding("packages", "ok", names)
    for name in facts["missing"]:
        yield Finding("packages", "error", f"{name} is missing", advice=f"pip install {name}")
    for name, version in facts["extras"].items():
        extra, purpose = EXTRAS[name]
        advice = "" if version else installed_by(extra)
        yield Finding(
            "extras", "ok", f"{name} {version or 'is not installed'}, for {purpose}", advice=advice
        )
    if facts["kernels"]:
        yield Finding("kernels", "ok", facts["kernels"])
    for part, error in facts["errors"].items():
        petsc = f"install python3-petsc4py, or {installed_by('petsc')}"
        yield Finding(part, "error", error, advice=petsc if part == "petsc" else "reinstall it")
    for key, judged in JUDGED.items():
        if key in facts:
            yield from judged(facts)


def _judge_petsc(facts: Keyed) -> Iterator[Finding]:
    text = (
        f"PETSc {facts['petsc']}, petsc4py {facts['petsc4py']}, {facts['scalar']}, "
        f"{facts['integer']}"
    )
    if facts["petsc"].split(".")[:2] != facts["petsc4py"].split(".")[:2]:
        yield Finding(
            "petsc",
            "error",
            f"{text}: releases differ",
            advice="install the petsc4py of the same release as PETSc",
        )
    elif facts["scalar"] != "float64":
        yield Finding(
            "petsc",
            "error",
            f"{text}: not a real double-precision build",
            advice="use a PETSc built with real scalars",
        )
    else:
        yield Finding(
            "petsc", "ok", f"{text}, with {', '.join(facts['packages']) or 'no external packages'}"
        )
    given, used = facts["environment"]["PETSC_DIR"], facts["petsc_dir"]
    if given and used and os.path.realpath(given) != os.path.realpath(used):
        yield Finding(
            "petsc",
            "warning",
            f"PETSC_DIR is {given}, but petsc4py uses {used}",
            advice="unset PETSC_DIR",
        )


def _judge_mpi(facts: Keyed) -> Iterator[Finding]:
    if len(facts["mpi_libraries"]) > 1:
        yield Finding(
            "mpi",
            "error",
            f"two MPI libraries in one process: {', '.join(facts['mpi_libraries'])}",
            advice="install mpi4py and petsc4py built with the same MPI",
        )
    if not facts["launcher"]:
        yield Finding(
            "mpi",
            "warning",
            f"{facts['mpi']}, but no mpiexec on the PATH",
            advice="install the launcher of this MPI",
        )
    elif "launched_size" not in facts:
        yield Finding(
            "mpi",
            "ok",
            f"{facts['mpi']}, already {facts['ranks']} ranks (mpiexec is not tried inside mpiexec)",
        )
    elif facts["launched_size"] != 2:
        found = facts["launched_size"] or facts["launched_error"]
        yield Finding(
            "mpi",
            "error",
            f"{facts['launcher']} -n 2 does not start 2 ranks of {facts['mpi']} ({found})",
            advice="use the mpiexec of the same MPI; as root set OMPI_ALLOW_RUN_AS_ROOT",
        )
    else:
        yield Finding("mpi", "ok", f"{facts['mpi']}, {facts['launcher']} starts 2 ranks of it")


def _judge_blas(facts: Keyed) -> Iterator[Finding]:
    share = max(1, facts["cores"] // facts["ranks"])
    text = (
        ", ".join(
            f"{name} {version} with {threads} threads" for name, version, threads in facts["blas"]
        )
        or "unknown"
    )
    if any(threads > share for _, _, threads in facts["blas"]):
        yield Finding(
            "blas",
            "warning",
            f"{text} on {facts['cores']} cores for {facts['ranks']} ranks",
            advice=f"export OPENBLAS_NUM_THREADS={share}",
        )
    else:
        yield Finding("blas", "ok", f"{text} on {facts['cores']} cores")


def _judge_hdf5(facts: Keyed) -> Iterator[Finding]:
    text = (
        f"h5py {facts['h5py']}, HDF5 {facts['hdf5']} "
        f"({'parallel' if facts['hdf5_mpi'] else 'serial'} flavour)"
    )
    versions = {
        Path(path).name.split(".so")[-1] for path in facts["hdf5_libraries"] if "_hl" not in path
    }
    if len(versions) > 1:
        yield Finding(
            "hdf5",
            "warning",
            f"{text}; several HDF5 libraries: {', '.join(facts['hdf5_libraries'])}",
            advice="install h5py and PETSc with one HDF5",
        )
    else:
        yield Finding("hdf5", "ok", text)


def _judge_plots(facts: Keyed) -> Iterator[Finding]:
    backend = facts["environment"]["MPLBACKEND"].lower()
    display = facts["environment"]["DISPLAY"] or facts["environment"]["WAYLAND_DISPLAY"]
    if not facts["font"]:
        yield Finding(
            "figures",
            "warning",
            "the font DejaVu Sans is missing",
            advice="install fonts-dejavu-core",
        )
    if (
        backend.endswith(("qtagg", "qt5agg", "tkagg", "gtk3agg", "gtk4agg", "wxagg", "macosx"))
        and not display
    ):
        yield Finding(
            "figures",
            "warning",
            f"MPLBACKEND={backend} without a display",
            advice="unset MPLBACKEND",
        )
    yield Finding(
        "figures", "ok", f"matplotlib {facts['matplotlib']}, files only: no display is needed"
    )


def _judge_folder(facts: Keyed) -> Iterator[Finding]:
    writable, free = facts["folder"]
    if not writable:
        yield Finding(
            "folder",
            "error",
            "the current folder cannot be written to",
            advice="go elsewhere, or use -o FILE",
        )
    elif free < 100e6:
        yield Finding(
            "folder",
            "warning",
            f"{free / 1e6:.0f} MB left in the current folder",
            advice="make room for results",
        )
    else:
        yield Finding("folder", "ok", f"writable, {free / 1e9:.0f} GB left")


JUDGED = {
    "petsc": _judge_petsc,
    "mpi": _judge_mpi,
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


def _run(words: list[str]) -> tuple[int, str, str]:
    try:
        # a child of a rank must not take itself for one
        alone = {key: value for key, value in os.environ.items() if not key.startswith(OF_RANKS)}
        done = subprocess.run(words, capture_output=True, text=True, timeout=60.0, env=alone)
    except (OSError, subprocess.TimeoutExpired) as error:
        return -1, "", f"{type(error).__name__}: {error}"
    return done.returncode, done.stdout, done.stderr


def _probe(part: str) -> Keyed:
    status, out, err = _run([sys.executable, "-m", "petcontact.doctor.probe", part])
    line = next((line for line in reversed(out.splitlines()) if line.startswith("{")), "")
    if status or not line:
        reason = err.strip().splitlines()[-1] if err.strip() else "no output"
        return {"errors": {part: f"loading it ends with status {status} ({reason})"}}
    return cast(Keyed, json.loads(line))


def _launch(launcher: str) -> Keyed:
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
