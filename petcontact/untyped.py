"""Names for what mypy cannot look into: objects of libraries that carry no types, and tables of
files.

A library is not imported for the name of its class, so that start-up stays short.
"""

from __future__ import annotations

from typing import Any

ArrayLike = Any
"""What numpy makes an array of; numpy.typing takes as long to import as a tenth of numpy."""
Comm = Any
"""petsc4py.PETSc.Comm or mpi4py.MPI.Comm: the ranks that work together."""
Mat = Any
"""petsc4py.PETSc.Mat."""
Vec = Any
"""petsc4py.PETSc.Vec."""
PC = Any
"""petsc4py.PETSc.PC."""
Figure = Any
"""matplotlib.figure.Figure."""
Axes = Any
"""matplotlib.axes.Axes, in space mpl_toolkits.mplot3d.Axes3D."""
Group = Any
"""h5py.Group: a folder within a file."""
Cells = Any
"""meshio.Mesh: nodes and cells of a Gmsh file."""
Keyed = dict[str, Any]
"""Keys and what they hold, as a table of TOML or an object of JSON; also keywords of a call."""
