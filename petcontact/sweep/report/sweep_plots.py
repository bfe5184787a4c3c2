"""Plots of any quantity of a sweep over any coordinate, lines by another one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...record import record
from ...runtime.figure_style import save
from ...untyped import Figure
from ..store.case_table import CaseTable
from .formats import label

MOST_LINES = 12


@record
class Plot:
    """What a plot shows.

    Attributes
    ----------
    quantity, over : str
        Columns with numbers.
    lines : str or None
        A line for each value of this column.
    """

    quantity: str
    over: str
    lines: str | None = None

    @property
    def caption(self) -> str:
        """The caption of the plot."""
        what = f"{self.quantity} over {self.over}" + (
            f", a line for each {self.lines}" if self.lines else ""
        )
        return f"{what}; means of the cases that converged"

    @property
    def stem(self) -> str:
        """Stem of the file of the plot."""
        return "-".join(filter(None, (self.quantity, "over", self.over, self.lines)))


def parse_plot(word: str) -> Plot:
    """Return the plot that QUANTITY:COORDINATE[:LINES] of a command line means.

    Raises
    ------
    InputError
        If it is none.
    """
    names = [name.strip() for name in word.split(":")]
    if not (2 <= len(names) <= 3 and all(names)):
        raise InputError(f"--plot {word}: must be QUANTITY:COORDINATE or QUANTITY:COORDINATE:LINES")
    return Plot(*names)


def draw(figure: Figure, table: CaseTable, plot: Plot) -> None:
    """Draw means of the cases that converged; axes are logarithmic if the values span decades.

    Raises
    ------
    InputError
        If the sweep has no such columns or they hold no numbers.
    """
    x, y = table.numbers(plot.over), table.numbers(plot.quantity)
    lines = table.values(plot.lines) if plot.lines else [None] * len(table)
    keys = list(dict.fromkeys(lines))
    if len(keys) > MOST_LINES:
        raise InputError(
            f"--plot: {plot.lines} has {len(keys)} values, a plot has {MOST_LINES} lines at most"
        )
    good = (np.array(table.status) == "converged") & np.isfinite(x) & np.isfinite(y)
    figure.set_size_inches(6.4, 4.2)
    axes = figure.subplots()
    for key in keys:
        on_line = good & np.array([value == key for value in lines])
        abscissae, inverse, counts = np.unique(x[on_line], return_inverse=True, return_counts=True)
        name = label(plot.lines, key) if plot.lines else None
        # of more different abscissae points are drawn, not lines
        if len(abscissae) > 60:
            axes.plot(x[on_line], y[on_line], ".", markersize=3, alpha=0.6, label=name)
            continue
        mean = np.bincount(inverse.ravel(), y[on_line], len(abscissae)) / np.maximum(counts, 1)
        axes.plot(abscissae, mean, "o-", markersize=3.5, linewidth=1.2, label=name)
    if not good.any():
        axes.text(0.5, 0.5, "no case has both", ha="center", transform=axes.transAxes)
    scales = [
        "log" if len(v) and v.min() > 0.0 and v.max() > 50.0 * v.min() else "linear"
        for v in (x[good], y[good])
    ]
    axes.set(xscale=scales[0], yscale=scales[1], xlabel=plot.over, ylabel=plot.quantity)
    axes.grid(alpha=0.3)
    if plot.lines:
        axes.legend(fontsize=8)


def write_plots(table: CaseTable, plots: Sequence[Plot], folder: str | Path) -> list[Path]:
    """Write a PNG file for each plot and return the paths."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    paths = [Path(folder) / f"{plot.stem}.png" for plot in plots]
    for path, plot in zip(paths, plots, strict=True):
        save(path, draw, table, plot)
    return paths
