"""Input files of Abaqus and CalculiX: sets, nodes and elements."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Container
from dataclasses import dataclass, field, replace
from pathlib import Path

from ..arrays import LARGEST_COORDINATE
from ..errors import InputError
from .inp_instances import flattened
from .inp_keywords import Keyword, keywords_of, numbers_in

MOST_NUMBERS = 10_000_000
"""Numbers that a set of a file of LARGEST bytes may name: a line of data each."""
FACES: dict[int, tuple[tuple[int, ...], ...]] = {
    3: ((0, 1), (1, 2), (2, 0)),
    4: ((0, 1), (1, 2), (2, 3), (3, 0)),
    -4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    -6: ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    -8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
}
"""Corners of the faces S1, S2, ... of elements of so many corners, negative in space."""
CORNERS = {
    **{
        f"{plane}{n}": corners
        for plane in ("CPE", "CPS", "CAX")
        for n, corners in ((3, 3), (4, 4), (6, 3), (8, 4))
    },
    **{
        f"C3D{n}": corners
        for n, corners in ((4, -4), (10, -4), (6, -6), (15, -6), (8, -8), (20, -8))
    },
}
"""Corners of the types of elements, of second order too."""
_RING = {n: tuple((k, (k + 1) % n) for k in range(n)) for n in (3, 4)}
MIDDLES: dict[int, tuple[tuple[int, int], ...]] = {
    **_RING,
    -4: (*_RING[3], (0, 3), (1, 3), (2, 3)),
    **{
        -2 * n: (*ring, *((a + n, b + n) for a, b in ring), *((k, k + n) for k in range(n)))
        for n, ring in _RING.items()
    },
}
"""Corners on either side of the nodes that follow the corners of an element."""
Face = tuple[int, int]
"""Element and number of its face, from 0."""


@dataclass
class InpFile:
    """What a file defines; names of sets in capitals.

    Attributes
    ----------
    nodes, elements : dicts by number
        Coordinates; type without its last letters, and corner nodes.
    instances : dict by number
        The instances of elements.
    middles : dict by number
        The two corners between which a node lies.
    nsets, elsets : dicts of lists of numbers by name
    rest : list of Keyword
        All other keywords, in order.
    """

    path: str
    nodes: dict[int, tuple[float, ...]] = field(default_factory=dict)
    elements: dict[int, tuple[str, tuple[int, ...]]] = field(default_factory=dict)
    instances: dict[int, str] = field(default_factory=dict)
    middles: dict[int, tuple[int, int]] = field(default_factory=dict)
    nsets: dict[str, list[int]] = field(default_factory=dict)
    elsets: dict[str, list[int]] = field(default_factory=dict)
    rest: list[Keyword] = field(default_factory=list)

    def members(self, word: str, kind: str = "NSET") -> list[int]:
        """Return the numbers of a set of nodes or elements, or a single number."""
        if word.isdecimal():
            return [int(word)]
        sets = self.nsets if kind == "NSET" else self.elsets
        if word.upper() not in sets:
            raise InputError(
                f"{self.path}: no {kind} {word!r}; there are {', '.join(sets) or 'none'}"
            )
        return sets[word.upper()]

    def faces(self, number: int) -> list[Face]:
        """Return the faces of an element."""
        return [(number, k) for k in range(len(FACES[CORNERS[self.elements[number][0]]]))]

    @functools.cached_property
    def between(self) -> dict[frozenset[int], int]:
        """The nodes in the middle of edges, by the corners of these."""
        return {frozenset(ends): node for node, ends in self.middles.items()}

    def cell(self, face: Face) -> tuple[int, ...]:
        """Return the nodes of a face: its corners, and the middles of its edges if all have one."""
        corners = self.corners(face)
        ends = zip(corners, (*corners[1:], corners[0]), strict=True)
        edges = [frozenset(pair) for pair in ends][: 1 if len(corners) == 2 else None]
        middles = [self.between[edge] for edge in edges if edge in self.between]
        return (*corners, *middles) if len(middles) == len(edges) else corners

    def corners(self, face: Face) -> tuple[int, ...]:
        """Return the corner nodes of a face."""
        kind, nodes = self.elements[face[0]]
        return tuple(nodes[c] for c in FACES[CORNERS[kind]][face[1]])


def read_inp(path: str | Path) -> InpFile:
    """An input file, flat or of parts and instances.

    Raises
    ------
    InputError
        If it cannot be read, or a number is none.
    """
    file = InpFile(str(path))
    for keyword in flattened(path, keywords_of(path)):
        other = keyword.name == "NODE" and keyword.parameters.get("SYSTEM", "R").upper() != "R"
        if keyword.name == "SYSTEM" or other:
            raise InputError(
                f"{path}: line {keyword.line}: *{keyword.name}: nodes in another system are not "
                "read; write them along the axes"
            )
        with numbers_in(path, keyword):
            _take(file, keyword)
    if not (file.nodes and file.elements):
        raise InputError(f"{path}: has no *NODE and *ELEMENT of types {', '.join(CORNERS)}")
    for number, (_, nodes) in file.elements.items():
        if unknown := sorted({*nodes} - file.nodes.keys()):
            raise InputError(f"{path}: element {number}: there is no node {unknown[0]}")
        if len({*nodes}) < len(nodes):
            raise InputError(f"{path}: element {number} names a node twice")
    return file


def _take(file: InpFile, keyword: Keyword) -> None:
    """Nodes, elements and sets; anything else is kept."""
    if keyword.name == "NODE":
        _extend(file.nsets, keyword.parameters.get("NSET"), _nodes(file, keyword))
    elif keyword.name == "ELEMENT":
        numbers = _elements(file, keyword)
        _extend(file.elsets, keyword.parameters.get("ELSET"), numbers)
        file.instances |= dict.fromkeys(numbers, keyword.parameters.get("INSTANCE", ""))
    elif keyword.name in ("NSET", "ELSET"):
        sets = file.nsets if keyword.name == "NSET" else file.elsets
        numbers = []
        for row in keyword.rows:
            if "GENERATE" in keyword.parameters:
                numbers += _generated(file, keyword, row)
            else:
                for word in row:
                    numbers += file.members(word, keyword.name)
        _extend(sets, keyword.parameters.get(keyword.name), numbers)
    else:
        file.rest.append(keyword)


def _generated(file: InpFile, keyword: Keyword, row: list[str]) -> range:
    """The numbers from one to another that a row stands for."""
    first, last, step = (int(word) for word in (*row, "1")[:3])
    numbers = range(first, last + 1, step)
    if (last - first) // step > MOST_NUMBERS:
        raise InputError(
            f"{file.path}: line {keyword.line}: *{keyword.name}: {', '.join(row)} are more "
            f"numbers than {MOST_NUMBERS:.0e}"
        )
    return numbers


def _nodes(file: InpFile, keyword: Keyword) -> list[int]:
    rows = {
        int(row[0]): (*(float(word or 0.0) for word in row[1:4]), 0.0, 0.0, 0.0)[:3]
        for row in keyword.rows
    }
    for number, place in rows.items():
        if not all(abs(x) <= LARGEST_COORDINATE for x in place):
            raise InputError(
                f"{file.path}: line {keyword.line}: *NODE: node {number} has coordinates that "
                f"are not finite, or larger than {LARGEST_COORDINATE:g}"
            )
    _new(file, keyword, file.nodes, [int(row[0]) for row in keyword.rows])
    file.nodes |= rows
    return list(rows)


def _elements(file: InpFile, keyword: Keyword) -> list[int]:
    kind = keyword.parameters.get("TYPE", "").upper().rstrip("RIHMT")
    if kind not in CORNERS:
        file.rest.append(replace(keyword, name=f"ELEMENT, TYPE={kind}"))
        return []
    words = [int(word) for row in keyword.rows for word in row]
    width = 1 + int(kind[3:])
    if len(words) % width:
        raise InputError(
            f"{file.path}: line {keyword.line}: *ELEMENT: {len(words)} numbers are no multiple of "
            f"{width}, the number of an element of type {kind} and its nodes"
        )
    numbers = words[::width]
    _new(file, keyword, file.elements, numbers)
    corners = CORNERS[kind]
    for start, number in zip(range(1, len(words), width), numbers, strict=True):
        nodes = words[start : start + width - 1]
        file.elements[number] = kind, tuple(nodes[: abs(corners)])
        for middle, (a, b) in zip(nodes[abs(corners) :], MIDDLES[corners], strict=False):
            file.middles[middle] = nodes[a], nodes[b]
    return numbers


def _new(file: InpFile, keyword: Keyword, taken: Container[int], numbers: list[int]) -> None:
    """Refuse numbers of nodes or elements that are defined twice."""
    twice = [n for n in numbers if n in taken] or [
        n for n, times in Counter(numbers).items() if times > 1
    ]
    if twice:
        raise InputError(
            f"{file.path}: line {keyword.line}: *{keyword.name}: number {twice[0]} is there already"
        )


def _extend(sets: dict[str, list[int]], name: str | None, numbers: list[int]) -> None:
    if name:
        sets.setdefault(name.upper(), []).extend(numbers)
