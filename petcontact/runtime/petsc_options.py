"""PETSc's options before PETSc reads them: words and files are looked through, and a config sets
solvers only.

PETSc ends the process, or writes a page of its own, over many a mistake in its options: what can be
known before is refused here in one line.
"""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from ..errors import InputError

OF_THE_PROGRAM = (
    "options_",
    "help",
    "log_",
    "malloc",
    "info",
    "skip_petscrc",
    "no_signal_handler",
    "on_error_",
    "alias",
    "start_in_debugger",
    "stop_for_debugger",
    "debugger",
    "fp_trap",
    "get_total_flops",
    "citations",
    "check_pointer_intensity",
    "memory_view",
    "objects_dump",
    "version",
    "petsc_",
    "history",
    "dll_",
    "python",
    "saws",
    "mpi_",
    "draw_",
    "display",
    "x_",
    "viewer_",
    "tmp",
    "shared_tmp",
    "not_shared_tmp",
    "device_",
    "cuda_",
    "hip_",
    "sycl_",
    "kokkos_",
    "use_gpu",
    "nox",
    "on_error",
    "prefix_",
    "root_device",
    "default_device",
    "split_ownership",
    "checkstack",
    "error_output",
)
"""Beginnings of what PETSc reads itself, when it starts or ends; no object of a solve has such
options."""
NEVER_IN_A_CONFIG = {
    "python",
    "file",
    "filename",
    "files",
    "tmpdir",
    "dir",
    "path",
    "dump",
    "plot",
    "draw",
    "saws",
    "socket",
    "lg",
    "load",
    "debugger",
    "dll",
    "ooc",
    "library",
    "matlab",
}
"""Words in the name of an option that loads code, or opens files, folders and windows."""
VIEWERS = {
    "draw",
    "socket",
    "binary",
    "hdf5",
    "matlab",
    "mathematica",
    "vtk",
    "saws",
    "glvis",
    "exodusii",
    "adios",
    "pyvista",
    "cgns",
}
"""Values that are a kind of viewer other than text."""
TO_STANDARD_OUTPUT = re.compile(r"(ascii)?(::ascii_\w+)?", re.ASCII)
PLAIN = re.compile(
    r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|[a-z_][\w-]*|[+-]?\d+-\d+", re.ASCII | re.IGNORECASE
)
"""A number, the name of a type, a range of integers."""
LARGEST_RESTART = 2000
"""PETSc takes memory for the square of a restart at once, and counts it in 32 bits."""


OF_THE_FOLDER = (".petscrc", "petscrc")
"""Files that PETSc looks for in the working folder: who else wrote there may have written them."""
OF_THE_HOME = "~/.petscrc"
SHOWING = ("log_view", "memory_view", "options_left")
"""Options of the program that only print, where no file is named."""


def refused_in_config(table: Mapping[str, str | int | float | bool]) -> str:
    """Why a `[petsc]` table cannot be accepted, "" if it can.

    A config is data: it may choose solvers and their parameters, and print; it may not load code,
    read or write files, open windows, or change how the program itself runs. On the command line
    all of that is the user's business.

    Examples
    --------
    >>> refused_in_config({"elastic_ksp_rtol": 1e-8, "ksp_view": "::ascii_info_detail"})
    ''
    >>> refused_in_config({"ksp_view": ":problem.toml"})
    "ksp_view = ':problem.toml': a config writes no file and opens no window; -ksp_view on the
    command line may"
    """
    for key, value in table.items():
        if reason := _refused(
            key.lower(), str(value).lower() if isinstance(value, bool) else str(value)
        ):
            return f"{key} = {value!r}: {reason}"
    return ""


def of_files() -> list[str]:
    """The words of the files that PETSc would look for by itself: it is told not to.

    Raises
    ------
    InputError
        If one is no file of options, or one of the working folder has an option that loads code,
        writes a file, or changes how the program runs.
    """
    home, words = Path(OF_THE_HOME).expanduser(), list[str]()
    if home.is_file() and home.resolve().parent != Path.cwd():
        words += ["-options_file", str(home)]
    for name in filter(os.path.isfile, OF_THE_FOLDER):
        for line in _lines(name, name):
            for option, value in _options(line if _is_option(line[0]) else ["-alias", *line[1:]]):
                shown = option.startswith(SHOWING) and TO_STANDARD_OUTPUT.fullmatch(value)
                if not shown and (reason := _refused(option, value, "this file")):
                    raise InputError(f"{name}: -{option} {value}: {reason}")
                words += [f"-{option}", value] if value else [f"-{option}"]
    return words


