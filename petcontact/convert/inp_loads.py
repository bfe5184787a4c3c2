"""Loads of an input file: forces at nodes, pressures and tractions of faces, and those of the
volume."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterable, Sequence
from typing import Any

import numpy as np

from .inp_elements import count
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
            add(read.forces[-1], [(number, int(freedom))], force)


def read_load(read: Any, keyword: Keyword) -> None:
    """Read pressures, tractions and forces of the volume."""
    for row in keyword.rows:
        kind, name = row[1].upper() if len(row) > 1 else "", row[0].upper()
        # a surface has its faces, whatever number stands behind the P
        whole = name in read.surfaces.keys() - read.covering.keys() - read.file.elsets.keys()
        if kind in ("GRAV", "CENTRIF", "BX", "BY", "BZ"):
            _volume_load(read, keyword, kind, row)
        elif kind == "TRVEC" and whole:
            _pull(read, keyword, row)
        elif kind[:1] == "P" and (kind[1:].isdecimal() or (kind == "P" and whole)):
            _press(read, keyword, row, name if whole else "")
        else:
            read.note(keyword, f"load {kind or 'missing'} on {row[0]}; not taken")


def _press(read: Any, keyword: Keyword, row: Sequence[str], surface: str) -> None:
    """Read a pressure on a surface or on a face of elements; note faces that another one pressed in
    an earlier step."""
    if surface:
        faces = read.surfaces[surface]
        read.used.add(surface)
    else:
        elements = read.file.members(row[0], "ELSET")
        faces = read.faces(keyword, row[0], elements, row[1])
    others = [face for face in faces if read.pressing.get(face, surface) != surface]
    # programs differ in whether loads of two steps add up, too
    if twice := [face[0] for face in others if face not in read.pressed[-1]]:
        read.note(
            keyword,
            f"{surface or 'the pressure'}: {count(twice, 'element')} that another surface "
            "presses since an earlier step; it takes the place of that one",
        )
    read.pressing |= dict.fromkeys(faces, surface) | dict.fromkeys(others, "several")
    add(read.pressed[-1], faces, read.floats(keyword, row[2:3])[0])


def _pull(read: Any, keyword: Keyword, row: Sequence[str]) -> None:
    """Read a traction by its size and direction."""
    size, *way = read.floats(keyword, (*row[2:6], *[""] * 4)[:4])
    read.used.add(row[0].upper())
    for face in read.surfaces[row[0].upper()]:
        dim = 3 if read.file.elements[face[0]][0].startswith("C3D") else 2
        pull = np.zeros((1 + dim, dim))
        pull[0] = size * np.array(way[:dim]) / np.linalg.norm(way)
        add(read.tractions[-1], [face], pull)


def _volume_load(read: Any, keyword: Keyword, kind: str, row: Sequence[str]) -> None:
    size, *way = read.floats(keyword, (*row[2:9], *[""] * 7)[:7])
    key, load = "acceleration", size * np.array(way[:3]) / (math.hypot(*way[:3]) or 1.0)
    if kind[0] == "B":
        key, load = "force", size * np.eye(3)["XYZ".index(kind[1])]
    # without a set it is that of the whole model
    elements = read.file.members(row[0], "ELSET") if row[0] else [*read.file.elements]
    if kind == "CENTRIF":
        key, load = "rotation", np.array([size, *way])
        if size < 0.0:
            raise read.error(keyword, f"CENTRIF: ω² is not negative, got {size:g}")
        if twice := [n for n in elements if read.volume[-1].pop((n, key), None) is not None]:
            read.note(keyword, f"CENTRIF: the second of {count(twice, 'element')}; it is taken")
    add(read.volume[-1], [(number, key) for number in elements], load)


def add(loads: dict[Any, Any], places: Iterable[Hashable], load: Any) -> None:
    """Add a load to those that act in the same step: lines of a step add up, also of CalculiX."""
    for place in places:
        loads[place] = loads.get(place, 0.0) + load
