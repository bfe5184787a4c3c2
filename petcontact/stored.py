"""Arrays of files that others wrote: what each must be, in one place for all formats.

What a file declares is checked before it is read, what it holds before it is used; whatever its
reader runs into is one line.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from math import prod
from pathlib import Path

import numpy as np

from .arrays import LARGEST_NUMBER, LONGEST_NAME, AnyArray
from .errors import InputError, PetcontactError
from .record import record

LARGEST_WHOLE = 2**31
"""Numbers of things that are counted."""
KINDS = {"f": ("real numbers", "fiu"), "i": ("whole numbers", "iu"), "U": ("names", "UO")}
"""Kinds of arrays by numpy's letter: in words, and the letters of numpy that will do."""


@record
class Stored:
    """What an array must be.

    Attributes
    ----------
    shape : str
        A letter or number an axis, or several with * between them; a letter has the same value
        everywhere. After | another shape with another number of axes.
    kind : str
        "f", "i" or "U".
    low, high : float
        Bounds of finite numbers.
    infinite : bool
        Whether it may be +∞, too.
    """

    shape: str
    kind: str = "f"
    low: float = -LARGEST_NUMBER
    high: float = LARGEST_NUMBER
    infinite: bool = False


@contextlib.contextmanager
def foreign(path: str | Path) -> Iterator[None]:
    """A block in which a library reads a file: any of its exceptions is one of ours.

    Raises
    ------
    InputError
        One line: the file, and what is wrong with it.
    """
    try:
        yield
    except PetcontactError:
        raise
    except Exception as found:  # of readers that meet damage with whatever they run into
        reason = " ".join(f"{getattr(found, 'strerror', None) or found}".split())[:80]
        said = "cannot be read" if getattr(found, "errno", None) else "damaged"
        raise InputError(f"{path}: {said} ({reason or type(found).__name__})") from None


def check_declared(
    name: str, shape: tuple[int, ...], kind: str, wanted: Stored, sizes: dict[str, int]
) -> None:
    """Refuse an array by its shape and kind; sizes that were not known are from then on.

    Raises
    ------
    InputError
        One line that begins with the name.

    Examples
    --------
    >>> sizes = {"d": 2}
    >>> check_declared("a.npz: points", (5, 2), "f", Stored("p d"), sizes)
    >>> sizes["p"]
    5
    """
    words, letters = KINDS[wanted.kind]
    if kind not in letters:
        raise InputError(f"{name}: must hold {words}")
    ways = [way.split() for way in wanted.shape.split("|")]
    axes = next((way for way in ways if len(way) == len(shape)), ways[0])
    for axis, length in zip(axes, shape, strict=False):
        *known, last = axis.split("*")
        if not last.isdecimal():
            sizes.setdefault(last, length // max(_product(known, sizes), 1))
    fits = len(axes) == len(shape)
    right = tuple(_product(axis.split("*"), sizes) for axis in axes) if fits else wanted.shape
    if right != tuple(shape):
        raise InputError(f"{name}: must have shape {right or '()'}, has {tuple(shape)}")


def _product(letters: list[str], sizes: dict[str, int]) -> int:
    return prod(int(c) if c.isdecimal() else sizes[c] for c in letters)


def checked(name: str, values: AnyArray, wanted: Stored) -> AnyArray:
    """The values as float64, int64 or text, each in its range; names are short, unlike each other,
    and can be printed.

    Raises
    ------
    InputError
        One line that begins with the name.
    """
    if wanted.kind == "U":
        names = [v.decode() if isinstance(v, bytes) else str(v) for v in np.ravel(values).tolist()]
        for own in names:
            if not own or len(own) > LONGEST_NAME or not own.isprintable():
                raise InputError(f"{name}: {own[:40]!r} is no name")
        return np.array(names).reshape(np.shape(values))
    if values.dtype.itemsize > 8:
        raise InputError(f"{name}: numbers of {8 * values.dtype.itemsize} bits are not read")
    whole = wanted.kind == "i"
    low, high = (
        (max(wanted.low, -LARGEST_WHOLE), min(wanted.high, LARGEST_WHOLE))
        if whole
        else (
            wanted.low,
            wanted.high,
        )
    )
    inside = (values >= low) & (values <= high) | (
        np.isposinf(values) if wanted.infinite else False
    )
    if not inside.all():
        bad = values[~inside].flat[0]
        raise InputError(f"{name}: must hold numbers from {low:g} to {high:g}, has {bad:g}")
    return values.astype(np.int64 if whole else np.float64)


def demand_unique(name: str, values: AnyArray) -> None:
    """Refuse rows that are there twice.

    Raises
    ------
    InputError
        One line that begins with the name.
    """
    if len(np.unique(values, axis=0)) < len(values):
        raise InputError(f"{name}: the same is there twice")
