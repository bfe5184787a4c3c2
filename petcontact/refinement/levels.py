"""Refinement levels of adaptive solves, and error estimates from differences of their meshes."""

from __future__ import annotations

import itertools
import math

from ..mesh.hp_grading import Grading
from ..record import record
from ..round_off import SOLVED, WRITTEN

LEAST_GAIN = math.sqrt(2.0)
"""Least ratio of the errors of two meshes in a force, and in every number where they are all:
tractions like r^(λ-1) at a corner make forces wrong by the size of the elements there to the power
λ. These halve at least from mesh to mesh, and λ is 1/2 or more (less only where they shrink by
more), so that the finer mesh is off by up to 1/(gain - 1) = 2.4 times what the two differ by
[-]."""


MOST_GAIN = 30.0
"""Largest ratio of the errors of two neighbouring levels; a larger one is chance [-]. The edges of
contact are found so much better by the third level than by the second."""
EDGE = 0.2
"""Relative L2 error of p over the smallest elements at edges of contact, which are relative to half
its width [-]. It is that of Cattaneo's and Mindlin's blocks, by scripts/verify_random --contact;
the best line through a root leaves 0.08."""


@record
class Level:
    """One refinement level: a grading and its errors.

    Attributes
    ----------
    grading : Grading
    resolved : float
        Relative error due to the smallest elements at corners and transition points [-].
    edge : float
        Smallest element at an edge of contact or stick over half the width of the contact [-].
    """

    grading: Grading
    resolved: float
    edge: float = 0.0

    @property
    def error(self) -> float:
        """Typical relative error; only ratios of it are used in estimates [-]."""
        return max(self.resolved, EDGE * self.edge)

    @property
    def finer(self) -> Level:
        """The level with a tenth of the errors by elements of the same order p.

        Errors on elements of length h fall as h^(2p + 2) at order 5: levels of 12 random bodies to
        1e-7 and of 10 random contacts to 1e-5 were as accurate as fitted ones with 0.8 to 1.1 times
        as many nodes (scripts/verify_random --seed 7 --first 100). A function with a singularity at
        a mark has on elements of ratio q the errors of one whose distance to the singularity, in
        half elements, is that of Bernstein's ellipse: they fall with (1 - √q)/(1 + √q) as with h.
        """
        root = math.sqrt(self.grading.ratio)
        shorter = math.pow(0.1, 0.5 / (self.grading.order + 1))
        step = shorter * (1.0 - root) / (1.0 + root)
        ratio = ((1.0 - step) / (1.0 + step)) ** 2
        grading = Grading(self.grading.order, ratio, shorter * self.grading.largest)
        return Level(grading, self.resolved / 10.0, self.edge / 10.0)


def continued(*levels: Level) -> tuple[Level, ...]:
    """Return levels with finer ones after the last, until corners are resolved to the digits that
    files hold."""
    if levels[-1].resolved > WRITTEN:
        return continued(*levels, levels[-1].finer)
    return levels


@record
class Ladder:
    """The levels of an adaptive solve, and a milder second level for rough accuracies.

    For a rough accuracy one difference is believed, that of the first two meshes; it is the error
    of the first. The second level is replaced then. Its orders and smallest elements are close to
    those of the first, so that both may miss the same features.

    Attributes
    ----------
    levels : tuple of Level
    rough : float
        Accuracy from which `milder` replaces the second level [-].
    milder : Level
    usual : float
        The wanted accuracy where none is named [-].
    """

    levels: tuple[Level, ...]
    rough: float
    milder: Level
    usual: float

    def reaching(self, accuracy: float) -> tuple[Level, ...]:
        """Return the levels for a wanted accuracy."""
        first, second, *finer = self.levels
        return (first, self.milder if accuracy >= self.rough else second, *finer)

    def believes(self, differences: list[float], accuracy: float) -> bool:
        """Return whether the only difference is the estimate."""
        return accuracy >= self.rough and len(differences) == 1


SLIP_LADDER = Ladder(
    continued(
        Level(Grading(2, 0.30), 1.5e-3),
        Level(Grading(2, 0.30), 8.0e-5),
        Level(Grading(3, 0.28, 0.8), 1.0e-5),
        Level(Grading(5, 0.28, 0.7), 1.0e-6),
    ),
    rough=1e-2,
    milder=Level(Grading(3, 0.25, 0.9), 1e-4),
    usual=1e-4,
)
"""Levels for u_t in bilateral contact; errors are about those of the paper's examples, see
scripts/benchmark_accuracy. On 183 random bodies (scripts/verify_random) the error on the third
level was at most 0.99 times the only difference, and in 9 of 10 below a fifth of it. On the milder
level 168 of 214 bodies had a difference below 1e-2, and errors of at most 2.8e-3. 50, 90 and 99 %
of these errors were below 0.14, 0.57 and 1.06 times the estimate. With corners twice as coarse, two
of 62 errors exceeded 1e-2 and were ten times the difference. For a wanted 2e-3 all levels took 0.81
times as many nodes on 20 random bodies as the first and the third one (scripts/verify_random --seed
7 --first 100)."""
CONTACT_LADDER = Ladder(
    continued(
        Level(Grading(2, 0.30), 2.5e-3, 1e-1),
        Level(Grading(3, 0.25), 5e-4, 2e-2),
        Level(Grading(4, 0.28), 5e-5, 1e-3),
        Level(Grading(5, 0.30), 3e-6, 1e-4),
    ),
    rough=5e-2,
    milder=Level(Grading(3, 0.25), 2e-4, 5e-3),
    usual=1e-2,
)
"""Levels for p and q. A level finds edges to a tenth of its elements there, and the next level's
elements are a tenth as large. For a wanted 5e-2 the errors of 105 random bodies of revolution
(scripts/verify_axial) were at most 0.020. 50, 90 and 99 % of them were below 0.21, 0.56 and 0.92
times the estimate, in which the only difference counts twice. Without the milder levels and the
only difference, 37 random problems took 1.4 times as many nodes."""


def first_level(accuracy: float) -> int:
    """Return the lowest level, except the first, that is expected to reach an accuracy."""
    levels = SLIP_LADDER.levels
    return next((k for k in range(1, len(levels)) if levels[k].error <= accuracy), len(levels) - 1)


def check_accuracy(accuracy: float) -> None:
    """Refuse an accuracy that no refinement level reaches.

    Raises
    ------
    ValueError
        If the accuracy does not lie in (0, 1).
    """
    if not (isinstance(accuracy, int | float) and 0.0 < accuracy < 1.0):
        raise ValueError(f"the accuracy lies between 0 and 1, got {accuracy!r}")


def believed(differences: list[float]) -> float:
    """Return the error that the last two differences of levels let one expect, infinite for fewer
    than two.

    It is at least the last difference, which is the error of the last level but one. Two levels may
    agree by chance: the last difference counts as at least the one before over `MOST_GAIN`. Growing
    differences are assumed to grow once more.
    """
    if len(differences) < 2:
        return math.inf
    before, last = differences[-2:]
    return max(last, before / MOST_GAIN, last**2 / max(before, SOLVED))


def growing(differences: list[float]) -> bool:
    """Return whether one of the last two differences exceeds round-off and the one before it."""
    return any(
        after > max(before, SOLVED) for before, after in itertools.pairwise(differences[-3:])
    )
