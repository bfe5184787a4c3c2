"""Loads of an input file: forces at nodes, pressures and tractions of faces, and those of the
volume."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..untyped import Keyed
from .inp_elements import count
from .inp_file import Face
from .inp_keywords import Keyword


def read_force(read: Any, keyword: Keyword) -> None:
    """Read forces at nodes."""
    for row in keyword.rows:
        if len(row) != 3:
            raise read.error(keyword, f"node, degree of freedom and force, got {', '.join(row)}")
        freedom, force = read.floats(keyword, row[1:])
        if freedom not in (1.0, 2.0, 3.0) and not read.refers(row[0]):
            read.note(keyword, f"{row[0]}: moments act on no node of a solid; not taken")
            continue
        for number in read.file.members(row[0]):
            forces, key = read.forces[-1], (number, int(freedom))
            forces[key] = forces.get(key, 0.0) + force


def read_load(read: Any, keyword: Keyword) -> None:
    """Read pressures, tractions and forces of the volume."""
    for row in keyword.rows:
        kind = row[1].upper() if len(row) > 1 else ""
        # a surface has its faces, whatever number stands behind the P
        whole = read.surfaces.keys() - read.covering.keys() - read.file.elsets.keys()
        pressed = kind[:1] == "P" and (kind == "P" or kind[1:].isdecimal())
        if pressed and row[0].upper() in whole:
            read.used.add(source := row[0].upper())
            faces = read.surfaces[source]
        elif kind in ("GRAV", "CENTRIF", "BX", "BY", "BZ"):
            _volume_load(read, keyword, kind, row)
            continue
        elif kind == "TRVEC" and row[0].upper() in whole:
            _pull(read, keyword, row)
            continue
        elif kind[:1] == "P" and kind[1:].isdecimal():
            source = ""
            faces = read.faces(keyword, row[0], read.file.members(row[0], "ELSET"), kind)
        else:
            read.note(keyword, f"load {kind or 'missing'} on {row[0]}; not taken")
            continue
        read.pressed[-1] |= dict.fromkeys(faces, read.floats(keyword, row[2:3])[0])
        _note_second(read, keyword, faces, source)


def _note_second(read: Any, keyword: Keyword, faces: list[Face], source: str) -> None:
    """Note faces that another surface presses already: Abaqus adds, CalculiX takes the last."""
    if twice := [face[0] for face in faces if read.pressing.get(face, source) != source]:
        name = source or "the pressure"
        read.note(
            keyword, f"{name}: {count(twice, 'element')} that another surface presses; it is taken"
        )
    read.pressing |= dict.fromkeys(faces, source)


def _pull(read: Any, keyword: Keyword, row: Sequence[str]) -> None:
    """Read a traction by its size and direction."""
    size, *way = read.floats(keyword, (*row[2:6], *[""] * 4)[:4])
    read.used.add(row[0].upper())
    for face in read.surfaces[row[0].upper()]:
        dim = 3 if read.file.elements[face[0]][0].startswith("C3D") else 2
        pull = np.zeros((1 + dim, dim))
        pull[0] = size * np.array(way[:dim]) / np.linalg.norm(way)
        read.tractions[-1][face] = pull


def _volume_load(read: Any, keyword: Keyword, kind: str, row: Sequence[str]) -> None:
    size, *way = read.floats(keyword, (*row[2:9], *[""] * 7)[:7])
    long = math.hypot(*way[:3]) or 1.0
    loads: Keyed = {"acceleration": [size * c / long for c in way[:3]]}
    if kind[0] == "B":
        loads = {f"force_{kind[1].lower()}": size}
    if kind == "CENTRIF":
        if size < 0.0:
            raise read.error(keyword, f"CENTRIF: ω² is not negative, got {size:g}")
        loads = {"angular_velocity": math.sqrt(size), "centre": way[:3], "axis": way[3:]}
    # without a set it is that of the whole model
    for number in read.file.members(row[0], "ELSET") if row[0] else read.file.elements:
        read.volume[-1][number] = read.volume[-1].get(number, {}) | loads
