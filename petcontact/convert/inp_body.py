"""One body of an input file: its boundary faces, the part of each, and the conditions of parts."""

from __future__ import annotations

import functools
import math
from collections import Counter
from collections.abc import Iterable, Iterator

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..round_off import SINGLE, WRITTEN
from ..untyped import Keyed
from .inp_changes import NOT_TURNED
from .inp_elements import count
from .inp_file import CORNERS, FACES, Face, InpFile
from .inp_forces import linear_traction, loaded_faces, outward, written
from .inp_statements import Statements

FREE = "free"
GMSH = {(2, 2): 1, (2, 3): 8, (3, 3): 2, (3, 4): 3, (3, 6): 9, (3, 8): 16}
"""Types of cells of a Gmsh file, by the dimension of the body and their number of nodes."""
Load = tuple[float, tuple[float | str, ...]]
"""Pressure and traction."""


def boundary_faces(file: InpFile, elements: list[int]) -> dict[Face, tuple[int, ...]]:
    """Return the corner nodes of faces of only one element, without those on an axis."""
    faces = {
        (number, k): tuple(file.elements[number][1][c] for c in own)
        for number in elements
        for k, own in enumerate(FACES[CORNERS[file.elements[number][0]]])
    }
    times = Counter(tuple(sorted(nodes)) for nodes in faces.values())
    single = {face: nodes for face, nodes in faces.items() if times[tuple(sorted(nodes))] == 1}
    if file.elements[elements[0]][0].startswith("CAX"):
        radii = {face: max(abs(file.nodes[n][0]) for n in nodes) for face, nodes in single.items()}
        axis = WRITTEN * max(radii.values())
        single = {face: nodes for face, nodes in single.items() if radii[face] > axis}
    return single


