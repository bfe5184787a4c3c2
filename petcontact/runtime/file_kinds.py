"""What a file that was given in the place of another one is, and what is done with it."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable
from pathlib import Path

from ..errors import InputError

RESULTS = (".h5", ".hdf5")
"""Suffixes of result files."""
CONFIG = "a config; solve it first: petcontact solve {path}"
PROBLEM = (
    "one problem, no sweep; `petcontact solve {path}` solves it, `petcontact init study --kind "
    "sweep` begins a sweep"
)
CAD = "a CAD file; name it in a config: [geometry] shape = 'gmsh', file = '{name}'"
KINDS = {
    **dict.fromkeys((".step", ".stp", ".iges", ".igs", ".brep"), CAD),
    ".msh": "a Gmsh file; name it in a config: [geometry] shape = 'gmsh', file = '{name}'",
    ".h5": "a result file; `petcontact show {path}` prints it, `petcontact plot` draws it",
    ".toml": CONFIG,
    **dict.fromkeys(("material", "body"), PROBLEM),
    "problems": "a sweep; solve its cases: petcontact sweep {path}",
}
"""What suffixes and keys of TOML files stand for, and the step that leads on."""


def demand_result_name(path: str | Path, option: str = "") -> None:
    """Refuse a name that no result file has: readers of other formats would fail on it."""
    if Path(path).suffix.lower() not in RESULTS:
        raise InputError(
            f"{option}{path}: a result is a file {' or '.join(RESULTS)}; petcontact field and "
            "export write other formats from it"
        )


def known_kind(path: str | Path, wanted: Iterable[str], keys: Iterable[str] = ()) -> str | None:
    """What a file is by its suffix and keys where none is wanted, None where nothing is known.

    Examples
    --------
    >>> known_kind("block.toml", [".h5"])
    'a config; solve it first: petcontact solve block.toml'
    """
    for word in (Path(path).suffix.lower(), *keys):
        if word in KINDS and word not in wanted:
            return KINDS[word].format(path=path, name=Path(path).name)
    return None


def like(path: str | Path, suffixes: Iterable[str] = (".toml", ".h5")) -> str:
    """`, did you mean ...?` where a file of a name like that of a missing one stands beside it."""
    wanted, folder = Path(path), Path(path).parent
    alike = difflib.get_close_matches(wanted.suffix, [*suffixes])
    kinds = {wanted.suffix, *alike} if wanted.suffix else {*suffixes}
    try:
        exists, names = wanted.exists(), os.listdir(folder)
    except (OSError, ValueError):
        return ""
    there = [] if exists else sorted(name for name in names if Path(name).suffix in kinds)
    whole = [name for name in there if Path(name).stem == wanted.name]
    near = whole or difflib.get_close_matches(wanted.name, there, n=1)
    return f", did you mean {folder / near[0]}?" if near else ""
