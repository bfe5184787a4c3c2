"""Methods and rules side by side on one or more problems: petcontact compare configs/example1.toml
-o out

Writes compare.md, compare.csv and two figures, and prints the tables. ω, τ, c_max, the tolerance
and the limit of iterations are those of each config.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from .options import option, options, positives

if TYPE_CHECKING:
    from ..model.problem import Problem

add_arguments = options(
    option("config", metavar="CONFIG.toml", nargs="+", help="the problems"),
    option("-o", "--output", metavar="DIR", default="compare", help="folder of tables and figures"),
    option(
        "--methods",
        metavar="NAMES",
        help="names separated by commas (default: all that take the problem)",
    ),
    option(
        "--rho",
        metavar="VALUES",
        type=positives,
        help="values of rho_0 separated by commas (default: 1 to 1e7)",
    ),
    option(
        "--element-size",
        metavar="VALUES",
        type=positives,
        default=[],
        help="values of h separated by commas (default: the config's)",
    ),
    option("--reference", metavar="RESULT.h5", help="measure errors against this result"),
    option("--no-figures", action="store_true", help="draw nothing"),
)
"""The options of `petcontact compare`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Run, print, write; exit status 0 however the contenders fare."""
    from ..compare.comparison_tables import csv_text, markdown, write_figures
    from ..compare.side_by_side import RHOS, Trial, compare, named_contenders
    from ..runtime.atomic_write import write_text
    from ..runtime.terminal import StatusLine
    from ..runtime.world import world
    from .unread import unused_reported

    words = arguments.methods.split(",") if arguments.methods else []
    names = [name for word in words for name in named_contenders(word)] or None
    comm = world(petsc_words)
    cases = list(_cases(arguments))
    first = comm.getRank() == 0
    status = StatusLine(first and sys.stderr.isatty(), first)

    def say(row: Trial) -> None:
        rho = "" if row.rho is None else f", rho_0 = {row.rho:g}"
        status.show(f"{row.problem}: {row.contender}{rho}: {row.iterations} iterations")

    with unused_reported(first):
        rows = compare(
            cases,
            contenders=names,
            rhos=arguments.rho or RHOS,
            reference=arguments.reference,
            comm=comm,
            say=say,
        )
    if first:
        status.close()
        text = markdown(rows)
        print(text, end="")
        folder = Path(arguments.output)
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in (("compare.md", text), ("compare.csv", csv_text(rows))):
            write_text(folder / name, content)
        for path in [] if arguments.no_figures else write_figures(rows, folder):
            print(f"figure: {path}")
    return 0


def _cases(arguments: argparse.Namespace) -> Iterator[tuple[str, Problem]]:
    """Each config with each element size that is asked for, and its label."""
    from ..model import case as config

    for path in arguments.config:
        name = Path(path).stem
        if not arguments.element_size:
            yield name, config.load(path)
        for size in arguments.element_size:
            yield f"{name}, h = {size:g}", config.load(path, {"mesh.element_size": size})
