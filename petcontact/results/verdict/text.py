"""Numbers and lines of a verdict."""

from __future__ import annotations

import numpy as np

from ...geometry.rotation import Axial


def vector(value: Axial, count: int = 6) -> str:
    """A number, or a vector in brackets, with so many significant digits."""
    text = ", ".join(f"{component:.{count}g}" for component in np.atleast_1d(value))
    return text if np.ndim(value) == 0 else f"({text})"


def digits(error: float, value: float) -> int:
    """Significant digits of a value whose error is known, 1 to 7."""
    if not error > 0.0 or value == 0.0:
        return 7
    return (
        int(np.clip(np.floor(np.log10(abs(value) / error)) + 1.0, 1, 7))
        if np.isfinite(error)
        else 1
    )


WIDTH = 80
"""Of a line."""


def wrapped(head: str, items: list[str], separator: str = ",") -> list[str]:
    """Items joined by commas, or words (separator " "), broken into lines that are indented under
    the first."""
    if separator == " ":
        items = " ".join(items).split()
    lines, line = [], head
    for k, item in enumerate(items):
        text = item + (separator.strip() if k < len(items) - 1 else "")
        if len(line) + len(text) + 1 > WIDTH and line.strip() and line != head:
            lines.append(line.rstrip())
            line = " " * len(head)
        line += text + " "
    return [*lines, line.rstrip()]
