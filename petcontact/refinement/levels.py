"""The ladders of gradings that adaptive solves climb, and what differences between their meshes let
one believe."""

from __future__ import annotations

import itertools
import math

from ..frozen import frozen
from ..mesh.hp_grading import Grading
from ..round_off import SOLVED

MOST_GAIN = 40.0
"""Ratio of the errors of two neighbouring levels beyond which it is chance."""
LEAST_GAIN = 1.5
"""The same of a single number, as a force, that is counted on where two meshes are all: the finer
one is off by up to 1/(gain - 1) = 2 times what they differ by. Of 492 numbers of random bodies six
were off by more than the difference, by 1.01, 1.08, 1.10, 1.15, 1.30 and 1.65 times."""
MARGIN = 1.3
"""How far below the wanted error a level's typical error is when it is tried first."""


@frozen
class Level:
    """One refinement level: a grading.

    Attributes
    ----------
    grading : Grading
    resolved : float
        Relative error that the smallest elements leave at corners and transition points [-].
    error : float
        Typical relative error; only ratios of it are used as estimates [-].
    edge : float
        Smallest element at an edge of contact or stick over half the width of the contact [-].
    """

    grading: Grading
    resolved: float
    error: float
    edge: float = math.inf


REFINEMENT_LEVELS = (
    Level(Grading(2, 0.30), 1.5e-3, 1.7e-3),
    Level(Grading(2, 0.30), 8.0e-5, 6.7e-5),
    Level(Grading(3, 0.28, 0.8), 1.0e-5, 4.6e-6),
    Level(Grading(5, 0.28, 0.7), 1.0e-6, 6.0e-7),
    Level(Grading(5, 0.33, 0.6), 8.0e-8, 4.0e-8),
    Level(Grading(5, 0.40, 0.5), 1.2e-8, 1.3e-8),
    Level(Grading(5, 0.50, 0.4), 2.5e-9, 3.0e-9),
)
"""For u_t of one body in bilateral contact, errors measured on the paper's examples."""
CONTACT_REFINEMENT_LEVELS = (
    Level(Grading(2, 0.30), 2.5e-3, 2e-2, 1e-1),
    Level(Grading(3, 0.25), 5e-4, 3e-3, 2e-2),
    Level(Grading(4, 0.28), 5e-5, 1e-4, 1e-3),
    Level(Grading(5, 0.30), 3e-6, 2e-5, 1e-4),
    Level(Grading(5, 0.45), 2e-7, 5e-6, 1e-5),
    Level(Grading(5, 0.52, 0.7), 2e-8, 1e-6, 5e-6),
    Level(Grading(5, 0.58, 0.5), 2e-9, 2e-7, 2e-6),
)
"""For pressure and shear, errors measured on Cattaneo's and Mindlin's blocks: a level finds edges
to a tenth of its elements or better, and those of the next one are ten times smaller."""


@frozen
class Ladder:
    """Levels to climb, and what takes the place of the second where a rough accuracy is wanted.

    There one difference is believed, that of the first two meshes: it is the error of the first.
    The second level does not do for that, whose orders and smallest elements are near those of the
    first: both may miss the same.

    Attributes
    ----------
    levels : tuple of Level
    rough : float
        Accuracy from which on the second level is left out [-].
    rougher : float
        Accuracy from which on `milder` stands before the third [-].
    milder : Level
    """

    levels: tuple[Level, ...]
    rough: float
    rougher: float
    milder: Level

    def to(self, accuracy: float) -> tuple[Level, ...]:
        """The levels to climb to an accuracy."""
        if accuracy < self.rough:
            return self.levels
        return (
            self.levels[0],
            *([self.milder] if accuracy >= self.rougher else []),
            *self.levels[2:],
        )

    def believes(self, differences: list[float], accuracy: float) -> bool:
        """Whether one difference is the estimate."""
        return accuracy >= self.rough and len(differences) == 1


SLIP_LADDER = Ladder(REFINEMENT_LEVELS, 2e-3, 1e-2, Level(Grading(3, 0.25, 0.9), 1e-4, 1e-4))
"""Of 183 random bodies the error on the third level was at most .99 times the one difference, of 9
in 10 less than a fifth. On the milder one it was at most 2.8e-3 on all 168 of 214 whose difference
was below 1e-2, and .14, .57, 1.06 times the estimate on 50, 90, 99 % of them. With corners twice as
coarse two of 62 were above 1e-2, where the difference was a tenth of the error."""
CONTACT_LADDER = Ladder(
    CONTACT_REFINEMENT_LEVELS, 5e-2, 5e-2, Level(Grading(3, 0.25), 2e-4, 2e-3, 5e-3)
)
"""On the milder level errors of 108 random problems were at most .032 where 5e-2 was wanted, and
.40, .90, 1.44 times the estimate in 50, 90, 99 % of them."""


def first_level(accuracy: float) -> int:
    """The lowest level but the first that may be expected to have this error."""
    last = len(REFINEMENT_LEVELS) - 1
    return next(
        (k for k in range(1, last + 1) if MARGIN * REFINEMENT_LEVELS[k].error <= accuracy), last
    )


def check_accuracy(accuracy: float) -> None:
    """Refuse what no refinement level reaches.

    Raises
    ------
    ValueError
        If the accuracy does not lie in (0, 1).
    """
    if not 0.0 < accuracy < 1.0:
        raise ValueError(f"the accuracy lies between 0 and 1, got {accuracy}")


def believed(differences: list[float], most: float = MOST_GAIN) -> float:
    """Error of the last level but one from the differences of neighbouring ones; infinite while
    there are fewer than two.

    Two levels may be alike by chance: no step is believed to gain more than `most` times.
    Differences that grow are believed to grow once more.
    """
    if len(differences) < 2:
        return math.inf
    before, last = differences[-2:]
    return max(last, before / most, last**2 / max(before, SOLVED))


def growing(differences: list[float]) -> bool:
    """Whether one of the last two differences is larger than the one before, and than round-off."""
    return any(
        after > max(before, SOLVED) for before, after in itertools.pairwise(differences[-3:])
    )
