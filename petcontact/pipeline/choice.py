"""Which kind of operator `mat_type = "auto"` takes: the one that is predicted to cost less."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh, RingMesh
from ..model.problem import Problem
from ..model.solver_options import Bem
from ..runtime.memory import physical_memory
from ..runtime.petsc import given_options, option

SMALLEST = 1200
"""Nodes up to which operators are dense: nothing is to be gained."""
SMALLEST_SURFACE = 700
"""The same in space."""
WORTH = 2.0
"""Dense surfaces, which hold more digits, may cost so much more. Two bodies of 738 nodes each, 441
in contact, pressed and pushed, took 1.4 s dense and 2.4 s compressed (1e-4), of 1008 nodes 3.4 and
3.4 s, of 1485 nodes 8.3 and 6.1 s."""
LARGEST = 12_000
"""Nodes up to which a compression that went wrong is replaced by dense operators (4.6 GB)."""
# Seconds of processor time on one core, measured with boxes, graded boxes and plates with ten holes
# of 1000 to 3600 nodes.
ENTRY, FLOP = 1.4e-7, 1.4e-10
"""A dense system of n unknowns over two takes ENTRY n² + FLOP n³, in space as in the plane."""
EVEN, UNEVEN = 1.5e-4, 1e-3
"""A compressed one takes so much a node: of elements of about one length on few curves; graded, or
of many holes."""
SURFACE = 1.2e-3
"""The same for surfaces in space, with the preconditioner: two boxes of 3568 to 14 368 nodes took
1e-3 to 1.6e-3."""
DIGIT = 1.4
"""A digit more of the tolerance than 1e-4 takes so many times as long: 9000 nodes 5.3 s at 1e-3,
9.0 s at 1e-4, 5760 11.7 s at 1e-6."""
IN_SPACE = 2.0
"""Dense systems in space take so much longer than plane ones as large: their kernels cost more."""
INCREMENT = (0.2, 0.4)
"""Time of an increment over that of the elimination, dense and compressed, in space: 0.35 to 0.6 of
pairs of 1485 to 8253 nodes each, 0.3 to 0.5 of one body and of pairs of 2970 to 30 042 nodes in
all."""
FREE = 0.13
"""More for each rigid motion of a compressed body that only contact holds, which is a column of the
preconditioner in every Newton step: 1.1 to 1.5 times the elimination with three and six motions."""
SHARED, ALONE = 3e-5, 600
"""The same a node on straight stretches of equal elements, beyond the first of each, whose clusters
share their blocks."""
IN_PLANE = 1.0
"""Time of an increment over that of the elimination in the plane: 0.3 by Newton's method, 0.8 to
2.6 by projection."""
CURVE_NODE, SHARED_NODE, SURFACE_NODE, SURFACE_CONTACT = 2.5e4, 2e3, 6e4, 7e4
"""Memory of compressed operators of curves (on stretches as above), and of surfaces with their
preconditioner, a node, and more a node in contact [bytes]; measured ones of 2970 to 29 160 nodes,
of tolerance 1e-3 and 1e-4, were within a fifth."""
TIGHTEST, LOOSEST = 1e-6, 1e-3
"""Tolerances of compressed surfaces that an adaptive solve chooses."""
FINER = 5e-3
"""Such a tolerance over the wanted error of tractions: elastic residuals are about as large as
tolerances, errors of p from them some times larger."""
NEWTON = 5
"""Matrices of the size of S that a Newton step holds, S among them."""
OVERHEAD = 5e7
"""Of PETSc and of blocks of integrals [bytes]."""
RATIO, CURVES = 30.0, 3
"""Largest ratio of node weights, and number of curves, that count as even."""


def dense_seconds(n_nodes: int, dim: int = 2) -> float:
    """Predicted time to assemble and factorise dense operators."""
    size = 0.5 * dim * n_nodes
    return (IN_SPACE if dim == 3 else 1.0) * (ENTRY * size**2 + FLOP * size**3)


def compressed_seconds(mesh: BoundaryMesh) -> float:
    """Predicted time to build and factorise compressed operators."""
    if not isinstance(mesh, CurveMesh):
        return SURFACE * mesh.n_nodes
    steps = np.linalg.norm(np.diff(mesh.x, axis=0), axis=1)
    # from curve to curve nodes are further apart than before and after
    around = np.maximum(np.append(steps[1:], 0.0), np.append(0.0, steps[:-1]))
    curves = 1 + np.count_nonzero(steps > 3.0 * around)
    even = mesh.measure.max() <= RATIO * mesh.measure.min() and curves <= CURVES
    return (EVEN if even else UNEVEN) * mesh.n_nodes


def shared_nodes(mesh: CurveMesh) -> int:
    """Nodes whose clusters of compressed operators share the blocks of others."""
    from ..compliance.body.stretches import repeated, runs

    counts = [
        int(mesh.first_node[last] - mesh.first_node[first])
        for first, last in runs(mesh, repeated(mesh))
    ]
    return sum(max(0, count - ALONE) for count in counts)


def predicted_seconds(bem: Bem, mesh: BoundaryMesh) -> float:
    """Processor time of assembly and factorisation."""
    if not is_compressed(bem, mesh):
        return dense_seconds(mesh.n_nodes, mesh.dim)
    if isinstance(mesh, CurveMesh):
        shared = shared_nodes(mesh)
        return SHARED * shared + compressed_seconds(mesh) * (1.0 - shared / mesh.n_nodes)
    return compressed_seconds(mesh) * float(DIGIT ** -math.log10(bem.hmatrix_tol / 1e-4))


def solve_seconds(
    bem: Bem, meshes: Sequence[BoundaryMesh], increments: int, motions: int = 0
) -> float:
    """Processor time [s] of elimination and some increments of bodies of which contact alone holds
    so many motions."""
    large = [is_compressed(bem, mesh) for mesh in meshes]
    seconds = sum(predicted_seconds(bem, mesh) for mesh in meshes)
    share = INCREMENT[any(large)] + FREE * motions * any(large) if meshes[0].dim == 3 else IN_PLANE
    return seconds * (1.0 + increments * share)


def compressed_memory(mesh: BoundaryMesh, contact: int) -> float:
    """Predicted memory of compressed operators [bytes]."""
    if isinstance(mesh, CurveMesh):
        shared = shared_nodes(mesh)
        return SHARED_NODE * shared + CURVE_NODE * (mesh.n_nodes - shared)
    return SURFACE_NODE * mesh.n_nodes + SURFACE_CONTACT * contact


def dense_memory(unknowns: Sequence[int], contact: Sequence[int], total: int) -> float:
    """Predicted peak of dense elimination and of a Newton step [bytes]; measured ones were within a
    tenth.

    Of a body with q unknowns and m of contact the factors, contact columns and S stay, and while
    they are made once more the columns and S; a Newton step holds S of all `total` contact
    unknowns, the block of closed ones, and its factors.
    """
    stays = sum(q * q + m * q + 2 * m * m for q, m in zip(unknowns, contact, strict=True))
    made = max((m * q + m * m for q, m in zip(unknowns, contact, strict=True)), default=0)
    return 8.0 * (stays + max(made, NEWTON * total * total)) + OVERHEAD


def check_memory(
    unknowns: Sequence[int],
    contact: Sequence[int],
    total: int,
    compressed: float = 0.0,
) -> float:
    """The memory that dense bodies and compressed ones take together
    [bytes].

    Raises
    ------
    InputError
        If the predicted peak is larger than the memory.
    """
    needed, there = (
        compressed + (dense_memory(unknowns, contact, total) if unknowns else 0.0),
        physical_memory(),
    )
    if needed > there and not unknowns:
        raise InputError(
            f"mesh: the compressed operators of all bodies take about {needed / 1e9:.3g} GB, this "
            f"machine has "
            f"{there / 1e9:.3g}; use larger elements"
        )
    if needed > there:
        raise InputError(
            f"mesh: dense operators of {sum(unknowns)} unknowns, {total} of contact, take "
            f"{needed / 1e9:.3g} GB, this machine has {there / 1e9:.3g}; use larger elements, or "
            f"compression "
            "where there is one"
        )
    return needed


def needed_memory(
    bem: Bem, meshes: Sequence[BoundaryMesh], contact: Sequence[int], total: int, directions: int
) -> float:
    """What `check_memory` gives of bodies with so many contact nodes, of the secondaries `total`,
    in k directions each."""
    small = [b for b, mesh in enumerate(meshes) if not is_compressed(bem, mesh)]
    large = sum(
        compressed_memory(mesh, contact[b]) for b, mesh in enumerate(meshes) if b not in small
    )
    return check_memory(
        [meshes[b].x.size for b in small],
        [directions * contact[b] for b in small],
        directions * total if small else 0,
        compressed=large,
    )


def is_compressed(bem: Bem, mesh: BoundaryMesh) -> bool:
    """Whether operators are compressed.

    Raises
    ------
    InputError
        If the compression of curves is asked for in space, or that of surfaces in the plane.
    """
    if isinstance(mesh, RingMesh):
        if bem.mat_type in ("hodlr", "hmatrix"):
            raise InputError(
                f'bem.mat_type: "{bem.mat_type}" does not compress bodies of revolution, whose '
                'curves are short; choose "auto" or "dense"'
            )
        return False
    curve = isinstance(mesh, CurveMesh)
    if bem.mat_type == "hodlr" and not curve:
        raise InputError(
            'bem.mat_type: "hodlr" compresses boundaries of plane bodies; choose "auto", "hmatrix" '
            'or "dense"'
        )
    if bem.mat_type == "hmatrix" and curve:
        raise InputError(
            'bem.mat_type: "hmatrix" compresses surfaces in space; choose "auto", "hodlr" or '
            '"dense"'
        )
    if bem.mat_type != "auto":
        return bem.mat_type != "dense"
    if mesh.n_nodes <= (SMALLEST if curve else SMALLEST_SURFACE):
        return False
    dense, compressed = dense_seconds(mesh.n_nodes, mesh.dim), compressed_seconds(mesh)
    if curve:
        return compressed < dense
    whole, parts = (
        seconds * (1.0 + more) for seconds, more in zip((dense, compressed), INCREMENT, strict=True)
    )
    return WORTH * parts < whole


def has_compressed(bem: Bem, meshes: Iterable[BoundaryMesh]) -> bool:
    """Whether operators of any body are compressed."""
    bem = resolved_bem(bem)
    return any(is_compressed(bem, mesh) for mesh in meshes)


def suitable_bem(problem: Problem, meshes: Sequence[BoundaryMesh]) -> Bem:
    """`[bem]` of a problem, dense where a part in space is the secondary of two interfaces.

    Compressed surfaces are not made for such parts. A storage that is named stays.
    """
    secondaries, bem = [i.ends[0] for i in problem.interfaces], problem.bem
    twice = len(set(secondaries)) < len(secondaries) and meshes[0].dim > 2
    return bem.model_copy(update={"mat_type": "dense"}) if twice and bem.mat_type == "auto" else bem


def contact_sizes(problem: Problem, meshes: Sequence[BoundaryMesh]) -> tuple[list[int], int]:
    """Nodes of each body on parts that may touch, and those of all secondaries."""
    ends = {end for interface in problem.interfaces for end in interface.ends}
    nodes = {(b, part): len(meshes[b].nodes_of(part)) for b, part in ends}
    touching = [sum(n for (b, _), n in nodes.items() if b == k) for k in range(len(meshes))]
    return touching, sum(nodes[interface.ends[0]] for interface in problem.interfaces)


def chosen_tolerance(bem: Bem, accuracy: float) -> float:
    """Tolerance of compressed surfaces for an error of the solution; NaN where one is given, which
    then stays [-]."""
    if "hmatrix_tol" in bem.model_fields_set or option("bem_hmatrix_tol") is not None:
        return math.nan
    return min(max(FINER * accuracy, TIGHTEST), LOOSEST)


def resolved_bem(bem: Bem) -> Bem:
    """`[bem]` with its -bem_ options over it."""
    everything = given_options()
    names = (
        [name for name in type(bem).model_fields if f"bem_{name}" in everything]
        if everything
        else []
    )
    if not names:
        return bem
    given = {name: option(f"bem_{name}") or "" for name in names}
    values: dict[str, Any] = {**bem.model_dump()}
    for name, text in given.items():
        try:
            values[name] = (
                text if name == "mat_type" else float(text) if name.endswith("_tol") else int(text)
            )
        except ValueError:
            raise InputError(f"-bem_{name}: {text!r} is not a number") from None
    try:
        return Bem(**values)
    except InputError as error:
        raise InputError(f"-bem_{error}") from None
