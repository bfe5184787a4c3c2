"""Compiles the C files beside this one into one shared library, on all cores.

    python petcontact/native/build.py            # for this processor only, beside this file
    python petcontact/native/build.py --level    # the level that this would be

`pip install` calls it through the command `build_ext` (pyproject.toml): a wheel has a copy of each
kernel for every level of the processor, unless the variable PETCONTACT_LEVEL names one. It needs
nothing but Python and a C compiler, so that scripts/setup can start it first.
"""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
FLAGS = [
    *("-std=gnu11", "-O3", "-g0", "-fPIC", "-ffp-contract=off"),
    *("-fno-math-errno", "-fno-trapping-math"),
]
"""Of every file. Without fused products the digits are the same on every machine; the two flags
about errors let square roots and comparisons be vector code; without what a debugger reads it takes
two thirds of the time."""
LEVELS = {
    "x86-64-v4": {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"},
    "x86-64-v3": {"avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe"},
}
"""Flags of a processor, beyond those of the level below (x86-64 psABI, 1.0)."""


def own_level() -> str:
    """The highest level of this processor; empty where it is of another architecture."""
    file = Path("/proc/cpuinfo")
    if platform.machine() != "x86_64" or not file.exists():
        return ""
    flags = next((line for line in file.read_text().splitlines() if line.startswith("flags")), "")
    v3 = LEVELS["x86-64-v3"] <= set(flags.split())
    v4 = v3 and LEVELS["x86-64-v4"] <= set(flags.split())
    return "x86-64-v4" if v4 else "x86-64-v3" if v3 else "x86-64"


def build(library: Path, level: str = "") -> None:
    """Compile and link.

    Parameters
    ----------
    library : Path
        Left alone if it is younger than the C files.
    level : str
        That of the processors which it is for; if empty there is a copy of each kernel for every
        level, and the library chooses when it is loaded.

    Raises
    ------
    SystemExit
        With one line, if there is no compiler or it fails.
    """
    sources = sorted(FOLDER.rglob("*.c"), key=lambda path: -path.stat().st_size)
    youngest = max(path.stat().st_mtime for path in [*FOLDER.rglob("*.[ch]"), Path(__file__)])
    if library.exists() and library.stat().st_mtime > youngest:
        return
    compiler = shlex.split(os.environ.get("CC", "")) or ["cc" if shutil.which("cc") else "gcc"]
    if shutil.which(compiler[0]) is None:
        raise SystemExit(
            f"petcontact: its kernels need a C compiler, and there is no {compiler[0]}: install it "
            f"(Debian: apt-get install gcc libc6-dev; conda: c-compiler), or name another by CC"
        )
    one = (
        [f"-march={level}", "-DPETCONTACT_ONE_LEVEL", f'-DPETCONTACT_LEVEL="{level}"']
        if level
        else []
    )
    with tempfile.TemporaryDirectory() as name, ThreadPoolExecutor(_cores()) as pool:

        def compiled(number: int) -> str:
            """`level.c` asks whether this processor has the level before anything of it runs."""
            own = [word for word in one if sources[number].name != "level.c" or "-D" in word]
            target = f"{name}/{number}.o"
            _run([*compiler, *FLAGS, *own, "-c", str(sources[number]), "-o", target])
            return target

        objects = list(pool.map(compiled, range(len(sources))))
        library.parent.mkdir(parents=True, exist_ok=True)
        new = library.with_suffix(f".{os.getpid()}")
        _run([*compiler, "-shared", "-o", str(new), *objects, "-lm"])
        new.replace(library)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _run(words: list[str]) -> None:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if "error" in line] or [done.stderr]
        raise SystemExit(
            f"petcontact: {words[0]} cannot compile its kernels (exit status {done.returncode}): "
            f"{lines[0].strip()}"
        )


try:
    from setuptools import Extension
    from setuptools.command.build_ext import build_ext
except ImportError:  # scripts/setup: only the library is wanted
    pass
else:

    class BuildKernels(build_ext):
        """The command of setuptools that compiles extension modules."""

        def build_extension(self, ext: Extension) -> None:
            """Instead of one file after another by distutils; in place where nothing is copied."""
            library = Path(self.get_ext_fullpath(ext.name))
            if self.editable_mode:
                own = FOLDER / library.name
                build(own, os.environ.get("PETCONTACT_LEVEL", own_level()))
                library.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(own, library)
            else:
                build(library, os.environ.get("PETCONTACT_LEVEL", ""))


if __name__ == "__main__":
    if sys.argv[1:] == ["--level"]:
        print(own_level())
    else:
        build(FOLDER / "_kernels.abi3.so", own_level())
