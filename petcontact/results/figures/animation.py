"""The deformed bodies through all increments, as a GIF, or as an MP4 where ffmpeg is installed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from ...errors import InputError
from ...runtime.atomic_write import temporary_name
from ...runtime.figure_style import style
from ..data import SolutionData
from .curves import headed
from .plots import plot_on
from .view import view_of

FORMATS = (".gif", ".mp4")
SECONDS = 6.0
"""About how long the whole animation takes [s]."""
SLOWEST, FASTEST = 2.0, 20.0
"""Frames a second."""


def animation_format(path: str | Path) -> str:
    """The format that a file name's suffix says.

    Raises
    ------
    InputError
        If it is neither of FORMATS, or needs ffmpeg and there is none.
    """
    from matplotlib.animation import FFMpegWriter

    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise InputError(f"{path}: an animation is {' or '.join(FORMATS)}")
    if suffix == ".mp4" and not FFMpegWriter.isAvailable():
        raise InputError(
            f"{path}: .mp4 needs the program ffmpeg, which is not installed; .gif needs nothing"
        )
    return suffix


def animate(solution: SolutionData, path: str | Path) -> Path:
    """Draw the deformed bodies after each increment, a frame each, all with one magnification,
    window and colour scale.

    Parameters
    ----------
    solution : Solution
        Of at least two increments.
    path : str or Path
        Its suffix is the format, .gif or .mp4.

    Raises
    ------
    InputError
        If there is no such format, or one increment only.
    OutputError
        If the file cannot be written.
    """
    from matplotlib import rc_context
    from matplotlib.animation import FFMpegWriter, PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    suffix, steps = animation_format(path), solution.steps
    if len(steps) < 2:
        raise InputError(
            f"{path}: an animation needs several increments, there is {len(steps)}; give the "
            "problem [[step]] with increments, or draw it by `petcontact plot` without --animate"
        )
    rate = min(max(len(steps) / SECONDS, SLOWEST), FASTEST)
    writer = (PillowWriter if suffix == ".gif" else FFMpegWriter)(fps=round(rate))
    view = view_of(solution, steps)
    with rc_context(style()), temporary_name(path, suffix=suffix) as temporary:
        figure = Figure(figsize=(7.0, 4.2), dpi=110, layout="constrained")
        FigureCanvasAgg(figure)
        with writer.saving(figure, str(temporary), 110):
            for k, step in enumerate(steps, 1):
                figure.clear()
                axes = plot_on(replace(solution, steps=steps[:k], failed=None), figure, view)
                axes.set_title(
                    headed(solution, f"{step.title}, load factor {step.load_factor:.4g}")
                )
                writer.grab_frame()
    return Path(path)
