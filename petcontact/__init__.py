"""petcontact: PETSc-backed boundary elements for frictional contact of elastic bodies."""

from __future__ import annotations

from . import _threads as _threads  # first: caps BLAS threads before numpy reads the environment

__version__ = "0.1.0"

_EXPORTS = {
    "Case": "config", "load": "config", "Problem": "problem", "Material": "problem", "Contact": "problem",
    "Displacement": "problem", "Traction": "problem", "Rectangle": "geometry", "Polygon": "geometry",
    "SideBySide": "outlines", "OutlineSide": "outlines", "Circle": "outlines", "Gmsh": "gmsh",
    "MeshOptions": "mesh_options", "Method": "method", "Bem": "method", "solve": "pipeline", "Solution": "solution",
    "adapt": "adaptive",
    "read_solution": "store", "write_solution": "store", "initialise": "_petsc", "plot_all": "plot",
    "field_at": "field", "field_on_grid": "field", "write_vtu": "vtu", "write_boundary_vtu": "vtu",
    "deformed_figure": "plot_field",
    "PetcontactError": "errors", "InputError": "errors", "SolverError": "errors", "ResultError": "errors",
}  # fmt: skip
__all__ = sorted([*_EXPORTS, "__version__"])


def __getattr__(name: str) -> object:
    """Public names are imported when first used: `petcontact --help` works without PETSc and starts at once."""
    if name in _EXPORTS:
        from importlib import import_module

        return getattr(import_module(f".{_EXPORTS[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
