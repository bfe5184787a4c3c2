"""TOML files to a `Problem`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from ..errors import InputError
from ..given.tables.base import Model, parse
from ..given.tables.solver_options import Bem, MeshOptions, Method
from ..given.tables.validated import validated
from ..runtime.file_kinds import known_kind, like
from ..runtime.hints import demand_name
from ..untyped import Keyed
from .problem import OneBody, Problem
from .toml_text import DEEPEST, parse_toml
from .variables import with_values

LARGEST_FILE = 4_000_000


def read_toml(path: str | Path, own: Sequence[str] = ("material", "body")) -> Keyed:
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


def checked_problem(given: Problem | str | Path) -> Problem:
    """A problem from Python, or from the TOML file of that name, all values of which are checked.

    Raises
    ------
    InputError
        One line: file, key, what was given, what is allowed.
    """
    problem = load(given) if isinstance(given, str | Path) else given
    if not isinstance(problem, Problem):
        raise InputError(
            f"a Problem or the name of a TOML file is expected, got {type(problem).__name__}"
        )
    return validated(problem)


def load(path: str | Path, overrides: Mapping[str, object] | None = None) -> Problem:
    """The problem of a TOML file.

    Parameters
    ----------
    path : str or Path
    overrides : mapping of dotted keys to values, optional
        For example ``{"method.omega": 1.0, "mesh.element_size": 0.1}``. Files are relative to where
        the program runs, those of the config to its folder.

    Returns
    -------
    Problem

    Raises
    ------
    InputError
        One line: file, key, what was given, what is allowed.

    Examples
    --------
    >>> problem = load("block.toml", {"boundary.0.friction_bound": 100.0, "mesh.order": 1})
    >>> print(solve(problem).verdict())
    """
    return parse_problem(read_toml(path), str(path), overrides or {}, Path(path).parent)


def parse_problem(
    data: Keyed, source: str, overrides: Mapping[str, object], folder: Path
) -> Problem:
    """A problem from plain data, whose files are relative to `folder`, those of the overrides to
    where the program runs."""
    data = files_in(data, folder)
    given = data.get("variables", {})
    variables = {} if not isinstance(given, dict) else given
    unused = _unused(data, variables, source)
    for key, value in overrides.items():
        table, _, name = key.partition(".")
        if table == "variables":
            demand_name("variables: no variable", name, variables)
            unused = [name] if name in unused else unused
        set_key(data, whole_key(key), value, source)
    data = with_values(data, (Problem, OneBody), source)
    # a file that petcontact wrote has values in place of all variables
    if unused and (len(unused) < len(variables) or overrides.keys() & {f"variables.{unused[0]}"}):
        raise InputError(f"{source}: variables.{unused[0]}: nothing in the file depends on it")
    return cast(Problem, parse(Problem, data, source))


def _unused(data: Keyed, variables: Keyed, source: str) -> list[str]:
    """The variables that stand nowhere else in the file."""
    for name, value in variables.items():
        if name in KEYS and isinstance(value, str):
            raise InputError(
                f"{source}: variables.{name}: {name} belongs above the first [table] of the file"
            )
    words = Counter(re.findall(r"[^\W\d]\w*", str(data)))
    return [name for name in variables if words[name] < 2]


def names_file(key: str, value: Any) -> bool:
    """Whether a value names a file, by the last part of its dotted key.

    >>> names_file("method.start", "a.h5:3"), names_file("method.start", "zero")
    (True, False)
    """
    last, text = key.rpartition(".")[2], isinstance(value, str)
    return text and (last in ("file", "points") or (last == "start" and ".h5" in value))


def files_in(data: object, folder: Path) -> Any:
    """A copy of the data with all files that they name relative to the folder."""
    if isinstance(data, list):
        return [files_in(each, folder) for each in data]
    if not isinstance(data, dict):
        return data
    return {
        key: str(folder / value) if names_file(key, value) else files_in(value, folder)
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


def set_key(data: Keyed, key: str, value: object, source: str) -> None:
    """Set a dotted key in plain data, making the tables on the way; numbers count entries, as in
    `boundary.0.value`."""
    *tables, last = key.split(".")
    if len(tables) > DEEPEST:
        raise InputError(f"{source}: {key[:40]!r}...: a key of {len(tables) + 1} parts")
    table: object = data
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


def _entry(entries: list[object], name: str, source: str, key: str) -> int:
    if not (name.isdecimal() and int(name) < len(entries)):
        names = [
            f"{k} ({entry.get('name') or entry['part']})"
            for k, entry in enumerate(entries)
            if isinstance(entry, dict) and (entry.get("name") or entry.get("part"))
        ]
        there = ", ".join(names) if names else f"0 to {len(entries) - 1}"
        raise InputError(f"{source}: {key}: {name!r} is no entry, entries are {there}")
    return int(name)
