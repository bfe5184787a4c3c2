"""Tables of a sweep as Markdown on standard output, beside the published counts where the cases are
the paper's; plots.

petcontact report out/ --cells max_u_t --rows friction_bound --columns rule --plot
slip_share:friction_bound:rule
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..errors import InputError
from .options import option, options

add_arguments = options(
    option("sweep", metavar="DIR", help="folder of a sweep, finished or not, or its results.h5"),
    option("--csv", metavar="FILE", help="write one line a case"),
    option(
        "--html",
        metavar="FILE",
        help="write one page with tables and figures that needs no other file",
    ),
    option("--parquet", metavar="FILE", help="write the same with types, for pandas and polars"),
    option(
        "--cells",
        metavar="QUANTITY,...",
        help="what the cells hold, for example max_u_t (default: iterations where the method is "
        "varied, else largest pressure, area, slip)",
    ),
    option(
        "--rows",
        metavar="NAME,...",
        help="coordinates or quantities down (cells are means over what is left), for example "
        "variant",
    ),
    option(
        "--columns",
        metavar="NAME,...",
        help="coordinates or quantities across (default: rule,element_size)",
    ),
    option(
        "--plot",
        metavar="QUANTITY:COORDINATE[:LINES]",
        action="append",
        default=[],
        help="plot one over the other, a line for each value of a third; may be repeated",
    ),
    option(
        "--figures",
        metavar="DIR",
        help="folder of the plots (default: the sweep's, without a page)",
    ),
)
"""The options of `petcontact report`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print and write; needs no PETSc."""
    from ..runtime.atomic_write import check_target, write_text
    from ..sweep.report.formats import csv_text, markdown, write_parquet
    from ..sweep.report.page import html
    from ..sweep.report.pivot import asked_about, make_tables, names_in
    from ..sweep.report.sweep_plots import parse_plot, write_plots
    from ..sweep.store.case_table import read_case_table

    if arguments.figures and not arguments.plot:
        raise InputError("--figures: is the folder of --plot, which is not given")
    for name in filter(None, (arguments.csv, arguments.html, arguments.parquet)):
        check_target(Path(name), replace=True)
    table = read_case_table(arguments.sweep)
    asked = [arguments.cells, arguments.rows, arguments.columns, *arguments.plot]
    about, rows, columns, *drawn = _short(asked, table.keys)
    plots = [parse_plot(word) for word in drawn]
    cells = asked_about(table, about)
    tables = make_tables(table, names_in(rows), names_in(columns), cells)
    print(markdown(table, tables, cells), end="")
    if arguments.csv:
        write_text(arguments.csv, csv_text(table))
    if arguments.parquet:
        write_parquet(arguments.parquet, table)
    if arguments.html:
        write_text(arguments.html, html(table, tables, cells, plots))
    if plots and (arguments.figures or not arguments.html):
        for path in write_plots(table, plots, arguments.figures or table.folder):
            print(f"figure: {path}")
    return 0


def _short(asked: Sequence[str], keys: Mapping[str, str]) -> list[str]:
    """Words of options with the names of coordinates in the place of the dotted keys they vary."""
    return [
        words and re.sub("[^:,]+", lambda word: keys.get(word[0].strip(), word[0]), words)
        for words in asked
    ]
