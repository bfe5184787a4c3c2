"""Names of faces in a STEP file (ISO 10303-21), which Gmsh does not pass on.

The file lists the faces of a solid in the order in which OpenCASCADE has them; that it is so for a
given solid is checked by the distances between the middles of their vertices, which no unit and no
place in an assembly changes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...arrays import Array

INSTANCE = re.compile(r"#(\d+)\s*=\s*(\w+)\s*\(((?:'(?:[^']|'')*'|[^';])*)\)\s*;", re.DOTALL)
"""Number, kind and values of a line of data."""
NAME = re.compile(r"\s*'((?:[^']|'')*)'")
REFERENCE = re.compile(r"#(\d+)")
WIDE = re.compile(r"\\X2\\((?:[0-9A-Fa-f]{4})+)\\X0\\")
"""Characters that are not ASCII."""
NAMELESS = {"", "NONE"}
AGREE = 1e-5
"""Of distances between faces, over the largest."""


def face_names(
    path: Path, solids: Sequence[Sequence[Sequence[Sequence[float]]]]
) -> list[list[str]]:
    """Names of the faces of solids, "" where there is none.

    Parameters
    ----------
    path : Path
        A STEP file; any other has no names.
    solids : sequences
        Of each solid, of each of its faces, the vertices [length].

    Returns
    -------
    list of list of str
        As the faces are given; all "" where the file's do not agree with them.
    """
    text = path.read_text(encoding="latin-1")
    data = {int(number): (kind, values) for number, kind, values in INSTANCE.findall(text)}
    shells = []
    for kind, values in data.values():
        if kind == "CLOSED_SHELL":
            faces = [data[key] for key in _references(values) if key in data]
            shells.append(
                (
                    [_name(given) for _, given in faces],
                    [_vertices(data, given) for _, given in faces],
                )
            )
    result = []
    for solid in solids:
        apart = _distances(solid)
        names = next(
            (
                names
                for names, corners in shells
                if len(corners) == len(solid)
                and np.allclose(_distances(corners), apart, atol=AGREE)
            ),
            [""] * len(solid),
        )
        result.append(names)
    return result


def _references(values: str) -> Iterator[int]:
    return map(int, REFERENCE.findall(NAME.sub("", values)))


def _name(values: str) -> str:
    found = NAME.match(values)
    name = found[1].replace("''", "'") if found else ""
    name = WIDE.sub(
        lambda match: bytes.fromhex(match[1]).decode("utf-16-be", "replace"), name
    ).strip()
    return "" if name in NAMELESS else name


def _vertices(data: dict[int, tuple[str, str]], face: str) -> list[list[float]]:
    """Points of the vertices around a face, from the bounds that it names before its surface."""
    found, left = dict[int, list[float]](), list(_references(face))[:-1]
    while left:
        number = left.pop()
        kind, values = data.get(number, ("", ""))
        if kind == "VERTEX_POINT":
            point = data.get(next(_references(values), -1), ("", ""))[1]
            found[number] = [
                float(word)
                for word in re.findall(r"[-+]?\d[\d.]*(?:[eE][-+]?\d+)?", NAME.sub("", point))
            ]
        elif kind == "EDGE_CURVE":
            left += list(_references(values))[:2]
        elif kind in (
            "FACE_BOUND",
            "FACE_OUTER_BOUND",
            "EDGE_LOOP",
            "ORIENTED_EDGE",
            "VERTEX_LOOP",
        ):
            left += _references(values)
    return list(found.values())


def _distances(faces: Sequence[Sequence[Sequence[float]]]) -> Array:
    """Between the middles of the vertices of faces, over the largest."""
    middles = np.array(
        [np.mean(corners, axis=0) if len(corners) else np.zeros(3) for corners in faces]
    )
    apart = np.linalg.norm(middles[:, None] - middles, axis=2)
    return np.asarray(apart / (apart.max(initial=0.0) or 1.0))
