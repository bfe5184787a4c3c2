"""Draw a problem before it is solved: bodies with the names of their parts, supports, loads,
obstacles, and the parts that may touch. Whether it is what was meant is seen before any waiting."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import in_file
from ..runtime.figure_style import FORMATS
from .options import option, options, overrides

add_arguments = options(
    option("config", metavar="CONFIG.toml", help="the problem"),
    option(
        "-o",
        "--output",
        metavar="FILE",
        help=f"the picture, {', '.join(FORMATS)} (default: the config's stem + -model.png)",
    ),
    option(
        "--set",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="override a key of the config, as in solve",
    ),
)
"""The options of `petcontact draw`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Draw; solves nothing."""
    from ..model.case import load
    from ..pipeline.pose.as_posed import as_posed
    from ..results.figures.model import draw_model
    from ..runtime.figure_style import figure_format, save

    problem = load(arguments.config, overrides(arguments.set))
    target = Path(arguments.output or f"{Path(arguments.config).stem}-model.png")
    figure_format(target)
    with in_file(arguments.config):
        solution = as_posed(problem)
    save(target, draw_model, solution)
    print(target)
    return 0
