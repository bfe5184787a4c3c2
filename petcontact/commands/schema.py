"""Print the JSON Schema of config files, with which editors complete and check them.

In VS Code install "Even Better TOML", write the schema beside your configs (petcontact schema -o
petcontact.schema.json) and begin each of them with the line

  #:schema petcontact.schema.json
"""

from __future__ import annotations

import argparse
from typing import Any


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `petcontact schema`."""
    parser.add_argument(
        "kind",
        nargs="?",
        default="problem",
        choices=["problem", "sweep"],
        help="of problem files (default) or of sweep files",
    )
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="write it there instead of to standard output"
    )
    parser.add_argument(
        "--markdown",
        action="store_true",
        help="the same as tables in Markdown: `petcontact help config`",
    )


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print or write; needs no PETSc."""
    text = schema_text(arguments.kind, arguments.markdown)
    if arguments.output is None:
        print(text, end="")
    else:
        from ..runtime.atomic_write import write_text

        write_text(arguments.output, text)
    return 0


def schema_text(kind: str, as_markdown: bool = False) -> str:
    """The schema of problem or sweep files, as JSON or as Markdown."""
    import json

    from ..model.problem import OneBody, Problem
    from ..model.reference import json_schema, markdown
    from ..sweep.design.sweep_file import SweepFile

    models: Any = {"body": Problem, "": OneBody} if kind == "problem" else {"": SweepFile}
    return (
        markdown(models)
        if as_markdown
        else json.dumps(json_schema(models), indent=1, ensure_ascii=False) + "\n"
    )