class InpBody:
    """One body.

    Attributes
    ----------
    name : str
    kind : str
        First letters of its elements: C3D, CPE, CPS or CAX.
    dim : int
    faces : dict of corner nodes by boundary face
    parts : dict of str by boundary face
    surfaces : list of str
        Those of contact pairs.
    sets : set of str
        Node sets that hold a part.
    rolling : set of str
        Node sets that are held across their plane faces only.
    free : dict of corner nodes by face
        Faces on which loads act: they are not in contact, and not held in all components for good.
    inside : dict of (K, d) arrays by node
        Forces inside at the end of each step [force].
    """

    def __init__(self, reader: Statements, elements: list[int], name: str) -> None:
        self.reader, self.elements, self.name = reader, elements, name
        self.kind = reader.file.elements[elements[0]][0][:3]
        self.dim = 3 if self.kind == "C3D" else 2
        self.faces = boundary_faces(reader.file, elements)
        self.width = reader.thickness.get(elements[0], 1.0)
        self._none: tuple[Load, ...] = ((0.0, (0.0,) * self.dim),) * len(reader.forces)
        self.surfaces: list[str] = []
        touching: dict[Face, str] = {}
        for surface in (pair[side] for pair in reader.pairs for side in ("secondary", "primary")):
            own_faces = self.faces.keys() & {*reader.surfaces.get(surface, ())}
            touching = dict.fromkeys(own_faces, surface) | touching
            self.surfaces += [surface] * bool(own_faces and surface not in self.surfaces)
        self._says: dict[str, tuple[tuple[str, ...], tuple[Load, ...]]] = {}
        others = self._named({f: nodes for f, nodes in self.faces.items() if f not in touching})
        self.parts = {face: touching.get(face) or others[face] for face in self.faces}
        self.sets = {name for names, _ in self._says.values() for name in names}

    def _named(self, faces: dict[Face, tuple[int, ...]]) -> dict[Face, str]:
        """Parts of faces that are not in contact: those on which the same sets hold and the same
        loads act."""
        holding = self._holding(faces)
        self.rolling = self._rolling(holding)
        steps = range(len(self.reader.held))
        self.free = {
            f: faces[f] for f in faces if any(FREE in self._value(holding[f], k) for k in steps)
        }
        loads = self._loads(self.free)
        says = {face: (holding[face], loads.get(face, self._none)) for face in faces}
        names: dict[tuple[tuple[str, ...], tuple[Load, ...]], str] = {((), self._none): "rest"}
        for sets, acting in dict.fromkeys(says.values()):
            words = [*sets]
            if acting != self._none:
                pulled = any(any(pull) for _, pull in acting)
                words.append(f"{'loaded' if pulled else 'pressed'}{len(names)}")
            names.setdefault((sets, acting), "+".join(words))
        self._says = {
            names[says_of_part]: says_of_part
            for says_of_part in says.values()
            if names[says_of_part] != "rest"
        }
        return {face: names[says_of_part] for face, says_of_part in says.items()}

    def _holding(self, faces: dict[Face, tuple[int, ...]]) -> dict[Face, tuple[str, ...]]:
        """Return the node sets that hold each face."""
        reader = self.reader
        members = {name: set(reader.file.members(name)) for name in reader.held[-1]}
        return {
            face: tuple(name for name, numbers in members.items() if numbers.issuperset(nodes))
            for face, nodes in faces.items()
        }

    def _rolling(self, holding: dict[Face, tuple[str, ...]]) -> set[str]:
        """Return the sets that are held across their faces only; note others that are held along
        turned axes."""
        across, along = set[str](), set[str]()
        for face, names in holding.items():
            for name in self.reader.rollers.keys() & {*names}:
                ways, nodes = self.reader.rollers[name], self.faces[face]
                normal = np.pad(outward(self._at(nodes)), (0, 3 - self.dim))
                flat = all(abs(ways[n] @ normal) > 1.0 - SINGLE for n in nodes if n in ways)
                one = len(names) == 1 and ways.keys() >= {*nodes}
                (across if flat and one else along).add(name)
        self.reader.notes += [NOT_TURNED.format(name) for name in sorted(along)]
        return across - along

    def _loads(self, free: dict[Face, tuple[int, ...]]) -> dict[Face, tuple[Load, ...]]:
        """Pressure and traction of faces at the end of each step; forces at nodes inside are at
        points."""
        forces = self._forces()
        inside = forces.keys() - {n for face in self.faces for n in self.reader.file.cell(face)}
        self.inside = {} if self.kind == "CAX" else {node: forces[node] for node in inside}
        pulled = self._pulled(free, forces, inside)
        pressures = {f: [step.get(f, 0.0) for step in self.reader.pressed] for f in free}
        return {
            face: tuple(zip(pressures[face], map(written, pulled[face]), strict=True))
            for face in free
        }

    def _pulled(
        self, free: dict[Face, tuple[int, ...]], forces: dict[int, Array], inside: set[int]
    ) -> dict[Face, Array]:
        """Return the tractions of faces at the end of each step, with those of forces at nodes."""
        none = np.zeros((1 + self.dim, self.dim))
        tractions = {
            face: np.array([step.get(face, none) for step in self.reader.tractions])
            for face in free
        }
        lost = forces.keys() - self.inside.keys()
        ends = {
            node: self.reader.file.middles.get(node, (node,)) for node in forces.keys() - inside
        }
        for faces, corners in loaded_faces(free, {end for own in ends.values() for end in own}):
            loaded = [node for node, own in ends.items() if own[0] in corners]
            cells = [self._at(self.reader.file.cell(face)) for face in faces]
            through = [
                linear_traction(cells, self._at(loaded), force / self.width, self.kind == "CAX")
                for force in np.stack([forces[node] for node in loaded], axis=1)
            ]
            tractions |= {face: tractions[face] + through for face in faces}
            lost -= {*loaded}
        if lost:
            self.reader.notes.append(
                f"*CLOAD: {count([*lost], 'node')} without a face that is neither held nor in "
                f"contact; not taken"
            )
        return tractions

    def _forces(self) -> dict[int, Array]:
        """Forces at nodes at the end of each step, (K, d), where a node is not held then: there
        they strain nothing."""
        reader, forces = self.reader, dict[int, Array]()
        for k, step in enumerate(reader.forces):
            held = {
                (node, freedom)
                for name, values in reader.held[k].items()
                for node in reader.file.members(name)
                for freedom in values
            }
            for node, freedom in (step.keys() - held) & self.freedoms:
                through = forces.setdefault(node, np.zeros((len(reader.forces), self.dim)))
                through[k, freedom - 1] = step[node, freedom]
        return {node: forces[node] for node in sorted(forces) if forces[node].any()}

    @functools.cached_property
    def freedoms(self) -> set[tuple[int, int]]:
        """Nodes and degrees of freedom, from 1."""
        file = self.reader.file
        own = {node for number in self.elements for node in file.elements[number][1]}
        middles = {node for node, ends in file.middles.items() if own.issuperset(ends)}
        return {
            (node, freedom)
            for node in (own | middles) - self.reader.apart
            for freedom in range(1, self.dim + 1)
        }

    def _at(self, nodes: Iterable[int]) -> Array:
        return np.array([self.reader.file.nodes[node][: self.dim] for node in nodes])

    def _value(self, names: tuple[str, ...], step: int) -> list[float | str]:
        """Return the values that sets hold at the end of a step, by component; none across
        rollers."""
        if self.rolling.issuperset(names) and names:
            return []
        merged: dict[int, float | str] = {}
        for name in names:
            merged |= self.reader.held[step].get(name, {})
        return [merged.get(c + 1, FREE) for c in range(self.dim)]

    def conditions(self, step: int) -> Iterator[Keyed]:
        """Return the conditions of all parts at the end of a step."""
        for part, (names, loads) in self._says.items():
            if not (value := self._value(names, step)):
                yield {"part": part}
                continue
            acting = [_acting(loads[step], c) if value[c] == FREE else 0.0 for c in range(self.dim)]
            says: Keyed = {"value": acting}
            if names:
                says = {"value": value}
                if any(pressure or any(pull) for pressure, pull in loads):
                    says["traction"] = acting
            elif not any(any(pull) for _, pull in loads):
                says = {"pressure": loads[step][0]}
            yield {"part": part, **says}

    def _condition(self, names: tuple[str, ...]) -> str:
        if not names:
            return "traction"
        return "symmetry" if self.rolling.issuperset(names) else "displacement"

    def volume(self, step: int) -> Keyed:
        """Return the `loads` at the end of a step."""
        taken: Keyed = {"temperature": self._warm[step]} if any(self._warm) else {}
        for key in ("acceleration", "force", "rotation"):
            every = [self.reader.volume[step].get((number, key)) for number in self.elements]
            loads = [load for load in every if load is not None]
            if loads and (len(loads) < len(every) or np.ptp(loads, axis=0).any()):
                self.reader.notes.append(
                    f"*DLOAD of {self.name}: not the same in all elements; that of one is taken"
                )
            for load in loads[:1]:
                whole = {key: load[: self.dim].tolist()}
                taken |= self._turning(load) if key == "rotation" else whole
        return taken

    def _turning(self, rotation: Array) -> Keyed:
        """Return the keys of a rotation: its ω², a point of its axis and the direction."""
        places = {"centre": rotation[1:4][: self.dim].tolist(), "axis": rotation[4:].tolist()}
        kept = {"C3D": ("centre", "axis"), "CAX": ()}.get(self.kind, ("centre",))
        return {
            "angular_velocity": math.sqrt(rotation[0]),
            **{key: places[key] for key in kept if rotation[0]},
        }

    @functools.cached_property
    def _warm(self) -> list[float | str]:
        """Rise of the temperature at the end of each step: a number, or linear in the place."""
        reader = self.reader
        nodes = sorted(
            {node for number in self.elements for node in reader.file.elements[number][1]}
        )
        at = np.column_stack([np.ones(len(nodes)), self._at(nodes)])
        rises = list[float | str]()
        for warmed in reader.warmed:
            given = [node for node in nodes if node in warmed]
            rise = np.array([warmed.get(n, reader.initial.get(n, 0.0)) for n in nodes])
            rise -= [reader.initial.get(n, 0.0) for n in nodes]
            terms = np.linalg.lstsq(at, rise, rcond=None)[0]
            if given and np.abs(at @ terms - rise).max() > SINGLE * np.abs(rise).max():
                reader.notes.append(
                    f"*TEMPERATURE of {self.name}: neither uniform nor linear; not taken"
                )
                terms *= 0.0
            if rise.any() and "thermal_expansion" not in self._material:
                reader.notes.append(f"*TEMPERATURE of {self.name}: no *EXPANSION; not taken")
                terms *= 0.0
            terms[np.abs(terms) <= SINGLE * np.abs(rise).max(initial=0.0)] = 0.0
            rises += written(terms[:, None])
        return rises

    def forces(self, step: int) -> list[Keyed]:
        """Return the point forces at the end of a step."""
        return [
            {"name": f"node{node}", "force": force[step].tolist()}
            for node, force in self.inside.items()
        ]

    @property
    def _material(self) -> Keyed:
        """The keys of the material.

        Raises
        ------
        InputError
            If there is none, or several.
        """
        reader = self.reader
        names = {reader.sections.get(number, "") for number in self.elements}
        if len(names) > 1:
            raise InputError(
                f"{reader.file.path}: a body of the materials {', '.join(sorted(names))}; a body "
                "has one"
            )
        material: Keyed = dict(reader.materials.get(next(iter(names)), {}))
        if "young_modulus" not in material:
            raise InputError(
                f"{reader.file.path}: element {self.elements[0]} has no *SOLID SECTION with an "
                f"*ELASTIC material"
            )
        return material

    def table(self, mesh: str) -> Keyed:
        """Return the [[body]] of the config."""
        conditions = [
            {
                "part": says["part"],
                "condition": self._condition(self._says[says["part"]][0]),
            }
            | says
            for says in self.conditions(0)
        ]
        points = [
            {**force, "at": self._at([node])[0].tolist()}
            for force, node in zip(self.forces(0), self.inside, strict=True)
        ]
        table = {
            "name": self.name,
            "material": self._material | self._across(),
            "geometry": {"shape": "gmsh", "file": mesh},
            "mesh": {"order": 1} if self.dim == 3 else {},
            "boundary": conditions,
            "point_force": points,
            "loads": self.volume(0),
        }
        return {key: value for key, value in table.items() if value}

    def _across(self) -> Keyed:
        """Return the keys of the material on the direction across a plane body."""
        thick = {"thickness": self.width} if self.reader.thickness and self.kind[:2] == "CP" else {}
        return thick | ({"plane": "stress"} if self.kind == "CPS" else {})

    def msh(self) -> str:
        """Return the boundary as a Gmsh file, whose physical groups are the parts."""
        tags = {part: k for k, part in enumerate(dict.fromkeys(self.parts.values()), 1)}
        faces = {face: self.reader.file.cell(face) for face in self.faces}
        used = sorted({node for nodes in faces.values() for node in nodes})
        cells = [
            f"{k} {GMSH[self.dim, len(nodes)]} 2 {tags[self.parts[face]]} {tags[self.parts[face]]} "
            + " ".join(map(str, nodes))
            for k, (face, nodes) in enumerate(faces.items(), 1)
        ]
        sections = {
            "PhysicalNames": [f'{self.dim - 1} {tag} "{part}"' for part, tag in tags.items()],
            "Nodes": [f"{n} " + " ".join(map(repr, self.reader.file.nodes[n])) for n in used],
            "Elements": cells,
        }
        return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + "".join(
            "\n".join([f"${name}", str(len(lines)), *lines, f"$End{name}", ""])
            for name, lines in sections.items()
        )


def _acting(load: Load, c: int) -> float | str:
    """Return component c of the sum of a traction and a pressure."""
    pressure, pull = load[0], load[1][c]
    if pressure == 0.0:
        return pull
    pushed = f"{-pressure:+.12g}*n{'xyz'[c]}"
    return pushed.removeprefix("+") if pull == 0.0 else f"{pull} {pushed}"
