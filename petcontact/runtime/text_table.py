"""Tables of words as text."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence

from .terminal import printable

FORMULA = ("=", "+", "-", "@")
"""What a spreadsheet's formula begins with."""


def aligned(grid: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table whose columns are aligned to the right, so that it reads well as
    plain text too.

    The first row of the grid is the head.
    """
    cells = [[printable(word).replace("|", "\\|") for word in line] for line in grid]
    widths = [max(3, *(len(line[k]) for line in cells)) for k in range(len(cells[0]))]
    padded = [
        [word.rjust(width) for word, width in zip(line, widths, strict=True)] for line in cells
    ]
    lines = ["| " + " | ".join(line) + " |" for line in padded]
    return [lines[0], "|" + "|".join("-" * (width + 1) + ":" for width in widths) + "|", *lines[1:]]


def as_csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Rows as CSV. Text that a spreadsheet would take for a formula begins with an apostrophe; None
    is an empty cell."""
    target = io.StringIO()
    writer = csv.writer(target, lineterminator="\n")
    for row in [head, *rows]:
        words = [printable(cell) if isinstance(cell, str) else cell for cell in row]
        writer.writerow(
            [
                "'" + word if isinstance(word, str) and word.startswith(FORMULA) else word
                for word in words
            ]
        )
    return target.getvalue()
