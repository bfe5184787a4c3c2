"""The operators of a problem in public: G and H of each body, S and u_0 of the contact, and elastic
solutions by them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ..arrays import Array
from ..bem.particular.volume import volume_solution
from ..compliance.body.eliminated import ElasticBody
from ..compliance.interface import slices
from ..compliance.reduced_bodies import BodiesSystem
from ..errors import InputError, the_body
from ..fields.stress_state import StressState
from ..linalg.dense_matrix import distributed
from ..mesh.boundary_mesh import BoundaryMesh
from ..model.problem import Problem
from ..record import record
from ..results.body_fields import BodyFields
from ..results.records import BodyResult
from ..runtime.petsc import options
from ..runtime.ranks import begin_together
from ..runtime.world import world
from ..untyped import ArrayLike, Comm, Keyed, Mat
from .eliminate import eliminated
from .pose.discretise import Discrete, discretise
from .run import described
from .solve import posed


@record
class BodyOperators:
    """One body: ½u + Hu = Gt at its n nodes, and what follows from it for contact tractions at m of
    them.

    Component c of node i is d i + c.

    Attributes
    ----------
    name : str
    mesh : BoundaryMesh
        With x, normal (n, d), weight (n,), nodes_of(part).
    eliminated : ElasticBody
        Its u_0 (K, m, k) and compliance (k m, k m) in the k contact directions `data.contact_frame`
        of the nodes `contact`.
    """

    name: str
    mesh: BoundaryMesh
    eliminated: ElasticBody
    _problem: Problem
    _number: int

    @functools.cached_property
    def G(self) -> Array:
        """Single layer: tractions to displacements, (d n, d n) [length/stress]."""
        return self._matrices[0]

    @functools.cached_property
    def H(self) -> Array:
        """Double layer, the principal value without ½ I, (d n, d n) [-]."""
        return self._matrices[1]

    @functools.cached_property
    def _matrices(self) -> tuple[Array, Array]:
        operators, d, n = self.eliminated.operators, self.mesh.components, self.mesh.n_nodes
        if not self._problem.outline(self._number).has_inside:
            raise InputError(
                f"{the_body(self.name)} is a superelement: it has no boundary integral operators"
            )
        single, double = np.zeros((n, d, n, d)), np.zeros((n, d, n, d))
        targets = self.mesh.targets(slice(None))
        for batch in self.mesh.batches():
            kernel_g, kernel_h = operators.kernel.integrals(targets, batch.elements)
            for whole, kernel in ((single, kernel_g), (double, kernel_h)):
                whole[:, :, batch.nodes] = kernel.transpose(3, 0, 2, 1)
        return single.reshape(d * n, -1) / operators.traction_scale, double.reshape(d * n, -1)

    def solve(
        self, sigma: ArrayLike | None = None, state: int = -1, alpha: ArrayLike | None = None
    ) -> tuple[Array, Array]:
        """Displacement [length] and traction [stress] (n, d) on the boundary under the loads and
        given contact tractions.

        Parameters
        ----------
        sigma : (m, k) array, optional
            Tractions in the contact directions, zero by default [stress].
        state : int
            0 is without loads, k the end of step k; the last one by default.
        alpha : (r,) array, optional
            Amplitudes of the rigid motions `eliminated.modes` that only contact holds.
        """
        body = self.eliminated
        shares = np.eye(len(body.u_0))[state]
        pushed = (
            np.zeros(body.data.contact_shape) if sigma is None else np.asarray(sigma, dtype=float)
        )
        return body.boundary(
            shares,
            pushed.reshape(body.data.contact_shape),
            np.zeros(body.modes.shape[2]) if alpha is None else np.asarray(alpha),
        )

    def state_at(
        self, points: ArrayLike, u: Array, traction: Array, step: int | None = None
    ) -> StressState:
        """Displacement and stress at points (q, d) inside or on the boundary, with the loads inside
        of the body at the end of a step, the last one by default; see `Solution.state_at`."""
        mesh, body = self.mesh, self._problem.bodies[self._number]
        volume, elsewhere = volume_solution(body, mesh), np.full(mesh.n_nodes, -1)
        shares = {step or len(body.loads): 1.0}
        return BodyFields(body, mesh, BodyResult(u, traction), volume, elsewhere, shares).at(points)

    def petsc(self, name: str, comm: Comm = None) -> Mat:
        """G, H or S of the contact directions as a dense PETSc Mat by rows over the ranks.

        Raises
        ------
        InputError
            If there is no such operator.
        """
        return distributed(
            _named(
                name,
                {"G": lambda: self.G, "H": lambda: self.H, "S": lambda: self.eliminated.compliance},
            ),
            comm,
        )


@record
class Operators:
    """What the bodies of a problem do at its M contact nodes: v = u_0 + Sσ + Mα - gap, Eσ + f = 0.

    σ are the tractions on the secondaries, v the relative displacement, in the k directions of each
    node: tangents, then, unless all contact is bilateral under a given bound, the normal. Component
    c of node i is k i + c.

    Attributes
    ----------
    problem : Problem
    bodies : dict of BodyOperators by name
    pairs : dict of slices by name
        The nodes of each interface; by the name of its part against fixed ground.
    x, normal : (M, d) arrays
        Nodes [length], and unit normals from the secondary to the primary.
    frame : (M, k, d) array
        The directions.
    weight, gap : (M,) arrays
        Quadrature weights [length, in space area], initial gaps [length].
    states : (K, M, k) array
        v without contact tractions and gap: without loads, then at the end of each step [length].
    modes : (k M, r) array
        M: rigid motions that only contact holds [-].
    balance : (r, k M) array
        E.
    resultant : (K, r) array
        f.
    """

    problem: Problem
    bodies: dict[str, BodyOperators]
    pairs: dict[str, slice]
    x: Array
    normal: Array
    frame: Array
    weight: Array
    gap: Array
    states: Array
    modes: Array
    balance: Array
    resultant: Array
    _system: BodiesSystem

    @functools.cached_property
    def S(self) -> Array:
        """The compliance of the contact, (k M, k M) [length/stress]; of compressed bodies by a
        product a column."""
        return np.asarray(self._system.operator.matrix())

    @property
    def u_0(self) -> Array:
        """v under the loads of the last state without contact tractions and gap, (M, k)
        [length]."""
        return np.asarray(self.states[-1])

    @property
    def body(self) -> BodyOperators:
        """The only body.

        Raises
        ------
        InputError
            If there are several.
        """
        if len(self.bodies) > 1:
            raise InputError(f"body: there are several, .bodies has {', '.join(self.bodies)}")
        return next(iter(self.bodies.values()))

    def apply(self, sigma: ArrayLike) -> Array:
        """S σ, (M, k) [length], without forming S."""
        if not len(self.x):
            raise InputError("apply: no part is in contact")
        return np.asarray(
            self._system.operator.apply(np.asarray(sigma, dtype=float).reshape(len(self.x), -1))
        )

    def petsc(self, name: str = "S", comm: Comm = None) -> Mat:
        """S as a dense PETSc Mat by rows over the ranks."""
        return distributed(_named(name, {"S": lambda: self.S}), comm)

    def close(self) -> None:
        """Free PETSc objects, if there are any."""
        self._system.close()


def operators(problem: Problem | str | Path, comm: Comm = None) -> Operators:
    """The operators of a problem, of any dimension, number of bodies and kind of contact, or
    without contact.

    Parameters
    ----------
    problem : Problem, or path of a TOML file
        Plane bodies without `[mesh]` get their default mesh.
    comm : PETSc.Comm, optional
        PETSc.COMM_WORLD by default.

    Returns
    -------
    Operators

    Raises
    ------
    InputError
        If the problem is ill-posed, or another one on another rank.
    SolverError
        If a body cannot be eliminated.
    RanksError
        If another rank does not begin within 60 s (PETCONTACT_PATIENCE).

    Examples
    --------
    >>> import numpy as np
    >>> from petcontact import Displacement, Material, MeshOptions, Problem, Rectangle, Traction
    >>> from petcontact import operators
    >>> bar = Problem(
    ...     material=Material(1000.0, 0.3, "stress"),
    ...     geometry=Rectangle((0, 0), (4, 1)),
    ...     mesh=MeshOptions(0.5, order=2),
    ...     boundary=[
    ...         Displacement("left", (0, "free")),
    ...         Traction("right", (1, 0)),
    ...         Traction("top", (0, 0)),
    ...         Displacement("bottom", ("free", 0)),
    ...     ],
    ... )
    >>> body = operators(bar).body
    >>> u, t = body.solve()
    >>> bool(np.allclose(0.5 * u.ravel() + body.H @ u.ravel(), body.G @ t.ravel(), atol=1e-9))
    True
    >>> np.round(body.state_at([[2.0, 0.5]], u, t).stress, 6) + 0.0
    array([[1., 0., 0.]])
    """
    given = problem

    def call() -> Callable[[], Mapping[str, object]]:
        nonlocal problem
        problem, _ = posed(given, None, None)
        return functools.partial(described, problem)

    begin_together(comm, call)
    assert isinstance(problem, Problem)
    comm = comm if comm is not None else world()
    with options(problem.petsc):
        discrete = discretise(problem)
        system = eliminated(discrete, comm)
    named = {
        body.name: BodyOperators(body.name, mesh, elastic, problem, b)
        for b, (body, mesh, elastic) in enumerate(
            zip(problem.body, discrete.meshes, system.bodies, strict=True)
        )
    }
    return _of(discrete, system, named)


def _of(discrete: Discrete, system: BodiesSystem, bodies: dict[str, BodyOperators]) -> Operators:
    faces, d = discrete.interfaces, discrete.meshes[0].components
    x, normal, frame = (
        np.concatenate([np.zeros((0, *shape)), *parts])
        for shape, parts in (
            ((d,), [discrete.meshes[face.body].x[face.nodes] for face in faces]),
            ((d,), [face.normal for face in faces]),
            ((system.k, d), [face.directions for face in faces]),
        )
    )
    return Operators(
        discrete.problem,
        bodies,
        slices(faces),
        x,
        normal,
        frame,
        system.weight,
        system.gap,
        system.base.reshape(len(system.base), system.size, system.k),
        system.modes,
        system.balance,
        system.resultant,
        system,
    )


def _named(name: str, there: Keyed) -> Array:
    if name not in there:
        raise InputError(f"no operator {name!r}; there are {', '.join(there)}")
    matrix = there[name]()
    if matrix is None:
        raise InputError(
            f"{name}: the body is compressed; take its products, or bem.mat_type = 'dense'"
        )
    return np.asarray(matrix)
