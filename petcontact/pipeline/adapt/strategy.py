"""Interface between the adaptive loop and the quantity for which it refines the meshes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

from ...contact.state import Start
from ...geometry.surface import Boundary
from ...given.body_data import Body
from ...refinement.marks import LevelMesh
from ...results.solution import Solution
from ..judge.findings import WHOLE_MESH, wants_smaller_elements
from ..steps.increment import PreparedProblem


class Strategy(Protocol):
    """How an adaptive solve estimates, marks and refines: `Slip`, `Tractions`, or in space
    `PanelTails`.

    Attributes
    ----------
    levels : sequence
        Refinement levels of the meshes, from coarse to fine.
    accuracy : float
        Default of the wanted accuracy [-].
    wanted, asked : float, bool
        The wanted accuracy, and whether the user named it.
    estimate : float
        Estimated error on the last mesh [-].
    differences : list of float
        Differences of neighbouring meshes, if meshes are compared [-].
    exhausted : str
        Why there is no mesh after the last one, or "".
    """

    wanted: float
    asked: bool
    differences: list[float]
    exhausted: str

    @property
    def levels(self) -> Sequence[Any]: ...
    @property
    def accuracy(self) -> float: ...
    @property
    def estimate(self) -> float: ...

    def mark(self, solution: Solution, level: Any) -> None:
        """Estimate the error of a solution, and mark where the next mesh is finer."""
        ...

    def mark_failed(self, solution: Solution) -> bool:
        """Mark where the mesh of a rejected solution is too coarse; return whether anything is
        marked, by default all of it."""
        failed = solution.failed
        return failed is not None and bool(wants_smaller_elements(failed.findings) & WHOLE_MESH)

    def refine(self, number: int, posed: Body, boundary: Boundary, level: Any) -> LevelMesh:
        """Return the next mesh of a body that has a condition on each part."""
        ...

    def start(self, problem: PreparedProblem) -> Start | None:
        """Return the start of the contact method on a new mesh, if there is one."""
        ...

    def shown(self) -> dict[str, Any]:
        """Return the fields of `Accuracy` that the meshes determine."""
        ...
