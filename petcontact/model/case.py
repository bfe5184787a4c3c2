"""TOML files to a `Case`: a problem, its method, and the options of PETSc that go with them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from ..errors import InputError
from .assembly import ONE_BODY, Assembly, assembly_of
from .base import Model, Options, parse
from .mesh_options import MeshOptions
from .problem import Problem
from .solver_options import Bem, Method

LARGEST_FILE = 4_000_000
DEEPEST = 16
"""Levels of arrays and tables, and parts of a dotted key: what tomllib does with more grows with their square."""
TEXT = re.compile(r'"""[\s\S]*?"""|\'\'\'[\s\S]*?\'\'\'|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|#[^\n]*')
"""Strings and comments of TOML."""
LONG_KEY = re.compile(rf"(?:\.[ \t]*[\w-]+[ \t]*){{{DEEPEST}}}")


class Case(Problem):
    """A problem and how it is solved: one TOML file.

    Attributes
    ----------
    method : Method
        How the contact problem is solved.
    bem : Bem
        How the boundary operators are stored.
    petsc : dict
        PETSc options without the leading dash; `-options_file` and the command line have precedence.
    """

    method: Method = Method()
    bem: Bem = Bem()
    petsc: Options = {}  # noqa: RUF012 (pydantic copies it)

    @classmethod
    def of(cls, problem: Problem) -> Case:
        """The problem with the default method, or the case itself."""
        if isinstance(problem, Case):
            return problem
        return cls(**{name: getattr(problem, name) for name in Problem.model_fields})

    def toml(self) -> str:
        """The whole case as TOML, defaults filled in."""
        return tomli_w.dumps(self.model_dump(mode="json", exclude_none=True))


def read_toml(path: str | Path) -> dict[str, Any]:
    """The plain content of a TOML file.

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML; one line that names it.
    """
    try:
        with open(path, "rb") as file:
            content = file.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise InputError(f"{path}: larger than {LARGEST_FILE} bytes, this is no config")
        return parse_toml(content.decode("utf-8"), f"{path}")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
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
        If it is not TOML, or small to write and large to read: keys of very many parts, arrays in arrays in arrays.
    """
    plain = TEXT.sub("_", text)
    depth = np.cumsum(np.array([(c in "[{") - (c in "]}") for c in re.findall(r"[\[\]{}]", plain)], dtype=np.int64))
    if LONG_KEY.search(plain) or depth.max(initial=0) > DEEPEST:
        raise InputError(f"{source}: nested deeper than {DEEPEST} levels, this is no config")
    try:
        return tomllib.loads(text)
    except (RecursionError, ValueError) as error:
        raise InputError(f"{source}: not valid TOML ({str(error) or 'nested too deeply'})") from None


def load(path: str | Path, overrides: Mapping[str, Any] | None = None) -> Case:
    """The case of a TOML file of one body; `load_assembly` reads those of several.

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
    return parse_case(read_toml(path), str(path), overrides or {}, Path(path).parent)


def load_assembly(path: str | Path, overrides: Mapping[str, Any] | None = None) -> Assembly:
    """The assembly of a TOML file, of several bodies or of one.

    Raises
    ------
    InputError
        As `load`.
    """
    case = load_any(path, overrides)
    return assembly_of(case)


def load_any(path: str | Path, overrides: Mapping[str, Any] | None = None) -> Case | Assembly:
    """What a TOML file holds.

    Raises
    ------
    InputError
        As `load`.
    """
    return parse_any(read_toml(path), str(path), overrides or {}, Path(path).parent)


def parse_case(data: dict[str, Any], source: str, overrides: Mapping[str, Any], folder: Path) -> Case:
    """A case from plain data; files that it names are taken relative to `folder`."""
    case = parse_any(data, source, overrides, folder)
    if isinstance(case, Assembly):
        raise InputError(f"{source}: body: one body is expected here; load_assembly and `petcontact solve` take several")
    return case


def parse_any(data: dict[str, Any], source: str, overrides: Mapping[str, Any], folder: Path) -> Case | Assembly:
    """A case, or an assembly where there are [[body]], [[obstacle]] or [[contact]] tables, from plain data."""
    for key, value in overrides.items():
        set_key(data, whole_key(key), value, source)
    data = _one_body_named(_found_in(data, folder))
    bodies = data.get("body")
    if isinstance(bodies, list):
        data = {**data, "body": [_found_in(body, folder) if isinstance(body, dict) else body for body in bodies]}
    case: Case | Assembly = parse(Assembly if "body" in data else Case, data, source)
    return case


def _found_in(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The data with the file of its geometry relative to the folder."""
    geometry = data.get("geometry")
    if isinstance(geometry, dict) and isinstance(geometry.get("file"), str):
        return {**data, "geometry": {**geometry, "file": str(folder / geometry["file"])}}
    return data


def _one_body_named(data: dict[str, Any]) -> dict[str, Any]:
    """A one-body file with obstacles or contact pairs as an assembly of one body."""
    if "body" in data or not {"obstacle", "contact"} & set(data):
        return data
    own = ("material", "geometry", "mesh", "boundary", "point_force")
    body = {"name": ONE_BODY, **{key: data[key] for key in own if key in data}}
    return {**{key: value for key, value in data.items() if key not in own}, "body": [body]}


def whole_key(key: str) -> str:
    """The dotted key of a bare one of [method], [mesh] or [bem], as in `element_size`; any other key as it is."""
    if "." in key or key in Case.model_fields:
        return key
    sections: dict[str, type[Model]] = {"method": Method, "mesh": MeshOptions, "bem": Bem}
    return next((f"{section}.{key}" for section, model in sections.items() if key in model.model_fields), key)


def set_key(data: dict[str, Any], key: str, value: Any, source: str) -> None:
    """Set a dotted key in plain data, making the tables on the way; numbers count entries, as in `boundary.0.value`."""
    *tables, last = key.split(".")
    if len(tables) > DEEPEST:
        raise InputError(f"{source}: {key[:40]!r}...: a key of {len(tables) + 1} parts")
    here: Any = data
    for name in tables:
        if isinstance(here, list):
            here = here[_entry(here, name, source, key)]
        elif isinstance(here, dict):
            here = here.setdefault(name, {})
    if isinstance(here, list):
        here[_entry(here, last, source, key)] = value
    elif isinstance(here, dict):
        here[last] = value
    else:
        raise InputError(f"{source}: {key}: {'.'.join(tables)!r} is not a table")


def _entry(entries: list[Any], name: str, source: str, key: str) -> int:
    if not (name.isdecimal() and int(name) < len(entries)):
        raise InputError(f"{source}: {key}: {name!r} is no entry, entries are 0 to {len(entries) - 1}")
    return int(name)
