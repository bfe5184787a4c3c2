"""Products with a symbol on an open strip of equal elements that is reflected at both ends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from ...arrays import Array, Complex

PRIME = 50
"""Largest prime factor of the number of elements for which transforms of that length are used.
Beyond it, transforms of twice a suitable length cost less."""


class Transforms(NamedTuple):
    """The names of a transform and its inverse, their type, and the frequencies of the reflected
    loop that they use."""

    to: str
    back: str
    kind: int
    frequencies: slice


REFLECTED = {
    (1.0, 1.0): Transforms("dct", "idct", 2, slice(None, -1)),
    (-1.0, -1.0): Transforms("dst", "idst", 2, slice(1, None)),
    (1.0, -1.0): Transforms("dct", "idct", 4, slice(1, None, 2)),
    (-1.0, 1.0): Transforms("dst", "idst", 4, slice(1, None, 2)),
}
"""Transforms by the signs of the reflections at the start and the end: 1 if even, -1 if odd."""


class Reflection:
    """Products with a symbol on a strip that is reflected at both ends, with one node per element.

    The cosine and sine transforms of types II and IV cost a quarter to a half of those of the
    reflected loop. If the number of nodes has a large prime factor, they cost several times as
    much. The sum over the reflected loop is then written as a Toeplitz and a Hankel matrix. Both
    products together take two transforms of twice a suitable length.

    Parameters
    ----------
    ends : (float, float)
        Signs of the reflections: 1 if even, -1 if odd.
    size : int
        Number of nodes.
    symbol : (size,) array
        Symbol at the frequencies of the reflected loop that the transforms use.
    """

    def __init__(self, ends: tuple[float, float], size: int, symbol: Array) -> None:
        self._transforms, self._symbol, self._size = REFLECTED[ends], symbol, size
        self._kernels: tuple[Array, Complex] | None = None
        if largest_prime(size) <= PRIME:
            return
        copies = 2 if ends[0] == ends[1] else 4
        whole = np.zeros(copies * size // 2 + 1)
        whole[self._transforms.frequencies] = symbol
        loop = np.fft.irfft(whole, copies * size)
        # kernels by the distance m of two nodes: direct, and from the mirror image of a node
        m, mixed = np.arange(1 - size, size), float(copies == 4)
        direct = loop[m % len(loop)] - mixed * loop[(m - 2 * size) % len(loop)]
        turned = (
            ends[1] * loop[(m - size) % len(loop)] + mixed * ends[0] * loop[(m + size) % len(loop)]
        )
        self._length = scipy.fft.next_fast_len(2 * size - 1, real=True)
        spectra = []
        for kernel in (direct, turned):
            circle = np.zeros(self._length)
            circle[m] = kernel
            spectra.append(scipy.fft.rfft(circle))
        back = np.exp(-2j * np.pi * (size - 1) / self._length * np.arange(len(spectra[0])))
        self._kernels = spectra[0], spectra[1] * back

    def __call__(self, x: Array) -> Array:
        """Return the product with x, (size,)."""
        if self._kernels is None:
            to, back, kind, _ = self._transforms
            return np.asarray(
                getattr(scipy.fft, back)(self._symbol * getattr(scipy.fft, to)(x, kind), kind)
            )
        spectrum = scipy.fft.rfft(x, self._length)
        direct, turned = self._kernels
        return np.asarray(
            scipy.fft.irfft(direct * spectrum + turned * np.conj(spectrum), self._length)[
                : self._size
            ]
        )


def largest_prime(number: int) -> int:
    """Return the largest prime factor of a number.

    Examples
    --------
    >>> largest_prime(133333)
    883
    """
    factor, largest = 2, 1
    while factor * factor <= number:
        if number % factor:
            factor += 1
        else:
            number, largest = number // factor, factor
    return max(largest, number)
