"""One number of a solution that is printed and written."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...record import record, replace
from ...round_off import SOLVED

ENERGY = "dissipated energy"
"""Name of the number; its unit is that of a moment."""
DISPLACEMENT = "largest displacement"
"""Name of the number."""
Key = tuple[str, str, int, int]
"""Of a number, as `Number.key`."""


@record
class Number:
    """One number, or vector, of a solution.

    Attributes
    ----------
    name : str
        What it is: "force", "largest p", ...
    of : str
        Name of the pair, obstacle or body.
    step, cycle : int
        Of the step at whose end it is; 0 of what belongs to no step.
    value : (k,) array
        The number, or its components.
    unit : str
        "stress", "length", "area", "force", "moment", "volume" or "rad"; of a K stress and a power
        of length, as in "stress length^0.5".
    scale : float
        Sum of the sizes of what it was computed from: round-off is a share of it.
    error : float
        Estimated error; nan where it is not known, infinite where the number has no bound, 0 of
        what is given.
    alone : float
        How far it may be off by what lies between two nodes, or increments, of one solution.
    place : (d,) array, optional
        Of a maximum [length].
    part : str
        Of the boundary, where a maximum lies; empty inside.
    beside : (d,) array, optional
        A place without a bound at whose stated distance the number is the largest, or of whose K
        it is; None of that of an edge, which is at `place` [length].
    exponent : float
        λ of a K: stress is K r^(λ-1); NaN of other numbers.
    """

    name: str
    of: str
    step: int
    cycle: int
    value: Array
    unit: str
    scale: float = 0.0
    error: float = np.nan
    alone: float = 0.0
    place: Array | None = None
    part: str = ""
    beside: Array | None = None
    exponent: float = np.nan

    @property
    def key(self) -> Key:
        """The name, the owner, the step and the cycle, by which numbers differ."""
        return self.name, self.of, self.step, self.cycle

    @property
    def size(self) -> float:
        """The length of the vector."""
        return float(np.linalg.norm(self.value))

    @property
    def is_resultant(self) -> bool:
        """Whether it is a force or a moment of something that acts."""
        return self.unit in ("force", "moment") and self.name != ENERGY and self.scale > 0.0

    def known_to(self, error: float) -> Number:
        """Return the number with an error; an error of round-off is 0."""
        least = SOLVED * max(self.scale, self.size)
        return replace(self, error=0.0 if error <= least < np.inf else error)
