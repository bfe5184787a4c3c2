"""A problem from an input file of Abaqus or CalculiX; what of it does not fit is named."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import scipy
import tomli_w

from ..errors import InputError
from .inp_elements import check_elements, count
from .inp_file import CORNERS, FACES, Face, InpFile, read_inp
from .inp_statements import Statements

FREE, PRESSED = "free", "pressed"


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


def convert_inp(path: str | Path, name: str) -> Converted:
    """The problem of a flat input file, as a config and a mesh of the surface of each body.

    Bodies are what hangs together by nodes, with the material of their *SOLID SECTION. Taken are
    *SURFACE of element faces, *CONTACT PAIR and *TIE with *FRICTION, *BOUNDARY of node sets that
    cover faces, *DLOAD and *DSLOAD of pressure, GRAV. Edges of elements of second order are taken
    as straight.

    Raises
    ------
    InputError
        If the file cannot be read, holds no body, or one of several materials.
    """
    reader = Statements(read_inp(path))
    reader.notes += check_elements(reader.file)
    reader.read()
    file, result, bodies = reader.file, Converted(notes=reader.notes), []
    owner: dict[str, list[str]] = {}
    taken, parts = set[str](), dict[Face, str]()
    for number, elements in enumerate(_connected(file), 1):
        body = _Body(reader, elements, f"body{number}")
        mesh = f"{name}-{body.name}.msh"
        result.meshes[mesh] = body.msh()
        bodies.append(body.table(mesh))
        taken |= body.sets
        parts |= body.parts
        for surface in body.surfaces:
            owner.setdefault(surface, []).append(f"{body.name}.{surface}")
    data: dict[str, Any] = {
        "title": Path(path).stem,
        "body": bodies,
        "contact": _pairs(reader, owner),
    }
    if len(reader.held) > 1:
        data["step"] = _steps(reader, bodies)
    uncovered = [name for name in reader.held[-1] if name not in taken]
    result.notes += [
        f"*BOUNDARY: {name} ({count(file.node_numbers(name), 'node')}) covers no face of a body "
        f"that is not in contact; not taken"
        for name in uncovered
    ]
    result.notes += _unused(reader, parts)
    head = "".join(f"# not taken: {note}\n" for note in result.notes)
    data = {key: value for key, value in data.items() if value}
    result.toml = (
        f"#:schema petcontact.schema.json\n# From {Path(path).name}.\n{head}{tomli_w.dumps(data)}"
    )
    return result


def _unused(reader: Statements, parts: dict[Face, str]) -> list[str]:
    """Faces in contact or under pressure that are none of a body's boundary, or have another
    condition."""
    notes = []
    for name, faces in reader.surfaces.items():
        if inside := [number for number, k in faces if (number, k) not in parts]:
            notes.append(f"*SURFACE {name}: faces inside of {count(inside, 'element')}; not taken")
    lost = [face[0] for face in reader.pressed[-1] if not parts.get(face, "").startswith(PRESSED)]
    if lost:
        notes.append(
            f"pressure on faces of {count(lost, 'element')} that lie inside, are held or in "
            f"contact; not taken"
        )
    return notes


def _pairs(reader: Statements, owner: dict[str, list[str]]) -> list[dict[str, Any]]:
    found = []
    for number, pair in enumerate(reader.pairs, 1):
        ends = [owner.get(pair[side], []) for side in ("secondary", "primary")]
        if not all(len(end) == 1 for end in ends):
            reader.notes.append(
                f"*{pair['kind']} {pair['secondary']}, {pair['primary']}: each surface must lie on "
                f"one "
                "body; not taken"
            )
            continue
        table: dict[str, Any] = {
            "name": f"pair{number}",
            "secondary": ends[0][0],
            "primary": ends[1][0],
        }
        if pair["kind"] == "TIE" or pair["interaction"] in reader.tied:
            table["normal"] = "bonded"
        elif pair["interaction"] in reader.friction:
            table |= reader.friction[pair["interaction"]]
        found.append(table)
    return found


def _steps(reader: Statements, bodies: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Load steps: what of held or pressed parts has another value than in the step before."""
    steps: list[dict[str, Any]] = []
    for number in range(len(reader.held)):
        changes = []
        for body in bodies:
            for condition in body["boundary"] if number else []:
                dim = len(condition.get("value", ()))
                now, before = (
                    _condition(reader, condition["part"], dim, k) for k in (number, number - 1)
                )
                if now != before and now.keys() == before.keys():
                    changes.append({"body": body["name"], "part": condition["part"], **now})
        steps.append({"name": f"step{number + 1}", **({"boundary": changes} if changes else {})})
    return steps


