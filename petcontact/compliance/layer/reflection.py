"""Products with a symbol on an open strip of equal elements that goes on by reflection at both
ends."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from ...arrays import Array, Complex

PRIME = 50
"""Prime factor of the number of elements beyond which transforms of that length cost more than
those of twice a good one."""


class Transforms(NamedTuple):
    """The names of a transform and of its inverse, their type, and which of the reflected loop's
    frequencies are theirs."""

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
"""By how a strip goes on at its start and end: even or odd."""


class Reflection:
    """Products with a symbol on a strip that goes on by reflection at both ends, one node an
    element.

    The cosine and sine transforms of types II and IV are a quarter to a half of the reflected
    loop's price. Where the number of nodes has a large prime factor they cost several times as
    much; there the sum over the reflected loop is that of a Toeplitz and a Hankel matrix, and both
    products take two transforms of twice a length that has none.

    Parameters
    ----------
    ends : (float, float)
        1 where it goes on evenly, -1 oddly.
    size : int
        Nodes.
    symbol : (size,) array
        Of the frequencies of the reflected loop that are the transforms'.
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
        # by the distance m of two nodes: directly, and from the node that is as far from the other
        # end
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
        """The product with x (size,)."""
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
    """Its largest prime factor.

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
