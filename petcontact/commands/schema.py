"""Print the JSON Schema of config files, with which editors complete and check them.

In VS Code install "Even Better TOML", write the schema beside your configs (petcontact schema -o
petcontact.schema.json) and begin each of them with the line

  #:schema petcontact.schema.json
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from .options import option, options

if TYPE_CHECKING:
    from ..given.tables.base import Model

add_arguments = options(
    option(
        "kind",
        nargs="?",
        default="problem",
        choices=["problem", "sweep"],
        help="of problem files (default) or of sweep files",
    ),
    option("-o", "--output", metavar="FILE", help="write it there instead of to standard output"),
)
"""The options of `petcontact schema`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print or write; needs no PETSc."""
    text = schema_text(arguments.kind)
    if arguments.output is None:
        print(text, end="")
    else:
        from ..runtime.atomic_write import write_text

        write_text(arguments.output, text)
    return 0


def schema_text(kind: str) -> str:
    """Return the JSON Schema of problem or sweep files."""
    import json

    from ..model.problem import OneBody, Problem
    from ..model.reference import json_schema
    from ..sweep.design.sweep_file import SweepFile

    models: dict[str, type[Model]] = (
        {"body": Problem, "": OneBody} if kind == "problem" else {"": SweepFile}
    )
    return json.dumps(json_schema(models), indent=1, ensure_ascii=False) + "\n"
