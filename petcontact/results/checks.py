"""Whether a result file holds what it should, before anything is made of it: links, types, lengths, numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from ..errors import ResultError
from ..mesh.curve_mesh import CurveMesh

LARGEST = 50_000_000
"""Entries of one array: a file of a few bytes may claim any number."""
LARGEST_ORDER = 5
MAY_BE_UNDEFINED = ("history", "bound", "friction_bound")
"""Names below which numbers need not be finite: w_k is not where nothing moves, nor the bound of bonded contact."""


def check_group(group: Any, source: str) -> None:
    """Refuse a group that refers to other files, or holds arrays that are too large, complex or not finite.

    Raises
    ------
    ResultError
        One line that names the array.
    """
    waiting, seen = [group], set()
    while waiting:
        here = waiting.pop()
        for name in here:
            if not isinstance(here.get(name, getlink=True), h5py.HardLink):
                raise ResultError(f"{source}: {here.name}/{name} refers to another place, results hold all their data")
            item = here[name]
            place = h5py.h5o.get_info(item.id).addr
            if place in seen:
                continue  # a second name of what was looked at; groups may even hold themselves
            seen.add(place)
            if isinstance(item, h5py.Group):
                waiting.append(item)
            else:
                _check_array(item, source)


def _check_array(data: Any, source: str) -> None:
    if not isinstance(data, h5py.Dataset) or data.external or data.is_virtual:
        raise ResultError(f"{source}: {data.name} has its data elsewhere, results hold theirs themselves")
    if data.size is None or data.size > LARGEST:
        raise ResultError(f"{source}: {data.name} has {data.size} entries, at most {LARGEST} are read")
    if data.dtype.kind not in "fiuOS":
        raise ResultError(f"{source}: {data.name} has values of type {data.dtype}; numbers are real, names are text")
    undefined = any(part in MAY_BE_UNDEFINED for part in data.name.split("/"))
    if data.dtype.kind == "f" and not undefined and not np.all(np.isfinite(data[()])):
        raise ResultError(f"{source}: {data.name} has values that are not finite")


def check_link(file: Any, path: str, source: str) -> None:
    """Refuse the path of a group that leads through links to elsewhere."""
    here = file
    for name in filter(None, path.split("/")):
        if not isinstance(here.get(name, getlink=True), h5py.HardLink):
            raise ResultError(f"{source}: {path} refers to another place")
        here = here[name]


def check_mesh(arrays: Mapping[str, Any], source: str) -> None:
    """Refuse arrays of a mesh that do not fit each other; what they are is said in `CurveMesh`."""
    vertices, elements = arrays["vertices"], arrays["elements"]
    count = len(elements)
    _demand(vertices.ndim == 2 and vertices.shape[1] == 2 and elements.shape == (count, 2) and count > 0,
            f"{source}: mesh/vertices has shape {vertices.shape}, mesh/elements {elements.shape}")  # fmt: skip
    _demand_range(elements, len(vertices), f"{source}: mesh/elements")
    for name in ("curvature", "order", "part", "line", "side_start"):
        _demand(arrays[name].shape == (count,), f"{source}: mesh/{name} has shape {arrays[name].shape}, not ({count},)")
    _demand_range(arrays["order"], LARGEST_ORDER + 1, f"{source}: mesh/order")
    _demand_range(arrays["part"], len(arrays["part_names"]), f"{source}: mesh/part")
    first, second = elements.T
    _demand(bool(np.all(np.any(vertices[first] != vertices[second], axis=1))), f"{source}: mesh: an element has no length")


def check_fields(mesh: CurveMesh, fields: Mapping[str, Any], source: str) -> None:
    """Refuse fields that are not one vector a node of the mesh."""
    for name, values in fields.items():
        wanted = mesh.x.shape
        _demand(values.shape == wanted, f"{source}: {name} has shape {values.shape}, not {wanted} as the mesh has nodes")


def check_contact(mesh: CurveMesh, contact: Mapping[str, Any], source: str) -> None:
    """Refuse contact fields that do not fit each other or the mesh."""
    m = len(contact["nodes"])
    shapes = {"x": (m, 2), "tangent": (m, 2), "u_t": (m, 1), "sigma_t": (m, 1)}
    for name, values in contact.items():
        wanted = shapes.get(name, (m,))
        _demand(values.shape == wanted and m > 0, f"{source}: contact/{name} has shape {values.shape}, not {wanted}")
    _demand_range(contact["nodes"], mesh.n_nodes, f"{source}: contact/nodes")
    _demand_range(contact["state"], 3, f"{source}: contact/state")
    _demand(bool(np.all(np.diff(contact["nodes"]) > 0)), f"{source}: contact/nodes is not in order")
    known = set(contact["part"].tolist()) <= set(mesh.part_names)
    _demand(known, f"{source}: contact/part names parts that the mesh has not")


def check_pair(mesh: CurveMesh, nodes: Any, arrays: Mapping[str, Any], name: str) -> None:
    """Refuse the fields of a contact pair that do not fit each other or the mesh of its secondary side."""
    _demand_range(nodes, mesh.n_nodes, f"{name}/nodes")
    for key, values in arrays.items():
        one_a_node = not isinstance(values, np.ndarray) or key == "force" or len(values) == len(nodes)
        _demand(one_a_node, f"{name}/{key} has shape {np.shape(values)}, not one value for each of {len(nodes)} nodes")


def _demand_range(values: Any, count: int, name: str) -> None:
    whole = values.dtype.kind in "iu" and (not values.size or (values.min() >= 0 and values.max() < count))
    _demand(bool(whole), f"{name} must be whole numbers below {count}")


def _demand(holds: bool, message: str) -> None:
    if not holds:
        raise ResultError(message)
