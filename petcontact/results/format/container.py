"""HDF5 files that appear whole or not at all, and say whether their bytes are those that were
written."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py

from ...errors import PetcontactError, ResultError
from ...runtime.atomic_write import temporary_name
from ...runtime.file_kinds import known_kind, like

SEAL = b"\npetcontact sha256\n"
"""What stands after the HDF5 file, which does not mind, before the hash of its bytes: HDF5 may
crash on damaged ones."""


def write_atomically(
    path: str | Path, fill: Callable[[h5py.File], None], *, replace: bool = True
) -> None:
    """Let `fill` write an HDF5 file that appears under its name only when it is whole and on the
    disk."""
    with temporary_name(path, replace=replace) as temporary:
        image = image_of(fill)
        temporary.write_bytes(image + SEAL + hashlib.sha256(image).digest())


def image_of(fill: Callable[[h5py.File], None]) -> bytes:
    """The bytes of an HDF5 file that `fill` writes; in memory, since HDF5 crashes the process when
    the disk fills up under a file of its own."""
    with h5py.File("result", "w", driver="core", backing_store=False, track_order=True) as file:
        fill(file)
        file.flush()
        return bytes(file.id.get_file_image())


@contextlib.contextmanager
def opened(path: str | Path) -> Iterator[h5py.File]:
    """An HDF5 file of ours, opened for reading; whatever is wrong with it is a `ResultError` of one
    line."""
    try:
        if not Path(path).is_file():
            raise ResultError(f"{path}: no such file{like(path, ['.h5'])}")
        if kind := known_kind(path, [".h5"]):
            raise ResultError(f"{path}: {kind}")
        _check_seal(Path(path))
        with h5py.File(path, "r") as file:
            yield file
    except PetcontactError:
        raise
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise ResultError(f"{path}: not a whole HDF5 file ({reason})") from None


def _check_seal(path: Path) -> None:
    """Refuse a file whose bytes are not those that were written; one without a hash (older, or
    changed by h5py) passes."""
    image = hashlib.sha256()
    with open(path, "rb") as file:
        file.seek(max(path.stat().st_size - len(SEAL) - image.digest_size, 0))
        _, seal, digest = file.read().rpartition(SEAL)
        left = file.tell() - len(seal + digest)
        file.seek(0)
        while seal and (block := file.read(min(left, 1 << 20))):
            image.update(block)
            left -= len(block)
    if seal and digest != image.digest():
        raise ResultError(f"{path}: damaged (its bytes are not those that were written)")
