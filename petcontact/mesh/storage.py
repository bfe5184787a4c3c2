"""Meshes as groups of a result file."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import fields, replace

import h5py
import numpy as np

from ..arrays import AnyArray, Array, Index, scattered
from ..errors import ResultError
from ..untyped import Group, Keyed
from .boundary_mesh import BoundaryMesh
from .curve_mesh import CurveMesh, as_curve
from .panels import HIGHEST_ORDER
from .ring_mesh import RingMesh, TwistedRingMesh
from .surface_mesh import SurfaceMesh

CURVE_ARRAYS, CURVE_OPTIONAL = ("curvature", "order", "part", "line", "side_start"), ("power",)
SURFACE_ARRAYS, SURFACE_OPTIONAL = ("order", "part"), ("middles",)


def write_mesh(group: Group, mesh: BoundaryMesh) -> None:
    """Write the vertices, the elements and the other arrays of a mesh."""
    _write(mesh, group)
    group.create_dataset(
        "part_names", data=np.array(mesh.part_names, dtype=object), dtype=h5py.string_dtype()
    )
    group.attrs["unit_length"] = mesh.unit_length
    if isinstance(mesh, CurveMesh) and mesh.thickness:
        group.attrs["thickness"] = mesh.thickness
    if isinstance(mesh, RingMesh):
        group.attrs["symmetry"] = "axial"
        group.attrs["components"] = mesh.components


@functools.singledispatch
def _write(mesh: BoundaryMesh, group: Group) -> None:
    mesh = as_curve(mesh)
    vertices, numbers = np.unique(np.vstack([mesh.start, mesh.end]), axis=0, return_inverse=True)
    group["vertices"] = vertices
    group["elements"] = numbers.reshape(2, -1).T
    for key in (*CURVE_ARRAYS, *(CURVE_OPTIONAL if mesh.power.any() else ())):
        group[key] = getattr(mesh, key)


@_write.register
def _(mesh: SurfaceMesh, group: Group) -> None:
    flat = np.concatenate([mesh.corners, mesh.middles], axis=1).reshape(-1, 3)
    real = ~np.isnan(flat[:, 0])
    vertices, numbers = np.unique(flat[real], axis=0, return_inverse=True)
    points = scattered(numbers.ravel(), real, len(flat), -1)
    elements, middles = np.split(points.reshape(-1, 9), [4], axis=1)
    group["vertices"], group["elements"] = vertices, elements
    if np.any(middles >= 0):
        group["middles"] = middles
    for key in SURFACE_ARRAYS:
        group[key] = getattr(mesh, key)


def read_mesh(group: Group, source: str) -> BoundaryMesh:
    """Return the mesh of a group.

    Raises
    ------
    ResultError
        If its elements are neither lines nor panels, or its arrays do not fit each other.
    """
    kinds: dict[tuple[int, int], tuple[tuple[str, ...], Callable[..., CurveMesh | SurfaceMesh]]] = {
        (2, 2): (CURVE_ARRAYS, _curve),
        (3, 4): (SURFACE_ARRAYS, _surface),
    }
    vertices, elements = group["vertices"][()], group["elements"][()]
    shown = f"{source}: mesh/vertices has shape {vertices.shape}, mesh/elements {elements.shape}"
    count = len(elements)
    demand(vertices.ndim == elements.ndim == 2 and count > 0, shown)
    kind = (vertices.shape[1], elements.shape[1])
    demand(kind in kinds, shown)
    keys, build = kinds[kind]
    arrays = {
        key: group[key][()] for key in (*keys, *(key for key in CURVE_OPTIONAL if key in group))
    }
    names = tuple(name.decode() for name in group["part_names"][()])
    for name, values in arrays.items():
        demand(
            values.shape == (count,),
            f"{source}: mesh/{name} has shape {values.shape}, not ({count},)",
        )
    demand_range(arrays["order"], 6, f"{source}: mesh/order")
    demand_range(arrays["part"], len(names), f"{source}: mesh/part")
    arrays |= {
        key: group[key][()] for key in SURFACE_OPTIONAL if build is _surface and key in group
    }
    mesh: BoundaryMesh = build(
        vertices, elements, arrays, names, float(group.attrs.get("unit_length", 0.0)), source
    )
    if isinstance(mesh, CurveMesh) and "thickness" in group.attrs:
        mesh = replace(mesh, thickness=float(group.attrs["thickness"]))
        demand(0.0 < mesh.depth < np.inf, f"{source}: mesh/thickness is {mesh.depth:g}")
    if group.attrs.get("symmetry") != "axial":
        return mesh
    kind_of_ring = TwistedRingMesh if group.attrs.get("components") == 3 else RingMesh
    return kind_of_ring(
        **{key.name: getattr(mesh, key.name) for key in fields(as_curve(mesh)) if key.init}
    )


def _curve(
    vertices: Array,
    elements: Index,
    arrays: Keyed,
    names: tuple[str, ...],
    unit_length: float,
    source: str,
) -> CurveMesh:
    demand_range(elements, len(vertices), f"{source}: mesh/elements")
    powers = arrays.get("power", np.zeros(1))
    demand(
        powers.dtype.kind == "f" and bool(np.all(np.abs(powers) < 1.0)),
        f"{source}: mesh/power must be below 1",
    )
    start, end = vertices[elements[:, 0]], vertices[elements[:, 1]]
    demand(bool(np.all(np.any(start != end, axis=1))), f"{source}: mesh: an element has no length")
    return CurveMesh(start=start, end=end, part_names=names, unit_length=unit_length, **arrays)


def _surface(
    vertices: Array,
    elements: Index,
    arrays: Keyed,
    names: tuple[str, ...],
    unit_length: float,
    source: str,
) -> SurfaceMesh:
    demand_range(elements + 1, len(vertices) + 1, f"{source}: mesh/elements")
    demand(
        bool(np.all(elements[:, :3] >= 0)),
        f"{source}: mesh/elements has a panel of fewer than three corners",
    )
    demand_range(arrays["order"], HIGHEST_ORDER + 1, f"{source}: mesh/order")
    count, middles = len(elements), arrays.get("middles", np.full((len(elements), 5), -1))
    demand(
        middles.shape == (count, 5),
        f"{source}: mesh/middles has shape {middles.shape}, not ({count}, 5)",
    )
    demand_range(middles + 1, len(vertices) + 1, f"{source}: mesh/middles")
    whole = np.where(elements[:, 3:] < 0, np.arange(5) < 3, True)
    demand(
        bool(np.all((middles >= 0) == (whole & (middles[:, :1] >= 0)))),
        f"{source}: mesh/middles has gaps",
    )
    corners, between = (
        np.where(numbers[..., None] >= 0, vertices[numbers], np.nan)
        for numbers in (elements, middles)
    )
    return SurfaceMesh(corners, arrays["order"], arrays["part"], names, between)


def demand_range(values: AnyArray, count: int, name: str) -> None:
    """Refuse values that are not whole numbers from 0 to count - 1."""
    whole = values.dtype.kind in "iu" and (
        not values.size or (values.min() >= 0 and values.max() < count)
    )
    demand(bool(whole), f"{name} must be whole numbers below {count}")


def demand(holds: bool, message: str) -> None:
    """Refuse a file that does not satisfy a condition."""
    if not holds:
        raise ResultError(message)
