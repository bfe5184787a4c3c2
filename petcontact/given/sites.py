"""Places at which given data are asked for: points, normals and arc lengths."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..record import record


@record
class Sites:
    """Points, with the names that expressions may use there.

    Attributes
    ----------
    x : (n, d) array
        Points [length].
    normal : (n, d) array, optional
        Outward unit normals; points inside a body have none [-].
    s : (n,) array, optional
        Arc lengths along the part; points of surfaces and inside have none [length].

    Examples
    --------
    >>> import numpy as np
    >>> list(Sites(np.zeros((1, 2)), np.ones((1, 2)), np.zeros(1)).names)
    ['x', 'y', 'nx', 'ny', 's']
    """

    x: Array
    normal: Array | None = None
    s: Array | None = None

    def __len__(self) -> int:
        return len(self.x)

    @property
    def names(self) -> dict[str, Array]:
        """Variables of expressions, (n,) each: x, y (and z), nx, ny (and nz), s where known."""
        names = dict(zip("xyz", self.x.T, strict=False))
        if self.normal is not None:
            names |= dict(zip(("nx", "ny", "nz"), self.normal.T, strict=False))
        return names if self.s is None else {**names, "s": self.s}

    @property
    def along(self) -> Array:
        """Arc lengths along the part, 0 where they are not known, (n,) [length]."""
        return np.zeros(len(self)) if self.s is None else self.s


Way = Callable[[Array], Sites]
"""Function from fractions (n,) of a line, 0 at its start and 1 at its end, to the sites there."""
