"""Displacement and stress inside the body of a result: a .vtu file for ParaView, and a figure.

Of bodies and load steps: .vtu files of each increment and body, and a .pvd file that ties them together."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from ..errors import InputError

PLANE_GRID, SPACE_GRID = (100, 100), (16, 16, 16)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `petcontact field`."""
    parser.add_argument("result", metavar="RESULT.h5", help="a result file")
    parser.add_argument("--grid", metavar="NXxNY", help="grid cells along x and y, in space along z too (100x100, 16x16x16)")
    parser.add_argument("-o", "--output", metavar="FILE.vtu", help="the field (default: the result's stem + .vtu)")
    parser.add_argument("--boundary", metavar="FILE.vtu",
                        help="also write the boundary's values (those of bodies and steps always are)")  # fmt: skip
    parser.add_argument("--figure", metavar="FILE.png",
                        help="also draw the deformed body coloured by von Mises stress "
                        "(.png, .pdf or .svg; one body in the plane)")  # fmt: skip
    parser.add_argument("--case", metavar="ID", default="/", help="one case of a sweep's folder, kept whole")


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Evaluate and write; needs no PETSc."""
    from ..fields.interior import field_on_grid
    from ..fields.peak import largest
    from ..mesh.curve_mesh import as_curve
    from ..mesh.surface_mesh import SurfaceMesh
    from ..results.solution import Solution
    from ..results.vtu import write_boundary_vtu, write_vtu
    from ..runtime.atomic_write import check_target
    from ..runtime.figure_style import figure_format
    from ..runtime.terminal import StatusLine
    from ..sweep.store.case_table import read_case

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
    if not isinstance(solution, Solution):
        from ..results.steps.vtu import write_collection

        if arguments.boundary or arguments.figure:
            raise InputError("--boundary, --figure: of bodies and load steps the boundary is always written, and no figure")
        for path in write_collection(output, solution, resolution):
            print(path)
        return 0
    if isinstance(solution.mesh, SurfaceMesh):
        from ..results.surface_vtu import write_surface_vtu, write_volume_vtu

        if arguments.figure:
            raise InputError("--figure: of bodies in space ParaView draws the fields; `petcontact plot` draws the surface")
        largest_stress = write_volume_vtu(output, solution, of_dimension(resolution, SPACE_GRID))
        print(f"{output}: largest von Mises stress on the grid {largest_stress:.6g}")
        if arguments.boundary:
            write_surface_vtu(arguments.boundary, solution)
            print(arguments.boundary)
        return 0
    mesh = as_curve(solution.mesh)
    cells = of_dimension(resolution, PLANE_GRID)
    status = StatusLine(sys.stderr.isatty())
    try:
        field = field_on_grid(mesh, solution.u, solution.traction, solution.case.material, cells,
                              lambda share: status.show(f"field: {share:.0%} of the elements"))  # fmt: skip
    finally:
        status.clear()
    write_vtu(output, field, solution.case.units)
    print(f"{output}: {len(field.points)} points, largest von Mises stress {largest(field, mesh)}")
    if arguments.boundary:
        write_boundary_vtu(arguments.boundary, solution)
        print(arguments.boundary)
    if arguments.figure:
        from ..results.field_figure import deformed_figure

        print(deformed_figure(solution, arguments.figure, field=field))
    return 0


def of_dimension(resolution: tuple[int, ...] | None, default: Any) -> Any:
    """What was asked for, or the default one.

    Raises
    ------
    InputError
        If it has not as many numbers as the body has dimensions.
    """
    if resolution is not None and len(resolution) != len(default):
        raise InputError(f"--grid {'x'.join(map(str, resolution))}: the body has {len(default)} dimensions")
    return default if resolution is None else resolution


def grid(text: str) -> tuple[int, ...]:
    """`200x100` as two, or `20x10x10` as three numbers of cells."""
    words = text.split("x")
    if len(words) not in (2, 3) or not all(word.isascii() and word.isdigit() and 0 < int(word) <= 10_000 for word in words):
        raise InputError(f"--grid {text}: expected two numbers of cells such as 200x100, at most 10000 each")
    return tuple(int(word) for word in words)
