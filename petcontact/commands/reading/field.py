"""Displacement and stress in the bodies of a result: .vtu files for ParaView, a table at given
points, and a figure.

Of several bodies or increments: .vtu files of each increment and body, and a .pvd file that ties
them together. --points FILE.csv evaluates points inside and on the boundary instead, and writes a
table.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...errors import InputError
from ...untyped import Keyed
from ..options import (
    BODY,
    CASE,
    FIGURE,
    RESULT,
    TABLE,
    check_output,
    increment,
    option,
    options,
    real,
)

if TYPE_CHECKING:
    from ...arrays import Array
    from ...results.solution import Solution
    from ...results.vtu.inner_fields import Window


add_arguments = options(
    RESULT,
    option("--step", metavar="K", help="only increment 1, 2, ..., or `last`; figures show it"),
    BODY,
    option(
        "--window",
        metavar="X",
        nargs="+",
        help="lower and upper corner of a box: only what is in it",
    ),
    option(
        "--grid",
        metavar="NXxNY",
        help="grid cells along x and y, in space along z too (100x100, 16x16x16; 72x72 if turned)",
    ),
    option(
        "--points",
        metavar="FILE.csv",
        help="points x, y (and z), a line each, in a body or on its boundary: write a table",
    ),
    option(
        "-o",
        "--output",
        metavar="FILE",
        help="the field (default: the result's stem + .vtu), or the table (-points.csv)",
    ),
    option(
        "--boundary",
        metavar="FILE.vtu",
        help="also write the boundary's values at the end (of several bodies FILE-BODY.vtu; those "
        "of all increments always are)",
    ),
    option(
        "--revolve",
        metavar="DEGREES",
        nargs="?",
        type=float,
        const=360.0,
        help="turn half sections of bodies of revolution about their axis in the .vtu files (360)",
    ),
    option(
        "--figure",
        metavar="FILE.png",
        help="also draw the deformed bodies coloured by a stress (.png, .pdf or .svg)",
    ),
    option(
        "--section",
        metavar="y=0",
        help="of the figure: a cut through bodies in space along a plane across an axis",
    ),
    option(
        "--quantity",
        metavar="NAME",
        help="of the figure: von_mises (default), principal_1, sigma_xx, sigma_xy, u, ux, ...",
    ),
    CASE,
)
"""The options of `petcontact field`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Evaluate and write; needs no PETSc."""
    from ...results.body_fields import quantities
    from ...results.figures.stress_figure import deformed_figure
    from ...results.vtu.revolve import check_revolved
    from ...runtime.hints import demand_name
    from ...sweep.store.case_table import read_case

    _check_figure(arguments)
    resolution = grid(arguments.grid, turned=arguments.revolve is not None)
    box = window(arguments.window) if arguments.window else None
    stem = Path(arguments.result).stem
    output = Path(arguments.output or (f"{stem}-points.csv" if arguments.points else f"{stem}.vtu"))
    _check_targets(arguments, output)
    solution = read_case(arguments.result, arguments.case)
    if arguments.step is not None:
        count = len(solution.steps)
        solution = solution.until(increment(arguments.step, count, count))
    check_revolved(list(solution.meshes.values()), arguments.revolve)
    for name in arguments.body or ():
        solution.body_fields(name)  # refuses what there is not
    shown = arguments.quantity or "von_mises"
    names = quantities(next(iter(solution.meshes.values())).components)
    demand_name("--quantity: no", shown, names)
    # before the inside, of which a coarse grid may have nothing
    if arguments.boundary:
        _write_boundaries(solution, arguments)
    fields = {}
    if arguments.points:
        print(points_table(arguments.points, output, solution, arguments.body))
    elif not arguments.section:
        fields = _write_fields(output, solution, arguments, resolution, box)
    if arguments.figure:
        cells = (resolution[0], resolution[1]) if resolution else None
        print(
            deformed_figure(
                solution,
                arguments.figure,
                resolution=cells,
                field=fields,
                quantity=shown,
                bodies=arguments.body,
                window=box,
                section=arguments.section,
            )
        )
    return 0


def _check_figure(arguments: argparse.Namespace) -> None:
    """Refuse options of a field or a figure where neither is made."""
    if arguments.quantity and not arguments.figure:
        raise InputError(
            f"--quantity {arguments.quantity}: is what a figure shows; --figure FILE.png draws one"
        )
    if arguments.section and not arguments.figure:
        raise InputError(f"--section {arguments.section}: is drawn by --figure FILE.png")
    if arguments.revolve is not None and arguments.points:
        raise InputError("--revolve: turns .vtu files, --points writes a table")
    for key in ("grid", "window"):
        if getattr(arguments, key) and arguments.points and not arguments.figure:
            raise InputError(f"--{key}: a table of --points is of these points alone")


def _check_targets(arguments: argparse.Namespace, output: Path) -> None:
    """Refuse files that could not be written, or have the suffix of something else."""
    inputs = list(filter(None, (arguments.result, arguments.points)))
    field = (".vtu",), "a field is written as .vtu, for ParaView and VisIt"
    check_output(output, *(TABLE if arguments.points else field), inputs)
    check_output(arguments.boundary, *field, inputs)
    check_output(arguments.figure, *FIGURE, inputs)


def _write_boundaries(solution: Solution, arguments: argparse.Namespace) -> None:
    """A .vtu file of the boundary of each body that is asked for."""
    from ...results.vtu.boundary import write_boundary_vtu
    from ...results.vtu.collection import file_word

    bodies = [name for name in solution.meshes if not arguments.body or name in arguments.body]
    for name in bodies:
        path = Path(arguments.boundary)
        path = path if len(bodies) == 1 else path.with_stem(f"{path.stem}-{file_word(name)}")
        write_boundary_vtu(path, solution, name, degrees=arguments.revolve)
        print(path)


def _write_fields(
    output: Path,
    solution: Solution,
    arguments: argparse.Namespace,
    resolution: tuple[int, ...] | None,
    box: Window | None,
) -> Keyed:
    """One .vtu of one body and increment, else a collection; the fields that are there then, by
    body."""
    from dataclasses import replace

    from ...results.vtu.collection import write_collection
    from ...runtime.terminal import StatusLine

    bodies = arguments.body or list(solution.meshes)
    only_one = len(bodies) == 1 and (arguments.step is not None or len(solution.tried) == 1)
    with contextlib.closing(StatusLine(sys.stderr.isatty(), True)) as status:
        if only_one:
            return one_field(
                output,
                solution,
                bodies[0],
                resolution,
                box,
                lambda share: status.show(f"field: {share:.0%}"),
                arguments.revolve,
            )
        some = solution if arguments.step is None else replace(solution, steps=solution.steps[-1:])
        for path in write_collection(
            output,
            some,
            resolution,
            lambda share: status.show(f"fields: {share:.0%}"),
            bodies=arguments.body,
            window=box,
            degrees=arguments.revolve,
        ):
            print(path)
    return {}


def one_field(
    output: Path,
    solution: Solution,
    name: str,
    resolution: tuple[int, ...] | None,
    box: Window | None,
    progress: Callable[[float], None],
    degrees: float | None = None,
) -> Keyed:
    """Write the field of a body at the end, and say how large its stress is; the field by body."""
    from ...results.numbers.peaks import largest_at
    from ...results.vtu.inner_fields import field_inside, grid_inside, write_vtu

    mesh = solution.meshes[name]
    field = field_inside(solution, grid_inside(mesh, resolution, box), name, progress=progress)
    write_vtu(output, field, solution.problem.units, degrees)
    largest = largest_at(solution, name, field.x, field.von_mises)
    print(f"{output}: {len(field.x)} points, largest von Mises stress {largest}")
    return {name: field}


def points_table(source: str, output: Path, solution: Solution, bodies: list[str] | None) -> Path:
    """Displacement, stress, von Mises and principal stresses at the points of a file, as CSV."""
    from ...results.body_fields import quantities, quantity
    from ...results.tables import csv_text, with_units
    from ...runtime.atomic_write import write_text

    if (bodies is None and len(solution.meshes) > 1) or len(bodies or ()) > 1:
        raise InputError(
            f"--points: --body must name one body; there are {', '.join(solution.meshes)}"
        )
    mesh = next(iter(solution.meshes.values()))
    state = solution.state_at(read_points(source, mesh.dim), bodies[0] if bodies else None)
    names = [name for name in quantities(mesh.components) if name != "u"]
    columns = {
        **dict(zip("xyz", state.x.T, strict=False)),
        **{name: quantity(state, name) for name in names},
    }
    write_text(output, csv_text(with_units(columns, solution)))
    return output


def read_points(path: str, dim: int) -> Array:
    """Read the points (n, d) of a file of columns; further columns are not read.

    Raises
    ------
    InputError
        If the file cannot be read, or a line is no point.
    """
    from ...given.tables.base import regular_file
    from ...given.tables.points import rows_of
    from ...model.shapes.files import LARGEST_MESH

    rows = rows_of(regular_file(path, LARGEST_MESH))
    points = np.array([row[:dim] for row in rows])
    if points.shape[1:] != (dim,) or not np.isfinite(points).all():
        raise InputError(f"{path}: {dim} coordinates are needed in a line, and one line at least")
    return points


def window(words: list[str]) -> Window:
    """Lower and upper corner of 4 or 6 numbers."""
    values = [real(word) for text in words for word in text.split(",") if word]
    half = len(values) // 2
    low, high = np.array(values[:half]), np.array(values[half:])
    if len(values) not in (4, 6) or not np.all(np.isfinite(values)) or not np.all(low < high):
        raise InputError(
            f"--window {' '.join(words)}: expected the lower and the upper corner of a box, such "
            "as 0 0 2 1"
        )
    return low, high


def grid(text: str | None, turned: bool = False) -> tuple[int, ...] | None:
    """`200x100` as two, or `20x10x10` as three numbers of cells; the default of no text."""
    if not text:
        return (72, 72) if turned else None  # files of turned fields below 10 MB
    words = text.split("x")
    if len(words) not in (2, 3) or not all(
        word.isascii() and word.isdigit() and 0 < int(word) <= 10_000 for word in words
    ):
        raise InputError(
            f"--grid {text}: expected two numbers of cells such as 200x100, at most 10000 each"
        )
    return tuple(int(word) for word in words)
