"""The options of a command as a table."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..runtime.atomic_write import check_target
from ..runtime.figure_style import FORMATS
from ..untyped import Keyed

Adder = Callable[[argparse.ArgumentParser], object]


def option(*names: str, **how: Any) -> Adder:
    """Return what adds an option to a parser.

    Parameters
    ----------
    *names : str
        The names of the option, or the name of an argument without a dash.
    **how
        The keywords of `argparse.ArgumentParser.add_argument`.

    Examples
    --------
    >>> parser = argparse.ArgumentParser()
    >>> _ = option("-o", "--output", metavar="FILE", default="result.h5")(parser)
    >>> parser.parse_args([]).output
    'result.h5'
    """
    return lambda parser: parser.add_argument(*names, **how)


RESULT = option("result", metavar="RESULT.h5", help="a result file")
BODY = option("--body", metavar="NAME", action="append", help="only this body; may be repeated")
CASE = option("--case", metavar="ID", default="/", help="one case of a sweep's folder, kept whole")
"""Options that several of the commands share which read results."""
TABLE = (".csv",), "a table is written as .csv"
FILES = {
    *(f".{kind}" for kind in FORMATS),
    *(".csv", ".gif", ".h5", ".jpeg", ".jpg", ".toml", ".txt", ".vtk", ".vtu", ".xls", ".xlsx"),
}
"""Suffixes by which the name of a file is told from that of a folder."""
FIGURE = [f".{kind}" for kind in FORMATS], "a figure is .png, .pdf or .svg"
"""Suffixes of files that commands write, and what is said of another one."""


def options(*table: Adder) -> Callable[[argparse.ArgumentParser], None]:
    """Return the function `add_arguments` of a command, which adds the options of a table."""

    def add_arguments(parser: argparse.ArgumentParser) -> None:
        for add in table:
            add(parser)

    return add_arguments


def real(word: str) -> float:
    """Return a number from its text, NaN for a text that is none."""
    try:
        return float(word)
    except ValueError:
        return math.nan


def positive(word: str) -> float:
    """Return a positive number from its text, as `type` of an option."""
    if not 0.0 < (value := real(word)) < math.inf:
        raise argparse.ArgumentTypeError(f"{word!r} is no positive number")
    return value


def positives(words: str) -> list[float]:
    """Return positive numbers that are separated by commas, as `type` of an option."""
    return [positive(word) for word in words.split(",")]


def overrides(words: list[str]) -> Keyed:
    """--set KEY=VALUE as dotted keys; the value is read as TOML, else as a number or a text.

    >>> overrides(["mesh.order=2", "mesh.element_size=.5", "boundary.0.gap=x**2"])
    {'mesh.order': 2, 'mesh.element_size': 0.5, 'boundary.0.gap': 'x**2'}
    """
    from ..model.toml_text import parse_toml

    result: Keyed = {}
    for word in words:
        try:
            word = os.fsencode(word).decode(
                "utf-8"
            )  # Python takes the words in the encoding of the locale
        except UnicodeDecodeError:
            raise InputError(f"--set {word!a}: not text in UTF-8") from None
        key, equals, value = word.partition("=")
        if not (key and equals and value):
            raise InputError(f"--set {word}: expected KEY=VALUE")
        try:
            result[key] = parse_toml(f"v = {value}", "--set")["v"]
        except InputError:  # numbers are written as .2 and 2., too
            result[key] = value if math.isnan(number := real(value)) else number
    return result


def increment(word: str, count: int, last: int) -> int:
    """Return the number of the increment that --step names.

    Parameters
    ----------
    word : str
        A number from 1 to `count`, or `last`.
    count, last : int
        Increments, and the number of the last solution, 0 where there is none.
    """
    if word == "last" and last:
        return last
    if not (word.isascii() and word.isdigit() and 1 <= int(word) <= count):
        raise InputError(f"--step {word}: there are increments 1 to {count}, and `last`")
    return int(word)


def check_folder(option: str, path: str | None, instead: Sequence[str] = ()) -> None:
    """Refuse a folder that is to be made, and is named like a file of none of the suffixes that
    may stand instead."""
    suffix = Path(path or "").suffix.lower()
    if suffix in {*FILES} - {*instead} and not Path(path or "").is_dir():
        raise InputError(f"{option} {path}: a folder is expected, and this is the name of a file")


def check_output(
    path: str | Path | None, suffixes: Sequence[str], text: str, inputs: Sequence[str | Path] = ()
) -> None:
    """Refuse, before any work is done, a file that is to be written and has the suffix of something
    else, or cannot be written.

    Parameters
    ----------
    path : str or Path
        None is not written.
    suffixes : sequence of str
        In small letters.
    text : str
        What is said of another suffix.
    inputs : sequence of str or Path
        Files that are read.
    """
    if path and Path(path).suffix.lower() not in suffixes:
        raise InputError(f"{path}: {text}")
    if path:
        check_target(Path(path), replace=True, inputs=inputs)
