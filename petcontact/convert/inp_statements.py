"""What the keywords of an input file say of surfaces, materials, contact, conditions and loads."""

from __future__ import annotations

import copy
import functools
import itertools
import math
import operator
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..arrays import LARGEST_NUMBER, Array
from ..errors import InputError
from ..given.posed import HOLD
from ..untyped import Keyed
from .inp_changes import at_end, gather, read_temperature, renew, turn
from .inp_elements import count
from .inp_file import CORNERS, FACES, Face, InpFile
from .inp_keywords import Keyword
from .inp_loads import read_force, read_load
from .inp_references import READ, Reference, references_of

SILENT = {
    "AMPLITUDE",
    "ORIENTATION",
    "TRANSFORM",
    "HEADING",
    "END STEP",
    "OUTPUT",
    "NODE OUTPUT",
    "ELEMENT OUTPUT",
    "CONTACT OUTPUT",
    "NODE PRINT",
    "EL PRINT",
    "NODE FILE",
    "EL FILE",
    "CONTACT FILE",
    "CONTACT PRINT",
    "ENERGY OUTPUT",
    "RESTART",
    "PREPRINT",
    "CONTROLS",
    "MONITOR",
    "PHYSICAL CONSTANTS",
    "PRINT",
}
"""What says nothing of the problem, all bodies being isotropic, or is read with what names it."""
_LOADS = ("OP", "AMPLITUDE", "LOAD CASE")
UNDERSTOOD: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("CLOAD", "DLOAD", "DSLOAD", "TEMPERATURE"), _LOADS),
    "BOUNDARY": (*_LOADS, "TYPE", "FIXED"),
    "STEP": ("NAME", "INC", "NLGEOM", "UNSYMM"),
    "STATIC": ("DIRECT", "SOLVER"),
    "AMPLITUDE": ("NAME", "DEFINITION", "TIME", "VALUE"),
    "INITIAL CONDITIONS": ("TYPE",),
    "TRANSFORM": ("NSET", "TYPE"),
    "SURFACE": ("NAME", "TYPE", "INTERNAL"),
    "CONTACT PAIR": ("INTERACTION", "TYPE", "TIED", "SMALL SLIDING", "EXTENSION ZONE"),
    "TIE": ("NAME", "ADJUST", "POSITION TOLERANCE", "TYPE", "TIED", "NO ROTATION", "NO THICKNESS"),
    "CLEARANCE": ("MASTER", "MAIN", "SLAVE", "SECONDARY", "VALUE"),
    "SURFACE INTERACTION": ("NAME",),
    "CHANGE FRICTION": ("INTERACTION",),
    "SURFACE BEHAVIOR": ("PRESSURE-OVERCLOSURE", "NO SEPARATION"),
    "FRICTION": ("TAUMAX",),
    "MATERIAL": ("NAME",),
    "ELASTIC": ("TYPE",),
    "DENSITY": (),
    "EXPANSION": ("TYPE", "ZERO"),
    "SOLID SECTION": ("ELSET", "MATERIAL", "ORIENTATION", "CONTROLS"),
    "COUPLING": ("REF NODE", "SURFACE", "CONSTRAINT NAME"),
    "RIGID BODY": ("REF NODE", "ROT NODE", "NSET"),
    "PRE-TENSION SECTION": ("SURFACE", "NODE"),
}
"""Parameters of keywords that are read, or that change nothing here."""
MEANING: dict[str, tuple[str, ...]] = {
    "OP": ("MOD", "NEW"),
    "NLGEOM": ("NO",),
    "LOAD CASE": ("1",),
    "DEFINITION": ("TABULAR",),
}
"""Values of parameters that are understood; other parameters may have any."""
MEANT = {
    "EQUATION": "ties displacements of nodes to each other: ",
    "MPC": "ties displacements of nodes to each other: ",
    "CONTACT": "contact of all surfaces; give *CONTACT PAIR: ",
    "PLASTIC": "yields; bodies stay elastic here: ",
    "SHELL SECTION": "elements without a volume: ",
    "BEAM SECTION": "elements without a volume: ",
    "SPRING": "springs between nodes: ",
    "MASS": "mass at nodes: ",
    "DYNAMIC": "inertia; loads are static here: ",
    "FREQUENCY": "vibration; loads are static here: ",
    "BUCKLE": "stability; displacements are small here: ",
    "HEAT TRANSFER": "flow of heat; give *TEMPERATURE: ",
    "COUPLED TEMPERATURE-DISPLACEMENT": "flow of heat; give *TEMPERATURE: ",
}
"""What keywords that are not taken would mean."""
PROPERTIES = {
    "ELASTIC": ("young_modulus", "poisson_ratio"),
    "DENSITY": ("density",),
    "EXPANSION": ("thermal_expansion",),
}
"""Keys of a `material` that keywords give."""
FREEDOMS = 99
"""Bound of the number of a degree of freedom, above that of any program."""
TYPED = {
    **{"ENCASTRE": (1, 2, 3, 4, 5, 6), "PINNED": (1, 2, 3)},
    **{"XSYMM": (1, 5, 6), "YSYMM": (2, 4, 6), "ZSYMM": (3, 4, 5)},
}
"""Degrees of freedom that named conditions hold."""


