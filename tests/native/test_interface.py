"""A library that was built from other C files is not used: it would read arguments that nobody
gave."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from petcontact import native

FOLDER = Path(native.__file__).parent
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
@pytest.mark.parametrize("interface", [None, "0x1"])
def test_a_library_of_other_files_is_not_used(tmp_path, interface):
    """One that is older than the check, and one that has another number: numpy serves, and a line
    says so."""
    source, library = tmp_path / "old.c", tmp_path / "old.so"
    function = (
        ""
        if interface is None
        else f"long long petcontact_interface(void) {{ return {interface}; }}"
    )
    source.write_text(f"void petcontact_level(char *name) {{ *(int *) 0 = 0; }} {function}")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
    program = "from petcontact import native; print(native.describe())"
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
        env={**os.environ, native.VARIABLE: str(library)},
    )
    assert done.stdout == "numpy (not compiled, or from other C files)\n"
    assert (
        done.stderr.startswith(f"petcontact: {library} was built from other C files")
        and done.stderr.count("\n") == 1
    )
