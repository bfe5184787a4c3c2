"""Laws of friction and wear at the nodes of all interfaces."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Mask
from ...compliance.interface import Interface, slices
from ...contact.law_protocol import ContactLaw, GivenLaw
from ...contact.laws import STEEP, SignoriniCoulomb, Tresca
from ...contact.methods.registry import ContactNodes, law_of, made_law
from ...errors import InputError
from ...given.interface_data import FRICTION, Law, PosedInterface
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import record, replace


def with_law(
    given: GivenLaw | None,
    sides: Sequence[PosedInterface],
    interfaces: list[Interface],
    meshes: list[BoundaryMesh],
) -> tuple[list[Interface], Laws]:
    """Return the laws in all load states, and interfaces with as many contact directions as the
    law has components.

    A law of the user may have the normal component.
    """
    if not interfaces:
        none = np.zeros((1, 0))
        return interfaces, Laws(none, none, none[0], none[0], True, meshes[0].components)
    laws = laws_between(sides, interfaces, meshes)
    if given is None:
        return interfaces, laws
    if laws.changes:
        raise InputError("step: a law of your own has no friction that steps change")
    nodes = _contact_nodes(sides, interfaces, meshes)
    if interfaces[0].held and made_law(given, nodes).k == meshes[0].components:
        interfaces = [replace(face, held=False) for face in interfaces]
        nodes = _contact_nodes(sides, interfaces, meshes)
    return interfaces, replace(laws, own=law_of(given, nodes))


def _contact_nodes(
    sides: Sequence[PosedInterface], interfaces: list[Interface], meshes: list[BoundaryMesh]
) -> ContactNodes:
    return ContactNodes(
        np.concatenate([meshes[face.body].x[face.nodes] for face in interfaces]),
        np.concatenate([face.normal for face in interfaces]),
        np.concatenate([meshes[face.body].weight[face.nodes] for face in interfaces]),
        slices(interfaces),
        laws_between(sides, interfaces, meshes).last,
    )


@record
class Laws:
    """The law of friction in all load states, and in between.

    Attributes
    ----------
    coefficient, bound : (K, M) arrays
        Friction in each load state at the nodes of all interfaces; NaN where a bound alone is
        given, infinite where there is no bound [-], [stress].
    opens, absent : (M,) bool arrays
        Whether the parts may separate, and nodes that face nothing.
    held : bool
        Whether all normals are held.
    dim : int
        Components of a displacement.
    own : ContactLaw, optional
        The law of the user, in all states.
    """

    coefficient: Array
    bound: Array
    opens: Mask
    absent: Mask
    held: bool
    dim: int
    own: ContactLaw | None = None

    @functools.cached_property
    def changes(self) -> bool:
        """Whether a step changes the friction of the pair."""
        return any(
            not np.array_equal(values[:1].repeat(len(values), axis=0), values, equal_nan=True)
            for values in (self.coefficient, self.bound)
        )

    @functools.cached_property
    def last(self) -> ContactLaw:
        """The law at the end of the last step."""
        return self.own or self._law(self.coefficient[-1], self.bound[-1])

    def at(self, shares: Array) -> ContactLaw:
        """Return the law between load states, whose weights are (K,)."""
        if not self.changes:
            return self.last
        some = np.flatnonzero(shares)
        return self._law(shares[some] @ self.coefficient[some], shares[some] @ self.bound[some])

    def _law(self, coefficient: Array, bound: Array) -> ContactLaw:
        if self.held:
            return Tresca(bound, self.dim - 1)
        steep = np.where(self.opens & (bound > 0.0) & np.isfinite(bound), STEEP, np.inf)
        mu = np.where(np.isnan(coefficient), steep, coefficient)
        return SignoriniCoulomb(mu, bound, self.opens, self.dim, self.absent)


def laws_between(
    sides: Sequence[PosedInterface], interfaces: list[Interface], meshes: list[BoundaryMesh]
) -> Laws:
    """Return the laws that the config names, at the nodes of all interfaces.

    Raises
    ------
    InputError
        If a coefficient or bound is negative.
    """
    absent = [~np.isfinite(interface.gap) for interface in interfaces]
    opens = [
        np.full(len(face.nodes), side.law.normal == "unilateral")
        for side, face in zip(sides, interfaces, strict=True)
    ]
    limits = [_limits(*pair, meshes) for pair in zip(sides, interfaces, strict=True)]
    coefficient, bound = (np.concatenate(values, axis=1) for values in zip(*limits, strict=True))
    nowhere = np.concatenate(absent)
    return Laws(
        coefficient,
        np.where(nowhere, 0.0, bound),
        np.concatenate(opens),
        nowhere,
        interfaces[0].held,
        meshes[0].components,
    )


def _limits(
    side: PosedInterface, interface: Interface, meshes: list[BoundaryMesh]
) -> tuple[Array, Array]:
    """Return coefficient and bound (K, m) of an interface, see `Laws`; a contact that has friction
    in later steps only has a coefficient or a bound of 0 until then."""
    rows: dict[Law, tuple[Array, Array]] = {}
    for law in side.laws:
        if law in rows:
            continue
        mu, bound = (_not_negative(side, interface, meshes, law, key) for key in FRICTION)
        none = np.zeros(len(interface.nodes))
        if not law.has_friction and side.law.has_friction:
            mu = none if side.law.friction_coefficient is not None else None
            bound = none if side.law.friction_bound is not None else None
        endless = mu is not None or law.normal == "bonded"
        rows[law] = (
            none + np.nan if mu is None else mu,
            none + (np.inf if endless else 0.0) if bound is None else bound,
        )
    coefficient, limit = zip(*(rows[law] for law in side.laws), strict=True)
    return np.array(coefficient), np.array(limit)


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
        _not_negative(side, face, meshes, side.law, "wear_coefficient")
        for side, face in zip(sides, interfaces, strict=True)
    ]
    parts = [
        np.zeros(len(face.nodes)) if values is None else values
        for face, values in zip(interfaces, coefficients, strict=True)
    ]
    return np.concatenate([np.zeros(0), *parts])


def _not_negative(
    side: PosedInterface, interface: Interface, meshes: list[BoundaryMesh], law: Law, key: str
) -> Array | None:
    """Return the values (m,) of one key of an interface's law; None if the key is not given."""
    datum, mesh, nodes = getattr(law, key), meshes[side.body], interface.nodes
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
