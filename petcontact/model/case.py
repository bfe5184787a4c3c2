"""TOML files to a `Problem`."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..given.tables.base import Model, parse
from ..given.tables.solver_options import Bem, MeshOptions, Method
from ..runtime.file_kinds import known_kind, like
from ..runtime.hints import NUMBER, demand_name, number_refused
from .problem import OneBody, Problem
from .variables import with_values

LARGEST_FILE = 4_000_000
DEEPEST = 16
"""Levels of arrays and tables, and parts of a dotted key: what tomllib does with more grows with
their square."""
TEXT = re.compile(r'"""[\s\S]*?"""|\'\'\'[\s\S]*?\'\'\'|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|#[^\n]*')
"""Strings and comments of TOML."""
MEANT = (
    (r"[“”„’‘]", 'a text stands in straight quotes, "..."'),
    (r"=\s*([-+]?\d+),(\d+)", "a decimal point, not a comma: {}.{}"),
    (r"=\s*([-+]?)\.(\d+)", "a digit stands before a decimal point: {}0.{}"),
    (r"=\s*([-+]?\d+)\.(?!\d)(\w*)", "a digit stands after a decimal point: {}.0{}"),
    (r"=\s*\(([^()]*)\)", "an array stands in brackets: [{}]"),
    (r"=\s*([-+]?\d[\d.]*(?:,\s+[-+]?\d[\d.]*)+)", "an array stands in brackets: [{}]"),
    (r"=\s*\[?.*\b(True|False)\b", "write true or false, not {}"),
    (r"=.*\b(null|None|none|nil)\b", 'there is no {} in TOML; leave the key out, or write "free"'),
    (
        r"=\s*(?:\[(?:[^]]*,)?\s*)?(?!true\b|false\b|inf\b|nan\b)([A-Za-z_][\w.-]*)",
        'a text needs quotes: "{}"',
    ),
    (r"=\s*([-+(\d][\w.\s]*[-+*/^(][^\"]*?)\s*$", 'an expression needs quotes: "{}"'),
    (r"overwrite.*: \[\[([^][]+)\]\]", "[{0}] stands above in single brackets; write [[{0}]]"),
    (
        r"(?:twice|overwrite).*: \[([^][]+)\]",
        "a table that stands several times is [[{}]] each time",
    ),
)
"""What a line that is no TOML most often means: a pattern of the error and the line, and a text."""
WITH_UNIT = re.compile(rf"[=\[,]\s*({NUMBER}\s*[A-Za-zµ°%][\w/*^²³·%]*)\s*(?:[],}}#]|$)")
LONG_KEY = re.compile(rf"(?:\.[ \t]*[\w-]+[ \t]*){{{DEEPEST}}}")


def read_toml(path: str | Path, own: Sequence[str] = ("material", "body")) -> dict[str, Any]:
    """The plain content of a TOML file, of a problem where no other keys are its own.

    Raises
    ------
    InputError
        If the file cannot be read, is not TOML, or has keys of another kind of file; one line
        that names it.
    """
    try:
        with open(
            path, "rb"
        ) as file:  # on the command line a pipe will do: `petcontact solve <(...)`
            content = file.read(LARGEST_FILE + 1)
        if kind := known_kind(path, [".toml"]):
            raise InputError(f"{path}: {kind}")
        if len(content) > LARGEST_FILE:
            raise InputError(f"{path}: larger than {LARGEST_FILE} bytes, this is no config")
        data = parse_toml(content.decode("utf-8-sig"), f"{path}")
        if kind := known_kind(path, [".toml", *own], data):
            raise InputError(f"{path}: {kind}")
        return data
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}){like(path)}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: not a text file in UTF-8") from None
    except InputError:
        raise
    except ValueError:  # a null byte, which no file name has
        raise InputError(f"{str(path)!r}: is no file name") from None


def parse_toml(text: str, source: str) -> dict[str, Any]:
    """The plain content of a TOML text.

    Raises
    ------
    InputError
        If it is not TOML, or small to write and large to read: keys of very many parts, arrays in
        arrays in arrays.
    """
    plain = TEXT.sub("_", text)
    depth = np.cumsum(
        np.array(
            [(c in "[{") - (c in "]}") for c in re.findall(r"[\[\]{}]", plain)], dtype=np.int64
        )
    )
    if LONG_KEY.search(plain) or depth.max(initial=0) > DEEPEST:
        raise InputError(f"{source}: nested deeper than {DEEPEST} levels, this is no config")
    try:
        return tomllib.loads(text)
    except (RecursionError, ValueError) as error:
        raise InputError(f"{source}: not valid TOML {_reason(text, error)}") from None


def _reason(text: str, error: Exception) -> str:
    """Why a text is no TOML, with the line, and what is most often meant."""
    place = re.search(r"\(at line (\d+), column (\d+)\)", str(error))
    row, column = map(int, place.groups()) if place else _left_open(text)
    if not row:
        return f"({str(error) or 'nested too deeply'})"
    whole = text.splitlines()[row - 1]
    line, rest = whole.strip(), whole[column - 1 :].strip()
    reason = f"{error}" if place else f"{error}".replace("at end of document", f"line {row}")
    plain = TEXT.sub(lambda part: "" if part[0][0] == "#" else '""', f"({error}): {line}").strip()
    hints = [
        text.format(*match.groups())
        for pattern, text in MEANT
        if (match := re.search(pattern, plain))
    ]
    if (number := WITH_UNIT.search(plain)) and (refused := number_refused(number[1])):
        hints.insert(0, refused)
    elif plain.startswith("(Unclosed"):
        word = re.match(r"[^\s,}\]=]+", rest)
        inside = word and place and (line != rest or rest[0] in "{\"'+-.0123456789")
        comma = f"a comma is missing before {word[0]}" if word and inside else ""
        closed = f"a bracket {'before' if place else 'in'} this line is not closed"
        hints.insert(0, comma or closed)
    return f"({reason}): {line[:60]!r}{''.join(f'; {hint}' for hint in hints[:1])}"


def _left_open(text: str) -> tuple[int, int]:
    """Line and column of the first quote or bracket that nothing closes, from 1; else zeros."""
    plain = TEXT.sub(lambda part: re.sub(".", " ", part[0]), text)
    opened: list[int] = []
    for mark in re.finditer(r"[][{}\"']", plain):
        if mark[0] in "\"'":
            opened = [mark.start()]
            break
        opened = [*opened, mark.start()] if mark[0] in "[{" else opened[:-1]
    if not opened:
        return 0, 0
    before = plain[: opened[0]]
    return before.count("\n") + 1, opened[0] - before.rfind("\n")


def load(path: str | Path, overrides: Mapping[str, Any] | None = None) -> Problem:
    """The problem of a TOML file.

    Parameters
    ----------
    path : str or Path
    overrides : mapping of dotted keys to values, optional
        For example ``{"method.omega": 1.0, "mesh.element_size": 0.1}``.

    Raises
    ------
    InputError
        One line: file, key, what was given, what is allowed.
    """
    return parse_problem(read_toml(path), str(path), overrides or {}, Path(path).parent)


def parse_problem(
    data: dict[str, Any], source: str, overrides: Mapping[str, Any], folder: Path
) -> Problem:
    """A problem from plain data; files that it names are taken relative to `folder`."""
    variables = data.get("variables", {})
    for key, value in overrides.items():
        table, _, name = key.partition(".")
        if table == "variables" and isinstance(variables, dict):
            demand_name("variables: no variable", name, variables)
        set_key(data, whole_key(key), value, source)
    data = _points_in(_found_in(with_values(data, (Problem, OneBody), source), folder), folder)
    if isinstance(data.get("body"), list):
        data["body"] = [
            _found_in(body, folder) if isinstance(body, dict) else body for body in data["body"]
        ]
    problem: Problem = parse(Problem, data, source)
    return problem


def _found_in(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A copy of the data with the file of its geometry relative to the folder."""
    geometry = data.get("geometry")
    if isinstance(geometry, dict) and isinstance(geometry.get("file"), str):
        return {**data, "geometry": {**geometry, "file": str(folder / geometry["file"])}}
    return dict(data)