def _refused(name: str, value: str, where: str = "a config") -> str:
    """Why one option cannot stand in a config, or a file of the working folder."""
    words = set(re.split(r"[_.]", name))
    elsewhere = f"-{name} on the command line may"
    if name.startswith(OF_THE_PROGRAM):
        return f"{where} sets options of solvers only; {elsewhere}"
    if "python" in words or "python" in value.lower():
        return f"{where} runs no code; {elsewhere}"
    prints = "view" in name or "monitor" in name or not words.isdisjoint({"reason", "rate"})
    if prints and "tao" in words:
        fits = value == ""  # anything else is the name of a file
    elif prints:
        fits = value in ("true", "false", "yes", "no", "1", "0") or bool(
            TO_STANDARD_OUTPUT.fullmatch(value)
        )
    else:
        fits = True
    if not fits or words & NEVER_IN_A_CONFIG or VIEWERS & set(re.split(r"[,:\s]+", value.lower())):
        return f"{where} writes no file and opens no window; {elsewhere}"
    if not prints and value and not all(PLAIN.fullmatch(part) for part in value.split(",")):
        return "must be a number, a name, or several with commas between them"
    return _too_large(name, value)


def _too_large(name: str, value: str) -> str:
    """Why the number of an option cannot be served."""
    number = value.removeprefix("+")
    if name.endswith("_restart") and number.isdecimal() and int(number) > LARGEST_RESTART:
        return f"must be at most {LARGEST_RESTART}: the restart's square is kept in memory"
    return ""


def files_first(words: Sequence[str]) -> list[str]:
    """PETSc lets the last word win: with its files first, the command line has precedence over them
    wherever it names them."""
    named = [k for k, word in enumerate(words) if word == "-options_file"]
    files = [word for k in named for word in words[k : k + 2]]
    others = [word for k, word in enumerate(words) if not {k, k - 1} & {*named}]
    return files + others


def check(words: Sequence[str]) -> None:
    """Refuse what PETSc would end the process over, or fail at silently.

    Parameters
    ----------
    words : sequence of str
        PETSc's part of a command line; its options files are read, too.

    Raises
    ------
    InputError
        If an options file cannot be read, is none or includes itself; a file of a viewer cannot be
        written; or an option asks for what cannot be.
    """
    for name, value in _given(words, ()):
        if name == "python":
            raise InputError(
                "-python: PETSc would start a second Python inside of this one; it is not needed"
            )
        if name == "fp_trap" and value.lower() not in ("0", "false", "no", "off"):
            raise InputError(
                "-fp_trap: numpy's own operations would end the program; "
                "only -fp_trap 0 is possible"
            )
        if reason := _too_large(name, value):
            raise InputError(f"-{name} {value}: {reason}")
        file = _written(name, value)
        if file and (Path(file).is_dir() or not os.access(Path(file).parent, os.W_OK | os.X_OK)):
            raise InputError(f"-{name} {value}: {file} cannot be written")


def _written(name: str, value: str) -> str:
    """The file that an option writes to, "" if it writes none."""
    if name in ("history", "log_trace", "malloc_dump", "malloc_view"):
        return value
    kind, colon, rest = value.partition(":")
    return (
        rest.partition(":")[0] if colon and kind in ("", "ascii", "binary", "hdf5", "vtk") else ""
    )


def _given(words: Sequence[str], within: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Names and values of the options in the words, and in the files that they name."""
    for name, value in _options(words):
        if name == "options_file":
            yield from _given_in_file(value, within)
        else:
            yield name, value


def _options(words: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Names and values of the options in the words."""
    for word, following in itertools.zip_longest(words, words[1:], fillvalue=""):
        if _is_option(word):
            yield word.lstrip("-").lower(), "" if _is_option(following) else following


def _is_option(word: str) -> bool:
    return word.startswith("-") and word.lstrip("-")[:1].isalpha()


def _given_in_file(name: str, within: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """The options of a file, which may name other files.

    PETSc would follow a circle of them for ever, and prints a page where a line is none of its own.
    """
    told = f"-options_file {name}"
    if not name or not Path(name).is_file():
        path = Path(name)
        what = "not a regular file" if name and path.exists() else "no such file"
        raise InputError(f"{told}: {'is a folder' if name and path.is_dir() else what}")
    real = os.path.realpath(name)
    if real in within:
        raise InputError(f"{told}: includes itself")
    for words in () if name.endswith((".yaml", ".yml")) else _lines(name, told):
        yield from _given(words, (*within, real))


def _lines(name: str, told: str) -> Iterator[list[str]]:
    """The words of the lines of a file of options."""
    try:
        content = Path(name).read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{told}: cannot be read ({error.strerror})") from None
    if "\0" in content:
        raise InputError(f"{told}: not a text file")
    for number, line in enumerate(content.splitlines(), start=1):
        words = [word.strip("\"'") for word in line.partition("#")[0].split()]
        if not words or words[0].startswith(("!", "%")):
            continue
        if not (_is_option(words[0]) or (words[0].lower() == "alias" and len(words) == 3)):
            raise InputError(
                f"{told}: line {number} begins with {words[0][:40]!r}, options begin with a dash"
            )
        yield words
