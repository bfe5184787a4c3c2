"""The solution of a contact problem, and what can be done with it: fields, tables, files, figures,
the verdict."""

from __future__ import annotations

from pathlib import Path

from ..untyped import Axes
from .data import SolutionData
from .hdf5 import read_data, write_solution
from .verdict.as_json import as_json
from .verdict.summary import verdict


class Solution(SolutionData):
    """What a solve returns, of any problem. It can be pickled.

    Of a problem of one body `mesh`, `u`, `traction`, `contact`, `zones` and `history` are those of
    the last increment.

    Attributes
    ----------
    problem : Problem
        What was solved; a one-body file is one body named "body".
    meshes : dict of BoundaryMesh by body
    nodes : dict of (m,) arrays by interface
        Numbers of the secondary's nodes in its body's mesh.
    sides : dict of (body, part) by interface
        Body and part of the secondary side.
    steps : list of StepResult
        Increments that were solved, in order.
    status : {"converged", "not converged", "failed"}
    reason : str
        Why the solve ended so.
    timings : dict of str to float
        Wall seconds by stage.
    accuracy : Accuracy
        The estimated error, and how it is known.
    provenance : Provenance
        How the solution was made: method, solver, command, versions.
    findings : tuple of Finding
        What the checks of the solution found.
    failed : StepResult, optional
        The increment that has no solution, with its last iterate; None where all were solved.
    wear : WearHistory, optional
        Wear after each jump over cycles; None without `[cycle]`.
    volumes : dict of VolumeSolution by body, optional
        Particular solutions for volume loads, None for bodies without them. The whole is None of
        a solution that was read, which finds them where they are needed.
    coarser : SolutionData, optional
        The solution on the mesh before, with which numbers are compared; files do not hold it.
    undivided : SolutionData, optional
        The solution on the same meshes with as many increments as the coarser ones have, where this
        one has more; files do not hold it.
    paths : tuple of SolutionData
        Solutions with other increments, each of which differs less from the one before than from
        this one. Files do not hold them.
    tracked : SolutionData, optional
        The solution with as many increments on a coarser mesh, where that one has the other paths;
        files do not hold it.
    written : tuple of Number, optional
        The numbers with errors that a result file holds; None of a solution that was not read.

    Examples
    --------
    >>> solution = solve("block.toml")
    >>> pair = solution.pairs["bottom"]
    >>> pair.x, pair.pressure, pair.sigma_t  # (m, 2) [length], (m,) and (m, 1) [stress]
    >>> [(n.name, n.value, n.error, n.unit) for n in solution.numbers["largest p"]]
    >>> solution.von_mises_at([[4.0, 2.0]])  # (1,) [stress]
    """

    def save(self, path: str | Path) -> None:
        """Write a result file, see `write_solution`."""
        write_solution(path, self)

    @staticmethod
    def load(path: str | Path) -> Solution:
        """A solution from a result file, see `read_result`."""
        return read_result(path)

    def plot(self, ax: Axes | None = None) -> Axes:
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
        """A few lines that say how the solve ended; more of them with `verbose`.

        Examples
        --------
        >>> solution.verdict().splitlines()[0]
        'converged: A block pushed over a foundation'
        """
        return verdict(self, verbose)

    def to_json(self) -> str:
        """Status, warnings, accuracy and numbers with their errors, as JSON for scripts."""
        return as_json(self)

    def _repr_html_(self) -> str:
        """The verdict, for notebooks."""
        import html

        return f"<pre>{html.escape(self.verdict())}</pre>"


def read_result(path: str | Path) -> Solution:
    """The solution that a result file of any format holds.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Solution

    Raises
    ------
    ResultError
        If the file is missing, truncated, not HDF5, not ours, or of a later format version.

    Examples
    --------
    >>> solution = read_result("block.h5")
    >>> print(solution.verdict())
    >>> solution.pairs["bottom"].force  # on the body [stress · length, in space · area]
    """
    data = read_data(path)
    return Solution(**{name: getattr(data, name) for name in SolutionData.__dataclass_fields__})
