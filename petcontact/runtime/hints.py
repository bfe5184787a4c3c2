"""What a name that does not exist, or a value that is not read, most likely stands for."""

from __future__ import annotations

import difflib
import re
from collections.abc import Container, Iterable, Sequence
from typing import Any, TypeVar

from ..errors import InputError

T = TypeVar("T")
SYNONYMS = {
    "mu": "friction_coefficient",
    "gravity": "acceleration",
    "omega": "angular_velocity",
    "alpha": "thermal_expansion",
    "rho": "density",
    "temp": "temperature",
    "displacements": "displacement",
    "friction": "friction_coefficient",
    "g": "friction_bound",
    "bound": "friction_bound",
    "E": "young_modulus",
    "nu": "poisson_ratio",
    "h": "element_size",
    "size": "element_size",
    "p": "order",
    "type": "condition",
    "frictional": "contact",
    "tresca": "contact",
    "coulomb": "contact",
    "clamped": "displacement",
    "encastre": "displacement",
    "fixed": "displacement",
    "dirichlet": "displacement",
    "neumann": "traction",
    "load": "traction",
    "free": "traction",
    "cylinder": "outline",
    "circle": "outline",
    "block": "rectangle",
    "cuboid": "box",
}
"""What others call it."""
SPELLINGS = {"center": "centre", "centre": "center"}
"""Of keys."""
UNIT = re.compile(
    r"([-+]?[\d.]+(?:e[-+]?\d+)?)\s+(?!(?:[xyzs]|n[xyz]|pi)\b)[A-Za-zµ°%][\w/*^²³·%]*"
)
"""A number, a space, and what is no variable of ours."""


def known_key(key: Any, fields: Container[str], given: Container[Any]) -> Any:
    """A key, or its other spelling where a table has that one and it is not given, too.

    >>> known_key("center", {"centre"}, {"center"}), known_key("x", {"centre"}, {"x"})
    ('centre', 'x')
    """
    other = SPELLINGS.get(key, key)
    return other if key not in fields and other in fields and other not in given else key


def nearest(given: Any, names: list[str]) -> str:
    """`, did you mean ...?` where a name is near, else nothing."""
    if not isinstance(given, str):
        return ""
    word = SYNONYMS.get(given, SYNONYMS.get(given.lower()))
    near = [word] if word in names else difflib.get_close_matches(given, names, n=1)
    return f", did you mean {near[0]!r}?" if near else ""


def among(given: Any, names: Sequence[str], there: str = "there are") -> str:
    """What ends a refusal of a name: the nearest of those that there are, or all of them.

    >>> among("rigth", ["left", "right"]), among("x", [], "bodies are")
    (", did you mean 'right'?", '; bodies are none')
    """
    return nearest(given, [*names]) or f"; {there} {', '.join(names) or 'none'}"


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


def number_refused(text: str) -> str:
    """Why a text that is a number with a unit or a comma is no number; nothing for any other text.

    Examples
    --------
    >>> number_refused("150 MPa")
    'a number has no unit here: 150; [units] names units'
    """
    if comma := re.fullmatch(r"([-+]?\d+),(\d+)", text.strip()):
        return f"a number has a decimal point, not a comma: {comma[1]}.{comma[2]}"
    match = UNIT.fullmatch(text.strip())
    return f"a number has no unit here: {match[1]}; [units] names units" if match else ""
