"""Names for the objects of libraries that are not imported for the name of a class, so that
start-up stays short, and for tables of files.

Types are checked by the libraries' own classes. Of those that carry no types yet mypy knows
nothing more than the name. `Comm` is also a communicator of mpi4py, `Axes` in space one of
mplot3d, and `Mesh` the nodes and cells of a Gmsh file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from h5py import Group as Group
    from matplotlib.axes import Axes as Axes
    from matplotlib.cm import ScalarMappable as ScalarMappable
    from matplotlib.figure import Figure as Figure
    from meshio import Mesh as Mesh
    from numpy.typing import ArrayLike as ArrayLike
    from pandas import DataFrame as DataFrame
    from petsc4py.PETSc import KSP as KSP
    from petsc4py.PETSc import PC as PC
    from petsc4py.PETSc import Comm as Comm
    from petsc4py.PETSc import Mat as Mat
    from petsc4py.PETSc import Vec as Vec
    from petsc4py.PETSc import Viewer as Viewer
else:
    ArrayLike = Axes = Comm = DataFrame = Figure = Group = KSP = Mat = Mesh = PC = object
    ScalarMappable = Vec = Viewer = object

Keyed = dict[str, Any]
"""Keys and what they hold, as a table of TOML or an object of JSON; also keywords of a call."""
