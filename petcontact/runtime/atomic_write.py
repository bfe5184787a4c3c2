"""Files that appear under their name only when they are whole and on the disk."""

from __future__ import annotations

import contextlib
import itertools
import os
import secrets
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..errors import InputError, OutputError
from .signals import deferred


def check_target(
    path: Path, *, replace: bool, inputs: Sequence[str | Path] = (), longest: str = ""
) -> None:
    """Refuse, before any work is done, a name under which a file could not be written or should not
    be.

    Parameters
    ----------
    path : Path
    replace : bool
        Whether a file that is there may be replaced.
    inputs : sequence of str or Path
        Files that are read, which must not be replaced.
    longest : str
        The longest name that is written into the same folder, if it is not that of `path`.

    Raises
    ------
    InputError
        If there is a file that must not be replaced, something else than a file, no such folder, or
        the name is too long.
    OutputError
        If no file can be made in the folder.
    """
    folder = path.parent
    try:
        if not folder.is_dir():
            raise InputError(f"{path}: the folder {folder} does not exist")
        limit = os.pathconf(folder, "PC_NAME_MAX") if hasattr(os, "pathconf") else 255
        for name in filter(None, (path.name, longest)):
            if len(os.fsencode(name)) > limit:
                raise InputError(
                    f"{path}: {name!r:.40}... is a name of {len(os.fsencode(name))} bytes, "
                    f"{limit} are allowed"
                )
        if path.is_symlink() and not path.exists():
            raise InputError(f"{path}: is a link to {os.readlink(path)}, which is not there")
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: is not a file, and cannot be replaced by one")
        if path.exists() and not replace:
            raise InputError(f"{path}: exists already; --force replaces it, or name another")
        for source in inputs:
            if path.exists() and Path(source).exists() and path.samefile(source):
                raise InputError(f"{path}: is what is read; name another")
        with tempfile.TemporaryFile(dir=os.path.realpath(path.parent)):
            pass
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror})") from None


@contextlib.contextmanager
def temporary_name(
    path: str | Path, *, replace: bool = True, suffix: str = ".tmp"
) -> Iterator[Path]:
    """A name beside `path`, renamed to it when the block ends well and removed when it does not.

    Signals wait until the rename is done. For any kind of file. A link is followed.

    Parameters
    ----------
    path : str or Path
    replace : bool
        Whether a file that is there by then is replaced. If not, the new file is kept under a name
        that is free.
    suffix : str
        Of the name, for writers that know the format by it.

    Raises
    ------
    OutputError
        If the file cannot be written, or is kept under another name.
    """
    target = Path(os.path.realpath(path))
    # short: the name of the file itself may be as long as any may
    temporary = target.with_name(f".petcontact-{secrets.token_hex(8)}{suffix}")
    try:
        with deferred():
            temporary.touch(exist_ok=False)
            yield temporary
            _sync(temporary)
            published = _published(temporary, target, replace)
            _sync(target.parent)
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise OutputError(f"{path}: cannot be written ({reason})") from error
    finally:
        with contextlib.suppress(OSError):  # after the renaming it is not there
            temporary.unlink()
    if published != target:
        raise OutputError(
            f"{path}: was written by another program meanwhile; what would have replaced it is in "
            f"{published}"
        )


def _published(temporary: Path, target: Path, replace: bool) -> Path:
    """The name under which a file appears: `target`, or where it may not replace any, the first
    free one like it."""
    if replace:
        return temporary.replace(target)
    stem, suffix = os.fsencode(target.stem)[:200].decode(errors="ignore"), target.suffix
    for name in itertools.chain(
        [target], (target.with_name(f"{stem}-{k}{suffix}") for k in itertools.count(2))
    ):
        with contextlib.suppress(FileExistsError):
            try:
                os.link(temporary, name)
            except FileExistsError:
                raise
            except OSError:  # a file system without links
                os.close(os.open(name, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
                os.replace(temporary, name)
            return name
    raise AssertionError  # numbers do not end


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
    InputError
        If there is no such folder.
    OutputError
        If it cannot be written.
    """
    if not Path(path).parent.is_dir():
        raise InputError(f"{path}: the folder {Path(path).parent} does not exist")
    with temporary_name(path) as temporary:
        temporary.write_text(content, encoding="utf-8")