def _condition(reader: Statements, part: str, dim: int, step: int) -> dict[str, Any]:
    """Value or pressure of a part at the end of a step."""
    if dim:
        merged: dict[int, float] = {}
        for name in part.split("+"):
            merged |= reader.held[step].get(name, {})
        return {"value": [merged.get(c + 1, FREE) for c in range(dim)]}
    return {
        "pressure": next(
            (p for face, p in reader.pressed[step].items() if reader.names.get(f"{face}") == part),
            0.0,
        )
    }


class _Body:
    """One body: its boundary faces, the part of each, and its conditions."""

    def __init__(self, reader: Statements, elements: list[int], name: str) -> None:
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
        """Contact surfaces first, then sets that are held, then what is pressed; the rest is
        free."""
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
            if names and face not in parts:
                self.sets.update(names)
                parts[face] = "+".join(names)
        values: dict[tuple[float, ...], str] = {}
        for face in reader.pressed[-1]:
            if face in self.faces and face not in parts:
                through = tuple(step.get(face, 0.0) for step in reader.pressed)
                parts[face] = values.setdefault(through, f"{PRESSED}{len(values) + 1}")
                reader.names[f"{face}"] = parts[face]
        return {face: parts.get(face, "rest") for face in self.faces}

    def table(self, mesh: str) -> dict[str, Any]:
        """The [[body]] of the config."""
        reader = self.reader
        names = {reader.sections.get(number, "") for number in self.elements}
        if len(names) > 1:
            raise InputError(
                f"{reader.file.path}: a body of the materials {', '.join(sorted(names))}; a body "
                f"has one"
            )
        material: dict[str, Any] = dict(reader.materials.get(next(iter(names)), {}))
        if "young_modulus" not in material:
            raise InputError(
                f"{reader.file.path}: element {self.elements[0]} has no *SOLID SECTION with an "
                f"*ELASTIC "
                "material"
            )
        if self.plane == "stress" and self.dim == 2:
            material["plane"] = "stress"
        conditions: list[dict[str, Any]] = []
        for part in dict.fromkeys(self.parts.values()):
            if part in self.surfaces or part == "rest":
                continue
            pressed = part.startswith(PRESSED)
            value = _condition(reader, part, 0 if pressed else self.dim, 0)
            conditions.append(
                {"part": part, "condition": "traction" if pressed else "displacement", **value}
            )
        table: dict[str, Any] = {
            "name": self.name,
            "material": material,
            "geometry": {"shape": "gmsh", "file": mesh},
            "mesh": {"order": 1} if self.dim == 3 else {},
            "boundary": conditions,
        }
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
        for kind, corners in (("line", 2), ("triangle", 3), ("quad", 4)):
            mine = [face for face, nodes in self.faces.items() if len(nodes) == corners]
            if mine:
                blocks.append(
                    (kind, np.array([[place[node] for node in self.faces[face]] for face in mine]))
                )
                physical.append(np.array([tags[self.parts[face]] for face in mine]))
        mesh = meshio.Mesh(
            points,
            blocks,
            cell_data={"gmsh:physical": physical, "gmsh:geometrical": physical},
            field_data={part: np.array([tag, self.dim - 1]) for part, tag in tags.items()},
        )
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
    graph = scipy.sparse.coo_matrix(
        (np.ones(len(rows)), (rows, len(numbers) + columns)), (size, size)
    )
    label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1][: len(numbers)]
    return [
        [numbers[k] for k in np.flatnonzero(label == value)]
        for value in dict.fromkeys(label.tolist())
    ]
