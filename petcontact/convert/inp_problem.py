"""A problem from an input file of Abaqus or CalculiX; what of it does not fit is named."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import scipy
import tomli_w

from ..errors import InputError
from .inp_file import CORNERS, FACES, Face, InpFile, Keyword, read_inp

SILENT = {
    "HEADING", "STATIC", "END STEP", "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT", "NODE PRINT", "EL PRINT",
    "NODE FILE", "EL FILE", "CONTACT FILE", "CONTACT PRINT", "ENERGY OUTPUT", "RESTART", "PREPRINT", "CONTROLS", "MONITOR",
    "SURFACE BEHAVIOR", "MATERIAL", "SURFACE INTERACTION", "SOLID SECTION", "PHYSICAL CONSTANTS", "PRINT",
}  # fmt: skip
"""What says nothing of the problem, or is read with the keyword that it belongs to."""
TYPED = {"ENCASTRE": (1, 2, 3), "PINNED": (1, 2, 3), "XSYMM": (1,), "YSYMM": (2,), "ZSYMM": (3,)}
"""Degrees of freedom that named conditions hold."""
FREE = "free"


@dataclass
class Converted:
    """The files of a problem.

    Attributes
    ----------
    toml : str
    meshes : dict of str to str
        Contents of .msh files by name.
    notes : list of str
        What of the file was not taken, a line each.
    """

    toml: str = ""
    meshes: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


@dataclass
class _Reader:
    """What the keywords say, by surface, set and step."""

    file: InpFile
    notes: list[str] = field(default_factory=list)
    surfaces: dict[str, list[Face]] = field(default_factory=dict)
    materials: dict[str, dict[str, float]] = field(default_factory=dict)
    sections: dict[int, str] = field(default_factory=dict)
    friction: dict[str, float] = field(default_factory=dict)
    pairs: list[dict[str, str]] = field(default_factory=list)
    held: list[dict[str, dict[int, float]]] = field(default_factory=lambda: [{}])
    pressed: list[dict[Face, float]] = field(default_factory=lambda: [{}])
    gravity: dict[int, tuple[float, ...]] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)

    def read(self) -> None:
        """All keywords, in order; those in a step belong to it."""
        material = interaction = ""
        for keyword in self.file.rest:
            name, given = keyword.name, keyword.parameters
            if name == "MATERIAL":
                material = given.get("NAME", "").upper()
                self.materials[material] = {}
            elif name == "SURFACE INTERACTION":
                interaction = given.get("NAME", "").upper()
            elif name in ("ELASTIC", "DENSITY", "EXPANSION") and keyword.rows:
                keys = {"ELASTIC": ("young_modulus", "poisson_ratio"), "DENSITY": ("density",),
                        "EXPANSION": ("thermal_expansion",)}[name]  # fmt: skip
                if name == "ELASTIC" and given.get("TYPE", "ISOTROPIC").upper() not in ("ISO", "ISOTROPIC"):
                    raise self.error(keyword, "materials are isotropic; take the body as a superelement")
                self.materials[material] |= dict(zip(keys, self.floats(keyword, keyword.rows[0]), strict=False))
            elif name == "FRICTION" and keyword.rows:
                self.friction[interaction] = self.floats(keyword, keyword.rows[0])[0]
            elif name == "SOLID SECTION":
                for number in self.file.element_numbers(given.get("ELSET", "")):
                    self.sections[number] = given.get("MATERIAL", "").upper()
            elif name == "STEP":
                # the first step's conditions stand beside those of the model
                if "STEP" in self.names:
                    self.held.append(dict(self.held[-1]))
                    self.pressed.append(dict(self.pressed[-1]))
                self.names["STEP"] = "seen"
            elif not self._take(keyword) and name not in SILENT:
                self.note(keyword, "not taken")

    def _take(self, keyword: Keyword) -> bool:
        """Whether a keyword is one of surfaces, contact, conditions or loads, and was read."""
        readers = {"SURFACE": self._surface, "CONTACT PAIR": self._pair, "TIE": self._pair, "BOUNDARY": self._boundary,
                   "DLOAD": self._load, "DSLOAD": self._load}  # fmt: skip
        if keyword.name not in readers:
            return False
        readers[keyword.name](keyword)
        return True

    def _surface(self, keyword: Keyword) -> None:
        if keyword.parameters.get("TYPE", "ELEMENT").upper() != "ELEMENT":
            self.note(keyword, "a surface of nodes has no faces; not taken")
            return
        faces = self.surfaces.setdefault(keyword.parameters.get("NAME", "").upper(), [])
        for row in keyword.rows:
            numbers, side = self.file.element_numbers(row[0]), row[1].upper() if len(row) > 1 else ""
            if not (side[:1] == "S" and side[1:].isdecimal()):
                self.note(keyword, f"face {side or 'missing'} of {row[0]}: S1, S2, ... are read; not taken")
                continue
            faces += [(number, int(side[1:]) - 1) for number in numbers if number in self.file.elements]

    def _pair(self, keyword: Keyword) -> None:
        for row in keyword.rows:
            self.pairs.append({"interaction": keyword.parameters.get("INTERACTION", "").upper(), "kind": keyword.name,
                               "secondary": row[0].upper(), "primary": row[1].upper()})  # fmt: skip

    def _boundary(self, keyword: Keyword) -> None:
        for row in keyword.rows:
            known = self.held[-1].setdefault(row[0].upper(), {})
            if len(row) > 1 and row[1].upper() in TYPED:
                known |= dict.fromkeys(TYPED[row[1].upper()], 0.0)
                continue
            first, last, value = self.floats(keyword, [*row[1:], *["", "", ""]][:3])
            for freedom in range(int(first), int(last or first) + 1):
                if freedom <= 3:
                    known[freedom] = value
                else:
                    self.note(keyword, f"{row[0]}: rotations are none of solids; not taken")

    def _load(self, keyword: Keyword) -> None:
        for row in keyword.rows:
            kind = row[1].upper() if len(row) > 1 else ""
            if keyword.name == "DSLOAD" and kind == "P":
                faces = self.surfaces.get(row[0].upper(), [])
            elif kind == "GRAV":
                size, *way = self.floats(keyword, row[2:6])
                self.gravity |= dict.fromkeys(self.file.element_numbers(row[0]), tuple(size * c for c in way))
                continue
            elif kind[:1] == "P" and kind[1:].isdecimal():
                faces = [(number, int(kind[1:]) - 1) for number in self.file.element_numbers(row[0])]
            else:
                self.note(keyword, f"load {kind or 'missing'} on {row[0]}; not taken")
                continue
            self.pressed[-1] |= dict.fromkeys(faces, self.floats(keyword, row[2:3])[0])

    def floats(self, keyword: Keyword, words: Sequence[str]) -> list[float]:
        """Numbers of a row; what is left out is 0."""
        try:
            return [float(word.upper().replace("D", "E")) if word else 0.0 for word in words]
        except ValueError:
            raise self.error(keyword, f"numbers are expected, got {', '.join(words)}") from None

    def error(self, keyword: Keyword, text: str) -> InputError:
        """One line that says where."""
        return InputError(f"{self.file.path}: line {keyword.line}: *{keyword.name}: {text}")

    def note(self, keyword: Keyword, text: str) -> None:
        """What is reported of a keyword."""
        self.notes.append(f"line {keyword.line}: *{keyword.name}: {text}")


def convert_inp(path: str | Path, name: str) -> Converted:
    """The problem of a flat input file, as a config and a mesh of the surface of each body.

    Bodies are what hangs together by nodes, with the material of their *SOLID SECTION. Taken are *SURFACE of element faces,
    *CONTACT PAIR and *TIE with *FRICTION, *BOUNDARY of node sets that cover faces, *DLOAD and *DSLOAD of pressure, GRAV.
    Edges of elements of second order are taken as straight.

    Raises
    ------
    InputError
        If the file cannot be read, holds no body, or one of several materials.
    """
    reader = _Reader(read_inp(path))
    reader.read()
    file, result, bodies = reader.file, Converted(notes=reader.notes), []
    owner: dict[str, list[str]] = {}
    taken: set[str] = set()
    for count, elements in enumerate(_connected(file)):
        body = _Body(reader, elements, f"body{count + 1}")
        mesh = f"{name}-{body.name}.msh"
        result.meshes[mesh] = body.msh()
        bodies.append(body.table(mesh))
        taken |= body.sets
        for surface in body.surfaces:
            owner.setdefault(surface, []).append(f"{body.name}.{surface}")
    data: dict[str, Any] = {"title": Path(path).stem, "body": bodies, "contact": _pairs(reader, owner)}
    if len(reader.held) > 1:
        data["step"] = _steps(reader, bodies)
    uncovered = [name for name in reader.held[-1] if name not in taken]
    result.notes += [f"*BOUNDARY: {name} covers no face of a body; not taken" for name in uncovered]
    head = "".join(f"# not taken: {note}\n" for note in result.notes)
    data = {key: value for key, value in data.items() if value}
    result.toml = f"#:schema petcontact.schema.json\n# From {Path(path).name}.\n{head}{tomli_w.dumps(data)}"
    return result


def _pairs(reader: _Reader, owner: dict[str, list[str]]) -> list[dict[str, Any]]:
    found = []
    for number, pair in enumerate(reader.pairs, 1):
        ends = [owner.get(pair[side], []) for side in ("secondary", "primary")]
        if not all(len(end) == 1 for end in ends):
            reader.notes.append(f"*{pair['kind']} {pair['secondary']}, {pair['primary']}: each surface must lie on one "
                                "body; not taken")  # fmt: skip
            continue
        table: dict[str, Any] = {"name": f"pair{number}", "secondary": ends[0][0], "primary": ends[1][0]}
        if pair["kind"] == "TIE":
            table["normal"] = "bonded"
        elif pair["interaction"] in reader.friction:
            table["friction_coefficient"] = reader.friction[pair["interaction"]]
        found.append(table)
    return found


def _steps(reader: _Reader, bodies: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Load steps: what of held or pressed parts has another value than in the step before."""
    steps: list[dict[str, Any]] = []
    for number in range(len(reader.held)):
        changes = []
        for body in bodies:
            for condition in body["boundary"] if number else []:
                dim = len(condition.get("value", ()))
                now, before = (_condition(reader, condition["part"], dim, k) for k in (number, number - 1))
                if now != before and now.keys() == before.keys():
                    changes.append({"body": body["name"], "part": condition["part"], **now})
        steps.append({"name": f"step{number + 1}", **({"boundary": changes} if changes else {})})
    return steps


