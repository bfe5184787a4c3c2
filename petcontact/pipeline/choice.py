"""Which kind of operator `mat_type = "auto"` takes: the one that is predicted to cost less."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ..arrays import Mask
from ..errors import InputError
from ..given.interface_data import PosedInterface
from ..given.posed import Posed
from ..given.sites import Sites
from ..given.tables.solver_options import Bem
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..mesh.ring_mesh import RingMesh, TwistedRingMesh
from ..mesh.surface_mesh import SurfaceMesh
from ..record import record
from ..runtime.memory import physical_memory
from ..runtime.petsc import given_options, option
from ..untyped import Keyed

LARGEST = 12_000
"""Nodes up to which a compression that went wrong is replaced by dense operators (4.6 GB)."""
# Seconds of processor time on one core, measured with boxes, graded boxes and plates with ten holes
# of 1000 to 3600 nodes.
ENTRY, FLOP = 1.4e-7, 1.4e-10
"""A dense system of n unknowns over two takes ENTRY n² + FLOP n³, in space as in the plane."""
EVEN, UNEVEN = 1.5e-4, 1e-3
"""Compressed curves take so much a node: of elements of about one length on few curves; graded, or
of many holes."""
SHARED, ALONE = 3e-5, 600
"""The same a node on straight stretches of equal elements, beyond the first of each, whose clusters
share their blocks."""
SLENDER = (3e-5, 1e-7, 750.0)
"""The same a node times the length of a strip over its thickness and times its square, and memory a
node times the first [bytes]. Its sides see each other all along: strips of 13 and 40 of it, 2400
nodes, took 1.2 and 3.3 s, of 200 and 400, 1206 and 2406 nodes, 8.2 and 68 s, 0.19 and 0.7 GB."""
CROWDED = 1.4e-4
"""The same a node and curve, times the shorter extent of a body over the longer one: halves of N
curves meet along √N of them in a square, and the work grows as the square of what meets. Plates
with 9, 49 and 100 holes of 816, 3248 and 6600 nodes took 1.6e-4, 1.1e-4 and 1.6e-4."""
RATIO, CURVES = 30.0, 3
"""Largest ratio of node weights, and number of curves, that count as even."""
CURVE_NODE, SHARED_NODE, SURFACE_NODE, PATCH_NODE = 2.5e4, 2e3, 6e4, 7.5e4
"""Memory of compressed operators of curves (on stretches as above), and of surfaces, a node, and of
the patches of their preconditioner, a secondary's node in contact with an obstacle [bytes].

