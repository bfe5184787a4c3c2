"""A case of the verification manual: a problem, reference values with their source, and how each is
read off the solution.

NAME.reference.toml has the words and the values, NAME.toml the problem; or `problem =
"module:function"` names a function here that returns it.
"""

from __future__ import annotations

import importlib
import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drawing_code import digest_of_code, digest_of_text, files

import petcontact

from . import measures

FOLDER = Path(__file__).parent
ROOT = FOLDER.parents[2]
PAGES = ROOT / "petcontact" / "manual" / "cases"
TABLE = ROOT / "petcontact" / "manual" / "cases.md"
PICTURES = ROOT / "configs" / "pictures" / "verification"
DRAWN = PICTURES / "drawn.json"
"""Digests of cases when their pictures were drawn."""
FIGURES = """model model_in_space posed_parts plane_figures space surface_figure surroundings view
    colour_bands finite"""
DRAWING = *files(*FIGURES.split()), ROOT / "scripts" / "campaigns" / "case_pictures.py"
"""Modules that draw the pictures."""
KINDS = ("closed form", "external source", "another code")


@dataclass(frozen=True)
class Value:
    """A reference value: its name, unit, number, tolerance (relative; of a reference 0 absolute),
    and the measure.

    `set` changes keys of the problem file, or keywords of the function, for this value.
    """

    name: str
    reference: float
    tolerance: float
    measure: str
    unit: str = ""
    source: str = ""
    missed: str = ""
    set: dict[str, Any] = field(default_factory=dict)
    keys: dict[str, Any] = field(default_factory=dict)

    def computed(self, solution: petcontact.Solution) -> float:
        return getattr(measures, self.measure)(solution, **self.keys)

    def met(self, computed: float) -> bool:
        return abs(computed - self.reference) <= self.tolerance * (abs(self.reference) or 1.0)


@dataclass(frozen=True)
class Case:
    """One page of the manual. `quick` says whether the tests solve it.

    `data` has the numbers of the problem, as a table. `accuracy` solves on adaptive meshes to it, as
    `--accuracy` does. `curve` has closed forms of "pressure" and "shear" that are drawn where they
    have no norm. `edges` are points of the contact where the reference has the end of a zone, and
    `multiple` a step and a factor: the pressure at the end is exactly as many times that of the step.
    `line` has `start` and `end` on which `components` of the displacement of a `body` are drawn with
    their `exact` forms, or without components the von Mises stress.
    """

    name: str
    path: Path
    number: str
    title: str
    kind: str
    uncertainty: str
    source: str
    text: str
    mesh: str = ""
    problem: str = ""
    accuracy: float | None = None
    quick: bool = False
    values: tuple[Value, ...] = ()
    data: dict[str, str] = field(default_factory=dict)
    curve: dict[str, str] = field(default_factory=dict)
    edges: tuple[tuple[float, ...], ...] = ()
    multiple: tuple[int, float] | None = None
    line: dict[str, Any] = field(default_factory=dict)

    @property
    def drawn(self) -> dict[str, Any]:
        """All that a picture of the contact shows beside the solution."""
        marks = {"edges": self.edges, "multiple": self.multiple, "line": self.line}
        return self.curve | {key: mark for key, mark in marks.items() if mark}

    @property
    def config(self) -> Path | None:
        """The problem file, where the problem is one."""
        return None if self.problem else self.path.parent / f"{self.name}.toml"

    def posed(self, changes: dict[str, Any] | None = None) -> petcontact.Problem:
        if self.config:
            return petcontact.load(self.config, changes)
        module, name = self.problem.split(":")
        return getattr(importlib.import_module(f"{__package__}.{module}"), name)(**(changes or {}))

    def computed(self) -> tuple[list[float], petcontact.Solution]:
        """The values, and the solution of the problem as it stands; one that did not converge is an
        error."""
        changed = {repr(value.set): value.set for value in self.values} | {"{}": {}}
        solutions = {key: self._solved(changes) for key, changes in changed.items()}
        return [value.computed(solutions[repr(value.set)]) for value in self.values], solutions[
            "{}"
        ]

    def _solved(self, changes: dict[str, Any]) -> petcontact.Solution:
        problem = self.posed(changes)
        solution = (
            petcontact.adapt(problem, self.accuracy) if self.accuracy else petcontact.solve(problem)
        )
        assert solution.converged, f"{self.name}: {solution.reason}"
        return solution


def read(path: Path) -> Case:
    """The case of a NAME.reference.toml; an unknown key is an error."""
    data = tomllib.loads(path.read_text())
    values = tuple(_value(entry) for entry in data.pop("value", ()))
    case = Case(name=path.name.removesuffix(".reference.toml"), path=path, values=values, **data)
    assert case.kind in KINDS and values, path
    return case


def _value(entry: dict[str, Any]) -> Value:
    known = {
        key: entry.pop(key)
        for key in list(entry)
        if key in Value.__dataclass_fields__ and key != "keys"
    }
    return Value(**known, keys=entry)


def every() -> list[Case]:
    """All cases, published ones first, by number."""
    return sorted(
        (read(path) for path in FOLDER.glob("*/*.reference.toml")), key=lambda case: case.number
    )


def digest_of(case: Case) -> str:
    """Of what its pictures show: the problem, how it is solved, the closed forms, and the code
    that draws."""
    posed = tomllib.loads(case.config.read_text()) if case.config else case.problem
    return digest_of_text(repr((posed, case.accuracy, case.drawn, digest_of_code(DRAWING))))


def number(value: float) -> str:
    """Six digits."""
    return f"{value:.6g}"


def rows(case: Case, computed: list[float]) -> list[list[str]]:
    """Name, target, computed, ratio, tolerance, met, of each value."""
    return [
        [
            value.name,
            f"{number(value.reference)} {value.unit}".strip(),
            number(found) if value.reference else f"{found:.1e}",
            f"{found / value.reference:.4f}" if value.reference else "",
            f"{value.tolerance:g}",
            "yes" if value.met(found) else f"**no**: {value.missed}",
        ]
        for value, found in zip(case.values, computed, strict=True)
    ]
