"""Parts and instances of an input file as a flat one: the nodes and elements of an instance get
numbers of their own, and its sets and surfaces the names INSTANCE-NAME."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy

from ..arrays import Array
from ..errors import InputError
from ..record import record, replace
from .inp_keywords import Keyword, numbers_in

NAMING = ("NSET", "ELSET", "SURFACE", "REF NODE", "ROT NODE", "NODE")
"""Parameters that name nodes, elements, sets or surfaces."""


@record
class Instance:
    """Where a part lies, and how the flat file calls what it has.

    Attributes
    ----------
    name : str
    shift : int
        What is added to the numbers of its nodes and elements.
    turn : (3, 3) array
    origin : (3,) array
        A place x of the part lies at turn x + origin [length].
    """

    name: str
    shift: int
    turn: Array
    origin: Array

    def named(self, word: str) -> str:
        """Return a number or a name of the part as the flat file has it."""
        return str(int(word) + self.shift) if word.isdecimal() else f"{self.name}-{word.upper()}"

    def members(self, keyword: Keyword) -> list[list[str]]:
        """Return the rows of a set; the step of numbers that are generated stays."""
        ends = 2 if "GENERATE" in keyword.parameters else None
        return [
            [*map(self.named, filter(None, row[:ends])), *row[2 : 3 if ends else 2]]
            for row in keyword.rows
        ]

    def moved(self, keyword: Keyword) -> Keyword:
        """Return a keyword of the part as one of the flat file."""
        given, rows = keyword.parameters, keyword.rows
        if keyword.name == "NODE":
            rows = [[self.named(row[0]), *self._at(row[1:4])] for row in rows]
        elif keyword.name == "ELEMENT":
            rows = [[self.named(word) for word in row] for row in rows]
        elif keyword.name in ("NSET", "ELSET"):
            rows = self.members(keyword)
        elif keyword.name == "SURFACE":
            given = given | {"NAME": self.named(given.get("NAME", ""))}
            rows = [[self.named(row[0]), *row[1:]] for row in rows]
        names = {key: self.named(given[key]) for key in NAMING if given.get(key)}
        return replace(keyword, parameters=given | names | {"INSTANCE": self.name}, rows=rows)

    def _at(self, words: list[str]) -> list[str]:
        place = np.array([*(float(word or 0.0) for word in words), 0.0, 0.0][:3])
        return [repr(x) for x in (self.turn @ place + self.origin).tolist()]


def flattened(path: str | Path, keywords: list[Keyword]) -> Iterator[Keyword]:
    """Yield the keywords of a flat file; those outside of parts and instances have names of
    instances.

    Raises
    ------
    InputError
        If there is no part that an instance names, or a place is no number.
    """
    instances, parts = dict[str, Instance](), dict[str, list[Keyword]]()
    step = 10 ** len(str(max(_numbers(keywords), default=0)))
    inside: list[Keyword] | None = None
    for keyword in keywords:
        kind, name = keyword.name, keyword.parameters.get("NAME", "").upper()
        if kind == "PART":
            inside = parts.setdefault(name, [])
        elif kind == "INSTANCE":
            part = keyword.parameters.get("PART", "").upper()
            if part not in parts:
                there = ", ".join(parts) or "none"
                raise InputError(
                    f"{path}: line {keyword.line}: *INSTANCE: no part {part!r}; there are {there}"
                )
            with numbers_in(path, keyword):
                instances[name] = _placed(name, step * (1 + len(instances)), keyword)
            inside = [*parts[part]]
        elif kind in ("END PART", "END INSTANCE"):
            if kind == "END INSTANCE" and inside is not None:
                for own in inside:
                    with numbers_in(path, own):
                        moved = [*instances.values()][-1].moved(own)
                    yield moved
            inside = None
        elif inside is not None:
            inside.append(keyword)
        elif kind not in ("ASSEMBLY", "END ASSEMBLY"):
            yield _renamed(keyword, instances)


def _numbers(keywords: list[Keyword]) -> Iterator[int]:
    """Yield the numbers of all nodes and elements."""
    for keyword in keywords:
        if keyword.name in ("NODE", "ELEMENT"):
            yield from (int(row[0]) for row in keyword.rows if row[0].isdecimal())


def _placed(name: str, shift: int, keyword: Keyword) -> Instance:
    """Return an instance: it is moved, and then turned about an axis through two points."""
    numbers = [[float(word or 0.0) for word in row] for row in keyword.rows]
    way, axis = ([*row, *[0.0] * 7] for row in (*numbers, [], [])[:2])
    start, end = np.array(axis[:3]), np.array(axis[3:6])
    long = float(np.linalg.norm(end - start)) or 1.0
    turn = scipy.spatial.transform.Rotation.from_rotvec(
        np.radians(axis[6]) * (end - start) / long
    ).as_matrix()
    return Instance(name, shift, turn, turn @ (np.array(way[:3]) - start) + start)


def _renamed(keyword: Keyword, instances: dict[str, Instance]) -> Keyword:
    """Return a keyword outside of instances, with names INSTANCE.NAME as the flat file has them."""

    def named(word: str) -> str:
        instance, dot, own = word.partition(".")
        return (
            instances[instance.upper()].named(own)
            if dot and instance.upper() in instances
            else word
        )

    if not instances:
        return keyword
    given = keyword.parameters
    owner = instances.get(given.get("INSTANCE", "").upper())
    rows = (
        owner.members(keyword) if owner else [[named(word) for word in row] for row in keyword.rows]
    )
    names = {key: named(given[key]) for key in NAMING if key in given}
    return replace(keyword, parameters=given | names, rows=rows)
