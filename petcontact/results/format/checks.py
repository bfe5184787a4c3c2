"""Whether a result file holds what it should, before anything is made of it: links, types, lengths,
numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import h5py
import numpy as np

from ...arrays import Array, Index
from ...errors import InputError, ResultError
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.storage import demand, demand_range
from ...stored import Stored, checked
from ...untyped import Group, Keyed

LARGEST = 50_000_000
"""Entries of one array: a file of a few bytes may claim any number."""
MAY_BE_UNDEFINED = ("history", "increments")
"""Groups whose numbers need not be finite: w_k is not where nothing moves."""
MAY_BE_INFINITE = ("bound", "friction_bound", "gap")
"""The bound of bonded contact, and the gap where nothing is faced."""


NAMES = ("part", "part_names", "numbers")
"""Names of arrays of texts; the `part` of a mesh has numbers."""
SQUARED = [Stored("", low=-1e154, high=1e154, infinite=infinite) for infinite in (False, True)]
"""Numbers whose squares do not overflow."""


def check_group(group: Group, source: str) -> None:
    """Refuse a group that refers to other files, or holds arrays that are too large, complex or not
    finite.

    Raises
    ------
    ResultError
        One line that names the array.
    """
    waiting, seen = [group], set()
    while waiting:
        folder = waiting.pop()
        for name in folder:
            if not isinstance(folder.get(name, getlink=True), h5py.HardLink):
                raise ResultError(
                    f"{source}: {folder.name}/{name} refers to another place, "
                    "results hold all their data"
                )
            item = folder[name]
            place = h5py.h5o.get_info(item.id).addr
            if place in seen:
                continue  # a second name of what was looked at; groups may even hold themselves
            seen.add(place)
            if isinstance(item, h5py.Group):
                waiting.append(item)
            else:
                _check_array(item, source)


def _check_array(data: h5py.Dataset, source: str) -> None:
    if not isinstance(data, h5py.Dataset) or data.external or data.is_virtual:
        raise ResultError(
            f"{source}: {data.name} has its data elsewhere, results hold theirs themselves"
        )
    if data.size is None or data.size > LARGEST:
        raise ResultError(
            f"{source}: {data.name} has {data.size} entries, at most {LARGEST} are read"
        )
    *_, folder, name = data.name.split("/")
    if not _fits(data.dtype, name):
        raise ResultError(
            f"{source}: {data.name} has values of type {data.dtype}; "
            "numbers are real, names are text"
        )
    if data.dtype.kind != "f" or folder in MAY_BE_UNDEFINED:
        return
    try:
        checked(f"{source}: {data.name}", data[()], SQUARED[name in MAY_BE_INFINITE])
    except InputError as error:
        raise ResultError(f"{error}") from None


def _fits(dtype: np.dtype[Any], name: str) -> bool:
    """Whether a dataset of a name has values of the type that it may have."""
    if name == "findings":
        return all(dtype[column].kind in "fO" for column in dtype.names or ())
    if h5py.check_string_dtype(dtype) is not None:
        return name in NAMES
    return dtype.kind in "fiu" and dtype.itemsize <= 8 and name != "part_names"


def check_fields(mesh: BoundaryMesh, fields: Mapping[str, Array], source: str) -> None:
    """Refuse fields that are not one vector a node of the mesh."""
    for name, values in fields.items():
        wanted = mesh.n_nodes, mesh.components
        demand(
            values.shape == wanted,
            f"{source}: {name} has shape {values.shape}, not {wanted} as the mesh has nodes",
        )


def check_history(columns: Mapping[str, Sequence[object]], source: str) -> None:
    """Refuse a history whose columns differ in length."""
    lengths = {len(values) for name, values in columns.items() if name != "exchanged"}
    demand(
        len(lengths) <= 1,
        f"{source}: history has columns of {', '.join(map(str, sorted(lengths)))} rows",
    )


def read_table(text: Any, name: str, *, numbers: bool = False) -> Keyed:
    """A table that is stored as JSON, of numbers only where asked for."""
    table = json.loads(text)
    fits = isinstance(table, dict) and (
        not numbers or all(isinstance(v, (int, float)) for v in table.values())
    )
    demand(fits, f"{name} is not a table{' of numbers' if numbers else ''}")
    return dict(table)


def check_pair(mesh: BoundaryMesh, nodes: Index, arrays: Keyed, name: str) -> None:
    """Refuse the nodal fields of a contact pair that do not fit each other or the mesh of its
    secondary, and states that are none."""
    m, d = len(nodes), mesh.components
    shapes = {
        **dict.fromkeys(("x", "normal"), (m, mesh.dim)),
        "tangent": (m, d - 1, d),
        **dict.fromkeys(("u_t", "sigma_t", "slip", "slip_increment"), (m, d - 1)),
        "wear": (m, 2),
    }
    demand_range(nodes, mesh.n_nodes, f"{name}/nodes")
    demand_range(arrays["state"], 3, f"{name}/state")
    for key, values in arrays.items():
        fits = np.shape(values) == shapes.get(key, (m,))
        whole = key.startswith(("force", "moment", "dissipated", "errors", "overlap"))
        demand(
            fits or whole or values is None,
            f"{name}/{key} has shape {np.shape(values)}, not {shapes.get(key, (m,))}",
        )


def check_steps(steps: Group, last: int, source: str) -> None:
    """Refuse increments that are one another, or of steps that the problem does not have.

    Parameters
    ----------
    steps : h5py.Group
        The increments by their numbers, from 1.
    last : int
        Number of the last step.
    source : str
        Name of the file.
    """
    seen = dict[int, str]()
    for name, place in steps.items():
        first = seen.setdefault(h5py.h5o.get_info(place.id).addr, name)
        where = f"{source}: damaged (increment {name} is"
        demand(first == name, f"{where} increment {first} again)")
        for key, least in (("step", 1), ("origin", 0)):
            number = int(place.attrs.get(key, least))
            allowed = f"the problem has steps up to {last})"
            demand(least <= number <= last, f"{where} of {key} {number}, {allowed}")