@dataclass
class Statements:
    """What the keywords say.

    Attributes
    ----------
    file : InpFile
    notes : list of str
        What was not taken.
    surfaces : dict of lists of faces by name
    materials : dict of dicts by name
        Keys and values of a `material`.
    sections : dict of str by element
        Name of the material.
    thickness : dict of float by element
        Of plane elements, where it is not 1; then forces are whole ones [length].
    laws : dict of dicts by interaction
        Keys and values of a `contact`.
    pairs : list of dict
        interaction, kind, secondary, primary, and bolt where one is cut.
    clearances : dict of float by secondary and primary
        Gap that stands in the place of that of the geometry [length].
    held : list of dicts by node set
        At the end of each step, values by degree of freedom from 1 [length], or "hold".
    pressed, tractions : lists of dicts by face
        At the end of each step, tractions as `linear_traction` has them [stress].
    pressing : dict of str by face
        The surface that presses it, "" of an element's own pressure, or "several".
    forces : list of dicts by node and degree of freedom
        At the end of each step [force].
    volume : list of dicts by element and kind
        At the end of each step: acceleration, force, or ω², centre and axis of a rotation.
    warmed : list of dicts by node
        Temperature at the end of each step.
    initial : dict by node
        Temperature without strain.
    covering : dict of sets of nodes by surface
        Surfaces that are given by their nodes.
    used : set of str
        Surfaces of pairs and loads.
    names : dict
        Of the last material and interaction.
    rollers : dict of dicts by node set
        Unit vectors by node, along each of which it is held and across which it is free.
    renewed : set of (int, str)
        Kinds of loads that a step, by its number, has begun to give.
    steps : list of str
        Names of the load steps.
    references : list of Reference
    period : float
        Time of the step that is read.
    begin : float
        Time of the steps before.
    """

    file: InpFile
    notes: list[str] = field(default_factory=list)
    surfaces: dict[str, list[Face]] = field(default_factory=dict)
    materials: dict[str, dict[str, float]] = field(default_factory=dict)
    sections: dict[int, str] = field(default_factory=dict)
    thickness: dict[int, float] = field(default_factory=dict)
    laws: list[dict[str, Keyed]] = field(default_factory=lambda: [{}])
    pairs: list[Keyed] = field(default_factory=list)
    clearances: dict[tuple[str, str], float] = field(default_factory=dict)
    held: list[dict[str, dict[int, float | str]]] = field(default_factory=lambda: [{}])
    pressed: list[dict[Face, float]] = field(default_factory=lambda: [{}])
    tractions: list[dict[Face, Any]] = field(default_factory=lambda: [{}])
    pressing: dict[Face, str] = field(default_factory=dict)
    forces: list[dict[tuple[int, int], float]] = field(default_factory=lambda: [{}])
    volume: list[dict[tuple[int, str], Array]] = field(default_factory=lambda: [{}])
    warmed: list[dict[int, float]] = field(default_factory=lambda: [{}])
    initial: dict[int, float] = field(default_factory=dict)
    rollers: dict[str, dict[int, Array]] = field(default_factory=dict)
    renewed: set[tuple[int, str]] = field(default_factory=set)
    covering: dict[str, set[int]] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)
    names: dict[str, str] = field(default_factory=dict)
    steps: list[str] = field(default_factory=list)
    references: list[Reference] = field(default_factory=list)
    period: float = 1.0
    begin: float = 0.0

    def read(self) -> None:
        """Read all keywords in order; those in a step belong to it."""
        for name, numbers in self.file.nsets.items():
            if unknown := {*numbers} - self.file.nodes.keys():
                self.notes.append(f"*NSET {name}: {count([*unknown], 'node')} not there; not taken")
        self.references, unread = references_of(self), dict[tuple[str, str], list[Keyword]]()
        for keyword in self.file.rest:
            for text in self._not_understood(keyword):
                unread.setdefault((keyword.name, text), []).append(keyword)
            if keyword.name == "STEP":
                # the first step's conditions stand beside those of the model
                if self.steps:
                    for states in list[Any]((self.held, self.warmed, self.laws)):
                        states.append(copy.deepcopy(states[-1]))
                    for states in itertools.chain(*self.added.values()):
                        states.append({})
                    self.begin += self.period
                self.steps.append(keyword.parameters.get("NAME", f"step{len(self.steps) + 1}"))
                self.period = 1.0
            elif read := self._readers.get(keyword.name):
                renew(self, keyword)
                read(at_end(self, keyword))
        for (_, text), (first, *more) in unread.items():
            self.note(first, text + (f" ({1 + len(more)} times)" if more else ""))
        gather(self)
        for states in itertools.chain(*self.added.values()):
            states[:] = itertools.accumulate(states, operator.or_)
        turn(self)

    def _not_understood(self, keyword: Keyword) -> Iterator[str]:
        """Yield what to say of a keyword that is not read, or of parameters of one that is."""
        name = keyword.name
        if name not in self._readers.keys() | SILENT | READ | {"STEP"}:
            yield f"{MEANT.get(name, '')}not taken"
        for parameter, value in keyword.parameters.items() if name in UNDERSTOOD else ():
            known = parameter in (*UNDERSTOOD[name], "INPUT", "INSTANCE")
            if not known or value.upper() not in MEANING.get(parameter, (value.upper(),)):
                yield f"{parameter}{value and f'={value}'}; not taken"

    @property
    def added(self) -> dict[str, list[list[dict[Any, Any]]]]:
        """Loads of the steps by keyword; those of one step add up, a later one replaces them."""
        return {"CLOAD": [self.forces], "DLOAD": [self.pressed, self.tractions, self.volume]}

    @functools.cached_property
    def _readers(self) -> dict[str, Callable[[Keyword], None]]:
        """What reads the keywords of materials, surfaces, contact, conditions and loads."""
        return {
            "SURFACE": self._surface,
            "CONTACT PAIR": self._pair,
            "TIE": self._pair,
            "CLEARANCE": self._clearance,
            "STATIC": self._static,
            "BOUNDARY": self._boundary,
            "CLOAD": functools.partial(read_force, self),
            "DLOAD": functools.partial(read_load, self),
            "DSLOAD": functools.partial(read_load, self),
            "MATERIAL": self._named,
            "SURFACE INTERACTION": self._named,
            "CHANGE FRICTION": self._named,
            "ELASTIC": self._property,
            "DENSITY": self._property,
            "EXPANSION": self._property,
            "FRICTION": self._friction,
            "SOLID SECTION": self._section,
            "SURFACE BEHAVIOR": self._behaviour,
            "TEMPERATURE": functools.partial(read_temperature, self),
            "INITIAL CONDITIONS": functools.partial(read_temperature, self),
        }

    def _static(self, keyword: Keyword) -> None:
        """Read the time of the step."""
        times = [time for row in keyword.rows[:1] for time in self.floats(keyword, row)]
        self.period = times[1] if len(times) > 1 and times[1] else 1.0

    def _named(self, keyword: Keyword) -> None:
        """Remember the material or interaction to which the next keywords belong."""
        kind = keyword.name.replace("CHANGE FRICTION", "SURFACE INTERACTION")
        name = keyword.parameters.get("NAME", keyword.parameters.get("INTERACTION", ""))
        self.names[kind] = name.upper()

    def _property(self, keyword: Keyword) -> None:
        if keyword.parameters.get("TYPE", "ISO").upper() not in ("ISO", "ISOTROPIC"):
            raise self.error(keyword, "materials are isotropic; take the body as a superelement")
        for row in keyword.rows[:1]:
            values = dict(zip(PROPERTIES[keyword.name], self.floats(keyword, row), strict=False))
            self.materials.setdefault(self.names.get("MATERIAL", ""), {}).update(values)
        if len(keyword.rows) > 1:
            self.note(keyword, "values that depend on temperature; the first are taken")

    def _section(self, keyword: Keyword) -> None:
        numbers = self.file.members(keyword.parameters.get("ELSET", ""), "ELSET")
        self.sections |= dict.fromkeys(numbers, keyword.parameters.get("MATERIAL", "").upper())
        thickness = self.floats(keyword, keyword.rows[0][:1])[0] if keyword.rows else 0.0
        flat = [n for n in numbers if self.file.elements.get(n, ("",))[0][:2] == "CP"]
        if flat and thickness not in (0.0, 1.0):
            self.thickness |= dict.fromkeys(flat, thickness)

    def _law(self) -> Keyed:
        """Return the keys and values of the interaction that is read."""
        return self.laws[-1].setdefault(self.names.get("SURFACE INTERACTION", ""), {})

    def _behaviour(self, keyword: Keyword) -> None:
        """Read hard contact, with or without opening, and ties; note anything else."""
        kind = keyword.parameters.get("PRESSURE-OVERCLOSURE", "HARD").upper()
        if kind == "TIED":
            self._law()["normal"] = "bonded"
        elif "NO SEPARATION" in keyword.parameters:
            self._law()["normal"] = "bilateral"
        if kind not in ("TIED", "HARD"):
            self.note(keyword, f"PRESSURE-OVERCLOSURE={kind}; hard contact is taken")

    def _friction(self, keyword: Keyword) -> None:
        """Read the coefficient and the largest shear."""
        for row in keyword.rows[:1]:
            coefficient, *slope = self.floats(keyword, row)[:2]
            self._law()["friction_coefficient"] = coefficient
            if "TAUMAX" in keyword.parameters:
                self._law()["friction_bound"] = self.floats(
                    keyword, [keyword.parameters["TAUMAX"]]
                )[0]
            if any(slope) and len(keyword.rows) == 1:
                self.note(keyword, f"stick slope {slope[0]:g}; what sticks does not move here")
        if len(keyword.rows) > 1:
            self.note(
                keyword,
                "a coefficient that depends on slip rate, pressure or temperature; the first is "
                "taken",
            )

    def _clearance(self, keyword: Keyword) -> None:
        """Read a constant gap between two surfaces."""
        sides = [
            keyword.parameters.get(old_word, keyword.parameters.get(new_word, "")).upper()
            for old_word, new_word in (("SLAVE", "SECONDARY"), ("MASTER", "MAIN"))
        ]
        if all(sides) and "VALUE" in keyword.parameters:
            value = self.floats(keyword, [keyword.parameters["VALUE"]])[0]
            self.clearances[sides[0], sides[1]] = value
        else:
            self.note(keyword, "not taken; MASTER, SLAVE and VALUE are read")

    def _surface(self, keyword: Keyword) -> None:
        name = keyword.parameters.get("NAME", "").upper()
        faces = self.surfaces.setdefault(name, [])
        if keyword.parameters.get("TYPE", "ELEMENT").upper() == "NODE":
            nodes = {n for row in keyword.rows for n in self.file.members(row[0])}
            self.covering.setdefault(name, set()).update(nodes)
            return
        for row in keyword.rows:
            numbers = self.file.members(row[0], "ELSET")
            side = row[1].upper() if len(row) > 1 else ""
            if not (side[:1] == "S" and side[1:].isdecimal()):
                self.note(
                    keyword,
                    f"face {side or 'missing'} of {row[0]}: S1, S2, ... are read; not taken",
                )
                continue
            faces += self.faces(keyword, row[0], numbers, side)

    def faces(self, keyword: Keyword, name: str, numbers: list[int], side: str) -> list[Face]:
        """Return face S2 or P2 of elements; note the elements that are not there."""
        k, elements = int(side[1:]) - 1, self.file.elements
        there = [number for number in numbers if number in elements]
        if unknown := {*numbers} - {*there}:
            self.note(keyword, f"{name}: {count([*unknown], 'element')} not there; not taken")
        faces = [
            (number, k) for number in there if 0 <= k < len(FACES[CORNERS[elements[number][0]]])
        ]
        if faceless := {*there} - {number for number, _ in faces}:
            self.note(
                keyword, f"{name}: {count([*faceless], 'element')} without a face {side}; not taken"
            )
        return faces

    def _pair(self, keyword: Keyword) -> None:
        kind = keyword.parameters.get("TYPE", "").upper()
        # sectors that repeat are no ties of faces that touch
        sectors = keyword.parameters.keys() - {*UNDERSTOOD["TIE"]} if keyword.name == "TIE" else ()
        for row in () if sectors else keyword.rows:
            if len(row) < 2:
                self.note(keyword, f"{row[0]}: contact of a surface with itself; not taken")
                continue
            sides = {"secondary": row[0].upper(), "primary": row[1].upper()}
            self.used.update(sides.values())
            tied = kind == "TIED" or "TIED" in keyword.parameters
            interaction = keyword.parameters.get("INTERACTION", "").upper()
            self.pairs.append(
                {"interaction": interaction, "kind": "TIE" if tied else keyword.name, **sides}
            )

    def _boundary(self, keyword: Keyword) -> None:
        kind = keyword.parameters.get("TYPE", "DISPLACEMENT")
        if kind.upper() != "DISPLACEMENT":
            self.note(keyword, f"TYPE={kind}; not taken")
            return
        # before the second step nothing has moved
        stays = "FIXED" in keyword.parameters and len(self.steps) > 1
        for row in keyword.rows:
            most, value = 6 if self.refers(row[0]) else 3, 0.0
            freedoms = TYPED.get(row[1].upper()) if len(row) > 1 else None
            if freedoms is None:
                first, last, value = self.floats(keyword, [*row[1:], *["", "", ""]][:3])
                if not 1.0 <= first <= (last or first) <= FREEDOMS:
                    text = f"degrees of freedom are 1 to {FREEDOMS}, got {row[1:3]}"
                    raise self.error(keyword, text)
                freedoms = tuple(range(int(first), int(last or first) + 1))
                if freedoms[-1] > most:
                    self.note(keyword, f"{row[0]}: rotations are none of solids; not taken")
            taken = [freedom for freedom in freedoms if freedom <= most]
            held = self.held[-1].setdefault(row[0].upper(), {})
            held |= dict.fromkeys(taken, HOLD if stays else value)

    @property
    def apart(self) -> set[int]:
        """Reference nodes, and those of their rotations."""
        return {node for one in self.references for node in (one.node, one.turning)}

    def refers(self, word: str) -> bool:
        """Return whether a word names reference nodes only."""
        return self.apart.issuperset(self.file.members(word))

    def width(self, face: Face) -> float:
        """Return the thickness of the element of a face, where forces are whole ones."""
        return self.thickness.get(face[0], 1.0)

    def floats(self, keyword: Keyword, words: Sequence[str]) -> list[float]:
        """Return the numbers of a row; a number that is left out is 0."""
        try:
            numbers = [float(word.upper().replace("D", "E")) if word else 0.0 for word in words]
        except ValueError:
            numbers = [math.nan]
        if not numbers or not all(abs(value) <= LARGEST_NUMBER for value in numbers):
            raise self.error(keyword, f"numbers are expected, got {', '.join(words)}")
        return numbers

    def error(self, keyword: Keyword, text: str) -> InputError:
        """Return an error of one line that names the file, the line and the keyword."""
        return InputError(f"{self.file.path}: line {keyword.line}: *{keyword.name}: {text}")

    def note(self, keyword: Keyword, text: str) -> None:
        """Report a text about a keyword."""
        self.notes.append(f"line {keyword.line}: *{keyword.name}: {text}")
