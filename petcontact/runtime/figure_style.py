"""One style for all figures: sizes, colours that the colour-blind can distinguish, labels with
units, and files."""

from __future__ import annotations

import base64
import importlib
import io
import os
import sys
import textwrap
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..untyped import Axes, Figure, Keyed
from .atomic_write import temporary_name
from .terminal import printable

if TYPE_CHECKING:
    from ..arrays import Array, States

FORMATS = ("png", "pdf", "svg")
SIZE = (7.0, 4.2)
"""Size of figures [inch]."""
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito's palette: seven hues that differ for every kind of colour vision, and in grey."""
STATES = {0: ("stick", COLOURS[0], "s"), 1: ("slip", COLOURS[1], "o"), 2: ("open", "white", "^")}
"""Name, colour and marker of each state of a contact node."""
CONTACT = ("contact", COLOURS[2], "o")
"""Style of nodes that touch without friction: nothing says that they slip."""
SHADES = {"stick": "#d3e4f1", "slip": "#f8dcc9", "open": "#eeeeee", "contact": "#d3ece3"}
"""Background of the zones of a contact part."""
TITLE = 62
"""Characters of a line of a title: of 10 points, each half as wide as high, they fill two thirds of
a figure's width of 7 inches."""
LINES = ("-", "--", "-.", (0, (1, 1)), (0, (5, 1, 1, 1, 1, 1)))
"""Styles of lines that also differ without colours."""
ROOM = 0.42
"""Height of the numbers and the label under axes [inch]."""
DOTS = 300
"""Dots an inch of what is drawn as an image inside a PDF or SVG file."""


def save_all(
    drawings: dict[str, Callable[..., None]],
    folder: str | Path,
    stem: str,
    *arguments: object,
    formats: Sequence[str] = ("png",),
) -> list[Path]:
    """Figures by name as STEM-NAME.png (or other formats) in a folder, which is made if it does not
    exist; their paths."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    paths = [
        (Path(folder) / f"{stem}-{name}.{suffix}", draw)
        for name, draw in drawings.items()
        for suffix in formats
    ]
    for path, draw in paths:
        save(path, draw, *arguments)
    return [path for path, _ in paths]


def save(path: Path, draw: Callable[..., None], *arguments: object) -> None:
    """One figure, drawn without a display, written whole or not at all; its format is that of its
    suffix.

    Raises
    ------
    InputError
        If there is no such format.
    OutputError
        If the file cannot be written.
    """
    suffix = figure_format(path)
    with temporary_name(path) as temporary:
        _save(temporary, suffix, draw, *arguments)


def png(draw: Callable[..., None], *arguments: object) -> str:
    """Return one figure as a PNG picture in base64."""
    picture = io.BytesIO()
    _save(picture, "png", draw, *arguments)
    return base64.b64encode(picture.getvalue()).decode()


def _save(target: object, suffix: str, draw: Callable[..., None], *arguments: object) -> None:
    """Draw one figure into a file."""
    load_matplotlib()
    from matplotlib import figure as figures
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with warnings.catch_warnings(), rc_context(style()):
        # Matplotlib's reader of formulas warns of itself
        warnings.filterwarnings("ignore", module="matplotlib|pyparsing")
        figure = figures.Figure(figsize=SIZE, dpi=150, layout="constrained")
        FigureCanvasAgg(figure)
        draw(figure, *arguments)
        # no date: the same result is the same file
        stamp = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(suffix)
        # zlib's own choice takes three times as long for an eighth less
        how: Keyed = (
            {"dpi": 150, "pil_kwargs": {"compress_level": 3}} if suffix == "png" else {"dpi": DOTS}
        )
        # no empty bands; boxes about axes in space leave out their names
        seen = [*figure.get_default_bbox_extra_artists(), *_names_in_space(figure)]
        how |= {"bbox_inches": "tight", "pad_inches": 0.06, "bbox_extra_artists": seen}
        figure.savefig(target, format=suffix, metadata=stamp, **how)


def _names_in_space(figure: Figure) -> Iterator[object]:
    """The names of axes in space that are shown."""
    for axes in figure.axes:
        if axes.name == "3d":
            yield from (axis.label for axis in (axes.xaxis, axes.yaxis, axes.zaxis))


def load_matplotlib() -> None:
    """Import matplotlib without the settings of the working folder, which name modules and programs
    to run; those of the user's own folder stay.

    Raises
    ------
    InputError
        If matplotlib cannot read these.
    """
    if "matplotlib" in sys.modules:
        return
    folder = os.open(".", os.O_RDONLY | getattr(os, "O_PATH", 0))
    try:
        os.chdir("/")
        importlib.import_module("matplotlib")
    except (ValueError, OSError) as error:
        raise InputError(f"matplotlib's settings cannot be read ({error})") from None
    finally:
        os.fchdir(folder)
        os.close(folder)


def figure_format(path: str | Path) -> str:
    """The format that a file name's suffix says.

    Raises
    ------
    InputError
        If it is none of FORMATS.
    """
    suffix = Path(path).suffix.lower().removeprefix(".")
    if suffix not in FORMATS:
        raise InputError(
            f"{path}: a figure is {', '.join(f'.{name}' for name in FORMATS[:-1])} "
            f"or .{FORMATS[-1]}"
        )
    return suffix


def style() -> Keyed:
    """Matplotlib's settings for our figures; text in PDF stays text."""
    from matplotlib import cycler

    return {
        "axes.prop_cycle": cycler(color=COLOURS),
        "font.size": 9.0,
        "axes.titlesize": 10.0,
        "legend.fontsize": 8.0,
        "legend.frameon": False,
        "lines.linewidth": 1.4,
        "axes.linewidth": 0.7,
        "pdf.fonttype": 42,
        "svg.hashsalt": "petcontact",
        "axes.formatter.useoffset": False,
        # where titles are anyway: to look for ticks above the axes takes a third of the layout
        "axes.titley": 1.0,
    }


