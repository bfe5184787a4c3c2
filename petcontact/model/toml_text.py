"""Texts in TOML: read, or refused with the line and what is most often meant."""

from __future__ import annotations

import re
import tomllib

import numpy as np

from ..errors import InputError
from ..runtime.hints import NUMBER, number_refused
from ..untyped import Keyed

DEEPEST = 16
"""Levels of arrays and tables, and parts of a dotted key: what tomllib does with more grows with
their square."""
TEXT = re.compile(r'"""[\s\S]*?"""|\'\'\'[\s\S]*?\'\'\'|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|#[^\n]*')
"""Strings and comments of TOML."""
MEANT = (
    (r"\): [{\[]\s*(?:\"\"\s*:|$)", "this is JSON; TOML has key = value, and [tables]"),
    (r"\): (?:-\s)?[\w-]+:(?:\s|$)", "this is YAML; TOML has key = value, and [tables]"),
    (r"[“”„’‘]", 'a text stands in straight quotes, "..."'),
    (r"\): (\w*[^\W\x00-\x7f]\w*)\s*=", 'letters beyond a to z stand in quotes: "{}" = ...'),
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


def parse_toml(text: str, source: str) -> Keyed:
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
    reason = f"{error}" if place else f"{error}".replace("at end of document", f"line {row}")
    plain = TEXT.sub(_emptied, f"({error}): {whole.strip()}").strip()
    number = WITH_UNIT.search(plain)
    hint = number_refused(number[1]) if number else ""
    if not hint and plain.startswith("(Unclosed"):
        start = whole[: column - 1].strip() if place else whole
        hint = _unclosed(start, whole[column - 1 :].strip())
    hint = hint or _meant(plain)
    return f"({reason}): {whole.strip()[:60]!r}{f'; {hint}' if hint else ''}"


def _emptied(part: re.Match[str]) -> str:
    """A text without what is in it; nothing of a comment."""
    return "" if part[0].startswith("#") else '""'


def _meant(plain: str) -> str:
    """What of `MEANT` fits an error and its line first."""
    for pattern, text in MEANT:
        if match := re.search(pattern, plain):
            return text.format(*match.groups())
    return ""


def _unclosed(start: str, rest: str) -> str:
    """What an array or a table lacks whose line is read up to `start`, where it goes on otherwise
    than it may."""
    word = re.match(r"[^\s,}\]=]+", rest)
    if word and (start or rest[0] in "{\"'+-.0123456789") and not start.endswith(rest):
        return f"a comma is missing before {word[0]}"
    return f"a bracket {'in' if start else 'before'} this line is not closed"


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
