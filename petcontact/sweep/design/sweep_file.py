"""Sweep files: what they may hold, and the points of a CSV file that they name."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic

from ...errors import InputError
from ...given.tables.base import Coordinate, Finite, Model, parse, regular_file
from ...given.tables.mistakes import FUNCTION, WORD
from ...model.case import LARGEST_FILE, read_toml
from ...untyped import Keyed

LARGEST_SWEEP = 1_000_000
LARGEST_POINTS = 200_000_000
"""Bytes of a file of points."""
Count = Annotated[int, pydantic.Field(ge=1, le=LARGEST_SWEEP)]
Keep = Literal["scalars", "contact", "all"]
Function = Annotated[str, pydantic.Field(pattern=FUNCTION)]
"""Name of a function of Python: "module:function"."""


class Sample(Model):
    """Points that fill a box of values evenly.

    Attributes
    ----------
    method : {"latin-hypercube", "sobol"}
        Sobol points fill evenly for powers of two.
    points, seed : int
        The same seed gives the same points.
    range : dict of str to (low, high)
        By key, as in `cross`.
    log : list of str
        Keys whose logarithm is sampled.
    """

    method: Literal["latin-hypercube", "sobol"]
    points: Count
    seed: Annotated[int, pydantic.Field(ge=0)] = 0
    range: Mapping[str, tuple[Finite, Finite]] = pydantic.Field(min_length=1, kw_only=True)
    log: tuple[str, ...] = ()

    @pydantic.model_validator(mode="after")
    def _ordered(self) -> Sample:
        for key, (low, high) in self.range.items():
            if not low < high:
                raise InputError(
                    f"range.{key} must be [low, high] with low < high, got [{low:g}, {high:g}]"
                )
            if key in self.log and low <= 0.0:
                raise InputError(
                    f"range.{key} must be positive, its logarithm is sampled, got {low:g}"
                )
        if unknown := set(self.log) - set(self.range):
            raise ValueError(f"log names {sorted(unknown)[0]!r}, which has no range")
        return self


class SweepFile(Model):
    """A sweep file.

    Attributes
    ----------
    title : str
    problems : list of str
        Problem files, relative to the sweep file.
    cross : dict of str to list
        Values to cross: rho, element_size, rule, any other key of [method], [mesh] or [bem], or any
        dotted key.
    zip : dict of str to list
        Lists of one length that are walked together, and crossed with the rest.
    sample : Sample, optional
        A design that fills a box; crossed with the rest.
    points : str, optional
        A CSV file, relative to the sweep file, whose first line names keys: a line is a point;
        crossed with the rest.
    variant : list of dict, optional
        Named sets of keys that change together: each has a `name` and keys over those of `set`;
        crossed with the rest.
    set : dict
        Keys with one value for all cases, over those of the problem files.
    names : dict of str to str
        What keys that vary are called in tables and ids, where their own names do not please.
    keep : {"scalars", "contact", "all"}, optional
        Which fields are kept beside the table; contact up to 1000 cases by default, scalars beyond.
    quantities : list of str
        Functions of your own, "module:function": of a Solution, a number.
    von_mises : list of points, optional
        Where the von Mises stress is evaluated.
    """

    title: str = ""
    problems: tuple[str, ...] = pydantic.Field(min_length=1, kw_only=True)
    cross: Mapping[str, Annotated[list[Any], pydantic.Field(min_length=1)]] = pydantic.Field(
        default={}
    )
    zip: Mapping[str, Annotated[list[Any], pydantic.Field(min_length=1)]] = pydantic.Field(
        default={}
    )
    sample: Sample | None = None
    points: str | Mapping[str, list[Any]] | None = None
    variant: tuple[Keyed, ...] = ()
    set: Mapping[str, Any] = pydantic.Field(default={})
    names: Mapping[str, Annotated[str, pydantic.Field(pattern=WORD)]] = pydantic.Field(default={})
    keep: Keep | None = None
    quantities: tuple[Function, ...] = ()
    von_mises: tuple[tuple[Coordinate, ...], ...] = ()

    @pydantic.field_validator("variant")
    @classmethod
    def _named(cls, variants: tuple[Keyed, ...]) -> tuple[Keyed, ...]:
        names = [variant.get("name") for variant in variants]
        if not all(isinstance(name, str) and name for name in names) or len(
            set(map(str, names))
        ) < len(names):
            raise InputError('every [[variant]] needs a name of its own, name = "..."')
        return variants

    @pydantic.field_validator("zip")
    @classmethod
    def _one_length(cls, lists: Mapping[str, list[object]]) -> Mapping[str, list[object]]:
        lengths = {key: len(values) for key, values in lists.items()}
        if len(set(lengths.values())) > 1:
            raise InputError(f"lists that are walked together need one length, got {lengths}")
        return lists


def read_files(path: str | Path) -> tuple[str, Keyed, dict[str, Keyed]]:
    """Name and plain content of a sweep file, and the plain content of its problem files by path;
    all that it needs."""
    data = read_toml(path, ("problems",))
    file: SweepFile = parse(SweepFile, data, str(path))
    folder = Path(path).parent
    paths = [str(folder / name) for name in file.problems]
    if len(set(paths)) < len(paths):
        raise InputError(f"{path}: problems: a file is named twice, got {list(file.problems)}")
    if isinstance(file.points, str):
        data["points"] = read_points(folder / file.points)
    return str(path), data, {name: read_toml(regular_file(name, LARGEST_FILE)) for name in paths}


def read_points(path: Path) -> dict[str, list[object]]:
    """Columns of a CSV file by the keys in its first line; numbers where they are numbers.

    Raises
    ------
    InputError
        One line: file, line, what is wrong.
    """
    try:
        with open(regular_file(path, LARGEST_POINTS), encoding="utf-8-sig", newline="") as file:
            head, *lines = [line for line in csv.reader(file) if line]
    except InputError:
        raise
    except (OSError, UnicodeDecodeError, ValueError, csv.Error) as error:
        raise InputError(f"{path}: no CSV file with a line of keys ({error})") from None
    keys = [key.strip() for key in head]
    if not lines or len(set(keys)) < len(keys) or not all(keys):
        raise InputError(f"{path}: needs a line of different keys and a line a point")
    for number, line in enumerate(lines, 2):
        if len(line) != len(keys):
            raise InputError(
                f"{path}: line {number} has {len(line)} values, there are {len(keys)} keys"
            )
    return {key: [_value(line[k].strip()) for line in lines] for k, key in enumerate(keys)}


def _value(word: str) -> object:
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            pass
    return {"true": True, "false": False}.get(word, word)
