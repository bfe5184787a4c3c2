"""A library that is missing or was built from other C files is refused: it would read arguments that
nobody gave."""

from __future__ import annotations

import ctypes
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from marks import slow

from petcontact import native

FOLDER = Path(native.__file__).parent
CONFIG = Path(__file__).parents[2] / "configs/example1.toml"
STRUCT, FUNCTION = r"typedef struct \{[^}]*\} \w+;", r"\w+ petcontact_\w+\([^;{]*\)(?= \{)"


def digest():
    """Of all structs, and of all functions that are seen from outside, without comments and line
    breaks."""
    found = []
    for path in sorted(FOLDER.rglob("*.[ch]")):
        text = " ".join(re.sub(r"/\*.*?\*/", " ", path.read_text(), flags=re.DOTALL).split())
        found += re.findall(STRUCT, text) + re.findall(FUNCTION, text)
    assert len(found) > 20
    return int(hashlib.sha256("\n".join(found).encode()).hexdigest()[:8], 16)


def test_the_interface_is_that_of_the_c_files():
    """Where it fails: write the number into level.c and native/__init__.py, and build."""
    written = re.search(r"return (0x[0-9a-f]+);", (FOLDER / "level.c").read_text())[1]
    assert f"{native.INTERFACE:#x}" == written == f"{digest():#x}"


@pytest.mark.skipif(shutil.which("cc") is None, reason="no compiler")
@pytest.mark.parametrize(
    ("more", "why"),
    [
        slow("", "was built from other C files"),
        ("long long petcontact_interface(void) { return 1; }", "was built from other C files"),
        slow(None, "No such file"),
    ],
)
def test_a_library_of_other_files_is_refused(tmp_path, more, why):
    """One that is older than the check, one that has another number, and none at all."""
    source, library = tmp_path / "old.c", tmp_path / "old.so"
    if more is not None:
        source.write_text(f"void petcontact_level(char *name) {{ *(int *) 0 = 0; }}\n{more}")
        subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
    environment = {**os.environ, native.VARIABLE: str(library)}
    words = [sys.executable, "-m", "petcontact", "solve", str(CONFIG)]
    given = {"capture_output": True, "text": True, "timeout": 300, "env": environment}
    done = subprocess.run(words, cwd=tmp_path, **given)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert done.stderr.startswith(f"petcontact: compiled kernels: {library}")
    assert why in done.stderr


def test_the_project_lists_all_sources_and_headers():
    """Those that it does not list are not in the archive of sources."""
    root = Path(__file__).parents[2]
    (kernels,) = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"][
        "ext-modules"
    ]
    files = {
        path.relative_to(root).as_posix()
        for end in ("c", "h")
        for path in (root / "petcontact/native").rglob(f"*.{end}")
    }
    assert {*kernels["sources"], *kernels["depends"]} == files


@pytest.mark.parametrize(
    "array", [np.ones(3, np.float32), np.ones(3, np.int64), np.ones((3, 2))[:, 0], np.ones(6)[::2]]
)
def test_an_array_that_c_would_misread_is_refused(array):
    """Of another type, or not one number after another; as an argument and in a struct."""
    solve = native.function("petcontact_hessenberg_solve", "DidDD")
    with pytest.raises(ctypes.ArgumentError, match="C takes arrays of kind D"):
        solve(array, 1, 1.0, np.ones(1), np.ones(3))
    with pytest.raises(TypeError, match="C takes arrays of kind D"):
        native.Struct("iD", 1, array)
