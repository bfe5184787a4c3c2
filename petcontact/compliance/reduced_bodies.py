"""Bodies and rigid obstacles, reduced to the nodes of all contact interfaces: v = v_0 + S σ + M α,
E σ + f = 0.

σ is the traction on the secondary at its nodes, along k directions. These are d-1 tangents τ and
the normal n; if all interfaces hold their normals, the tangents alone. The primary carries -Jσ,
see `Interface.loads`. v is the displacement of the secondary relative to the primary along the same
directions; v_n is reduced by the initial gap. A rigid obstacle has S = 0. Its displacement is taken
at the secondary's node.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Array
from ..bem.boundary_data import BoundaryData
from ..contact.system import ContactSystem, Modes, Surrogate
from ..mesh.curve_mesh import CurveMesh, as_curve
from ..untyped import Comm
from .body.eliminated import ElasticBody
from .composed import ComposedSystem, Joint
from .contact_compliance import ContactCompliance, DenseCompliance, ProductCompliance
from .interface import ContactMaps, contact_maps, directions_looked_for, places, slices
from .interface import Interface as Interface
from .robin_solves import shared_by

if TYPE_CHECKING:
    from .layer.kernel import Strip


class BodiesSystem:
    """The contact problem of all interfaces.

    Parameters
    ----------
    bodies : sequence of ElasticBody
    interfaces : sequence of Interface
        Either all of them hold their normals or none does.
    x : sequence of (m, d) arrays
        Nodes of each interface [length].
    centres : sequence of (d,) arrays
        Centres of the obstacles [length].
    comm : PETSc.Comm
    cases : int
        Number of contact problems that will be solved. Several problems can share one reduction
        of S (`hessenberg`).
    join : callable, optional
        Returns a `Joint` from bodies, interfaces, maps and communicator. It is given if the
        storage needs all equations to be solved together.

    Attributes
    ----------
    interfaces, bodies : lists
    slices : list of slices
        The nodes of each interface among all M.
    components : int
        Number of displacement components at a node, one more than that of tangents.
    k : int
        Number of contact directions at a node.
    motions : Motions
        Rigid motions of bodies and obstacles of this kind.
    weight : (M,) array
        Node weights of the secondaries [length; area in space and for rings].
    gap : (M,) array
        Initial gap [length].
    operator : ContactCompliance
        S. Component c of node i has number k i + c; the tangential ones come first.
    base : (K, k M) array
        v in each load state, without contact tractions and gap [length].
    modes, balance : (k M, r), (r, k M) arrays
        M and E of the free motions of all bodies.
    resultant : (K, r) array
        f of the bodies in each load state.
    obstacle_modes : list of (k M, q) arrays
        v for unit displacements and unit rotations of each obstacle (see `Motions.every`), then
        for the overlap of each preloaded interface, by the first column. E is their transpose
        times the weights.
    """

    def __init__(
        self,
        bodies: Sequence[ElasticBody],
        interfaces: Sequence[Interface],
        x: Sequence[Array],
        centres: Sequence[Array],
        comm: Comm,
        cases: int = 1,
        join: Callable[
            [Sequence[ElasticBody], Sequence[Interface], Sequence[ContactMaps], object], Joint
        ]
        | None = None,
    ) -> None:
        self.bodies, self.interfaces = list(bodies), list(interfaces)
        mesh, none = bodies[0].mesh, np.zeros(0)
        self.components, self.motions = mesh.components, mesh.motions
        self.k = directions_looked_for(self.components, interfaces)
        self.slices = list(slices(interfaces).values())
        self.size = sum(len(face.nodes) for face in interfaces)
        self.weight = np.concatenate(
            [none, *(bodies[i.body].mesh.weight[i.nodes] for i in interfaces)]
        )
        self._maps = [
            contact_maps(number, self.bodies, interfaces) for number in range(len(self.bodies))
        ]
        self._x, self._layer = np.concatenate([mesh.x[:0], *x]), list[Surrogate]()
        self._joint = None if join is None else join(self.bodies, interfaces, self._maps, comm)
        self._softened: tuple[Array, ContactCompliance] | None = None
        mapped = list(zip(self._maps, self.bodies, strict=True))
        self.modes = np.concatenate(
            [maps.seen(body.contact_modes) for maps, body in mapped], axis=1
        )
        self.balance = np.concatenate([maps.felt(body.balance.T).T for maps, body in mapped])
        self._load()
        self.obstacle_modes = [
            self._obstacle_modes(k, centre, x) for k, centre in enumerate(centres)
        ]
        for where, face in zip(self.slices, interfaces, strict=True):
            if face.preloaded:
                mode = np.zeros((self.size, self.k, self.motions.components))
                mode[where, -1, 0] = 1.0
                self.obstacle_modes.append(mode.reshape(self.k * self.size, -1))
        self.operator = self._composed(comm, cases)

    def _load(self) -> None:
        """Compute gap, base and resultant from the loads, gaps and jumps."""
        states = self.bodies[0].data.states
        self.gap = np.concatenate([np.zeros(0), *(i.gap for i in self.interfaces)])
        self.base = np.zeros((states, self.k * self.size))
        for body, maps in zip(self.bodies, self._maps, strict=True):
            self.base += maps.seen(body.u_0.reshape(states, -1).T).T
        for where, face in zip(self.slices, self.interfaces, strict=True):
            if face.overlap is not None and not face.held:
                normals = slice(self.k * (where.start + 1) - 1, self.k * where.stop, self.k)
                self.base[:, normals] += face.overlap
            if face.jump is not None:
                columns = slice(self.k * where.start, self.k * where.stop)
                self.base[:, columns] += np.einsum(
                    "mtc,sc->smt", face.directions, face.jump
                ).reshape(states, -1)
        self.resultant = np.concatenate([body.resultant for body in self.bodies], axis=1)

    def loaded(
        self, data: Sequence[BoundaryData], interfaces: Sequence[Interface]
    ) -> BodiesSystem | None:
        """Return a system with the same S under other known values, gaps and jumps.

        Both share their PETSc objects; closing one closes both.

        Parameters
        ----------
        data : sequence of BoundaryData
            One for each body. A body whose data do not change has the same object as here.
        interfaces : sequence of Interface
            They may differ from those here in gaps and jumps only.

        Returns
        -------
        BodiesSystem or None
            None if a body must be eliminated again.
        """
        bodies = [
            body if new is body.data else body.with_data(new)
            for body, new in zip(self.bodies, data, strict=True)
        ]
        kept = [body for body in bodies if body is not None]
        if len(kept) < len(bodies) or (self._joint is not None and kept != self.bodies):
            return None
        system = copy.copy(self)
        system.bodies, system.interfaces = kept, list(interfaces)
        system._load()
        return system

    def _composed(self, comm: Comm, cases: int) -> ContactCompliance:
        if self._joint is not None:
            return self._joint.compliance(self.surrogate)
        if len(self.bodies) == 1:
            place = places(self.bodies[0], self.interfaces)
            if (own := self.bodies[0].contact_compliance(place, self.surrogate)) is not None:
                return own
        if any(body.compliance is None for body in self.bodies):
            motions = self.modes.shape[1] + sum(mode.shape[1] for mode in self.obstacle_modes)
            text = " and ".join(dict.fromkeys(body.describe() for body in self.bodies))
            products = ProductCompliance(
                self._apply, (self.size, self.k), motions, comm, self.surrogate, text
            )
            return shared_by(cases, products, self.base.shape[1], comm)
        dense = DenseCompliance(self._compliance(), comm, self.surrogate)
        return shared_by(cases, dense, self.base.shape[1], comm)

    def _compliance(self) -> Array:
        """S of all bodies; where it is that of the only one, not a copy of it."""
        if len(self.bodies) == 1 and self._maps[0].is_identity:
            return np.asarray(self.bodies[0].compliance)
        total = np.zeros((self.k * self.size, self.k * self.size))
        for body, maps in zip(self.bodies, self._maps, strict=True):
            maps.add_compliance(body.compliance, total)
        return total.T

    def _obstacle_modes(self, number: int, centre: Array, x: Sequence[Array]) -> Array:
        motions = [self.motions.every(points, centre) for points in x]
        result = np.zeros((self.size, self.k, self.motions.components))
        for where, face, moved in zip(self.slices, self.interfaces, motions, strict=True):
            if face.obstacle == number:
                result[where] = -np.einsum("mtc,mck->mtk", face.directions, moved)
        return result.reshape(self.k * self.size, -1)

    def increment_system(
        self, u_0: Array, modes: Modes, shares: Array, layer: Array | None = None
    ) -> ContactSystem:
        """Return the contact system of one increment.

        Parameters
        ----------
        u_0 : (M, k) array
            v for σ = 0 [length].
        modes : Modes
        shares : (K,) array
            Weights of the load states.
        layer : (M,) array, optional
            Compliance of a layer that yields to pressure [length/stress].
        """
        operator = self.operator if layer is None or not layer.any() else self._with(layer)
        if self._joint is not None:
            return self._joint.system(u_0, self.weight, modes, shares, operator)
        return ComposedSystem(u_0, self.weight, modes, operator)

    def _with(self, layer: Array) -> ContactCompliance:
        """Return S with a layer; the last result is stored."""
        if self._softened is None or not np.array_equal(self._softened[0], layer):
            if self._softened is not None:
                self._softened[1].close()
            self._softened = layer, self.operator.softened(layer)
        return self._softened[1]

    def _apply(self, sigma: Array) -> Array:
        """Return S σ (M, k) as the sum over bodies. Collective."""
        flat, result = sigma.ravel(), np.zeros(sigma.size)
        for body, maps in zip(self.bodies, self._maps, strict=True):
            result += maps.seen(body.apply(maps.carried(flat)))
        return result.reshape(sigma.shape)

    def surrogate(self) -> Surrogate | None:
        """Return the unscaled surrogate T in all directions, or None.

        On curves T is made of the layers of both bodies at each interface. On surfaces it is made
        of half spaces, if there are at most `LARGEST` nodes.
        """
        if not self._layer:
            from .half_space import LARGEST, HalfSpace
            from .layer.operator import LayerOperator

            if all(isinstance(body.mesh, CurveMesh) for body in self.bodies):
                measure = np.concatenate(
                    [self.bodies[i.body].mesh.measure[i.nodes] for i in self.interfaces]
                )
                self._layer.append(
                    LayerOperator(list(self._strips()), self.weight, self._x, measure)
                )
            elif max(self.size, *(len(body.contact) for body in self.bodies)) <= LARGEST:
                alone = len(self.bodies) == 1 and all(face.held for face in self.interfaces)
                self._layer.append(
                    HalfSpace(functools.cache(self._half_spaces), self.weight, predicts=alone)
                )
        return copy.copy(self._layer[0]) if self._layer else None

    def _half_spaces(self) -> Array:
        from .half_space import half_space

        identity = np.eye(self.k * self.size)
        total = np.zeros((self.k * self.size, self.k * self.size))
        for body, maps in zip(self.bodies, self._maps, strict=True):
            own = half_space(body.operators, body.contact, body.data.contact_frame)
            total += maps.seen(own @ maps.carried(identity))
        return total

    def _strips(self) -> Iterator[Strip]:
        from .layer.kernel import body_thickness, strips

        for where, face in zip(self.slices, self.interfaces, strict=True):
            others: tuple[tuple[float, float], ...] = ()
            if face.primary is not None and face.primary_nodes is not None:
                opposite = self.bodies[face.primary].operators
                thickness = body_thickness(as_curve(opposite.mesh), face.primary_nodes)
                others = ((opposite.kernel.half_space_compliance, thickness),)
            own_strips = strips(
                self.bodies[face.body].operators, face.nodes, face.directions, others
            )
            for strip in own_strips:
                yield replace(strip, nodes=strip.nodes + where.start)

    def weighted(self, modes: Array) -> Array:
        """Return E = MᵀW (q, k M) of an obstacle; E σ is the resultant of the tractions on it."""
        return np.ascontiguousarray((modes * np.repeat(self.weight, self.k)[:, None]).T)

    def tractions(self, number: int, sigma: Array) -> Array:
        """Return the tractions (m_c, k) along a body's contact directions, from σ (M, k)
        [stress]."""
        return self._maps[number].carried(sigma.ravel()).reshape(-1, self.k)

    def motion(self, number: int, alpha: Array) -> Array:
        """Return the part of α (r,) that belongs to one body."""
        ends = np.cumsum([0, *(body.modes.shape[2] for body in self.bodies)])
        return alpha[ends[number] : ends[number + 1]]

    def describe(self) -> str:
        """Return a text that names the storage of the bodies and the KSP of Robin solves."""
        stored = " and ".join(dict.fromkeys(body.describe() for body in self.bodies))
        return "; ".join(filter(None, [stored, self.operator.kind]))

    def close(self) -> None:
        """Free every PETSc object."""
        self.operator.close()
        if self._softened is not None:
            self._softened[1].close()
        for body in self.bodies:
            body.close()
