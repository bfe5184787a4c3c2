"""Adaptive strategy in space without contact: panels of half the size on each mesh."""

from __future__ import annotations

from ...errors import InputError
from ...given.posed import Posed
from ...refinement.body_meshes import mesh_of, resized
from ...refinement.levels import LEAST_GAIN, believed
from ...results.solution import Solution
from ...untyped import Keyed
from ..pose.body_parts import body_alone
from .budget import beyond_budget
from .difference import displacement_difference
from .strategy import Before, Estimate, Meshes, Strategy, Tried, Wanted


class HalvedPanels(Strategy[Estimate, Before[Estimate]]):
    """The strategy for u, which is compared with u on panels of twice the size.

    All panels are halved, so that what one mesh is off by shows in the next one everywhere. The
    first mesh has panels of twice the usual size, or of the size that the config names.

    Attributes
    ----------
    accuracy : float
        Default of the wanted accuracy [-].
    """

    accuracy, first = 2e-2, ()

    def __init__(self, posed: Posed, wanted: Wanted) -> None:
        self._posed, self.wanted = posed, wanted

    def estimate(self, tried: Tried[Before[Estimate]], before: Estimate | None) -> Estimate:
        """Return the error of u.

        It halves with the panels at least, so that it is no larger than the only difference; two of
        them say more.
        """
        differences = [] if before is None else before.differences
        if before is not None and _has_less(before.solution, tried.solution):
            differences = [*differences, displacement_difference(before.solution, tried.solution)]
        error = differences[0] if len(differences) == 1 else believed(differences)
        return Estimate(tried, error, differences)

    def marks(self, estimate: Estimate) -> Before[Estimate]:
        """Return the estimate: all panels are marked."""
        return (estimate,)

    def meshes(self, marks: Before[Estimate], level: int) -> Meshes[Before[Estimate]]:
        """Return meshes with panels that are halved at each level; from the third on they fit the
        budget."""
        try:
            made = [
                mesh_of(
                    resized(body_alone(self._posed, b, boundary), boundary, 1 - level), boundary
                )
                for b, boundary in enumerate(self._posed.boundaries)
            ]
        except InputError as error:
            if level == 0:
                raise
            return Meshes(marks, level, exhausted=f"there is no finer mesh ({error})")
        if marks and marks[0].differences:
            counts = len(marks[0].solution.steps), 0
            if refused := beyond_budget(self._posed, made, counts, self.wanted):
                return Meshes(marks, level, exhausted=refused)
        return Meshes(marks, level, made)

    def shown(self, estimate: Estimate) -> Keyed:
        """Return fields of `Accuracy`: the errors of the last two meshes, as near to one another as
        those of stresses may be."""
        return {"estimates": [LEAST_GAIN * estimate.error, estimate.error]}


def _has_less(coarse: Solution, fine: Solution) -> bool:
    """Return whether a mesh is another one than that of the level before."""
    before, after = (sum(m.n_nodes for m in each.meshes.values()) for each in (coarse, fine))
    return before < after
