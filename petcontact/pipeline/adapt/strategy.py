"""What an adaptive solve asks of the quantity that it refines for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from ...contact.state import Start
from ...geometry.surface import Boundary
from ...model.problem import Problem
from ...refinement.marks import LevelMesh
from ...results.solution import Solution
from ..steps.increment import PreparedProblem


class Strategy(Protocol):
    """What an adaptive solve refines for: `Slip`, `Tractions`, or in space `PanelTails`.

    Attributes
    ----------
    levels : sequence
        Meshes to solve on, from coarse to fine.
    accuracy : float
        That is wanted by default [-].
    wanted, asked : float, bool
        The accuracy, and whether somebody named it.
    estimate : float
        Of the error on the last mesh [-].
    differences : list of float
        Between neighbouring meshes, where they are compared [-].
    exhausted : str
        Why there is no mesh after the last, or nothing.
    dense_nodes : int
        Of a body, up to which `mat_type = "auto"` stays dense.
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
    @property
    def dense_nodes(self) -> int: ...

    def mark(self, solution: Solution, level: Any) -> bool:
        """Estimate the error of a solution, and mark where the next mesh is finer; whether its own
        level shall be solved once more."""
        ...

    def mark_failed(self, solution: Solution) -> bool:
        """Mark where the mesh of a solution that is not accepted is too coarse; whether it is."""
        ...

    def refine(
        self, number: int, one: Callable[[], Problem], boundary: Boundary, level: Any
    ) -> LevelMesh:
        """The mesh of a body by its number, as marks and level want it."""
        ...

    def start(self, problem: PreparedProblem) -> Start | None:
        """Where the method starts on a new mesh."""
        ...

    def shown(self) -> dict[str, Any]:
        """Fields of `Accuracy` that the meshes show."""
        ...
