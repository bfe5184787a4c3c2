"""Adaptive strategy in space without contact: panels of half the size on each mesh."""

from __future__ import annotations

from typing import Any

from ...contact.state import Start
from ...errors import InputError
from ...geometry.surface import Boundary
from ...given.body_data import Body
from ...given.posed import Posed
from ...refinement.body_meshes import mesh_of, resized
from ...refinement.levels import LEAST_GAIN, believed
from ...refinement.marks import LevelMesh
from ...results.solution import Solution
from ..pose.body_parts import body_alone
from ..steps.increment import PreparedProblem
from .budget import beyond_budget
from .difference import displacement_difference
from .strategy import Strategy


class HalvedPanels(Strategy):
    """The strategy for u, which is compared with u on panels of twice the size.

    All panels are halved, so that what one mesh is off by shows in the next one everywhere. The
    first mesh has panels of twice the usual size, or of the size that the config names.

    Attributes
    ----------
    levels : range
        Numbers of the meshes.
    accuracy : float
        Default of the wanted accuracy [-].
    differences : list of float
        Relative differences of u between neighbouring meshes [-].
    exhausted : str
        Why there is no next mesh, or "".
    """

    levels, accuracy = range(12), 2e-2

    def __init__(self, posed: Posed) -> None:
        self.differences: list[float] = []
        self.wanted, self.asked, self.exhausted = self.accuracy, False, ""
        self._posed = posed
        self._last: Solution | None = None

    def refine(self, number: int, posed: Body, boundary: Boundary, level: int) -> LevelMesh:
        """Return the mesh of a level."""
        return LevelMesh(mesh_of(resized(posed, boundary, 1 - level), boundary), 0.0)

    def start(self, problem: PreparedProblem) -> Start | None:
        """Return None: there is no contact to start."""
        return None

    def mark(self, solution: Solution, level: int) -> None:
        """Compare a solution with the one before, and ask whether the next meshes fit."""
        if self._last is not None and _has_less(self._last, solution):
            self.differences.append(displacement_difference(self._last, solution))
        self._last = solution
        if self.differences and self.estimate > self.wanted:
            self.exhausted = self._too_much(solution, level + 1)

    def _too_much(self, solution: Solution, level: int) -> str:
        """Return why a level cannot be solved, or ""."""
        bodies = [
            body_alone(self._posed, number, boundary)
            for number, boundary in enumerate(self._posed.boundaries)
        ]
        pairs = list(zip(bodies, self._posed.boundaries, strict=True))
        try:
            meshes = [self.refine(k, *pair, level).mesh for k, pair in enumerate(pairs)]
        except InputError as error:
            return f"there is no finer mesh ({error})"
        return beyond_budget(self._posed, meshes, (len(solution.steps), 0), self.wanted, self.asked)

    @property
    def estimate(self) -> float:
        """Estimated error of the last mesh [-].

        The error halves with the panels at least, so that it is no larger than the only
        difference; two of them say more.
        """
        return self.differences[0] if len(self.differences) == 1 else believed(self.differences)

    def shown(self) -> dict[str, Any]:
        """Return fields of `Accuracy`: the errors of the last two meshes, as near to one another as
        those of stresses may be."""
        return {"estimates": [LEAST_GAIN * self.estimate, self.estimate]}


def _has_less(coarse: Solution, fine: Solution) -> bool:
    """Return whether a mesh is another one than that of the level before."""
    before, after = (sum(m.n_nodes for m in each.meshes.values()) for each in (coarse, fine))
    return before < after
