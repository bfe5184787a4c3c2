"""Draw the figures of a result file: outline, displacement and traction on the contact parts,
history; an animation; or a page that turns the bodies (--html)."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import InputError
from ...runtime.figure_style import FORMATS
from ..options import CASE, check_folder, option, options

if TYPE_CHECKING:
    from ...results.data import SolutionData

add_arguments = options(
    option("result", metavar="RESULT.h5", nargs="+", help="result files, or the folder of a sweep"),
    option("-o", "--figures", metavar="DIR", help="folder of the figures (default: the result's)"),
    option(
        "--format",
        choices=FORMATS,
        action="append",
        help="png (default), pdf or svg; may be repeated",
    ),
    option(
        "--animate",
        metavar="FILE.gif",
        help="draw the deformed bodies through all increments instead (.gif, .mp4)",
    ),
    option(
        "--html",
        action="store_true",
        help="write one page STEM.html that turns the deformed bodies in a browser instead",
    ),
    option(
        "--magnification",
        type=float,
        metavar="M",
        help="draw displacements times M (default: a round number at which they are seen)",
    ),
    option(
        "--view",
        type=float,
        nargs=2,
        metavar=("UP", "ROUND"),
        help="3D: see the bodies from these angles (elevation and azimuth, degrees; default: with "
        "their contact in view)",
    ),
    option(
        "--revolve",
        type=float,
        nargs="?",
        const=270.0,
        metavar="DEGREES",
        help="draw bodies of revolution in space instead, turned about their axis by so much "
        "(270: cut open)",
    ),
    CASE,
)
"""The options of `petcontact plot`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Draw; needs no PETSc."""
    from ...sweep.store.case_table import read_case

    drawn = "animate" if arguments.animate else "html"
    unread = {
        "animate": ("figures", "format", "html", "magnification", "view", "revolve"),
        "html": ("format", "magnification", "view", "revolve") if arguments.html else (),
    }[drawn]
    for key in unread:
        if getattr(arguments, key):
            raise InputError(f"--{key}: is not used by --{drawn}; give one of them")
    check_folder("-o", arguments.figures)
    if arguments.animate:
        _check_animation(arguments)
    for name in arguments.result:
        solution = read_case(name, arguments.case)
        if arguments.animate:
            from ...results.figures.animation import animate

            print(animate(solution, arguments.animate))
            continue
        folder = Path(arguments.figures or Path(name).parent)
        stem = Path(name).stem if arguments.case == "/" else arguments.case
        print(*_drawn(solution, arguments, folder, stem), sep="\n")
    return 0


def _drawn(
    solution: SolutionData, arguments: argparse.Namespace, folder: Path, stem: str
) -> list[Path]:
    """The page, the bodies in space or the figures of a result, in a folder."""
    from ...results.figures.plots import plot_all
    from ...results.figures.turned import draw_turned
    from ...results.figures.turning import write_page
    from ...results.figures.view import view_of
    from ...runtime.figure_style import save_all

    if arguments.html:
        folder.mkdir(parents=True, exist_ok=True)
        return [write_page(folder / f"{stem}.html", solution)]
    formats = arguments.format or FORMATS[:1]
    view = view_of(solution, factor=arguments.magnification, eye=arguments.view)
    if arguments.revolve is not None:
        draw = partial(draw_turned, view=view, degrees=arguments.revolve)
        return save_all({"revolved": draw}, folder, stem, solution, formats=formats)
    asked = arguments.magnification is not None or arguments.view is not None
    return plot_all(solution, folder, stem, formats, view=view if asked else None)


def _check_animation(arguments: argparse.Namespace) -> None:
    """Refuse a file that could not be written, and several results, before any is read."""
    from ...results.figures.animation import animation_format
    from ...runtime.atomic_write import check_target

    animation_format(arguments.animate)
    check_target(Path(arguments.animate), replace=True, inputs=arguments.result)
    if len(arguments.result) > 1:
        raise InputError(
            f"--animate {arguments.animate}: draws one result, {len(arguments.result)} are given"
        )
