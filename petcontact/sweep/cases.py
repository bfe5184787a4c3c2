"""Sweep files: problem files, and lists of values to cross, to a list of cases with readable ids."""

from __future__ import annotations

import copy
import dataclasses
import fnmatch
import hashlib
import itertools
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any

import pydantic

from ..errors import InputError
from ..model.base import Model, parse
from ..model.case import Case, parse_case, read_toml
from ..model.mesh_options import MeshOptions
from ..model.solver_options import Bem, Method

SECTIONS: dict[str, type[Model]] = {"method": Method, "mesh": MeshOptions, "bem": Bem}
LONGEST_VALUE = 24
"""Characters of a value in an id; a longer one is cut and told apart by a hash."""
LARGEST_SWEEP = 1_000_000


class SweepFile(Model):
    """A sweep file.

    Attributes
    ----------
    title : str
    problems : list of str
        Problem files, relative to the sweep file.
    cross : dict of str to list
        Values to cross: rho, element_size, rule, any other key of [method], [mesh] or [bem], or any dotted key.
    variant : list of dict, optional
        Named sets of keys that change together: each has a `name` and keys over those of `set`; crossed with the rest.
    set : dict
        Keys with one value for all cases, over those of the problem files.
    """

    title: str = ""
    problems: Annotated[tuple[str, ...], pydantic.Field(min_length=1)]
    cross: Mapping[str, Annotated[list[Any], pydantic.Field(min_length=1)]] = pydantic.Field(default={})
    variant: tuple[dict[str, Any], ...] = ()
    set: Mapping[str, Any] = pydantic.Field(default={})

    @pydantic.field_validator("variant")
    @classmethod
    def _named(cls, variants: tuple[dict[str, Any], ...]) -> tuple[dict[str, Any], ...]:
        names = [variant.get("name") for variant in variants]
        if not all(isinstance(name, str) and name for name in names) or len(set(map(str, names))) < len(names):
            raise ValueError('every [[variant]] needs a name of its own, name = "..."')
        return variants


@dataclass(frozen=True)
class SweepCase:
    """One case of a sweep.

    Attributes
    ----------
    id : str
        Readable and the same in every run, for example ``example1-modified-rho1e3-h0.05``; a valid file name.
    case : Case
    coordinates : dict
        What distinguishes the case: problem, variant, and the value of each crossed key.
    """

    id: str
    case: Case
    coordinates: dict[str, Any]


@dataclass(frozen=True)
class Sweep:
    """The cases of a sweep file, crossed: problems slowest, the last crossed key fastest."""

    title: str
    cases: tuple[SweepCase, ...]

    def only(self, patterns: Sequence[str]) -> Sweep:
        """The cases whose id matches one of the shell patterns; all of them if there is no pattern.

        Raises
        ------
        InputError
            If a pattern matches nothing.
        """
        for pattern in patterns:
            if not any(fnmatch.fnmatchcase(case.id, pattern) for case in self.cases):
                raise InputError(f"--only {pattern}: no case has such an id (--list shows them)")
        chosen = [c for c in self.cases if not patterns or any(fnmatch.fnmatchcase(c.id, p) for p in patterns)]
        return dataclasses.replace(self, cases=tuple(chosen))


def load_sweep(path: str | Path) -> Sweep:
    """The cases of a sweep file.

    Raises
    ------
    InputError
        One line: file, key or case, what was given, what is allowed.
    """
    return build_sweep(*read_files(path))


def read_files(path: str | Path) -> tuple[str, dict[str, Any], dict[str, dict[str, Any]]]:
    """Name and plain content of a sweep file, and the plain content of its problem files by path."""
    data = read_toml(path)
    file: SweepFile = parse(SweepFile, data, str(path))
    paths = [str(Path(path).parent / name) for name in file.problems]
    if len(set(paths)) < len(paths):
        raise InputError(f"{path}: problems: a file is named twice, got {list(file.problems)}")
    return str(path), data, {name: read_toml(name) for name in paths}


