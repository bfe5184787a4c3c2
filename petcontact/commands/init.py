"""Write a commented starter config, with the schema that editors complete and check it by.

--from part.inp writes the problem of an input file of Abaqus or CalculiX: bodies with their
surfaces as .msh files, contact pairs with friction, supports and pressures. --from assembly.step
(.iges, .brep, .msh) proposes one: its bodies, which of their parts may touch, supports and loads to
be given. What of a file is not taken is named, and stands in the config, too.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import InputError
from .options import option, options

KINDS = {
    "block": "a block on a foundation",
    "fretting": "a rounded pad drawn to and fro on a block",
    "press-fit": "a hub on a shaft",
    "bolt": "a bolt that clamps a plate",
    "seal": "an O-ring in a groove",
    "bearing": "a pin in a bearing with play",
    "indentation": "a ball pressed on a plate",
    "outline": "straight sides, arcs and a hole",
    "gmsh": "a body from a Gmsh mesh",
    "bodies": "two bodies, Coulomb friction, load steps",
    "space": "a block in three dimensions",
    "sweep": "many cases of a block",
}

OTHER_WORDS = {
    **{
        "2d": "block",
        "3d": "space",
        "polygon": "outline",
        "contact": "bodies",
        "ball": "indentation",
    },
    **{"hertz": "indentation", "o-ring": "seal", "shrink-fit": "press-fit", "pin": "bearing"},
    **{"press_fit": "press-fit", "pressfit": "press-fit", "axial": "press-fit", "screw": "bolt"},
}
"""What others call a kind."""


add_arguments = options(
    option("name", metavar="NAME", help="NAME.toml is written, and what goes with it"),
    option(
        "--kind",
        choices=KINDS,
        metavar="KIND",
        type=lambda word: OTHER_WORDS.get(word.lower(), word),
        help="; ".join(f"{kind}: {text}" for kind, text in KINDS.items()) + " (default: block)",
    ),
    option(
        "--from",
        metavar="FILE",
        dest="source",
        help="the problem of a file of Abaqus or CalculiX (.inp), or bodies of CAD or .msh",
    ),
    option("--force", action="store_true", help="replace files that exist"),
)
"""The options of `petcontact init`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Write the files; needs no PETSc."""
    from ..runtime.atomic_write import check_target, write_text

    if arguments.source and arguments.kind:
        raise InputError(
            "init: --kind is a starter's, --from takes the problem from a file; give one of them"
        )
    target = Path(arguments.name.removesuffix(".toml"))
    if not target.name:
        raise InputError("init: a name is needed, for example petcontact init block")
    contents = (
        starter(arguments.kind or "block", target.name)
        if arguments.source is None
        else _converted(arguments.source, target)
    )
    paths = [target.parent / name for name in contents]
    for path in paths:
        if not path.name.endswith("schema.json"):
            check_target(path, replace=arguments.force)
    for path, text in zip(paths, contents.values(), strict=True):
        write_text(path, text)
    for path in paths:
        print(path)
    return 0


def _converted(source: str, target: Path) -> dict[str, str]:
    """File names and contents of the problem of a file, which is checked as far as no mesh is
    needed."""
    import sys

    from ..convert.assembly import proposed, with_contacts
    from ..convert.inp_problem import convert_inp
    from ..geometry.cad.part import is_cad
    from ..given.tables.base import regular_file
    from ..model.case import parse_problem
    from ..model.shapes.files import LARGEST_MESH
    from ..model.toml_text import parse_toml
    from .schema import schema_text

    suffix = Path(source).suffix.lower()
    if not (is_cad(source) or suffix in (".inp", ".msh")):
        raise InputError(
            f"--from {source}: must end in .inp (Abaqus, CalculiX), .step, .iges, .brep or .msh"
        )
    config = (
        with_contacts(convert_inp(source, target.name))
        if suffix == ".inp"
        else proposed(str(regular_file(source, LARGEST_MESH)), target)
    )
    parse_problem(parse_toml(config.toml, source), source, {}, target.parent)
    for note in config.notes:
        print(f"petcontact: {source}: {note}", file=sys.stderr)
    return {
        f"{target.name}.toml": config.toml,
        **config.meshes,
        "petcontact.schema.json": schema_text("problem"),
    }


def starter(kind: str, name: str) -> dict[str, str]:
    """File names and contents of a starter."""
    from .schema import schema_text

    result = {
        f"{name}.toml": _read(f"{kind}.toml", name),
        "petcontact.schema.json": schema_text("problem"),
    }
    if kind == "gmsh":
        result[f"{name}.msh"] = _read("gmsh.msh", name)
    if kind == "sweep":
        result |= {f"{name}-problem.toml": _read("block.toml", f"{name}-problem")}
        result["petcontact.sweep-schema.json"] = schema_text("sweep")
    return result


def _read(file: str, name: str) -> str:
    from ..manual import installed

    return installed(f"starters/{file}").replace("NAME", name)
