"""The solution of a contact problem, and what can be done with it: fields, tables, files, figures,
the verdict."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .data import SolutionData
from .hdf5 import read_data, write_solution
from .verdict.summary import verdict


class Solution(SolutionData):
    """What a solve returns, of any problem; its attributes are those of `SolutionData`. It can be
    pickled.

    Of a problem of one body `mesh`, `u`, `traction`, `contact`, `zones` and `history` are those of
    the last increment.
    """

    def save(self, path: str | Path) -> None:
        """Write a result file, see `write_solution`."""
        write_solution(path, self)

    @staticmethod
    def load(path: str | Path) -> Solution:
        """A solution from a result file, see `read_result`."""
        return read_result(path)

    def plot(self, ax: Any = None) -> Any:
        """Draw the bodies as they were and as they are, with the states of the contact nodes;
        returns the axes.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            A new figure's by default; in space with `projection="3d"`.
        """
        from .figures.plots import plot_on

        return plot_on(self, ax)

    def verdict(self, verbose: bool = False) -> str:
        """A few lines that say how the solve ended; more of them with `verbose`."""
        return verdict(self, verbose)

    def _repr_html_(self) -> str:
        """The verdict, for notebooks."""
        import html

        return f"<pre>{html.escape(self.verdict())}</pre>"


def read_result(path: str | Path, group: str = "/") -> Solution:
    """The solution that a result file of any format holds.

    Parameters
    ----------
    path : str or Path
    group : str
        Of the file, one case of several.

    Raises
    ------
    ResultError
        If the file is missing, truncated, not HDF5, not ours, or of a later format version.
    """
    data = read_data(path, group)
    return Solution(**{name: getattr(data, name) for name in SolutionData.__dataclass_fields__})
