"""What a file that was given in the place of another one is, and what is done with it."""

from __future__ import annotations

from pathlib import Path

CAD = "a CAD file; name it in a config: [geometry] shape = 'gmsh', file = '{name}'"
KINDS = {
    **dict.fromkeys((".step", ".stp", ".iges", ".igs", ".brep"), CAD),
    ".msh": "a Gmsh file; name it in a config: [geometry] shape = 'gmsh', file = '{name}'",
    ".h5": "a result file; `petcontact plot {path}` draws it",
    ".toml": "a config; solve it first: petcontact solve {path}",
}
"""What suffixes stand for, and the step that leads on."""


def known_kind(path: str | Path, wanted: str) -> str | None:
    """What a file is by its suffix where that is not the wanted one, None where nothing is known.

    Examples
    --------
    >>> known_kind("block.toml", ".h5")
    'a config; solve it first: petcontact solve block.toml'
    """
    suffix = Path(path).suffix.lower()
    if suffix == wanted or suffix not in KINDS:
        return None
    return KINDS[suffix].format(path=path, name=Path(path).name)
