"""Compute independent cases over MPI ranks: mpiexec -n 2 petcontact sweep configs/tables.toml -o
out/

A case is on the disk within a second after it is finished; the same command started again goes on
from there. In the end results.h5 is a table, a column a quantity and a row a case. Exit status: 0
all converged, 3 some not converged, 1 some failed, 2 bad input.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from ..errors import InputError
from ..runtime.signals import Interrupted
from .options import option, options

add_arguments = options(
    option("config", metavar="SWEEP.toml", help="problem files, and lists of values to cross"),
    option(
        "-o", "--output", metavar="DIR", help="folder of the sweep (default: the sweep file's stem)"
    ),
    option("--list", action="store_true", help="show the ids of the cases and compute nothing"),
    option(
        "--only",
        metavar="PATTERN",
        action="append",
        default=[],
        help="compute the cases whose id matches, for example '*-h0.4'; may be repeated",
    ),
    option(
        "--ranks-per-case",
        metavar="K",
        type=int,
        default=1,
        help="ranks that solve one case together, for cases too large for one",
    ),
    option(
        "--part",
        metavar="K/N",
        help="compute the K-th of N parts, for jobs of an array that share the folder",
    ),
    option("--force", action="store_true", help="compute finished cases again"),
)
"""The options of `petcontact sweep`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """List the cases of a sweep, or compute them."""
    from ..sweep.design.sweep import build_sweep, read_sweep
    from ..sweep.design.sweep_file import read_files

    if arguments.list:
        sweep = read_sweep(arguments.config)
        for place in sweep.only(arguments.only):
            print(sweep.ids[place])
        return 0
    if arguments.ranks_per_case < 1:
        raise InputError(f"--ranks-per-case {arguments.ranks_per_case}: must be at least 1")
    from ..runtime.petsc import initialise, petsc
    from ..runtime.terminal import say

    initialise(petsc_words)
    from ..runtime.mpi import shared
    from ..sweep.run import run_sweep
    from .unread import unused_reported

    world = petsc().COMM_WORLD.tompi4py()
    sweep = build_sweep(*shared(world, lambda: read_files(arguments.config)))
    folder = arguments.output or Path(arguments.config).stem
    try:
        with unused_reported(world.Get_rank() == 0):
            summary = run_sweep(
                sweep,
                folder,
                world,
                only=arguments.only,
                part=_part(arguments.part),
                ranks_per_case=arguments.ranks_per_case,
                force=arguments.force,
                say=say,
            )
    except Interrupted as error:
        raise Interrupted(
            error.number, f"finished cases are saved in {folder}, the same command goes on"
        ) from None
    if world.Get_rank() == 0:
        for line in summary.lines():
            say(line)
    # Open MPI may end the job when a rank ends with an error status: not before the summary is out
    world.Barrier()
    return summary.exit_status


def _part(word: str | None) -> tuple[int, int] | None:
    """Return the two numbers of K/N."""
    if word is None:
        return None
    match = re.fullmatch(r"(\d{1,7})/(\d{1,7})", word)
    if match is None or not 1 <= int(match[1]) <= int(match[2]):
        raise InputError(f"--part {word}: must be K/N with 1 <= K <= N")
    return int(match[1]), int(match[2])