def _condition(reader: _Reader, part: str, dim: int, step: int) -> dict[str, Any]:
    """Value or pressure of a part at the end of a step."""
    if dim:
        merged: dict[int, float] = {}
        for name in part.split("+"):
            merged |= reader.held[step].get(name, {})
        return {"value": [merged.get(c + 1, FREE) for c in range(dim)]}
    return {"pressure": next((p for face, p in reader.pressed[step].items() if reader.names.get(f"{face}") == part), 0.0)}


class _Body:
    """One body: its boundary faces, the part of each, and its conditions."""

    def __init__(self, reader: _Reader, elements: list[int], name: str) -> None:
        self.reader, self.elements, self.name = reader, elements, name
        file = reader.file
        kinds = {file.elements[number][0] for number in elements}
        self.dim = 3 if next(iter(kinds)).startswith("C3D") else 2
        self.plane = "stress" if any(kind.startswith("CPS") for kind in kinds) else "strain"
        seen: dict[tuple[int, ...], list[tuple[Face, tuple[int, ...]]]] = {}
        for number in elements:
            kind, nodes = file.elements[number]
            for k, corners in enumerate(FACES[CORNERS[kind]]):
                face = tuple(nodes[c] for c in corners)
                seen.setdefault(tuple(sorted(face)), []).append(((number, k), face))
        self.faces = dict(found[0] for found in seen.values() if len(found) == 1)
        self.surfaces: list[str] = []
        self.sets: set[str] = set()
        self.parts = self._parts()

    def _parts(self) -> dict[Face, str]:
        """Contact surfaces first, then sets that are held, then what is pressed; the rest is free."""
        reader, parts = self.reader, dict[Face, str]()
        for pair in reader.pairs:
            for surface in (pair["secondary"], pair["primary"]):
                mine = [face for face in reader.surfaces.get(surface, []) if face in self.faces]
                parts |= {face: surface for face in mine if face not in parts}
                if mine and surface not in self.surfaces:
                    self.surfaces.append(surface)
        members = {name: set(reader.file.node_numbers(name)) for name in reader.held[-1]}
        for face, nodes in self.faces.items():
            names = [name for name, numbers in members.items() if numbers.issuperset(nodes)]
            self.sets.update(names)
            if names and face not in parts:
                parts[face] = "+".join(names)
        values: dict[float, str] = {}
        for face, pressure in reader.pressed[-1].items():
            if face in self.faces and face not in parts:
                parts[face] = values.setdefault(pressure, f"pressed{len(values) + 1}")
                reader.names[f"{face}"] = parts[face]
        return {face: parts.get(face, "rest") for face in self.faces}

    def table(self, mesh: str) -> dict[str, Any]:
        """The [[body]] of the config."""
        reader = self.reader
        names = {reader.sections.get(number, "") for number in self.elements}
        if len(names) > 1:
            raise InputError(f"{reader.file.path}: a body of the materials {', '.join(sorted(names))}; a body has one")
        material: dict[str, Any] = dict(reader.materials.get(next(iter(names)), {}))
        if "young_modulus" not in material:
            raise InputError(f"{reader.file.path}: element {self.elements[0]} has no *SOLID SECTION with an *ELASTIC "
                             "material")  # fmt: skip
        if self.plane == "stress" and self.dim == 2:
            material["plane"] = "stress"
        conditions: list[dict[str, Any]] = []
        for part in dict.fromkeys(self.parts.values()):
            if part in self.surfaces or part == "rest":
                continue
            pressed = part.startswith("pressed")
            value = _condition(reader, part, 0 if pressed else self.dim, 0)
            conditions.append({"part": part, "condition": "traction" if pressed else "displacement", **value})
        table: dict[str, Any] = {"name": self.name, "material": material, "geometry": {"shape": "gmsh", "file": mesh},
                                 "mesh": {"order": 1} if self.dim == 3 else {}, "boundary": conditions}  # fmt: skip
        gravity = next((reader.gravity[n] for n in self.elements if n in reader.gravity), None)
        if gravity is not None:
            table["loads"] = {"acceleration": list(gravity[: self.dim])}
        return table

    def msh(self) -> str:
        """The boundary as a Gmsh file, its parts physical groups."""
        used = sorted({node for nodes in self.faces.values() for node in nodes})
        place = {node: k for k, node in enumerate(used)}
        points = np.array([(*self.reader.file.nodes[node], 0.0, 0.0)[:3] for node in used])
        tags = {part: k for k, part in enumerate(dict.fromkeys(self.parts.values()), 1)}
        blocks, physical = [], []
        for kind, count in (("line", 2), ("triangle", 3), ("quad", 4)):
            mine = [face for face, nodes in self.faces.items() if len(nodes) == count]
            if mine:
                blocks.append((kind, np.array([[place[node] for node in self.faces[face]] for face in mine])))
                physical.append(np.array([tags[self.parts[face]] for face in mine]))
        mesh = meshio.Mesh(points, blocks, cell_data={"gmsh:physical": physical, "gmsh:geometrical": physical},
                           field_data={part: np.array([tag, self.dim - 1]) for part, tag in tags.items()})  # fmt: skip
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "body.msh"
            meshio.write(file, mesh, file_format="gmsh22", binary=False)
            return file.read_text(encoding="utf-8")


def _connected(file: InpFile) -> list[list[int]]:
    """Elements that hang together by nodes, body by body, in the order of their numbers."""
    numbers = sorted(file.elements)
    place = {node: k for k, node in enumerate(sorted(file.nodes))}
    rows = np.concatenate([np.full(len(file.elements[n][1]), k) for k, n in enumerate(numbers)])
    columns = np.array([place[node] for n in numbers for node in file.elements[n][1]])
    size = len(numbers) + len(place)
    graph = scipy.sparse.coo_matrix((np.ones(len(rows)), (rows, len(numbers) + columns)), (size, size))
    label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1][: len(numbers)]
    return [[numbers[k] for k in np.flatnonzero(label == value)] for value in dict.fromkeys(label.tolist())]
