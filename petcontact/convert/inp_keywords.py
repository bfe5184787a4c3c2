"""Input files of Abaqus and CalculiX as keywords."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path

from ..errors import InputError
from ..given.tables.base import regular_file
from ..record import record

LARGEST = 500_000_000
"""Bytes."""
INCLUDED = re.compile(r"\s*\*\s*(\w+)\b[^*]*,\s*INPUT\s*=\s*([^,]+)", re.IGNORECASE)
"""A keyword whose lines, or all of it, stand in another file: its name, and the file."""


@record
class Keyword:
    """One keyword with its parameters, in capitals, and data lines as words."""

    name: str
    parameters: dict[str, str]
    rows: list[list[str]]
    line: int


@contextlib.contextmanager
def numbers_in(path: str | Path, keyword: Keyword) -> Iterator[None]:
    """Name the place of what is no number.

    Raises
    ------
    InputError
        If a text within is none.
    """
    try:
        yield
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{path}: line {keyword.line}: *{keyword.name}: a number was expected"
        ) from None


def _lines(path: Path, within: tuple[Path, ...] = ()) -> Iterator[tuple[int, str]]:
    """Yield the lines of a file with their numbers, and those of files of its folder that it
    includes."""
    text = regular_file(path, LARGEST).read_text(encoding="utf-8", errors="replace")
    for number, line in enumerate(text.splitlines(), 1):
        included = INCLUDED.match(line)
        if not (included and included[1].upper() == "INCLUDE"):
            yield number, line
        if included:
            other = path.parent / included[2].strip("\"' ")
            if other in (path, *within) or not other.resolve().is_relative_to(
                path.parent.resolve()
            ):
                raise InputError(
                    f"{path}: line {number}: {included[2]}: only files of the same folder are "
                    "read, and none by itself"
                )
            yield from _lines(other, (path, *within))


def keywords_of(path: str | Path) -> list[Keyword]:
    """Return the keywords of a file, and of those that it includes."""
    keywords: list[Keyword] = []
    for number, line in _lines(Path(path)):
        if line.startswith("**") or not line.strip():
            continue
        words = [word.strip() for word in line.strip().rstrip(",").split(",")]
        if line.lstrip().startswith("*"):
            pairs = (word.partition("=") for word in words[1:])
            parameters = {" ".join(key.split()).upper(): value.strip() for key, _, value in pairs}
            name = " ".join(words[0].lstrip("* ").upper().split())
            keywords.append(Keyword(name, parameters, [], number))
        elif keywords:
            keywords[-1].rows.append(words)
    return keywords
