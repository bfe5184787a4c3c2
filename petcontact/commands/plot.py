"""Draw the figures of a result file: outline, displacement and traction on the contact parts, history."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..runtime.figure_style import FORMATS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `petcontact plot`."""
    parser.add_argument("result", metavar="RESULT.h5", nargs="+", help="result files, or the folder of a sweep")
    parser.add_argument("-o", "--figures", metavar="DIR", help="folder of the figures (default: the result's)")
    parser.add_argument("--format", choices=FORMATS, action="append", help="png (default), pdf or svg; may be repeated")
    parser.add_argument("--case", metavar="ID", default="/", help="one case of a sweep's folder, kept whole")


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Draw; needs no PETSc."""
    from ..results.figures.plots import plot_all
    from ..sweep.store.case_table import read_case

    for name in arguments.result:
        solution = read_case(name, arguments.case)
        stem = Path(name).stem if arguments.case == "/" else arguments.case
        for path in plot_all(solution, arguments.figures or Path(name).parent, stem, arguments.format or FORMATS[:1]):
            print(path)
    return 0
