"""Whether coordinates of 16 digits tell the parts of a body from one another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import LARGEST_COORDINATE, Array
from ..errors import InputError


def check_digits(size: float, points: Sequence[Array], what: str) -> None:
    """Refuse a body that is much smaller than it is far from the origin, or whose squared size vanishes.

    Parameters
    ----------
    size : float
        Of the body [length].
    points : sequence of (d,) arrays
        Where it is [length].
    what : str
        What the message calls it.

    Raises
    ------
    InputError
    """
    farthest = max(float(np.abs(point).max()) for point in points)
    if not size > max(1e-9 * farthest, 1.0 / LARGEST_COORDINATE):
        raise InputError(f"geometry: the {what} is {size:.3g} wide at {farthest:.3g} from the origin: too little for 16 "
                         "digits, choose another origin or unit of length")  # fmt: skip