A patch of n unknowns, o of them its own, holds entries and factors n² and rows of inverses n·o. It
has the nodes of a cluster of a secondary and those of the primary that face them, s nodes for one:
n and o are at most s times those at an obstacle, memory s². A primary is taken to have no more
nodes opposite than its secondary has. A box and a ball on obstacles took 6.4e4 and 7.6e4, two cubes
of 6534 nodes each three quarters of what this makes, a bolted plate of 8220 nodes 1.5 times it. Of
the peak before errors are judged .82 to 1.2 was announced; samples of gaps that are expressions add
up to .2 GB then, which nothing announces."""
SURFACE = 1.2e-3
"""Compressed surfaces take so much a node, with the preconditioner: two boxes of 3568 to 14 368
nodes took 1e-3 to 1.6e-3."""
PRODUCT = 1.5e-5
"""Products with them, and with their preconditioner, take so much a node: increments of 472 to 5580
nodes took 1.0e-5 to 2.1e-5, a Newton step one for each motion besides its KSP iterations."""
DIGIT = 1.4
"""A digit more of the tolerance than 1e-4 takes so many times as long: 9000 nodes 5.3 s at 1e-3,
9.0 s at 1e-4, 5760 11.7 s at 1e-6."""
TIGHTEST = 1e-6
"""Least tolerance of compressed surfaces that an adaptive solve chooses."""
FINER = 5e-3
"""Such a tolerance over the wanted error of tractions: elastic residuals are about as large as
tolerances, errors of p from them some times larger."""
NEWTON = 5
"""Matrices of the size of S that a Newton step holds, S among them."""


BUDGET = 10.0
"""Processor time of a mesh in space where no accuracy is named [s]."""
OPERATION = 2.2e-11
"""Seconds of an operation of a factorisation or a product of blocks: bodies of 576 to 5318 nodes,
one core, 1.8e-11 to 2.6e-11."""


@record
class Newton:
    """Newton steps of an increment, those of the mesh before or about the middle of 2.5 to 11, and
    the share of the unknowns of contact that are closed, the middle of half to all."""

    steps: float = 6.0
    closed: float = 0.75

    def seconds(self, unknowns: int) -> float:
        """Time of an increment: a factorisation of the block of what is closed in each step [s]."""
        return self.steps * OPERATION * 2.0 / 3.0 * (self.closed * unknowns) ** 3


USUAL = Newton()
"""Where no increment is known."""


@record
class Compression:
    """A way to compress the operators of a body.

    Attributes
    ----------
    name : str
        Its value of `mat_type`.
    what : str
        What it compresses, in words.
    smallest : int
        Nodes up to which nothing is to be gained.
    seconds, exact_seconds : callable
        Predicted time to build and factorise the operators of a mesh, from the mesh alone, which
        decides, and with all that is known [s].
    memory : callable
        Of the operators of a mesh, without a preconditioner [bytes].
    """

    name: str
    what: str
    smallest: int
    seconds: Callable[[Any], float]
    exact_seconds: Callable[[Bem, Any], float]
    memory: Callable[[Any], float]


@record
class Costs:
    """What the storages of one kind of mesh cost.

    Attributes
    ----------
    compression : str
        Of `COMPRESSIONS`, or "" where there is none.
    dense : float
        Time of a dense system over that of one in the plane as large: kernels cost more [-].
    increment : (float, float)
        Time of an increment over that of the elimination, dense and compressed [-].
    motion : float
        More for each rigid motion of a compressed body that only contact holds [-].
    worth : float
        So many times the cost may be that of dense operators, which hold more digits [-].
    """

    compression: str
    dense: float = 1.0
    increment: tuple[float, float] = (1.0, 1.0)
    motion: float = 0.0
    worth: float = 1.0


def _curve_seconds(mesh: CurveMesh) -> float:
    steps = np.linalg.norm(np.diff(mesh.x, axis=0), axis=1)
    # from curve to curve nodes are further apart than before and after
    around = np.maximum(np.append(steps[1:], 0.0), np.append(0.0, steps[:-1]))
    curves = 1 + np.count_nonzero(steps > 3.0 * around)
    even = mesh.measure.max() <= RATIO * mesh.measure.min() and curves <= CURVES
    extent = np.ptp(mesh.x, axis=0)
    crowded = CROWDED * curves * float(extent.min() / extent.max())
    return max(EVEN if even else UNEVEN, crowded, _slender_seconds(mesh)) * mesh.n_nodes


def _slender(mesh: CurveMesh) -> float:
    """Length of the strip with the perimeter and the area of a body over its thickness [-]."""
    length = float(mesh.measure.sum())
    inside = 0.5 * float(mesh.measure @ np.sum(mesh.normal * (mesh.x - mesh.x[0]), axis=1))
    return length**2 / (4.0 * abs(inside)) if inside else 0.0


def _slender_seconds(mesh: CurveMesh) -> float:
    slender = _slender(mesh)
    return slender * (SLENDER[0] + SLENDER[1] * slender)


def shared_nodes(mesh: CurveMesh) -> int:
    """Nodes whose clusters of compressed operators share the blocks of others."""
    from ..compliance.body.stretches import repeated, runs

    counts = [
        int(mesh.first_node[last] - mesh.first_node[first])
        for first, last in runs(mesh, repeated(mesh))
    ]
    return sum(max(0, count - ALONE) for count in counts)


def _exact_curve_seconds(bem: Bem, mesh: CurveMesh) -> float:
    shared = shared_nodes(mesh)
    single = SHARED * shared + _curve_seconds(mesh) * (1.0 - shared / mesh.n_nodes)
    return max(single, _slender_seconds(mesh) * mesh.n_nodes)


def _curve_memory(mesh: CurveMesh) -> float:
    shared = shared_nodes(mesh)
    single = SHARED_NODE * shared + CURVE_NODE * (mesh.n_nodes - shared)
    return max(single, SLENDER[2] * _slender(mesh) * mesh.n_nodes)


COMPRESSIONS = {
    "hodlr": Compression(
        "hodlr",
        "boundaries of plane bodies",
        1200,
        _curve_seconds,
        _exact_curve_seconds,
        _curve_memory,
    ),
    "hmatrix": Compression(
        "hmatrix",
        "surfaces in space",
        700,
        lambda mesh: SURFACE * mesh.n_nodes,
        lambda bem, mesh: SURFACE * mesh.n_nodes * DIGIT ** -math.log10(bem.hmatrix_tol / 1e-4),
        lambda mesh: SURFACE_NODE * mesh.n_nodes,
    ),
}
COSTS: dict[type, Costs] = {
    CurveMesh: Costs("hodlr"),
    RingMesh: Costs(""),
    TwistedRingMesh: Costs(""),
    SurfaceMesh: Costs("hmatrix", 2.0, (0.2, 0.4), 0.13, 2.0),
}
"""By the kind of a mesh. An increment in the plane took 0.3 of the elimination by Newton's method,
and 0.8 to 2.6 by projection. In space it took 0.35 to 0.6 of pairs of 1485 to 8253 dense nodes
each, and 0.3 to 0.5 of compressed bodies of 2970 to 30 042 nodes in all; 1.1 to 1.5 of the
elimination with three and six motions that only contact holds, each a column of the preconditioner
in every Newton step. Two bodies of 738 nodes each, 441 in contact, pressed and pushed, took 1.4 s
dense and 2.4 s compressed (1e-4), of 1008 nodes 3.4 and 3.4 s, of 1485 nodes 8.3 and 6.1 s."""


def dense_seconds(mesh: BoundaryMesh) -> float:
    """Predicted time to assemble and factorise dense operators [s]."""
    size = 0.5 * mesh.x.size
    return COSTS[type(mesh)].dense * (ENTRY * size**2 + FLOP * size**3)


def compression_of(bem: Bem, mesh: BoundaryMesh) -> Compression | None:
    """How the operators of a body are compressed; None where they are dense.

    Raises
    ------
    InputError
        If a compression is asked for that is for other bodies.
    """
    costs, asked = COSTS[type(mesh)], bem.mat_type
    if asked in COMPRESSIONS and asked != costs.compression:
        usable = "".join(f', "{name}"' for name in COMPRESSIONS if name == costs.compression)
        raise InputError(
            f'bem.mat_type: "{asked}" compresses {COMPRESSIONS[asked].what}; choose "auto"{usable} '
            f'or "dense"'
        )
    compression = COMPRESSIONS.get(costs.compression)
    if compression is None or asked == "dense":
        return None
    if asked == "auto":
        if mesh.n_nodes <= compression.smallest:
            return None
        whole, parts = (
            seconds * (1.0 + more)
            for seconds, more in zip(
                (dense_seconds(mesh), compression.seconds(mesh)), costs.increment, strict=True
            )
        )
        return compression if costs.worth * parts < whole else None
    return compression


def has_compressed(bem: Bem, meshes: Iterable[BoundaryMesh]) -> bool:
    """Whether operators of any body are compressed."""
    bem = resolved_bem(bem)
    return any(compression_of(bem, mesh) for mesh in meshes)


def solve_seconds(
    bem: Bem,
    meshes: Sequence[BoundaryMesh],
    contact: Sequence[int],
    total: int,
    increments: int,
    motions: int = 0,
    newton: Newton = USUAL,
) -> float:
    """Processor time [s] of elimination and some increments of bodies of which contact alone holds
    so many motions.

    Bodies have so many unknowns of `contact`, the secondaries of all pairs `total`. On compressed
    surfaces each increment solves with the bodies, elsewhere with the contact alone.
    """
    ways = [compression_of(bem, mesh) for mesh in meshes]
    seconds = sum(
        way.exact_seconds(bem, mesh) if way else _eliminated_seconds(mesh, unknowns)
        for way, mesh, unknowns in zip(ways, meshes, contact, strict=True)
    )
    if any(way and way.name == "hmatrix" for way in ways):
        costs, steps = COSTS[type(meshes[0])], increments * newton.steps / USUAL.steps
        return seconds * (1.0 + steps * (costs.increment[1] + costs.motion * motions))
    return seconds + increments * newton.seconds(total)


def posed_seconds(
    posed: Posed, meshes: Sequence[BoundaryMesh], increments: int, motions: int = 0
) -> float:
    """`solve_seconds` of a problem on meshes."""
    nodes_of, total = contact_sizes(posed, meshes)
    bem, components = resolved_bem(suitable_bem(posed, meshes)), meshes[0].components
    unknowns = [components * count for count in nodes_of]
    return solve_seconds(bem, meshes, unknowns, components * total, increments, motions)


def _eliminated_seconds(mesh: BoundaryMesh, contact: int) -> float:
    """Time of the entries of a dense body, its factors, and a solution for each contact unknown
    [s]."""
    unknowns = mesh.x.size
    entries = COSTS[type(mesh)].dense * ENTRY * (0.5 * unknowns) ** 2
    return entries + OPERATION * 2.0 * unknowns**2 * (unknowns / 3.0 + contact)


def dense_memory(
    unknowns: Sequence[int],
    contact: Sequence[int],
    total: int,
    ranks: int = 1,
    closed: float = 1.0,
) -> float:
    """Predicted peak of dense elimination and of a Newton step, of all ranks together [bytes];
    measured ones were within a tenth.

    Of a body with q unknowns and m of contact the factors, contact columns and S stay, and while
    they are made once more S and, on one rank, the columns; a Newton step holds S of all `total`
    contact unknowns, the block of the share of them that is closed, and its factors. Ranks share
    the factors and the columns; each has S and the Newton step.
    """
    pairs = [*zip(unknowns, contact, strict=True)]
    stays = sum(q * q + m * q + 2 * ranks * m * m for q, m in pairs)
    made = max((m * q * (ranks == 1) + ranks * m * m for q, m in pairs), default=0)
    step = total * total * (1.0 + (NEWTON - 1) * closed**2)
    return 8.0 * (stays + max(made, ranks * step))


def check_memory(
    unknowns: Sequence[int],
    contact: Sequence[int],
    total: int,
    compressed: float = 0.0,
    ranks: int = 1,
    closed: float = 1.0,
) -> float:
    """The memory that dense bodies and compressed ones take together, on all ranks [bytes].

    Raises
    ------
    InputError
        If the predicted peak is larger than the memory.
    """
    needed = compressed + (
        dense_memory(unknowns, contact, total, ranks, closed) if unknowns else 0.0
    )
    there = physical_memory()
    if needed > there and not unknowns:
        raise InputError(
            f"mesh: the compressed operators of all bodies take about {needed / 1e9:.3g} GB, this "
            f"machine has {there / 1e9:.3g}; use larger elements"
        )
    if needed > there:
        raise InputError(
            f"mesh: dense operators of {sum(unknowns)} unknowns, {total} of contact, take "
            f"{needed / 1e9:.3g} GB, this machine has {there / 1e9:.3g}; use larger elements, or "
            "compression where there is one (elements of thin bodies are as short as these are "
            "thick)"
        )
    return needed


def needed_memory(
    bem: Bem,
    meshes: Sequence[BoundaryMesh],
    contact: Sequence[int],
    total: int,
    directions: int,
    closed: float = 1.0,
) -> float:
    """What `check_memory` gives of bodies with so many contact nodes, of the secondaries `total`,
    in k directions each, of which a share is closed."""
    ways = [compression_of(bem, mesh) for mesh in meshes]
    large = sum(way.memory(mesh) for way, mesh in zip(ways, meshes, strict=True) if way)
    # patches have both sides of contacts, dense bodies, too
    patched = any(way and way.name == "hmatrix" for way in ways)
    large += patched * PATCH_NODE * min(sum(contact), 2 * total) ** 2 / max(total, 1)
    small = [b for b, way in enumerate(ways) if not way]
    return check_memory(
        [meshes[b].x.size for b in small],
        [directions * contact[b] for b in small],
        directions * total if small else 0,
        compressed=large,
        closed=closed,
    )


def posed_memory(posed: Posed, meshes: Sequence[BoundaryMesh], directions: int) -> float:
    """`needed_memory` of a problem on meshes, of contact nodes in k directions each."""
    bem = resolved_bem(suitable_bem(posed, meshes))
    return needed_memory(bem, meshes, *contact_sizes(posed, meshes), directions)


def suitable_bem(posed: Posed, meshes: Sequence[BoundaryMesh]) -> Bem:
    """`[bem]` of a problem, dense where a part in space is the secondary of two interfaces.

    Compressed surfaces are made for such parts where no node has something opposite twice, and only
    for Newton's method. A storage that is named stays.
    """
    sides, bem = posed.interfaces, posed.bem
    twice = meshes[0].dim > 2 and any(
        one.ends[0] == other.ends[0]
        and not (
            posed.method.resolved_name == "semismooth-newton"
            and _are_apart(meshes[one.body], one, other)
        )
        for one, other in itertools.combinations(sides, 2)
    )
    return bem.model_copy(update={"mat_type": "dense"}) if twice and bem.mat_type == "auto" else bem


def _are_apart(mesh: BoundaryMesh, one: PosedInterface, other: PosedInterface) -> bool:
    """Return whether no node of a part meets two things: those of one contact, of which each node
    takes one, tools beside one another, and plates on both sides of a roller."""
    return one.group == other.group or not np.any(_meets(mesh, one) & _meets(mesh, other))


def _meets(mesh: BoundaryMesh, side: PosedInterface) -> Mask:
    """Return which nodes of a secondary (m,) may have something opposite."""
    x, normal = (values[mesh.nodes_of(side.part)] for values in (mesh.x, mesh.normal))
    if side.obstacle is not None and side.law.gap is not None:
        return np.isfinite(side.law.gap.near(Sites(x, normal), np.inf))
    faces = side.primary is None or side.direction is None or normal @ side.direction > 0.0
    return np.broadcast_to(faces, len(x))


def contact_sizes(posed: Posed, meshes: Sequence[BoundaryMesh]) -> tuple[list[int], int]:
    """Nodes of each body on parts that may touch, and those of all secondaries."""
    ends = {end for interface in posed.interfaces for end in interface.ends}
    nodes = {(b, part): len(meshes[b].nodes_of(part)) for b, part in ends}
    touching = [sum(n for (b, _), n in nodes.items() if b == k) for k in range(len(meshes))]
    return touching, sum(nodes[interface.ends[0]] for interface in posed.interfaces)


def chosen_tolerance(bem: Bem, accuracy: float) -> float:
    """Tolerance of compressed surfaces for an error of the solution; NaN where one is given, which
    then stays [-]."""
    if "hmatrix_tol" in bem.model_fields_set or option("bem_hmatrix_tol") is not None:
        return math.nan
    return max(FINER * accuracy, TIGHTEST)


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
    values: Keyed = {**bem.model_dump()}
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
