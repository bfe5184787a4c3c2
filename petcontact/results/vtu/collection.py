"""Every increment for ParaView: fields inside and on the boundary of every body, tied by a .pvd
file."""

from __future__ import annotations

from collections.abc import Callable, Collection
from pathlib import Path
from xml.sax.saxutils import quoteattr

from ...runtime.atomic_write import write_text
from ..data import SolutionData
from .boundary import write_boundary_vtu
from .inner_fields import Window, fields_of_bodies, filled_bodies, grid_inside, within, write_vtu


def write_collection(
    path: str | Path,
    solution: SolutionData,
    resolution: tuple[int, ...] | None = None,
    progress: Callable[[float], None] | None = None,
    *,
    bodies: Collection[str] | None = None,
    window: Window | None = None,
    degrees: float | None = None,
) -> list[Path]:
    """Write STEM.pvd and the .vtu files that it names: of each increment and body the field (but of
    an infinite plate) and the boundary.

    Parameters
    ----------
    path : str or Path
    solution : Solution
    resolution : numbers of grid cells along the axes, optional
    progress : callable, optional
        Called with the share of the fields that is there.
    bodies : names, optional
        Only these.
    window : two (d,) arrays, optional
        Corners of the box that is filled; bodies outside of it are left out.
    degrees : float, optional
        Angle by which half sections are turned about their axis, up to 360.

    Returns
    -------
    list of Path
        What was written, the .pvd last.

    Raises
    ------
    InputError
        If the resolution does not fit.
    OutputError
        If a file cannot be written.
    """
    path = Path(path).with_suffix(".pvd")
    chosen = [name for name in solution.meshes if bodies is None or name in bodies]
    filled = [name for name in filled_bodies(solution) if name in chosen]
    grids = within(
        window, filled, lambda name: grid_inside(solution.meshes[name], resolution, window)
    )
    chosen = [name for name in chosen if name in grids or name not in filled]
    written, rows = list[Path](), list[str]()
    steps = solution.steps or solution.tried
    inside = fields_of_bodies(solution, grids, steps, progress)
    for k, step in enumerate(steps, 1):
        for part, name in enumerate(chosen):
            files = [path.with_name(f"{path.stem}-{k:03d}-{file_word(name)}-boundary.vtu")]
            write_boundary_vtu(files[0], solution, name, step, degrees)
            if name in inside:
                files.append(path.with_name(f"{path.stem}-{k:03d}-{file_word(name)}.vtu"))
                write_vtu(files[1], next(inside[name]), solution.problem.units, degrees)
            written += files
            rows += [
                f'    <DataSet timestep="{solution.time(step):.12g}" part="{2 * part + i}" '
                f"file={quoteattr(file.name)}/>"
                for i, file in enumerate(files)
            ]
    rows = ['<VTKFile type="Collection" version="0.1">', "  <Collection>", *rows]
    write_text(path, "\n".join([*rows, "  </Collection>", "</VTKFile>", ""]))
    return [*written, path]


def file_word(name: str) -> str:
    """The name of a body as a part of a file's name."""
    return "".join(c if c.isalnum() or c in "-_" else "-" for c in name)