def build_sweep(source: str, data: dict[str, Any], problems: dict[str, dict[str, Any]]) -> Sweep:
    """Cross what `read_files` read; the same on every rank.

    Raises
    ------
    InputError
        If a case is invalid, or two cases would have the same id.
    """
    file: SweepFile = parse(SweepFile, data, source)
    fixed = {full_key(key, source): value for key, value in file.set.items()}
    axes = {full_key(key, source): values for key, values in file.cross.items()}
    varied_keys = {full_key(key, source) for variant in file.variant for key in variant if key != "name"}
    for key in axes:
        if key in fixed or key in varied_keys:
            raise InputError(f"{source}: cross.{key}: the key is set elsewhere in this file too")
    count = len(problems) * max(1, len(file.variant))
    for values in axes.values():
        count *= len(values)
    if count > LARGEST_SWEEP:
        raise InputError(f"{source}: {count} cases; the largest sweep has {LARGEST_SWEEP}")
    stems = _stems(list(problems), source)
    cases: dict[str, SweepCase] = {}
    for path, variant, values in itertools.product(problems, file.variant or ({},), itertools.product(*axes.values())):
        crossed = dict(zip(axes, values, strict=True))
        id_ = case_id(stems[path], variant.get("name", ""), crossed)
        if id_ in cases:
            raise InputError(f"{source}: two cases have the id {id_}: is a value listed twice?")
        varied = {full_key(key, source): value for key, value in variant.items() if key != "name"}
        case = parse_case(
            copy.deepcopy(problems[path]), f"{source}: {id_}", {**fixed, **varied, **crossed}, Path(path).parent
        )
        names = {"variant": variant["name"]} if variant else {}
        cases[id_] = SweepCase(id_, case, {"problem": stems[path], **names, **_short_keys(crossed)})
    return Sweep(file.title, tuple(cases.values()))


def full_key(key: str, source: str) -> str:
    """The dotted key of a short one: rho is method.rho, element_size is mesh.element_size."""
    if "." in key or key == "title":
        return key
    found = [f"{section}.{key}" for section, model in SECTIONS.items() if key in model.model_fields]
    if not found:
        raise InputError(f"{source}: {key}: neither a key of [method], [mesh] or [bem] nor a dotted key")
    return found[0]


def case_id(problem: str, variant: str, crossed: dict[str, Any]) -> str:
    """Problem, variant, rule, rho and h in this order, then the other crossed keys with their names."""
    words = [problem, _text(variant)] if variant else [problem]
    known = {"method.rule": "", "method.rho": "rho", "mesh.element_size": "h"}
    for key in sorted(crossed, key=lambda k: [*known, k].index(k)):
        words.append(known.get(key, key.rsplit(".", 1)[-1].replace("_", "")) + _text(crossed[key]))
    return "-".join(words)


def _short_keys(crossed: dict[str, Any]) -> dict[str, Any]:
    """Coordinates under the last word of their key where that is unique: rho, not method.rho."""
    last = [key.rsplit(".", 1)[-1] for key in crossed]
    return {(word if last.count(word) == 1 else key): crossed[key] for key, word in zip(crossed, last, strict=True)}


def _stems(paths: list[str], source: str) -> dict[str, str]:
    """The problem's part of the ids, by path."""
    stems = {path: _text(Path(path).stem) for path in paths}
    if len(set(stems.values())) < len(stems):
        raise InputError(f"{source}: problems: the files need names that differ in more than their folders, got {paths}")
    return stems


def _text(value: Any) -> str:
    """A value as part of an id; different numbers give different texts."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return short_number(value)
    text = value if isinstance(value, str) else json.dumps(value, sort_keys=True, default=str)
    plain = re.sub(r"[^\w.+]+", "-", text).strip("-.") or "empty"
    if len(plain) > LONGEST_VALUE:
        return f"{plain[:LONGEST_VALUE]}~{hashlib.sha256(text.encode()).hexdigest()[:6]}"
    return plain


def short_number(value: float) -> str:
    """The shorter of 1000.0 and 1e3 without what says nothing."""
    scientific = f"{Decimal(repr(value)).normalize():e}".replace("e+", "e")
    return min(repr(value).removesuffix(".0"), scientific, key=len)
