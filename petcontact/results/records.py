"""What an increment leaves on interfaces, bodies and obstacles."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..arrays import Array, Index, Names, States, scattered
from ..contact.friction_law import lengths
from ..contact.state import History
from ..geometry.rotation import Axial, moment
from ..mesh.boundary_mesh import BoundaryMesh
from ..record import field, record
from ..runtime.hints import Hinted, Named
from ..untyped import Keyed
from .joined import Pairs, shares
from .report import Finding

SLIDING_WITHIN = 1e-4
"""Share of friction that may be left where a contact slips as a whole, of the load to which that is
found, and of a step below which no load is tried where all larger ones failed
(`pipeline.steps.sliding`) [-]."""


@record
class PairResult(Hinted):
    """Nodal fields of one interface after an increment; the secondary's nodes.

    Attributes
    ----------
    x, normal : (m, d) arrays
        Nodes [length], and n, from the secondary to the primary.
    tangent : (m, d-1, d) array
        τ: in the plane n turned by +90°.
    weight : (m,) array
        Quadrature weights [length, in space area].
    arc_length : (m,) array
        Along the secondary's part, 0 in space [length].
    pressure : (m,) array
        p = -σ_n [stress].
    sigma_t : (m, d-1) array
        Shear traction on the secondary along τ [stress].
    bound : (m,) array
        Of |σ_t|: µp, the given bound, the smaller of both, 0, or infinite where bonded [stress].
    gap : (m,) array
        What is left of the gap, infinite where nothing is faced [length].
    slip, slip_increment : (m, d-1) arrays
        w, relative tangential displacement, and what this increment added [length].
    state : (m,) array
        0 stick, 1 slip, 2 open.
    force : (d,) array
        On the secondary [force/length, in space force].
    moment : float, in space (3,) array
        Of it about the origin [force, in space force · length].
    dissipated : float
        Energy that friction took in this increment, by the trapezoidal rule [force, in space force
        · length].
    dissipated_error : float
        A bound of its error; nan in files before it was known.
    errors : callable, optional
        Estimates `pressure_error` and `sigma_t_error` when one of them is asked for.
    force_primary, moment_primary : (d,) array, and float, in space (3,) array, optional
        On the body of the primary side, as its nodes feel them; None where that is the ground or an
        obstacle.
    wear : (m, 2) array, optional
        Depths by which secondary and primary are worn; None where nothing wears [length].
    overlap : float
        The largest overlap that the parts were given by an interference and a preload, less the
        clearance [length].
    primary : (m,) array, optional
        Of a contact of several parts: which of its primaries a node meets, from 0; -1 where it
        meets another one first, or none.
    """

    x: Array
    normal: Array
    tangent: Array
    weight: Array
    arc_length: Array
    pressure: Array
    sigma_t: Array
    bound: Array
    gap: Array
    slip: Array
    slip_increment: Array
    state: States
    force: Array
    moment: Axial
    dissipated: float
    dissipated_error: float = np.nan
    force_primary: Array | None = None
    moment_primary: Axial | None = None
    wear: Array | None = None
    errors: Callable[[], tuple[Array, Array]] | None = None
    overlap: float = 0.0
    primary: Index | None = None

    @functools.cached_property
    def _errors(self) -> tuple[Array, Array] | tuple[None, None]:
        return (None, None) if self.errors is None else self.errors()

    @property
    def pressure_error(self) -> Array | None:
        """Estimated error (m,) of p, rms over each element, from the highest degree of its
        polynomial; None in files before it was known [stress]."""
        return self._errors[0]

    @property
    def sigma_t_error(self) -> Array | None:
        """Estimated error of the vector σ_t, as `pressure_error`, (m,) [stress]."""
        return self._errors[1]

    @property
    def size(self) -> Array:
        """Sizes (m,) of the tractions, of p and σ_t together [stress]."""
        return np.hypot(self.pressure, lengths(self.sigma_t))

    @property
    def worn_volume(self) -> Array:
        """Worn volume of secondary and primary, (2,) [length², in space length³]."""
        return np.zeros(2) if self.wear is None else np.asarray(self.weight @ self.wear)

    @property
    def worn_depth(self) -> float:
        """The largest, of both sides together [length]."""
        return 0.0 if self.wear is None else float(self.wear.sum(axis=1).max(initial=0.0))

    @property
    def area(self) -> float:
        """Length, in space area, of the closed part of the interface [length]."""
        return float(self.weight[self.state != 2].sum())

    @property
    def imbalance(self) -> float:
        """What force and moment on the two sides leave over, over all that acts and its reach [-];
        0 of one body alone."""
        return self.imbalance_beyond(0.0)

    def imbalance_beyond(self, couple: Axial) -> float:
        """Imbalance without the moment that a couple on the primary explains, such as that of
        friction across a gap."""
        size = float(self.weight @ self.size)
        if self.force_primary is None or self.moment_primary is None or size == 0.0:
            return 0.0
        middle = self.weight @ self.x / self.weight.sum()
        reach = float(lengths(self.x - middle).max())
        force = self.force + self.force_primary
        left = np.atleast_1d(
            self.moment + self.moment_primary - couple - moment(middle[None], force[None])
        )
        # a single node has no moment about itself
        return float(max(np.linalg.norm(force), np.linalg.norm(left) / (reach or np.inf))) / size

    @property
    def friction_used(self) -> float:
        """|Q| over what friction can carry with these pressures, ∫μp (a bound: ∫g), where 1 is a
        contact that slips as a whole [-]; nan without friction, and on faces in space that are not
        flat, of whose directions there is no sum."""
        # tangential tractions have a sum where |∫n| is nearly the area
        flat = float(np.linalg.norm(self.weight @ self.normal)) > 0.99 * float(self.weight.sum())
        carried = float(self.weight @ self.bound)
        if not (0.0 < carried < np.inf and (flat or self.tangent.shape[1] == 1)):
            return float(np.nan)
        along = self.sigma_t if not flat else np.einsum("mk,mkd->md", self.sigma_t, self.tangent)
        return float(np.linalg.norm(self.weight @ along)) / carried

    @property
    def tension_share(self) -> float:
        """Share of the interface that is in tension by more than methods leave at the default
        tolerance [-]."""
        level = 1e-6 * float(self.size.max(initial=0.0))
        return float(self.weight[self.pressure < -level].sum() / self.weight.sum())


@record
class BodyResult(Hinted):
    """Displacement [length] and traction [stress] (n, d) on the boundary of one body."""

    u: Array
    traction: Array

    def moment_on(self, mesh: BoundaryMesh, part: str) -> Axial:
        """Moment about the origin of the tractions on a part; with torsion about the axis
        [force times length]."""
        nodes = mesh.nodes_of(part)
        return mesh.motions.moment(mesh.x[nodes], mesh.weight[nodes, None] * self.traction[nodes])


@record
class ObstacleResult:
    """Where an obstacle is, and the force and moment about its centre that act on it from outside.

    Displacement and force are (d,), rotation and moment numbers, in space (3,).
    """

    displacement: Array
    rotation: Axial
    force: Array
    moment: Axial


@record
class StepResult:
    """One increment.

    Attributes
    ----------
    name : str
        Of the step.
    step : int
        Its number, from 1.
    load_factor : float
        How much of the step's change is reached, in (0, 1].
    status : {"converged", "not converged"}
    reason : str
    iterations : int
        Of the method.
    residuals : dict
        normal, tangential, balance, elastic, equilibrium, elimination, overlap [-]; between,
        displaced: the deepest overlap between nodes and what tractions displace there [length].
    pairs, bodies, obstacles : dicts by name
        Of a contact of several parts the pairs are "contact: primary on secondary"; its own name
        gives all of it.
    alpha : (r,) array
        Rigid motions of the bodies.
    rho : float
        Largest Robin parameter of the last iteration [stress/length].
    residual : float
        ‖R_ρ‖ in L2 of the interfaces with that ρ [stress · length^½, in space stress · length].
    history : History
        A row an iteration.
    cycle : int
        Of a step of a cycle, how many cycles are done with it; else 0.
    origin : float, optional
        Number of the step at whose end the step begins, if not the one before; 1.4 where 0.4 of
        the second step was reached.
    sliding : str
        Name of the contact that slips as a whole, which ends a step with `until = "sliding"`.
    findings : tuple of Finding
        What checks found of it; status and reason follow from them. Files do not have them.
    """

    name: str
    step: int
    load_factor: float
    status: str
    reason: str
    iterations: int
    residuals: dict[str, float]
    pairs: dict[str, PairResult]
    bodies: dict[str, BodyResult]
    obstacles: dict[str, ObstacleResult]
    alpha: Array
    rho: float = math.nan
    residual: float = math.nan
    history: History = field(default_factory=History)
    cycle: int = 0
    origin: float | None = None
    sliding: str = ""
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        for name, kind in (("pairs", Pairs), ("bodies", Named), ("obstacles", Named)):
            object.__setattr__(self, name, kind(getattr(self, name)))

    @property
    def title(self) -> str:
        """Name of the step, and of a step of a cycle which one it is."""
        return f"{self.name}, cycle {self.cycle}" if self.cycle else self.name

    def shares_of(self, contact: str, *, axial: bool = False) -> dict[str, float]:
        """The share of the force of a contact of several parts that each pair carries [-].

        It is along the whole force, with `axial` along the axis, by "primary on secondary".
        """
        parts: dict[str, PairResult] = Pairs(self.pairs).parts_of(contact)
        found = shares(parts, axial=axial)
        return {name.removeprefix(f"{contact}: "): share for name, share in found.items()}

    @property
    def shares(self) -> dict[int, float]:
        """Shares of the loads at the ends of steps, by the numbers of the steps [-]."""
        return shares_of_states(self.step, self.load_factor, self.origin)

    @property
    def ends(self) -> bool:
        """Whether the step ends with it: all its loads act, or a contact slips as asked for."""
        return self.load_factor == 1.0 or bool(self.sliding)


def shares_of_states(step: int, factor: float, origin: float | None) -> dict[int, float]:
    """Return the shares of the loads at the ends of steps, by their number.

    >>> shares_of_states(3, 0.5, None), shares_of_states(3, 0.5, 1.25)
    ({2: 0.5, 3: 0.5}, {1: 0.375, 2: 0.125, 3: 0.5})
    """
    begun = step - 1 if origin is None else origin
    state = math.floor(begun)
    later = begun - state
    shares = {state: (1.0 - later) * (1.0 - factor)}
    if later:
        shares[state + 1] = later * (1.0 - factor)
    return shares | {step: factor}


def weights_of(shares: dict[int, float], count: int) -> Array:
    """Return the weights (count,) of all load states, from the shares of some by their number."""
    return scattered(np.array([*shares.values()]), np.array([*shares]), count)


@record
class WearHistory:
    """Wear over cycles, at the ends of those that were computed.

    Attributes
    ----------
    cycle : (j,) array
        How many are done.
    pressure, depth : dicts of (j, m) arrays by interface
        p [stress], and the worn depth of both sides together [length], at the secondary's nodes.
    """

    cycle: Index
    pressure: dict[str, Array]
    depth: dict[str, Array]


@record
class ContactFields:
    """Nodal fields on the contact parts of one body, by number of the node.

    Attributes
    ----------
    nodes : (m,) array
        Numbers of the contact nodes.
    x : (m, d) array
        Nodes [length].
    tangent : (m, d-1, d) array
        In the plane the outward normal turned by +90° (+x on a bottom side).
    weight, arc_length : (m,) arrays
        Quadrature weights [length or area], and arc length along the part, 0 in space [length].
    u_t, sigma_t : (m, d-1) arrays
        Components of displacement [length] and traction [stress] along the tangents.
    sigma_n, friction_bound : (m,) arrays
        Normal traction, negative in compression, and the bound of |σ_t| [stress].
    state : (m,) array
        0 stick, 1 slip, 2 open.
    part : (m,) array of str
    """

    nodes: Index
    x: Array
    tangent: Array
    weight: Array
    arc_length: Array
    u_t: Array
    sigma_t: Array
    sigma_n: Array
    friction_bound: Array
    state: States
    part: Names


def step_ends(steps: Sequence[StepResult]) -> list[StepResult]:
    """The last increment of each step."""
    return [
        step
        for k, step in enumerate(steps)
        if k + 1 == len(steps) or steps[k + 1].step != step.step
    ]


def below(tables: Sequence[Mapping[str, object]]) -> Keyed:
    """Return the rows of tables with the same columns, one table below the other."""
    keys = tables[0] if tables else ()
    return {key: np.concatenate([table[key] for table in tables]) for key in keys}


def along_tangents(name: str, values: Array) -> dict[str, Array]:
    """Return the columns of components (n, d-1) along the tangents.

    A single component has the name NAME, two have the names NAME_1 and NAME_2.
    """
    several = values.shape[1] > 1
    return {f"{name}_{k}" if several else name: column for k, column in enumerate(values.T, 1)}
