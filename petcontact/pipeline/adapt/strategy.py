"""The functions of an adaptive solve, and the values that pass from one to the next.

A strategy has three functions: the estimate of a solution, the marks of an estimate, and the meshes
of marks. It keeps no notes from one mesh to the next: all that is known is in these values.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Generic, Protocol, TypeVar

from ...contact.state import Start
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import field, record
from ...results.solution import Solution
from ...untyped import Keyed
from ..judge.findings import WHOLE_MESH, wants_smaller_elements
from ..pose.discretise import Discrete
from ..steps.prepared import PreparedProblem

M = TypeVar("M")


@record
class Wanted:
    """The wanted accuracy [-], and whether the user named it: the budget is larger then."""

    accuracy: float
    asked: bool


def no_start(problem: PreparedProblem) -> Start | None:
    """Return None: the contact method starts as on any mesh."""
    return None


@record
class Meshes(Generic[M]):
    """Meshes of all bodies for one solve.

    Attributes
    ----------
    marks : Any
        The marks that the meshes follow.
    level : int
        Their number, from 0.
    of_bodies : sequence of BoundaryMesh
        Empty if there are no finer meshes.
    missed : float
        Largest defect of the given data above the accepted one [-].
    exhausted : str
        Why there are no finer meshes, if not for want of a finer level.
    start : callable
        Returns the start of the contact method on these meshes, or None.
    """

    marks: M
    level: int
    of_bodies: Sequence[BoundaryMesh] = ()
    missed: float = 0.0
    exhausted: str = ""
    start: Callable[[PreparedProblem], Start | None] = no_start


@record
class Tried(Generic[M]):
    """A solve: its meshes, the problem on them and the solution, which may be rejected."""

    meshes: Meshes[M]
    discrete: Discrete
    solution: Solution


@record
class Estimate:
    """What is known of the error of a solution.

    Attributes
    ----------
    tried : Tried
        The solve.
    error : float
        Estimated relative error [-].
    differences : list of float
        Relative differences of neighbouring meshes, where meshes are compared [-].
    """

    tried: Tried[Any]
    error: float
    differences: list[float] = field(default_factory=list)

    @property
    def solution(self) -> Solution:
        """The solution."""
        return self.tried.solution

    @property
    def of_before(self) -> float:
        """The estimated error of the solution on the meshes before [-]."""
        return self.differences[-1] if self.differences else math.inf


E = TypeVar("E", bound=Estimate)
Before = tuple[E, ...]
"""Marks that are the estimate on the meshes before, or nothing."""


class Strategy(Protocol[E, M]):
    """How an adaptive solve estimates, marks and refines.

    The strategies are `Slip` and `Tractions` in the plane, `PanelTails` and `HalvedPanels` in
    space.

    Attributes
    ----------
    accuracy : float
        Default of the wanted accuracy [-].
    wanted : Wanted
        The wanted accuracy.
    """

    accuracy: float
    wanted: Wanted

    @property
    def first(self) -> M:
        """The marks before the first solve."""
        ...

    def estimate(self, tried: Tried[M], before: E | None) -> E:
        """Return the error of an accepted solution; `before` is the estimate on coarser meshes."""
        ...

    def marks(self, estimate: E) -> M:
        """Return where the next meshes are finer."""
        ...

    def marks_after_failure(self, tried: Tried[M], estimate: E | None) -> M | None:
        """Return where the meshes of a rejected solution are too coarse, or None if finer ones do
        not help.

        By default they are refined as before if they are too coarse everywhere. `estimate` is that
        of the last accepted solution.
        """
        failed = tried.solution.failed
        kinds = wants_smaller_elements(failed.findings) if failed is not None else set()
        return tried.meshes.marks if kinds & WHOLE_MESH else None

    def meshes(self, marks: M, level: int) -> Meshes[M]:
        """Return meshes of a level that are finer where it is marked."""
        ...

    def shown(self, estimate: E) -> Keyed:
        """Return the fields of `Accuracy` that the meshes determine."""
        ...
