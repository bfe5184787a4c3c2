"""Limits on the cost of an adaptive solve's meshes, and the sentences on accuracies not reached."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from ...errors import InputError
from ...given.posed import Posed
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import record
from ...refinement.levels import growing
from ...results.solution import Solution
from ..choice import BUDGET, posed_memory, posed_seconds
from ..eliminate import Announce
from ..steps.increment import Monitor
from .strategy import Wanted


@record
class Reached:
    """A mesh that an adaptive solve has finished.

    Attributes
    ----------
    number : int
        Number of the mesh, from 1.
    nodes : int
        Nodes of all bodies.
    estimate : float
        Estimated relative error, infinite while it is unknown.
    seconds : float
        Wall-clock time since the solve began [s].
    solution : Solution
        Solution on this mesh, "not converged". It is the result if the solve ends before the next
        mesh.
    """

    number: int
    nodes: int
    estimate: float
    seconds: float
    solution: Solution


Callbacks = tuple[Monitor | None, Announce | None, Callable[[Reached], None] | None]
"""What a solve calls: `monitor`, `announce` and `reached` of `solve`."""


@record
class Budget:
    """Largest cost of a mesh: nodes of all bodies, and predicted processor time [s] of a solve."""

    nodes: int
    seconds: float

    def exceeds(self, other: Budget) -> bool:
        """Return whether a cost is larger than another one."""
        return self.nodes > other.nodes or self.seconds > other.seconds

    def __str__(self) -> str:
        return f"{self.nodes} nodes and {self.seconds:g} s of processor time"


BUDGETS = {False: Budget(4000, BUDGET), True: Budget(30_000, 200.0)}
"""Budgets in space for one or two bodies, by whether the user named an accuracy."""


def says_something(estimate: float) -> bool:
    """Return whether the true relative error is less than 1 by its estimate.

    Estimates are relative to the norm of the solution. The true norm may be smaller by the error:
    from one half on the true relative error may be 1 or more.
    """
    return estimate < 1.0 - estimate


def budget_of(bodies: int, asked: bool) -> Budget:
    """Return the budget of a problem with a number of bodies."""
    pairs, given = max(1.0, 0.5 * bodies), BUDGETS[asked]
    return Budget(int(pairs * given.nodes), pairs * given.seconds)


def beyond_budget(
    posed: Posed,
    meshes: Sequence[BoundaryMesh],
    counts: tuple[int, int],
    wanted: Wanted,
    faces: int = 0,
    own: Sequence[BoundaryMesh] = (),
) -> str:
    """Return a sentence if solves on the meshes exceed the budget or the memory, else "".

    `counts` are the numbers of increments, and of motions that only contact holds. Each of the
    `faces` on which the meshes follow contacts has the budget of a pair of bodies. First meshes of
    the user's `own` may cost anything, and what follows from them twice that.
    """
    bodies, nodes = max(len(meshes), 2 * faces), sum(mesh.n_nodes for mesh in meshes)
    seconds = posed_seconds(posed, meshes, *counts)
    dear = Budget(nodes, seconds).exceeds(budget_of(bodies, wanted.asked))
    # the cost grows at least as the nodes do
    if dear and nodes > 2 * sum(mesh.n_nodes for mesh in own):
        return _refusal(Budget(nodes, round(seconds, 1)), bodies, wanted)
    try:
        posed_memory(posed, meshes, meshes[0].components)
    except InputError as error:
        return f"the next mesh does not fit the memory ({error})"
    return ""


def _refusal(cost: Budget, bodies: int, wanted: Wanted) -> str:
    """Return the sentence on a mesh that exceeds the budget, and what allows more."""
    goes_on = f"--accuracy {wanted.accuracy:g} goes on, to at most {budget_of(bodies, True)}"
    more = "a [mesh] of your own may have more" if wanted.asked else goes_on
    kind = "" if wanted.asked else " where no accuracy is named"
    return (
        f"the next mesh would have {cost}, the budget{kind} is "
        f"{budget_of(bodies, wanted.asked)}; {more}"
    )


def short_of(
    error: float, wanted: Wanted, trouble: str, differences: Sequence[float], differ: str
) -> str:
    """Return the sentence with the estimate, the wanted accuracy and why the solve ended.

    `differ` says where the last two meshes differ most, if that is known.
    """
    reached = (
        f"the error is estimated to be {error:.2g}"
        if math.isfinite(error)
        else "the error is not known"
    )
    where = trouble or "on the finest mesh"
    if growing([*differences]):
        where += (
            "; the differences of the meshes grow: "
            f"{', '.join(f'{d:.1e}' for d in differences[-3:])}"
        )
    where += f"; {differ}" if differ else ""
    return f"{reached}, {wanted.accuracy:g} was wanted: {where}"
