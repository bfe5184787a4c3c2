"""Print the verdict of a result again: petcontact show result.h5

--json prints its status, warnings and numbers for scripts. A number has its value, unit, estimated
error and place; an error that is not known is null.
"""

from __future__ import annotations

import argparse

from ..options import CASE, RESULT, option, options

add_arguments = options(
    RESULT,
    option("--json", action="store_true", help="numbers for scripts, as one JSON object"),
    option("--verbose", action="store_true", help="all of the verdict, as solve --verbose"),
    CASE,
)
"""The options of `petcontact show`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print; needs no PETSc."""
    from ...results.solution import Solution
    from ...runtime.terminal import say
    from ...sweep.store.case_table import read_case

    solution: Solution = read_case(arguments.result, arguments.case)
    say(solution.to_json() if arguments.json else solution.verdict(arguments.verbose))
    return 0
