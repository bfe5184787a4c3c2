"""The doctor finds what bites users, in installations that are invented here, and runs on this
one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from petcontact.doctor.facts import gather, judge

ROOT = Path(__file__).parents[2]
HEALTHY = {
    "python": "3.11.2",
    "missing": [],
    "versions": {"numpy": "1.24.2"},
    "cores": 4,
    "ranks": 1,
    "errors": {},
    "extras": {"gmsh": ""},
    "environment": {"PETSC_DIR": "", "MPLBACKEND": "", "DISPLAY": "", "WAYLAND_DISPLAY": ""},
    "launcher": "/usr/bin/mpiexec",
    "folder": (True, 5e9),
    "petsc": "3.18.5",
    "petsc4py": "3.18.5",
    "kernels": "compiled (x86-64-v3)",
    "petsc_dir": "/usr/lib/petsc",
    "scalar": "float64",
    "integer": "int32",
    "packages": ["mumps"],
    "mpi": "Open MPI v4.1.4",
    "mpi_libraries": ["/usr/lib/libmpi.so.40"],
    "launched_size": 2,
    "launched_error": "",
    "blas": [["openblas", "0.3.21", 4]],
    "h5py": "3.7.0",
    "hdf5": "1.10.8",
    "hdf5_mpi": False,
    "hdf5_libraries": ["/usr/lib/libhdf5.so.103", "/usr/lib/libhdf5_hl.so.100"],
    "matplotlib": "3.6.3",
    "font": "/usr/share/DejaVuSans.ttf",
    "config_dir": "/var/cache/matplotlib",
}


def test_a_healthy_installation_has_nothing_to_report():
    assert {finding.severity for finding in judge(HEALTHY)} == {"ok"}
    assert any("int64" in finding.text for finding in judge(HEALTHY | {"integer": "int64"}))


def environment(**changes):
    return {"environment": HEALTHY["environment"] | changes}


@pytest.mark.parametrize(
    ("changes", "level", "message"),
    [
        ({"petsc4py": "3.20.1"}, "error", "releases differ"),
        ({"scalar": "complex128"}, "error", "not a real double-precision build"),
        (environment(PETSC_DIR="/old"), "warning", "PETSC_DIR is /old"),
        ({"launched_size": 1}, "error", "does not start 2 ranks"),
        ({"launcher": ""}, "warning", "no mpiexec"),
        ({"mpi_libraries": ["/a/libmpi.so.40", "/b/libmpi.so.12"]}, "error", "two MPI libraries"),
        ({"ranks": 4}, "warning", "on 4 cores for 4 ranks"),
        ({"hdf5_libraries": ["/a/libhdf5.so.103", "/b/libhdf5.so.310"]}, "warning", "several HDF5"),
        ({"font": ""}, "warning", "DejaVu Sans is missing"),
        (environment(MPLBACKEND="TkAgg"), "warning", "without a display"),
        ({"folder": (False, 0)}, "error", "cannot be written"),
        ({"kernels": "", "errors": {"kernels": "of other C files"}}, "error", "other C files"),
        ({"folder": (True, 1e6)}, "warning", "1 MB left"),
        ({"missing": ["shapely"]}, "error", "shapely is missing"),
        ({"errors": {"petsc": "ImportError: libpetsc.so.3.17"}}, "error", "libpetsc.so.3.17"),
    ],
)
def test_each_defect_is_found(changes, level, message):
    findings = [finding for finding in judge(HEALTHY | changes) if finding.severity != "ok"]
    assert [finding.severity for finding in findings] == [level]
    assert message in findings[0].text and findings[0].advice


@pytest.mark.slow
@pytest.mark.parametrize(
    ("library", "error"),
    [
        ("raise ImportError('libpetsc.so: cannot open shared object file')", "cannot open"),
        ("import os; os.abort()", "status -6"),
    ],
)
def test_a_library_that_is_broken_does_not_take_the_doctor_with_it(
    tmp_path, monkeypatch, library, error
):
    (tmp_path / "petsc4py.py").write_text(library)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), str(ROOT)]))
    findings = {finding.kind: finding for finding in judge(gather())}
    assert findings["petsc"].severity == "error" and error in findings["petsc"].text
    assert findings["hdf5"].severity == "ok"


def test_the_command_on_this_installation():
    allow = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "petcontact", "doctor"],
        capture_output=True,
        text=True,
        timeout=300,
        env=os.environ | allow,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "starts 2 ranks" in done.stdout and "PETSc" in done.stdout
