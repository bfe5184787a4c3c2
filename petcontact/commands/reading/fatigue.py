"""Fatigue parameters over a cycle of load steps, on the surface of the bodies and below it.

petcontact fatigue RESULT.h5 --first push --last pull --parameter smith-watson-topper --depth 0.5 -o
out.csv
"""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

import numpy as np

from ...arrays import shown
from ...errors import InputError
from ..options import (
    BODY,
    CASE,
    FIGURE,
    RESULT,
    TABLE,
    check_output,
    option,
    options,
    positive,
    real,
)

if TYPE_CHECKING:
    from ...fatigue.evaluate import Fatigue

add_arguments = options(
    RESULT,
    option(
        "--parameter",
        metavar="NAME",
        default="smith-watson-topper",
        help="smith-watson-topper (default), findley, crossland, dang-van, ruiz-1, ruiz-2",
    ),
    option(
        "--first",
        metavar="STEP",
        help="name of the step that the cycle begins with (default: [cycle]'s)",
    ),
    option(
        "--last", metavar="STEP", help="name of the step that it ends with (default: [cycle]'s)"
    ),
    option(
        "--depth",
        metavar="LENGTH",
        type=float,
        default=0.0,
        help="how far below the surface, too (default: 0)",
    ),
    option(
        "--sensitivity",
        metavar="NUMBER",
        type=float,
        help="k of findley, alpha of crossland and dang-van",
    ),
    option(
        "--limit",
        metavar="STRESS",
        type=positive,
        help="what the parameter may be: the largest value is given over it",
    ),
    option(
        "--life",
        metavar="S,B,E,C",
        help="sigma_f', b, epsilon_f', c: cycles to failure by smith-watson-topper",
    ),
    BODY,
    option(
        "--part",
        metavar="NAME",
        action="append",
        help="this part of the surface instead of those in contact; may be repeated",
    ),
    option("-o", "--output", metavar="FILE.csv", help="a table, a row a place"),
    option("--figure", metavar="FILE.png", help="also draw it (.png, .pdf or .svg)"),
    CASE,
)
"""The options of `petcontact fatigue`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Evaluate, print and write; needs no PETSc."""
    from ...fatigue.evaluate import fatigue, table
    from ...fatigue.figure import fatigue_figure
    from ...results.tables import csv_text
    from ...runtime.atomic_write import write_text
    from ...sweep.store.case_table import read_case

    life = _life(arguments.life, arguments.parameter) if arguments.life else None
    check_output(arguments.output, *TABLE, [arguments.result])
    check_output(arguments.figure, *FIGURE, [arguments.result])
    solution = read_case(arguments.result, arguments.case)
    result = fatigue(
        solution,
        arguments.parameter,
        first=arguments.first,
        last=arguments.last,
        depth=arguments.depth,
        sensitivity=arguments.sensitivity,
        bodies=arguments.body,
        parts=arguments.part,
    )
    print(f"{result.parameter}: {result.increments} increments, {result.places} places")
    _print_largest(result)
    worst, k = result.largest
    value, body = float(worst.value[k]), worst.sites.body
    if arguments.limit is not None:
        print(f"  over the limit {arguments.limit:g}: {value / arguments.limit:.4g}")
    if life is not None:
        material = next(member.material for member in solution.problem.body if member.name == body)
        print(_cycles(value, result.error, material.young_modulus, life))
    if arguments.output:
        write_text(arguments.output, csv_text(table(result)))
        print(arguments.output)
    if arguments.figure:
        print(fatigue_figure(solution, result, arguments.figure))
    return 0


def _print_largest(result: Fatigue) -> None:
    """The largest value, its place, and the plane that it is found on."""
    from ...results.numbers.number import Number
    from ...results.verdict.text import told

    worst, k = result.largest
    sites = worst.sites
    x = np.where(np.abs(sites.x[k]) < 1e-12 * np.abs(sites.x).max(), 0.0, sites.x[k])
    deep = f", {sites.depth[k]:.4g} below it" if sites.depth[k] else ""
    largest = told(Number("", "", 0, 0, worst.value[k : k + 1], "", error=result.error))
    print(f"  largest {largest} at {shown(x)}, {sites.body}.{sites.part[k]}{deep}")
    if worst.normal is not None:
        normal = ", ".join(f"{c + 0.0:.4f}" for c in worst.normal[k].round(4))
        print(f"  critical plane: normal ({normal})")


def _cycles(value: float, error: float, modulus: float, life: tuple[float, ...]) -> str:
    """The line on cycles to failure, with what the error of the value leaves of them."""
    from ...fatigue.evaluate import cycles_to_failure

    off = 0.0 if math.isnan(error) else error
    damages = value, value + off, max(value - off, 0.0)
    count, least, most = (cycles_to_failure(damage, modulus, life) for damage in damages)
    interval = "" if math.isnan(error) else f" ({least:.2g} to {most:.2g})"
    return f"  cycles to failure: {count:.4g}{interval}"


def _life(text: str, parameter: str) -> tuple[float, ...]:
    """Return the four constants of the curve of lives."""
    if parameter != "smith-watson-topper":
        raise InputError("--life: of smith-watson-topper only")
    values = tuple(map(real, text.split(",")))
    if len(values) != 4 or any(map(math.isnan, values)):
        raise InputError(f"--life {text}: four numbers are expected: sigma_f',b,epsilon_f',c")
    return values
