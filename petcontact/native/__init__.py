"""Kernels compiled from the C files beside this one, where a compiler was at hand; numpy serves
everywhere else.

A caller asks for a function by name and falls back on numpy when there is none:

    integrals = native.function("petcontact_plane_integrals", "pipipp")   # once, at import
    if integrals is not None: ...

The C code allocates nothing, keeps nothing and knows neither Python nor numpy: ctypes hands it
pointers, with Python's lock released. Its digits are the same on every machine (`elementary.h`).
PETCONTACT_NATIVE=0 switches it off, PETCONTACT_NATIVE=FILE takes another build of it.
"""

from __future__ import annotations

import ctypes
import functools
import os
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

VARIABLE = "PETCONTACT_NATIVE"
SUFFIX = ".abi3.so"
INTERFACE = 0x2AC397FE
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
def _library() -> ctypes.CDLL | None:
    asked = os.environ.get(VARIABLE, "1")
    path = Path(__file__).with_name("_kernels" + SUFFIX) if asked in ("0", "1", "") else Path(asked)
    if asked == "0" or not path.exists():
        return None
    found = ctypes.CDLL(str(path))
    interface = getattr(found, "petcontact_interface", None)
    if interface is not None:
        interface.restype = ctypes.c_int64
    if interface is None or interface() != INTERFACE:
        reason = "was built from other C files"
    elif not _level(found):
        reason = "was built for another processor"
    else:
        return found
    print(
        f"petcontact: {path} {reason} and is not used; scripts/setup builds it again",
        file=sys.stderr,
    )
    return None


def _level(library: ctypes.CDLL) -> str:
    """Which copies of its functions this processor runs; empty where it can run none."""
    name = ctypes.create_string_buffer(32)
    library.petcontact_level(name)
    return name.value.decode()


@functools.cache
def function(name: str, arguments: str) -> Compiled | None:
    """A function of the library, or None where there is none.

    Parameters
    ----------
    name : str
    arguments : str
        A letter for each: i for int64_t, d for double, p for a pointer (see `pointer`).
    """
    found: Any = getattr(_library(), name, None)
    if found is None:
        return None
    found.argtypes, found.restype = [_TYPES[letter] for letter in arguments], None
    return found  # type: ignore[no-any-return]


@functools.cache
def address(name: str) -> int | None:
    """Where a function of the library begins, for other functions of it to call; None where there
    is none."""
    found: Any = getattr(_library(), name, None)
    return None if found is None else ctypes.cast(found, ctypes.c_void_p).value


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


class Record:
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
    """Which kernels run, in a few words."""
    if (library := _library()) is not None:
        return f"compiled ({_level(library)})"
    switched_off = os.environ.get(VARIABLE, "1") == "0"
    return (
        f"numpy ({VARIABLE}=0)" if switched_off else "numpy (not compiled, or from other C files)"
    )
