"""Bodies eliminated, each on the storage that suits it, and composed to the contact problem."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..bem.kernels import kernel_for
from ..bem.operators import BoundaryOperators
from ..compliance.body.dense import DenseBody
from ..compliance.body.eliminated import ElasticBody
from ..compliance.reduced_bodies import BodiesSystem
from ..errors import InputError, SolverError
from ..geometry.condensed_surface import CondensedSurface
from ..geometry.surface import Boundary
from ..given.tables.solver_options import Bem
from ..runtime.memory import resident_memory
from ..untyped import Comm
from .choice import (
    LARGEST,
    USUAL,
    Newton,
    check_memory,
    compression_of,
    has_compressed,
    needed_memory,
    resolved_bem,
    solve_seconds,
)
from .judge.findings import limit_of
from .pose.discretise import Discrete

SAFE = 0.1
"""Share of the largest accepted elastic residual above which compressed operators are replaced by
dense ones."""
FORMED = 1000
"""Contact unknowns up to which S of a compressed body is formed, where T alone does not find the
sets of contact."""
MOST_NODES = 2000
"""Largest number of contact nodes for which the linear program of equilibrium costs less than a
dense solve, and a step on H-matrices less than their assembly. The program is then solved first,
else only after a failure, and the error of the path is estimated. A joint solve always costs
more than the program."""
PATHS, UNNAMED, SOUGHT = 3, 8, 7
"""Increments of all paths over those of a step: two more paths have about as many, and half of
them. A step that names none is solved with 1, 4 and often 16. Where a contact slides at the end of
one, so many loads are tried for each: 67 of a disc that is pressed and turned, 74 of a box."""
FINISHED = 1.2
"""Processor time of a solve with errors and stresses over that of its increments. The told time of
five problems in space was then 0.5 to 1.9 of what they took."""
Progress = Callable[[float], None]
"""Called with the share of a matrix that is built."""
Announce = Callable[[int, int, float, float], Progress]
"""Called with nodes, unknowns, predicted processor seconds of the whole solve and bytes; what it
returns is called with the share of the matrix that is built."""


def silent(share: float) -> None:
    """A progress callback that reports nothing."""


def eliminated(
    discrete: Discrete,
    comm: Comm,
    cases: int = 1,
    announce: Announce | None = None,
    newton: Newton = USUAL,
) -> BodiesSystem:
    """Eliminate the bodies and compose them; the same on every rank.

    All ranks eliminate each body together.

    Parameters
    ----------
    discrete : Discrete
    comm : PETSc.Comm
    cases : int
        How many will be run on it: several may share more than one would.
    announce : callable, optional
    newton : Newton, optional
        What increments are expected to take.

    Raises
    ------
    InputError
        If the storage that is asked for is not for such a body, or does not fit the machine.
    SolverError
        If a body cannot be eliminated.
    """
    bem, meshes = resolved_bem(discrete.posed.bem), discrete.meshes
    progress = _announced(discrete, bem, announce, newton)
    if discrete.posed.method.formulation == "full":
        bodies: list[ElasticBody | None] = [_full(discrete, bem, comm)]
    else:
        bodies = [_compressed(discrete, b, bem, comm, progress) for b in range(len(meshes))]
    dense = [b for b, body in enumerate(bodies) if body is None]
    check_memory(*_sizes(discrete, dense), ranks=comm.getSize(), closed=newton.closed)
    for b in dense:
        bodies[b] = eliminated_alone(discrete, b, comm)
    complete = [body for body in bodies if body is not None]
    x = [meshes[i.body].x[i.nodes] for i in discrete.interfaces]
    centres = [np.array(o.centre_in(meshes[0].dim)) for o in discrete.posed.obstacles]
    if not any(body.is_solved_jointly for body in complete):
        return BodiesSystem(complete, discrete.interfaces, x, centres, comm, cases)
    from ..compliance.hierarchical.body import joined

    return BodiesSystem(complete, discrete.interfaces, x, centres, comm, cases, joined)


def _announced(discrete: Discrete, bem: Bem, announce: Announce | None, newton: Newton) -> Progress:
    """Refuse what does not fit the machine, and tell the size of what does."""
    meshes, nodes = discrete.meshes, sum(len(interface.nodes) for interface in discrete.interfaces)
    contact = [data.contact_shape for data in discrete.data]
    parts = [m for m, _ in contact]
    needed = needed_memory(bem, meshes, parts, nodes, contact[0][1], newton.closed)
    if announce is None:
        return silent
    costly = has_compressed(bem, meshes) and nodes > MOST_NODES
    seconds = FINISHED * solve_seconds(
        bem,
        meshes,
        [m * k for m, k in contact],
        nodes * contact[0][1],
        _increments(discrete, costly=costly),
        sum(free.shape[2] for free in discrete.motions),
        newton,
    )
    return announce(
        sum(mesh.n_nodes for mesh in meshes),
        sum(mesh.x.size for mesh in meshes),
        seconds,
        needed + resident_memory(),
    )


def _increments(discrete: Discrete, *, costly: bool) -> int:
    """Return about how many increments are solved, with those of other paths where friction makes
    the path matter and these are not too `costly`."""
    steps = discrete.posed.steps
    paths = not costly and any(side.rubs for side in discrete.posed.interfaces)
    counts = [1 if step.increments == "auto" else int(step.increments) for step in steps]
    if paths:
        counts = [
            UNNAMED if step.increments == "auto" or not step.is_divided else PATHS * count
            for step, count in zip(steps, counts, strict=True)
        ]
    tried = [SOUGHT if step.until else 1 for step in steps]
    return max(1, sum(map(int.__mul__, counts, tried)))


def _sizes(discrete: Discrete, some: list[int]) -> tuple[list[int], list[int], int]:
    """Unknowns of some bodies, those in contact, and those of all contacts."""
    directions = discrete.data[0].contact_shape[1] * sum(
        len(interface.nodes) for interface in discrete.interfaces
    )
    return (
        [discrete.meshes[b].x.size for b in some],
        [discrete.data[b].contact_directions.size for b in some],
        directions if some else 0,
    )


def operators_of(discrete: Discrete, number: int) -> tuple[BoundaryOperators, Array]:
    """The operators of a body, and the rigid motions (n, d, r) that no condition holds."""
    mesh, data, posed = discrete.meshes[number], discrete.data[number], discrete.posed
    kernel = kernel_for(mesh, posed.bodies[number].material, resolved_bem(posed.bem).quadrature_tol)
    return BoundaryOperators(mesh, data, kernel), discrete.motions[number]


def eliminated_alone(discrete: Discrete, number: int, comm: Comm) -> ElasticBody:
    """One body by dense operators, or as it is given."""
    return _alone(discrete.boundaries[number], *operators_of(discrete, number), comm)


@functools.singledispatch
def _alone(
    boundary: Boundary, operators: BoundaryOperators, modes: Array, comm: Comm
) -> ElasticBody:
    return DenseBody(operators, modes, comm)


@_alone.register
def _(
    boundary: CondensedSurface, operators: BoundaryOperators, modes: Array, comm: Comm
) -> ElasticBody:
    from ..compliance.body.superelement import SuperelementBody

    return SuperelementBody(operators, boundary)


def _full(discrete: Discrete, bem: Bem, comm: Comm) -> ElasticBody:
    from ..compliance.body.full import FullBody

    operators, modes = operators_of(discrete, 0)
    apart = not (discrete.boundaries[0].has_inside and discrete.interfaces)
    if len(discrete.meshes) > 1 or apart or not discrete.holds_normals or modes.shape[2]:
        raise InputError(
            'method.formulation: "full" is the paper\'s, for one body that is held, in bilateral '
            "contact with "
            'a friction bound; use "condensed"'
        )
    if bem.mat_type in ("hodlr", "hmatrix"):
        raise InputError(
            f'method.formulation: "full" is dense; use "condensed" with bem.mat_type = '
            f'"{bem.mat_type}"'
        )
    contact = discrete.data[0].contact_directions.size
    check_memory([discrete.meshes[0].x.size], [contact], contact, ranks=comm.getSize())
    return FullBody(operators, modes, comm)


def _compressed(
    discrete: Discrete, number: int, bem: Bem, comm: Comm, progress: Progress
) -> ElasticBody | None:
    """A body on compressed operators; None where dense ones are predicted, or found, to do
    better."""
    if not discrete.boundaries[number].has_inside:
        return None
    compression = compression_of(bem, discrete.meshes[number])
    return (
        COMPRESSED[compression.name](discrete, number, bem, comm, progress) if compression else None
    )


def _by_hmatrix(
    discrete: Discrete, number: int, bem: Bem, comm: Comm, progress: Progress
) -> ElasticBody | None:
    from ..compliance.hierarchical.body import HierarchicalBody

    return HierarchicalBody(*operators_of(discrete, number), bem, comm, progress)


def _by_hodlr(
    discrete: Discrete, number: int, bem: Bem, comm: Comm, progress: Progress
) -> ElasticBody | None:
    from ..compliance.body.hodlr import HodlrBody

    formed = 0 if discrete.holds_normals else FORMED
    build = functools.partial(HodlrBody, *operators_of(discrete, number), bem, comm, formed)
    if bem.mat_type == "hodlr" or discrete.meshes[number].n_nodes > LARGEST:
        return build()
    try:
        body = build()
    except SolverError:
        return None
    # what all loads and an even traction do satisfies the integral equations well enough
    shares, alpha = np.ones(len(body.u_0)), np.zeros(body.modes.shape[2])
    even = np.full(body.u_0.shape[1:], float(np.abs(body.data.value).max(initial=0.0)) or 1.0)
    u, traction = body.boundary(shares, even, alpha)
    residual = body.residual(shares, u, traction, even, alpha)
    return body if residual <= SAFE * limit_of("elastic residual") else None


COMPRESSED: dict[str, Callable[..., ElasticBody | None]] = {
    "hodlr": _by_hodlr,
    "hmatrix": _by_hmatrix,
}
"""What builds a body on each of `choice.COMPRESSIONS`."""
