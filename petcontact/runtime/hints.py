"""What a name that does not exist, or a value that is not read, most likely stands for."""

from __future__ import annotations

import difflib
import re
from collections.abc import Container, Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from ..errors import InputError
from .other_words import ATTRIBUTES, IN_MM_AND_N, SAID, SYNONYMS

T = TypeVar("T")
SPELLINGS = {"center": "centre", "centre": "center"}
"""Other spellings of keys."""
SHOWN = 20
"""Attributes of a thing that are listed where none is near."""
NUMBER = r"[-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:e[-+]?\d+)?"
UNIT = re.compile(
    rf"({NUMBER})\s*(?!(?:[xyzs]|n[xyz]|pi|e[-+]?\d+)\b)([A-Za-zµ°%][\w/*^²³·%]*)", re.IGNORECASE
)
"""A number, and what is no variable of ours."""


def demand_functions(**given: object) -> None:
    """Refuse what is given for a function and cannot be called; None is no function."""
    for name, function in given.items():
        if not (function is None or callable(function)):
            raise InputError(f"{name}: a function is expected, got {type(function).__name__}")


def known_key(key: Any, fields: Container[str], given: Container[Any]) -> Any:
    """A key, or its other spelling where a table has that one and it is not given, too.

    >>> known_key("center", {"centre"}, {"center"}), known_key("x", {"centre"}, {"x"})
    ('centre', 'x')
    """
    other = SPELLINGS.get(key, key)
    return other if key not in fields and other in fields and other not in given else key


def nearest(given: object, names: Sequence[str]) -> str:
    """`, did you mean ...?` where a name is near, what is said of a word of other programs, else
    nothing.

    >>> nearest("mu", ["friction_coefficient"]), nearest("Top", ["top", "left"]), nearest("x", [])
    (", did you mean 'friction_coefficient'?", ", did you mean 'top'?", '')
    >>> nearest("frictionless", ["friction_coefficient"])
    '; contact without friction_coefficient and friction_bound is frictionless'
    """
    if not isinstance(given, str):
        return ""
    small = given.lower()
    word = SYNONYMS.get(given, SYNONYMS.get(small))
    same = [name for name in names if name.lower() == small]
    near = [word] if word in names else same
    if not near and (said := SAID.get(given, SAID.get(small))):
        return f"; {said}"
    near = near or difflib.get_close_matches(given, names, n=1)
    return f", did you mean {near[0]!r}?" if near else ""


def among(given: object, names: Sequence[str], there: str = "there are") -> str:
    """What ends a refusal of a name: the nearest of those that there are, or all of them.

    >>> among("rigth", ["left", "right"]), among("x", [], "bodies are")
    (", did you mean 'right'?", '; bodies are none')
    """
    near = nearest(given, [*names])  # what is said of words of other programs is about keys
    return near if near.startswith(",") else f"; {there} {', '.join(names) or 'none'}"


def demand_name(what: str, given: str, names: Iterable[str], there: str = "there are") -> None:
    """Refuse a name that is none of those that there are.

    >>> demand_name("no part", "rigth", ["left", "right"])
    Traceback (most recent call last):
    petcontact.errors.InputError: no part 'rigth', did you mean 'right'?
    """
    listed = [*names]
    if given not in listed:
        raise InputError(f"{what} {given!r}{among(given, listed, there)}")


class Named(dict[str, T]):
    """What has names: a name that is not there is answered with the nearest.

    >>> Named(bottom=1)["botom"]
    Traceback (most recent call last):
    KeyError: "'botom', did you mean 'bottom'?"
    """

    def __missing__(self, name: str) -> T:
        raise KeyError(f"{name!r}{among(name, [*self])}")

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> object:
            hint = f"; names are keys: [{name!r}]" if name in self else ""
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}{hint}")


class Hinted:
    """What answers an attribute that it has not with the nearest, or with where such a thing is."""

    if not TYPE_CHECKING:  # which would take any attribute then

        def __getattr__(self, name: str) -> object:
            if name.startswith("_") or hasattr(type(self), name):  # what a property raises
                return object.__getattribute__(self, name)
            raise no_attribute(self, name)


def no_attribute(thing: object, name: str) -> AttributeError:
    """The error of an attribute that a thing has not, with what is meant by it."""
    names = [own for own in dir(thing) if not own.startswith("_")]
    return AttributeError(f"{type(thing).__name__} has no {name!r}{missing_attribute(name, names)}")


def missing_attribute(name: str, names: Sequence[str]) -> str:
    """What is meant by an attribute, of those that there are.

    >>> missing_attribute("presure", ["pressure"])
    ", did you mean 'pressure'?"
    >>> missing_attribute("stress", ["stress_at", "verdict"])
    '; stress at points: .stress_at(points), .von_mises_at(points)'
    >>> missing_attribute("temperature", ["pressure"])
    '; there are pressure'
    """
    said = next((text for words, text in ATTRIBUTES.items() if name in words), "")
    if said:
        return f"; {said}"
    return among(name, names) if len(names) <= SHOWN else nearest(name, names)


class Listed(list[T]):
    """A list whose entries have names: a text finds all of one name.

    >>> from types import SimpleNamespace
    >>> forces = Listed([SimpleNamespace(name="force", of=body) for body in ("upper", "lower")])
    >>> [force.of for force in forces["force"]]
    ['upper', 'lower']
    >>> forces["forse"]
    Traceback (most recent call last):
    KeyError: "'forse', did you mean 'force'?"
    """

    def __getitem__(self, key: Any) -> Any:
        if not isinstance(key, str):
            return super().__getitem__(key)
        names = list(dict.fromkeys(str(getattr(entry, "name", "")) for entry in self))
        if found := [entry for entry in self if getattr(entry, "name", None) == key]:
            return found
        raise KeyError(f"{key!r}{among(key, list(filter(None, names)), 'names are')}")


def number_refused(text: str) -> str:
    """Why a text that is a number with a unit or a comma is no number; nothing for any other text.

    Examples
    --------
    >>> number_refused("210 GPa")
    'a number has no unit here; with mm, N and MPa 210 GPa are 210000'
    >>> number_refused("20 °C"), number_refused("0,3")
    ('a number has no unit here: 20', 'a number has a decimal point, not a comma: 0.3')
    >>> number_refused("scan.csv")
    'a file of points is a table: { points = "scan.csv" }'
    """
    if re.fullmatch(r"[^,;()=]+\.(csv|txt|dat|tsv)", text.strip()):
        return f'a file of points is a table: {{ points = "{text.strip()}" }}'
    if comma := re.fullmatch(r"([-+]?\d+),(\d+)", text.strip()):
        return f"a number has a decimal point, not a comma: {comma[1]}.{comma[2]}"
    match = UNIT.fullmatch(text.strip())
    if not match:
        return ""
    number, unit = match.groups()
    if unit not in IN_MM_AND_N:
        return f"a number has no unit here: {number}"
    value = float(number.replace("_", "")) * IN_MM_AND_N[unit]
    return f"a number has no unit here; with mm, N and MPa {number} {unit} are {value:.10g}"
