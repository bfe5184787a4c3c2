"""Elements of an input file: which are numbered clockwise, and which are no elements at all."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..round_off import WRITTEN
from .inp_file import CORNERS, InpFile

_TOP = {-6: 3, -8: 4}
EDGES: dict[int, tuple[tuple[int, ...], ...]] = {
    3: ((0, 1, 2),),
    4: tuple((k, (k + 1) % 4, (k + 3) % 4) for k in range(4)),
    -4: ((0, 1, 2, 3),),
    **{
        kind: (
            *((k, (k + 1) % n, (k + n - 1) % n, k + n) for k in range(n)),
            *((k + n, (k + n - 1) % n + n, (k + 1) % n + n, k) for k in range(n)),
        )
        for kind, n in _TOP.items()
    },
}
"""Corners and those that they are joined to, right-handed, of elements of so many corners, negative
in space."""


def check_elements(file: InpFile) -> list[str]:
    """What is to be reported of elements that are turned; faces keep the numbers that they have in
    the file.

    Raises
    ------
    InputError
        If an element has no area or volume, or is folded, so that it is turned at some of its
        corners only.
    """
    turned: list[int] = []
    for kind, corners in CORNERS.items():
        numbers = [number for number, (own, _) in file.elements.items() if own == kind]
        if not numbers:
            continue
        dim = 3 if corners < 0 else 2
        x = np.array(
            [[file.nodes[node][:dim] for node in file.elements[number][1]] for number in numbers]
        )
        signs = _signs(x, EDGES[corners])
        low, high = signs.min(axis=1), signs.max(axis=1)
        for bad, what in (
            ((high <= WRITTEN) & (low >= -WRITTEN), f"has no {'volume' if dim == 3 else 'area'}"),
            ((high > WRITTEN) & (low < -WRITTEN), "is folded: its corners turn both ways"),
        ):
            if bad.any():
                raise InputError(f"{file.path}: element {numbers[int(np.argmax(bad))]} {what}")
        turned += [number for number, down in zip(numbers, low < -WRITTEN, strict=True) if down]
    return (
        [f"{count(turned, 'element')} numbered clockwise, or inside out; taken as they lie"]
        if turned
        else []
    )


def count(numbers: list[int], word: str) -> str:
    """How many, and the first of them: "3 elements (7, 8, ...)"."""
    numbers = sorted({*numbers})
    shown = ", ".join(map(str, numbers[:2])) + (", ..." if len(numbers) > 2 else "")
    return f"{len(numbers)} {word}{'s' if len(numbers) > 1 else ''} ({shown})"


def _signs(x: Array, edges: tuple[tuple[int, ...], ...]) -> Array:
    """Sines at the corners of elements (n, c, d), (n, len(edges)); negative where they are
    turned."""
    signs = []
    for corner, *others in edges:
        along = x[:, others] - x[:, [corner]]
        size = np.linalg.norm(along, axis=2).prod(axis=1)
        signs.append(np.linalg.det(along) / np.where(size > 0.0, size, 1.0))
    return np.stack(signs, axis=1)
