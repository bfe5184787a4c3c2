"""Numbers and lines of a verdict."""

from __future__ import annotations

import math
import textwrap

import numpy as np

from ...arrays import Array, shown
from ...given.tables.units import Units
from ...round_off import TINY, WRITTEN
from ...runtime.terminal import printable
from ..numbers.number import Number

WIDTH, KEPT = 80, "\xa0"
"""Columns of a line, and a space at which none is broken."""
UNKNOWN, EXACT = 5, 7
"""Digits of a number whose error is not known or round-off, and the most that are shown."""
POWERS = {"area": 0, "force": 0, "moment": 1, "volume": 1}
"""Powers of the length in units, beyond that of an area (`weight_power`)."""


def digits(error: float, value: float) -> int:
    """Significant digits of a value whose error is known, 1 to 7."""
    if not error > 0.0 or value == 0.0:
        return 7
    return (
        int(np.clip(np.floor(np.log10(abs(value) / error)) + 1.0, 1, 7))
        if np.isfinite(error)
        else 1
    )


def told(number: Number, unit: str = "", others: bool = False) -> str:
    r"""A number with the digits that its error allows, its error and its unit; where errors of
    others are known a question mark stands for its own, which is not.

    >>> told(Number("force", "top", 1, 0, np.array([0.0, -55.2139]), "force", error=0.012), "N")
    '(0,\xa0-55.21)\xa0+-\xa00.02 N'
    """
    value, error = number.value, number.error
    after = f" {printable(unit)}" if unit else ""
    if np.isinf(error):
        return "without a bound"
    if np.isnan(value).any():
        return "not known"
    if not is_resolved(number):
        return f"below {rounded_up(number.size + error)}".replace(" ", KEPT) + after
    # a component that is less than half of the error says nothing
    shown = [0.0 if abs(each) < 0.5 * error else float(each) for each in value]
    texts = [_to(each, error) for each in shown]
    text = f"({', '.join(texts)})" if len(texts) > 1 else texts[0]
    off = " +- ?" * bool(others and np.isnan(error))
    off += f" +- {rounded_up(error)}" if error > 0.0 else ""
    return (text + off).replace(" ", KEPT) + after


def is_resolved(number: Number) -> bool:
    """Whether a number is larger than its error, as that would be printed."""
    return not 0.0 < number.error < np.inf or float(rounded_up(number.error)) < number.size


def _to(value: float, error: float) -> str:
    """A value to the digit that its error changes, at most `EXACT` of them.

    >>> _to(98.5569, 0.046), _to(4.08003, 6e-4), _to(10.23, 2.0), _to(1.2e-5, 3e-7)
    ('98.56', '4.0800', '10', '1.20e-05')
    """
    if value == 0.0:
        return "0"
    if not error > 0.0:
        rounded = float(f"{value:.{UNKNOWN if np.isnan(error) else EXACT}g}")
        return f"{rounded:.{EXACT}g}"
    leading = math.floor(math.log10(abs(value)))
    decimals = min(-math.floor(math.log10(float(rounded_up(error)))), EXACT - 1 - leading)
    if -4 <= leading < EXACT:
        return f"{round(value, decimals):.{max(decimals, 0)}f}"
    return f"{value:.{max(leading + decimals, 0)}e}"


def rounded_up(error: float) -> str:
    """An error with one digit, rounded up.

    >>> rounded_up(0.0121), rounded_up(13.0), rounded_up(0.97)
    ('0.02', '20', '1')
    """
    decade = 10.0 ** np.floor(np.log10(error))
    rounded = np.ceil(error / decade * (1.0 - WRITTEN)) * decade
    return f"{rounded:.0f}" if 1.0 <= rounded < 10.0**EXACT else f"{rounded:.1g}"


def place_of(x: Array, size: float) -> str:
    """A point with as many decimals as show a ten-thousandth of the size of the bodies.

    More of them would be those of the search for a maximum, which is flat, and of a processor.
    """
    decimals = -math.floor(math.log10(max(1e-4 * size, TINY)))
    rounded = np.round(x, decimals)
    return shown(np.where(np.abs(x) < 1e-4 * size, 0.0, rounded), 10).replace(" ", KEPT)


def unit_of(kind: str, units: Units, power: int) -> str:
    """The user's name of a unit, by the kinds of `Number.unit`; `power` is that of length in an
    area."""
    length, stress = units.length, units.stress
    if kind in ("stress", "length"):
        return getattr(units, kind) or ""
    if kind == "rad":
        return "rad"
    if kind.startswith("stress "):  # of a K
        return f"{stress} {length}{kind.partition('length')[2]}" if stress and length else ""
    power += POWERS[kind]
    if kind in ("area", "volume"):
        return f"{length}{' ²³'[power - 1].strip()}" if length else ""
    return (units.stress_times(power) or "") if stress else ""


def wrapped(head: str, items: list[str], separator: str = ",", width: int = WIDTH) -> list[str]:
    """Items joined by commas, or words (separator " "), broken into lines that are indented under
    the first, or by four more than it where it is long."""
    if separator == ",":
        items = [item.replace(" ", KEPT) for item in items]
    indent = len(head) if len(head) <= width // 4 else len(head) - len(head.lstrip()) + 4
    start = head.replace(" ", KEPT)
    if indent < len(head):  # a long head may stand alone on its line
        start = f"{start[:-1]} "
    lines = textwrap.wrap(
        start + f"{separator.strip()} ".join(items),
        width,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(KEPT, " ").rstrip() for line in lines] or [""]


def table(columns: dict[str, list[str]]) -> list[str]:
    """Lines of a table, of its columns that are not empty; what does not fit beside the others
    stands below them, with the first column again.

    >>> table({"step": ["1 press", "2 pull"], "energy": ["", "0.66"], "slip": ["", ""]})
    ['    step     energy', '    1 press', '    2 pull   0.66']
    """
    first, blocks = list[str](), [[""] * (1 + max(map(len, columns.values())))]
    for heading, cells in columns.items():
        texts = [cell.replace(KEPT, " ") for cell in (heading, *cells)]
        if not any(cells):
            continue
        first = first or [f"    {text}" for text in texts]
        wide = max(map(len, blocks[-1])) + 2
        if wide + max(map(len, texts)) > WIDTH and blocks[-1] != first:
            blocks.append(first)
            wide = max(map(len, first)) + 2
        beside = zip(blocks[-1], texts, strict=True)
        blocks[-1] = [f"{row:<{wide}}{text}" for row, text in beside] if any(blocks[-1]) else first
    return [row.rstrip() for block in blocks for row in block]
