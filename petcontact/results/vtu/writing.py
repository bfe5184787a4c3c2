"""A mesh with point and cell data as a .vtu file, with notes in its field data."""

from __future__ import annotations

from pathlib import Path
from xml.sax.saxutils import quoteattr

import meshio

from ...given.tables.units import Units
from ...runtime.atomic_write import temporary_name
from ...runtime.terminal import printable
from .revolve import revolved


def unit_notes(units: Units | None) -> dict[str, int]:
    """Return the notes of a file that name the units."""
    given = units.model_dump(exclude_none=True) if units is not None else {}
    return {f"unit of {quantity} is {name}": 1 for quantity, name in given.items()}


def write_mesh(
    path: str | Path, mesh: meshio.Mesh, notes: dict[str, int], degrees: float | None = None
) -> None:
    """The file with notes as its field data, which meshio reads but does not write; names are what
    they say. A section is turned by an angle, where one is given."""
    mesh = mesh if degrees is None else revolved(mesh, degrees)
    with temporary_name(path) as temporary:
        meshio.write(temporary, mesh, file_format="vtu")
        if notes:
            kind = 'type="Int32" NumberOfTuples="1" format="ascii"'
            arrays = "".join(
                f"<DataArray Name={quoteattr(printable(name))} {kind}>{value}</DataArray>"
                for name, value in notes.items()
            )
            start = b"<UnstructuredGrid>"
            content = temporary.read_bytes()
            temporary.write_bytes(
                content.replace(start, start + f"<FieldData>{arrays}</FieldData>".encode(), 1)
            )
