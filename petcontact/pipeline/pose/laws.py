"""Laws of friction and wear at the nodes of all interfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...arrays import Array, Mask
from ...compliance.interface import Interface, slices
from ...contact.law_protocol import ContactLaw
from ...contact.laws import STEEP, SignoriniCoulomb, Tresca
from ...contact.methods.registry import ContactNodes, law_of
from ...errors import InputError
from ...given.interfaces import PosedInterface
from ...mesh.boundary_mesh import BoundaryMesh


def with_law(
    given: Any,
    sides: Sequence[PosedInterface],
    interfaces: list[Interface],
    meshes: list[BoundaryMesh],
) -> tuple[list[Interface], ContactLaw]:
    """Return the law, and interfaces with as many contact directions as the law has components.

    A law of the user may have the normal component.
    """
    if not interfaces:
        return interfaces, Tresca(np.zeros(0), meshes[0].components - 1)
    if given is None:
        return interfaces, law_between(sides, interfaces, meshes)
    nodes = _contact_nodes(sides, interfaces, meshes)
    wanted = getattr(given, "k", None) if hasattr(given, "project") else given(nodes).k
    if interfaces[0].held and wanted == meshes[0].components:
        interfaces = [replace(face, held=False) for face in interfaces]
        nodes = _contact_nodes(sides, interfaces, meshes)
    return interfaces, law_of(given, nodes)


def _contact_nodes(
    sides: Sequence[PosedInterface], interfaces: list[Interface], meshes: list[BoundaryMesh]
) -> ContactNodes:
    return ContactNodes(
        np.concatenate([meshes[face.body].x[face.nodes] for face in interfaces]),
        np.concatenate([face.normal for face in interfaces]),
        np.concatenate([meshes[face.body].weight[face.nodes] for face in interfaces]),
        slices(interfaces),
        law_between(sides, interfaces, meshes),
    )


def law_between(
    sides: Sequence[PosedInterface], interfaces: list[Interface], meshes: list[BoundaryMesh]
) -> ContactLaw:
    """Return the law that the config names, at the nodes of all interfaces.

    Raises
    ------
    InputError
        If a coefficient or bound is negative.
    """
    parts: list[tuple[Array, Array, Mask, Mask]] = []
    for side, interface in zip(sides, interfaces, strict=True):
        m, law, absent = len(interface.nodes), side.law, ~np.isfinite(interface.gap)
        mu, bound = (
            _not_negative(side, interface, meshes, key)
            for key in ("friction_coefficient", "friction_bound")
        )
        if bound is None:
            bound = np.full(m, np.inf if mu is not None or law.normal == "bonded" else 0.0)
        bound = np.where(absent, 0.0, bound)
        opens = np.full(m, law.normal == "unilateral")
        steep = np.where(opens & (bound > 0.0) & np.isfinite(bound), STEEP, np.inf)
        parts.append(
            (
                steep if mu is None else mu,
                bound,
                opens,
                absent,
            )
        )
    coefficient, bound, opens, absent = (
        np.concatenate(values) for values in zip(*parts, strict=True)
    )
    if interfaces[0].held:
        return Tresca(bound, meshes[0].components - 1)
    return SignoriniCoulomb(coefficient, bound, opens, meshes[0].components, absent)


def wear_between(
    sides: Sequence[PosedInterface], interfaces: list[Interface], meshes: list[BoundaryMesh]
) -> Array:
    """Return the coefficient of Archard's law at the nodes of all interfaces, (M,) [1/stress].

    Raises
    ------
    InputError
        If a coefficient is negative.
    """
    coefficients = [
        _not_negative(side, face, meshes, "wear_coefficient")
        for side, face in zip(sides, interfaces, strict=True)
    ]
    parts = [
        np.zeros(len(face.nodes)) if values is None else values
        for face, values in zip(interfaces, coefficients, strict=True)
    ]
    return np.concatenate([np.zeros(0), *parts])


def _not_negative(
    side: PosedInterface, interface: Interface, meshes: list[BoundaryMesh], key: str
) -> Array | None:
    """Return the values (m,) of one key of an interface's law; None if the key is not given."""
    datum, mesh, nodes = getattr(side.law, key), meshes[side.body], interface.nodes
    if datum is None:
        return None
    values = np.asarray(datum.at(mesh.sites(nodes)))
    if np.any(values < 0.0):
        k = int(np.argmin(values))
        position = ", ".join(
            f"{name} = {coordinate:g}"
            for name, coordinate in zip("xyz", mesh.x[nodes[k]], strict=False)
        )
        raise InputError(f"{side.key}.{key}: must be >= 0, is {values[k]:g} at {position}")
    return values
