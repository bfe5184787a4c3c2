"""Blocks, obstacles and steps as text of a config: what tests of several bodies are made of."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

from petcontact import Problem, Solution
from petcontact.given.tables.base import parse

LARGEST = 0.05
"""Estimated error of a shipped problem that needs no reason to stand there."""
Vector = list[float | str]


def block(
    name: str,
    low: Vector,
    high: Vector,
    modulus: float = 1.0,
    ratio: float = 0.3,
    mesh: str = "",
    **parts,
) -> str:
    """A rectangle, or a box in space; of its parts the displacement, or a condition and its
    value."""
    shape, first, last = (
        ("rectangle", "lower_left", "upper_right") if len(low) == 2 else ("box", "lower", "upper")
    )
    text = f"""
[[body]]
name = "{name}"
material = {{ young_modulus = {modulus}, poisson_ratio = {ratio} }}
geometry = {{ shape = "{shape}", {first} = {low}, {last} = {high} }}
"""
    text += f"mesh = {{ {mesh} }}\n" if mesh else ""
    for part, given in parts.items():
        condition, value = given if isinstance(given, tuple) else ("displacement", given)
        text += (
            f'[[body.boundary]]\npart = "{part}"\ncondition = "{condition}"\nvalue = '
            f"{json.dumps(value)}\n"
        )
    return text


def obstacle(name: str, displacement: Vector, more: str = "") -> str:
    """A rigid body without a mesh."""
    return f'[[obstacle]]\nname = "{name}"\ndisplacement = {json.dumps(displacement)}\n{more}\n'


def contact_pair(name: str, secondary: str, primary: str, friction: float, gap: str = "") -> str:
    """Unilateral contact with Coulomb friction."""
    text = f'[[contact]]\nname = "{name}"\nsecondary = "{secondary}"\nprimary = "{primary}"\n'
    return text + (f'gap = "{gap}"\n' if gap else "") + f"friction_coefficient = {friction}\n"


def load_step(name: str = "", increments: int = 0, **bodies: dict[str, Vector]) -> str:
    """A load step: new values of parts by body, or under `displacement` what an obstacle does."""
    text = (
        "[[step]]\n"
        + (f'name = "{name}"\n' if name else "")
        + (f"increments = {increments}\n" if increments else "")
    )
    for body, changes in bodies.items():
        for part, value in changes.items():
            if part == "displacement":
                text += f'[[step.obstacle]]\nname = "{body}"\ndisplacement = {json.dumps(value)}\n'
            else:
                text += (
                    f'[[step.boundary]]\nbody = "{body}"\npart = "{part}"\nvalue = '
                    f"{json.dumps(value)}\n"
                )
    return text


def posed(text: str) -> Problem:
    """The problem of such a text."""
    return parse(Problem, tomllib.loads(text), "test")


def unexplained(config: Path, solution: Solution) -> list[str]:
    """Warnings of a shipped problem, and errors of its mesh and path that are large or not known;
    where its comments say why it stands there, their per cent that no warning has."""
    errors = {"mesh": solution.accuracy.error, "path": solution.accuracy.path}
    large = [
        f"error of the {name}: {error}" for name, error in errors.items() if not error <= LARGEST
    ]
    said = re.search(r"^# It stands here (.*\n(?:# .*\n)*)", config.read_text(), re.MULTILINE)
    if said is None:
        return [*solution.warnings, *large]
    found = " ".join([*solution.warnings, *(f"{100.0 * each:.0f}%" for each in errors.values())])
    return [share for share in re.findall(r"(\d+) %", said[1]) if f"{share}%" not in found]