def label(quantity: str, unit: str | None) -> str:
    """An axis label, with the unit; units that have no names are those of the user's numbers."""
    return f"{quantity} [{plain(unit) if unit else 'consistent units'}]"


def name_what_is_seen(axes: Axes) -> None:
    """Take out of the legend the names of lines, markers and areas of whose look none lies within
    the axes."""
    view = axes.viewLim
    for line in [each for each in axes.lines if each.get_transform() == axes.transData]:
        look = line.get_color(), line.get_linestyle(), line.get_marker()
        points = [
            point
            for each in axes.lines
            if (each.get_color(), each.get_linestyle(), each.get_marker()) == look
            for point in each.get_xydata().tolist()
        ]
        if points and not any(view.contains(*point) for point in points):
            line.set_label("")
    for area in axes.patches:
        shade = area.get_hatch(), area.get_facecolor()
        alike = [each for each in axes.patches if (each.get_hatch(), each.get_facecolor()) == shade]
        if not any(view.overlaps(each.get_path().get_extents()) for each in alike):
            area.set_label("")


def legend_below(axes: Axes, columns: int, caption: str = "") -> None:
    """A legend under the axes and their label, where it hides nothing, and a caption below it."""
    from matplotlib.text import Annotation
    from matplotlib.transforms import ScaledTranslation

    below = axes.transAxes + ScaledTranslation(0.0, -ROOM, axes.figure.dpi_scale_trans)
    how = {"bbox_to_anchor": (0.5, 0.0), "bbox_transform": below, "ncols": columns}
    legend = axes.legend(loc="upper center", **how)
    if caption:
        place = {"xycoords": legend, "textcoords": "offset points", "xytext": (0.0, -4.0)}
        centred = {"ha": "center", "va": "top", "fontsize": 8.0}
        axes.figure.add_artist(Annotation(caption, (0.5, 0.0), **place, **centred))


def legend_beside(axes: Axes) -> None:
    """A legend to the right of the axes."""
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def new_label(axes: Axes, word: str) -> str | None:
    """A word for the legend; none where it stands there already."""
    return None if word in axes.get_legend_handles_labels()[1] else word


def state_style(state: int, *, friction: bool) -> tuple[str, str, str]:
    """Return name, colour and marker of a state, of contact with or without friction."""
    return STATES[state] if friction or state != 1 else CONTACT


def draw_states(axes: Axes, points: Array, states: States, *, friction: bool) -> None:
    """Contact nodes (m, 2) by their state: a shape and a colour each."""
    for state in STATES:
        name, colour, marker = state_style(state, friction=friction)
        chosen = states == state
        if chosen.any():
            axes.plot(
                *points[chosen].T,
                ls="",
                marker=marker,
                color=colour,
                mec="black",
                mew=0.2,
                ms=3.0,
                label=new_label(axes, name),
            )


def round_number(wanted: float, peak: float) -> float:
    """The number 1, 2 or 5 times a power of ten next below wanted/peak, by which to magnify."""
    import numpy as np

    if not peak > 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(wanted / peak))
    return float(
        max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted / peak * (1.0 + 1e-12))
        * power
    )


def wrapped(text: str) -> str:
    """A user's title in as many lines as it needs."""
    return "\n".join(plain(line) for line in textwrap.wrap(text, TITLE))


def plain(text: str) -> str:
    """A user's text for matplotlib, which would take what stands between dollars for a formula."""
    return printable(text).replace("$", r"\$")
