"""Write what a result holds for other programs: petcontact export result.h5 --csv tables

--csv DIR writes a file each of pairs (contact nodes), boundary (all nodes), reactions (by part),
resultants (by pair), obstacles, increments and history (iterations); --csv FILE.csv writes one
table. --vtkhdf FILE.vtkhdf is one file with all increments, bodies and fields, for ParaView.
--superelement FILE.npz condenses a body to its contact parts: its compliance, for petcontact and
numpy; FILE.inp is the stiffness for Abaqus.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import InputError
from ..options import CASE, RESULT, TABLE, check_folder, check_output, increment, option, options

if TYPE_CHECKING:
    from ...results.solution import Solution


add_arguments = options(
    RESULT,
    option("--csv", metavar="DIR", help="tables as CSV into a folder, or one into FILE.csv"),
    option(
        "--table",
        metavar="NAME",
        action="append",
        default=[],
        help="of --csv: this table; may be repeated (default: all, of FILE.csv pairs)",
    ),
    option(
        "--step",
        metavar="K",
        help="of --csv: increment 1, 2, ..., or `last` (default: all, below one another)",
    ),
    option(
        "--vtkhdf",
        metavar="FILE.vtkhdf",
        help="all increments, bodies and fields for ParaView 5.12 on",
    ),
    option(
        "--grid",
        metavar="NXxNY",
        help="of --vtkhdf: grid cells along x and y, in space along z too",
    ),
    option(
        "--superelement",
        metavar="FILE.npz",
        help="a body condensed to its contact parts (.npz, .inp)",
    ),
    option("--body", metavar="NAME", help="of --superelement: which body, where there are several"),
    CASE,
)
"""The options of `petcontact export`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Write; only superelements need PETSc."""
    from ...runtime.atomic_write import check_target
    from ...sweep.store.case_table import read_case

    if not (arguments.csv or arguments.vtkhdf or arguments.superelement):
        raise InputError(
            "export: nothing to write; --csv DIR writes tables, --vtkhdf FILE.vtkhdf fields for "
            "ParaView, --superelement FILE.npz a condensed body"
        )
    for key, of in (
        ("table", "csv"),
        ("step", "csv"),
        ("grid", "vtkhdf"),
        ("body", "superelement"),
    ):
        if getattr(arguments, key) and not getattr(arguments, of):
            raise InputError(f"--{key}: is of --{of}, which is not given")
    check_folder("--csv", arguments.csv, TABLE[0])
    check_output(
        arguments.vtkhdf,
        (".vtkhdf",),
        "must end in .vtkhdf, by which ParaView recognises the format",
        [arguments.result],
    )
    if arguments.superelement:
        from ...pipeline.condensation import superelement_format

        superelement_format(arguments.superelement)
        check_target(Path(arguments.superelement), replace=True, inputs=[arguments.result])
    solution = read_case(arguments.result, arguments.case)
    if arguments.csv:
        from ...results.tables import write_tables

        count, last = len(solution.tried), solution.tried.index(solution.last) + 1
        steps = [] if arguments.step is None else [increment(arguments.step, count, last)]
        for path in write_tables(solution, arguments.csv, arguments.table, steps):
            print(path)
    if arguments.vtkhdf:
        _fields(arguments, solution)
        print(arguments.vtkhdf)
    if arguments.superelement:
        _superelement(arguments, solution, petsc_words)
    return 0


def _superelement(
    arguments: argparse.Namespace, solution: Solution, petsc_words: list[str]
) -> None:
    from ...pipeline.condensation import condensed_body
    from ...runtime.world import world

    comm = world(petsc_words)
    body = condensed_body(solution, arguments.body, comm)
    if comm.getRank() == 0:
        body.save(arguments.superelement)
        print(f"{arguments.superelement}: body {body.name}, {len(body.x)} nodes")


def _fields(arguments: argparse.Namespace, solution: Solution) -> None:
    from ...results.vtu.vtkhdf import write_vtkhdf
    from ...runtime.terminal import StatusLine
    from .field import grid

    resolution = grid(arguments.grid)
    with contextlib.closing(StatusLine(sys.stderr.isatty(), True)) as status:
        write_vtkhdf(
            arguments.vtkhdf,
            solution,
            resolution,
            lambda share: status.show(f"fields: {share:.0%}"),
        )
