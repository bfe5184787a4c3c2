"""Kernels compiled from the C files beside this one.

A caller asks for a function by name, once, when it is imported:

    solve = native.function("petcontact_hessenberg_solve", "DidDD")

and hands it numpy's arrays. Each letter says what the argument must be: an array of another type,
or one whose numbers do not lie one after another, is refused before C reads it.

The C code allocates nothing, keeps nothing and knows neither Python nor numpy: ctypes hands it
pointers, with Python's lock released. Its digits are the same on every machine (`elementary.h`).
The variable PETCONTACT_NATIVE names another build of it.
"""

from __future__ import annotations

import ctypes
import functools
import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..errors import MissingKernelsError

VARIABLE = "PETCONTACT_NATIVE"
SUFFIX = ".abi3.so"
INTERFACE = 0x1BA2A7EE
"""`petcontact_interface` of the C files beside this one; a library of others expects other
arguments."""
FILLER = "piNiNDD"
"""Arguments of a function of C that fills columns of an operator: what it knows, rows, columns, and
two blocks."""
Compiled = Callable[..., None]
AnyArray = np.ndarray[tuple[int, ...], np.dtype[Any]]
Member = AnyArray | int | float | None
"""A member of a struct of C: an array, a number, or nothing in the place of an array."""
_byte_of: Callable[[Any], object] = ctypes.c_char.from_buffer
_address_of: Callable[[Any], int] = ctypes.addressof
_NUMBERS = {"i": ctypes.c_int64, "d": ctypes.c_double, "p": ctypes.c_void_p}
_ARRAYS = {"D": "d", "N": "lq", "I": "i", "B": "?bB", "V": "defhlq?bB"}
"""Characters of numpy's types (`dtype.char`) of which the array of an argument may be."""


class _Checked:
    """The type of an argument that is an array; ctypes asks `from_param`."""

    def __init__(self, letter: str) -> None:
        self._letter = letter

    def from_param(self, array: AnyArray | None) -> ctypes.c_void_p:
        """The pointer to the numbers, or to nothing; TypeError where C would read others."""
        return ctypes.c_void_p(_checked(array, self._letter))


def _checked(array: AnyArray | None, letter: str) -> int | None:
    if array is not None and not (array.dtype.char in _ARRAYS[letter] and array.flags.c_contiguous):
        raise TypeError(
            f"C takes arrays of kind {letter}, whose numbers lie one after another; got "
            f"{array.dtype} {array.shape} with strides {array.strides}"
        )
    return pointer(array)


_TYPES = _NUMBERS | {letter: _Checked(letter) for letter in _ARRAYS}


@functools.cache
def _library() -> ctypes.CDLL:
    asked = os.environ.get(VARIABLE)
    path = Path(asked).absolute() if asked else Path(__file__).with_name("_kernels" + SUFFIX)
    try:
        found = ctypes.CDLL(str(path))
    except OSError as error:
        raise MissingKernelsError(str(error)) from None
    interface = getattr(found, "petcontact_interface", None)
    if interface is not None:
        interface.restype = ctypes.c_int64
    if interface is None or interface() != INTERFACE:
        reason = "was built from other C files"
    elif not _level(found):
        reason = "was built for another processor"
    else:
        return found
    raise MissingKernelsError(f"{path} {reason}")


def _level(library: ctypes.CDLL) -> str:
    """Which copies of its functions this processor runs; empty where it can run none."""
    name = ctypes.create_string_buffer(32)
    library.petcontact_level(name)
    return name.value.decode()


@functools.cache
def function(name: str, arguments: str) -> Compiled:
    """A function of the library.

    Parameters
    ----------
    name : str
    arguments : str
        A letter for each: i for int64_t, d for double, p for an address (of a `Struct`, or from
        `pointer`). D, N, I, B stand for arrays or None: of doubles, of int64_t, of int, of bytes; V
        for arrays of any of these.

    Raises
    ------
    MissingKernelsError
        If the library is missing, or was built from other C files or for another processor.
    """
    found: Any = getattr(_library(), name)
    found.argtypes, found.restype = [_TYPES[letter] for letter in arguments], None
    return found  # type: ignore[no-any-return]


@functools.cache
def address(name: str) -> int:
    """Where a function of the library begins, for other functions of it to call."""
    return ctypes.cast(getattr(_library(), name), ctypes.c_void_p).value or 0


def pointer(array: AnyArray | None) -> int | None:
    """The address of an array's first number, for what no letter says: parts of rows, and tables of
    addresses. The caller keeps the array alive."""
    if array is None:
        return None
    try:
        return _address_of(_byte_of(array))
    except (
        TypeError,
        ValueError,
        BufferError,
    ):  # not contiguous, read-only, or empty: three times as slow
        return int(array.__array_interface__["data"][0])


class Struct:
    """A struct of C: pointers to arrays (which are kept alive) and numbers, in the order of the
    members, whose letters are those of `function`."""

    def __init__(self, letters: str, *members: Member) -> None:
        values, kinds, self._members = [], "", members
        for letter, member in zip(letters, members, strict=True):
            kinds += {"i": "q", "d": "d"}.get(letter, "P")
            array = cast("AnyArray | None", member)
            values.append((member if letter in _NUMBERS else _checked(array, letter)) or 0)
        self._memory = ctypes.create_string_buffer(struct.pack(kinds, *values))
        self.address = ctypes.addressof(self._memory)


def contiguous(array: AnyArray, dtype: type = np.float64) -> AnyArray:
    """The array as C sees it: rows one after another, of one type; itself if it is so already."""
    return np.ascontiguousarray(array, dtype=dtype)


def describe() -> str:
    """For which level of the processor the library is, in a few words; errors as of `function`."""
    return f"compiled ({_level(_library())})"
