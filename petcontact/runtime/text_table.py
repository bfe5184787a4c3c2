"""Tables of words as text."""

from __future__ import annotations

from collections.abc import Sequence


def aligned(grid: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table whose columns are aligned to the right, so that it reads well as plain text too.

    The first row of the grid is the head.
    """
    cells = [[word.replace("|", "\\|") for word in line] for line in grid]
    widths = [max(3, *(len(line[k]) for line in cells)) for k in range(len(cells[0]))]
    padded = [[word.rjust(width) for word, width in zip(line, widths, strict=True)] for line in cells]
    lines = ["| " + " | ".join(line) + " |" for line in padded]
    return [lines[0], "|" + "|".join("-" * (width + 1) + ":" for width in widths) + "|", *lines[1:]]
