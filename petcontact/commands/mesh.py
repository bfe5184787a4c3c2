"""Surfaces of a CAD file, to be named in a config, and its mesh: petcontact mesh part.step --size 2
-o part.msh

STEP, IGES and BREP files are read by Gmsh's Python package, which scripts/setup --cad installs.
Without -o the surfaces are listed: number, part (the name in the STEP file, else the number), kind,
area and centre. `--part foot=3,4` names some, as `parts = { foot = [3, 4] }` does in [geometry]. A
config may name the CAD file itself: shape = "gmsh", file = "part.step".
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import InputError
from .options import check_output, option, options, positive

add_arguments = options(
    option("file", metavar="PART.step", help="a CAD file: .step, .stp, .iges, .igs or .brep"),
    option(
        "--size",
        metavar="S",
        type=positive,
        help="of the cells [length] (default: a twelfth of the body's diagonal)",
    ),
    option(
        "--order",
        type=int,
        choices=(1, 2),
        default=2,
        help="of the cells: flat (1) or curved (2, default)",
    ),
    option(
        "--part",
        metavar="NAME=N,N",
        action="append",
        default=[],
        help="name surfaces by their numbers; may be repeated",
    ),
    option("--solid", metavar="NAME", help="name or number of the solid, where there are several"),
    option("-o", "--output", metavar="PART.msh", help="write the mesh there"),
)
"""The options of `petcontact mesh`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """List the surfaces, or write the mesh; needs no PETSc."""
    from ..geometry.cad.part import CadSurface, is_cad
    from ..model.shapes.files import Gmsh
    from ..runtime.atomic_write import temporary_name
    from ..runtime.text_table import aligned

    if not is_cad(arguments.file):
        raise InputError(f"{arguments.file}: must end in .step, .stp, .iges, .igs or .brep")
    target = arguments.output and Path(arguments.output)
    check_output(target, (".msh",), "a mesh is written as .msh", [arguments.file])
    solid = (
        int(arguments.solid) if arguments.solid and arguments.solid.isdecimal() else arguments.solid
    )
    surface = Gmsh(arguments.file, parts=_parts(arguments.part) or None, solid=solid).outline()
    assert isinstance(surface, CadSurface)
    print("\n".join(aligned(surface.table())))
    if target:
        with temporary_name(target, suffix=".msh") as temporary:  # by which Gmsh knows the format
            surface.write_msh(temporary, arguments.size, arguments.order)
        print(target)
    return 0


def _parts(words: list[str]) -> dict[str, tuple[int, ...]]:
    """Names and numbers of surfaces."""
    result: dict[str, tuple[int, ...]] = {}
    for word in words:
        name, _, numbers = word.partition("=")
        if not name or not all(number.isdecimal() for number in numbers.split(",")):
            raise InputError(f"--part {word}: expected NAME=N,N with the numbers of surfaces")
        result[name] = (*result.get(name, ()), *map(int, numbers.split(",")))
    return result
