"""Displacement and stress inside the body of a result: a .vtu file for ParaView, and a figure.

Of bodies and load steps: .vtu files of each increment and body, and a .pvd file that ties them together."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from ...errors import InputError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `petcontact field`."""
    parser.add_argument("result", metavar="RESULT.h5", help="a result file")
    parser.add_argument("--grid", metavar="NXxNY", help="grid cells along x and y, in space along z too (100x100, 16x16x16)")
    parser.add_argument("-o", "--output", metavar="FILE.vtu", help="the field (default: the result's stem + .vtu)")
    parser.add_argument("--boundary", metavar="FILE.vtu",
                        help="also write the boundary's values at the end (of several bodies FILE-BODY.vtu; those of "
                        "all increments always are)")  # fmt: skip
    parser.add_argument("--figure", metavar="FILE.png",
                        help="also draw the deformed bodies coloured by von Mises stress (.png, .pdf or .svg)")  # fmt: skip
    parser.add_argument("--case", metavar="ID", default="/", help="one case of a sweep's folder, kept whole")


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Evaluate and write; needs no PETSc."""
    from ...results.figures.stress import deformed_figure
    from ...results.vtu.boundary import write_boundary_vtu
    from ...results.vtu.collection import file_word, write_collection
    from ...runtime.atomic_write import check_target
    from ...runtime.figure_style import figure_format
    from ...runtime.terminal import StatusLine
    from ...sweep.store.case_table import read_case

    resolution = grid(arguments.grid) if arguments.grid else None
    output = Path(arguments.output or Path(arguments.result).with_suffix(".vtu").name)
    for name in filter(None, (output, arguments.boundary)):
        if Path(name).suffix.lower() != ".vtu":
            raise InputError(f"{name}: a field is written as .vtu, which ParaView and VisIt read")
    if arguments.figure:
        figure_format(arguments.figure)
    for name in filter(None, (output, arguments.boundary, arguments.figure)):
        check_target(Path(name), replace=True, inputs=[arguments.result])
    solution = read_case(arguments.result, arguments.case)
    status = StatusLine(sys.stderr.isatty())
    fields = {}
    try:
        if len(solution.meshes) == len(solution.tried) == 1:
            fields = one_field(output, solution, resolution, lambda share: status.show(f"field: {share:.0%}"))
        else:
            for path in write_collection(output, solution, resolution, lambda share: status.show(f"fields: {share:.0%}")):
                print(path)
    finally:
        status.clear()
    for name in solution.meshes if arguments.boundary else ():
        path = Path(arguments.boundary)
        path = path if len(solution.meshes) == 1 else path.with_stem(f"{path.stem}-{file_word(name)}")
        write_boundary_vtu(path, solution, name)
        print(path)
    if arguments.figure:
        print(deformed_figure(solution, arguments.figure, field=fields))
    return 0


def one_field(output: Path, solution: Any, resolution: Any, progress: Any) -> dict[str, Any]:
    """Write the field of the only increment of the only body, and say how large its stress is; the field by body."""
    from ...fields.peak import peak_of
    from ...results.vtu.inside import field_inside, grid_inside, write_vtu

    ((name, mesh),) = solution.meshes.items()
    field = field_inside(solution, grid_inside(mesh, resolution), name, progress=progress)
    write_vtu(output, field, solution.problem.units)
    print(f"{output}: {len(field.points)} points, largest von Mises stress {peak_of(mesh, field)}")
    return {name: field}


def grid(text: str) -> tuple[int, ...]:
    """`200x100` as two, or `20x10x10` as three numbers of cells."""
    words = text.split("x")
    if len(words) not in (2, 3) or not all(word.isascii() and word.isdigit() and 0 < int(word) <= 10_000 for word in words):
        raise InputError(f"--grid {text}: expected two numbers of cells such as 200x100, at most 10000 each")
    return tuple(int(word) for word in words)
