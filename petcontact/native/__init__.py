"""Kernels compiled from the C files beside this one.

A caller asks for a function by name, once, when it is imported:

    integrals = native.function("petcontact_plane_integrals", "pipipp")

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
from typing import Any

import numpy as np

from ..errors import MissingKernelsError

VARIABLE = "PETCONTACT_NATIVE"
SUFFIX = ".abi3.so"
INTERFACE = 0x7D763989
"""`petcontact_interface` of the C files beside this one; a library of others expects other
arguments."""
FILLER = "pipippp"
"""Arguments of a function of C that fills columns of an operator: what it knows, rows, columns, and
two blocks."""
Compiled = Callable[..., None]
AnyArray = np.ndarray[Any, np.dtype[Any]]
_byte_of: Callable[[Any], Any] = ctypes.c_char.from_buffer
_address_of: Callable[[Any], int] = ctypes.addressof
_TYPES = {"i": ctypes.c_int64, "d": ctypes.c_double, "p": ctypes.c_void_p}


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
        A letter for each: i for int64_t, d for double, p for a pointer (see `pointer`).

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
    """The address of an array's first number; the caller keeps it alive, and sees to its type and
    strides."""
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
    """A struct of C: pointers to arrays (which are kept alive), int64_t and double, in the order of
    the members."""

    def __init__(self, *members: AnyArray | int | float | None) -> None:
        self.arrays = [member for member in members if isinstance(member, np.ndarray)]
        numbers = [(type(m) is not int, m) if isinstance(m, int | float) else None for m in members]
        values = [pointer(m) or 0 if isinstance(m, np.ndarray) else m or 0 for m in members]
        kinds = "".join(["P" if pair is None else "qd"[pair[0]] for pair in numbers])
        self._memory = ctypes.create_string_buffer(struct.pack(kinds, *values))
        self.address = ctypes.addressof(self._memory)


def contiguous(array: AnyArray, dtype: type = np.float64) -> AnyArray:
    """The array as C sees it: rows one after another, of one type; itself if it is so already."""
    return np.ascontiguousarray(array, dtype=dtype)


def describe() -> str:
    """For which level of the processor the library is, in a few words; errors as of `function`."""
    return f"compiled ({_level(_library())})"
