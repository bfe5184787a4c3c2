"""By how much a drawing of the deformed bodies magnifies displacements, and its window."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...frozen import frozen
from ...runtime.figure_style import round_number
from ..data import SolutionData
from ..records import StepResult

MAGNIFIED = 0.08
"""Largest displacement drawn, as a fraction of the size of the bodies."""


@frozen
class View:
    """Magnification and window of one drawing, or of all that are to be compared.

    Attributes
    ----------
    factor : float
        Of displacements: at least 1, unless they are larger than the bodies.
    low, high : (d,) arrays
        What the bodies cover as they were and as they are drawn [length].
    largest : float
        |u| [length].
    """

    factor: float
    low: Array
    high: Array
    largest: float

    @property
    def text(self) -> str:
        """How displacements are drawn, in words."""
        if self.factor == 1.0:
            return "displacements to scale"
        return f"displacements × {self.factor:g}" if self.factor > 1.0 else f"displacements / {1.0 / self.factor:g}"


def view_of(
    solution: SolutionData, steps: Sequence[StepResult] = (), *, share: float = MAGNIFIED, factor: float | None = None
) -> View:
    """The view of some increments, of the last one by default, with displacements of about a share of the bodies' size."""
    x = {name: mesh.x for name, mesh in solution.meshes.items()}
    every = np.vstack(list(x.values()))
    size = float(np.linalg.norm(np.ptp(every, axis=0)))
    u = [(name, body.u) for step in steps or [solution.last] for name, body in step.bodies.items()]
    largest = max(float(np.linalg.norm(values, axis=1).max()) for _, values in u)
    if factor is None:
        factor = round_number(share * size, largest)
        if factor < 1.0 and largest <= size:
            factor = 1.0
    places = np.vstack([every, *(x[name] + factor * values for name, values in u)])
    return View(factor, places.min(axis=0), places.max(axis=0), largest)