def _points_in(data: Any, folder: Path) -> Any:
    """A copy of the data with all files of points relative to the folder."""
    if isinstance(data, list):
        return [_points_in(each, folder) for each in data]
    if not isinstance(data, dict):
        return data
    return {
        key: str(folder / value)
        if key == "points" and isinstance(value, str)
        else _points_in(value, folder)
        for key, value in data.items()
    }


KEYS = frozenset((*OneBody.model_fields, *Problem.model_fields))
"""What may stand at the top of a file."""


def whole_key(key: str) -> str:
    """The dotted key of a bare one of [method], [mesh] or [bem], as in `element_size`; any other
    key as it is."""
    if "." in key or key in KEYS:
        return key
    sections: dict[str, type[Model]] = {"method": Method, "mesh": MeshOptions, "bem": Bem}
    return next(
        (f"{section}.{key}" for section, model in sections.items() if key in model.model_fields),
        key,
    )


def set_key(data: dict[str, Any], key: str, value: Any, source: str) -> None:
    """Set a dotted key in plain data, making the tables on the way; numbers count entries, as in
    `boundary.0.value`."""
    *tables, last = key.split(".")
    if len(tables) > DEEPEST:
        raise InputError(f"{source}: {key[:40]!r}...: a key of {len(tables) + 1} parts")
    table: Any = data
    for name in tables:
        if isinstance(table, list):
            table = table[_entry(table, name, source, key)]
        elif isinstance(table, dict):
            table = table.setdefault(name, {})
    if isinstance(table, list):
        table[_entry(table, last, source, key)] = value
    elif isinstance(table, dict):
        table[last] = value
    else:
        raise InputError(f"{source}: {key}: {'.'.join(tables)!r} is not a table")


def _entry(entries: list[Any], name: str, source: str, key: str) -> int:
    if not (name.isdecimal() and int(name) < len(entries)):
        names = [
            f"{k} ({entry.get('name') or entry['part']})"
            for k, entry in enumerate(entries)
            if isinstance(entry, dict) and (entry.get("name") or entry.get("part"))
        ]
        there = ", ".join(names) if names else f"0 to {len(entries) - 1}"
        raise InputError(f"{source}: {key}: {name!r} is no entry, entries are {there}")
    return int(name)
