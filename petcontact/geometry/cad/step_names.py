"""Names of faces in a STEP file (ISO 10303-21), which Gmsh does not pass on.

The file lists the faces of a solid in the order of OpenCASCADE. The distances between the middles
of the faces' vertices check this order for each solid: no unit and no place in an assembly changes
them. The module belongs to the program `worker.py` and imports nothing of petcontact. Its time and
memory are linear in the size of a file, whatever the file says.
"""

from __future__ import annotations

import math
import mmap
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

BREAKS = re.compile(rb"'[^']*'?|/\*.*?(?:\*/|\Z)|;", re.DOTALL)
"""A text, a comment, the end of a line of data: no character is looked at twice."""
HEAD = re.compile(rb"\s*#(\d{1,18})\s*=\s*(\w{1,80})\s*\(")
"""Number and kind of a line of data."""
NAME = re.compile(rb"\s*'([^']*(?:''[^']*)*)'")
REFERENCE = re.compile(rb"#(\d{1,18})(?!\d)")
POINT = re.compile(rb"\(([^()]*)\)")
WIDE = re.compile(r"\\X2\\((?:[0-9A-Fa-f]{4})+)\\X0\\")
"""Characters that are not ASCII."""
NAMELESS = {"", "NONE"}
BOUNDS = ("FACE_BOUND", "FACE_OUTER_BOUND", "EDGE_LOOP", "ORIENTED_EDGE", "VERTEX_LOOP")
"""Kinds whose values lead to the vertices around a face."""
FACES = ("ADVANCED_FACE", "FACE_SURFACE")
KINDS = {
    kind.encode()
    for kind in (*BOUNDS, *FACES, "CLOSED_SHELL", "EDGE_CURVE", "VERTEX_POINT", "CARTESIAN_POINT")
}
Lines = dict[int, tuple[str, bytes]]


def face_names(
    path: Path, solids: Sequence[Sequence[Sequence[Sequence[float]]]]
) -> list[list[str]]:
    """Names of the faces of solids, "" where there is none.

    Parameters
    ----------
    path : Path
        A STEP file.
    solids : sequences
        Of each solid, of each of its faces, the vertices [length].

    Returns
    -------
    list of list of str
        As the faces are given; all "" where the file's do not agree with them.
    """
    shells, result = list(_shells(_lines(path), {len(solid) for solid in solids})), []
    for solid in solids:
        apart = _distances(solid)
        fitting = (
            names
            for names, own in shells
            if own.shape == apart.shape and np.allclose(own, apart, atol=1e-5)
        )
        result.append(next(fitting, [""] * len(solid)))
    return result


def _shells(lines: Lines, wanted: set[int]) -> Iterator[tuple[list[str], Any]]:
    """Names and distances of the faces of shells that have so many, and names."""
    # two faces share an edge, and few more a vertex
    left = [20 * len(lines)]
    for kind, values in lines.values():
        if kind == "CLOSED_SHELL":
            faces = [lines[key][1] for key in _references(values) if key in lines]
            if len(faces) in wanted and any(names := list(map(_name, faces))):
                yield names, _distances([_vertices(lines, given, left) for given in faces])


def _lines(path: Path) -> Lines:
    """The lines of data that matter, by number."""
    lines = Lines()
    if os.path.getsize(path) == 0:
        return lines
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
        start = 0
        for match in BREAKS.finditer(text):
            if text[match.start()] != ord(";"):
                continue
            # bytes of a line: a shell of a million faces
            line, start = text[start : min(match.start(), start + 10_000_000)], match.end()
            head = HEAD.match(line) or HEAD.match(
                BREAKS.sub(lambda match: b" " if match[0].startswith(b"/") else match[0], line)
            )
            if head and head[2] in KINDS:
                lines[int(head[1])] = head[2].decode(), head.string[head.end() :]
    return lines


def _references(values: bytes) -> Iterator[int]:
    return map(int, REFERENCE.findall(BREAKS.sub(b"", values)))


def _name(values: bytes) -> str:
    text = NAME.match(values[:2048])
    name = text[1].decode("latin-1").replace("''", "'") if text else ""
    name = WIDE.sub(
        lambda match: bytes.fromhex(match[1]).decode("utf-16-be", "replace"), name
    ).strip()
    return "" if name in NAMELESS or not name.isprintable() else name


def _vertices(lines: Lines, face: bytes, left: list[int]) -> list[list[float]]:
    """Points of the vertices around a face, from the bounds that it names before its surface."""
    vertices, waiting, seen = list[list[float]](), list(_references(face))[:-1], set[int]()
    while waiting and left[0] > 0:
        left[0] -= 1
        number = waiting.pop()
        kind, values = lines.get(number, ("", b""))
        if number in seen:
            continue
        seen.add(number)
        if kind == "VERTEX_POINT":
            vertices += _point(lines.get(next(_references(values), -1), ("", b""))[1])
        elif kind == "EDGE_CURVE":
            waiting += list(_references(values))[:2]
        elif kind in BOUNDS:
            waiting += _references(values)
    return vertices


def _point(values: bytes) -> list[list[float]]:
    """The point of a line, none where it does not hold three numbers."""
    inner = POINT.search(BREAKS.sub(b"", values))
    try:
        point = [float(word) for word in inner[1].split(b",")] if inner else []
    except ValueError:
        return []
    return [point] if len(point) == 3 and all(map(math.isfinite, point)) else []


def _distances(faces: Sequence[Sequence[Sequence[float]]]) -> Any:
    """From the middles of the vertices of faces to some of them, over the largest."""
    middles = np.array(
        [np.mean(corners, axis=0) if len(corners) else np.zeros(3) for corners in faces]
    ).reshape(-1, 3)
    # four faces that lie in no plane tell places apart; sixteen are taken
    some = np.linspace(0, len(faces) - 1, min(len(faces), 16)).astype(int)
    with np.errstate(all="ignore"):  # what overflows agrees with nothing
        apart = np.linalg.norm(middles[:, None] - middles[some], axis=2)
        return apart / (apart.max(initial=0.0) or 1.0)
