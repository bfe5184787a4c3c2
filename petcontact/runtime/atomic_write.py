"""Files that appear under their name only when they are whole and on the disk."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..errors import ResultError
from .signals import deferred


@contextlib.contextmanager
def temporary_name(path: str | Path) -> Iterator[Path]:
    """A name beside `path`, renamed to it when the block ends well and removed when it does not.

    Signals wait until the rename is done. For any kind of file.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    path = Path(path)
    temporary: Path | None = None
    try:
        with deferred():
            descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".tmp", dir=path.parent)
            os.close(descriptor)
            temporary = Path(name)
            yield temporary
            _sync(temporary)
            os.chmod(temporary, 0o666 & ~_umask())
            os.replace(temporary, path)
            temporary = None
            _sync(path.parent)
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise ResultError(f"{path}: cannot be written ({reason})") from error
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                temporary.unlink()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_text(path: str | Path, content: str) -> None:
    """A text file, whole or not at all.

    Raises
    ------
    ResultError
        If it cannot be written.
    """
    if not Path(path).parent.is_dir():
        raise ResultError(f"{path}: the folder {Path(path).parent} does not exist")
    with temporary_name(path) as temporary:
        temporary.write_text(content, encoding="utf-8")
