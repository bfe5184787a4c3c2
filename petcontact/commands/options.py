"""The options of a command as a table."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from typing import Any

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
