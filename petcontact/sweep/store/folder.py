"""The folder of a sweep: sweep.json (what its cases follow from), log/ (the truth), results.h5
(derived from these two)."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from ...errors import InputError, ResultError
from ...runtime.atomic_write import write_text
from ...untyped import Keyed
from ..design.identity import Identity
from ..design.sweep import Sweep

FORMAT, FORMAT_VERSION = "petcontact sweep", 3


class SweepFolder:
    """Paths below one folder.

    Attributes
    ----------
    index, table, logs : Path
        sweep.json, results.h5, and the folder of the logs.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.index, self.table, self.logs = (
            self.path / name for name in ("sweep.json", "results.h5", "log")
        )
        self._lock = -1

    def open(self, token: str) -> tuple[Path, list[str]]:
        """Make the folder, and one for the counters of a run; for one rank. Also a remark where
        another run is at work.

        Nothing depends on being alone, as logs and counters carry the name of their run: two runs
        may compute a case twice. What a killed run has left is removed by the next one that is
        alone.

        Raises
        ------
        InputError
            If the folder cannot be made, or holds something else.
        """
        running, remarks = self.path / f".run-{token}", []
        try:
            for folder in (self.path, self.logs):
                folder.mkdir(parents=True, exist_ok=True)
            if self.table.is_dir() or self.index.is_dir():
                raise InputError(f"{self.path}: results.h5 and sweep.json are no folders")
            if (self.path / "journal").exists() or (self.path / "cases").exists():
                raise InputError(
                    f"{self.path}: holds a sweep of an older petcontact; "
                    "name another folder with -o"
                )
            self._lock = os.open(self.path / ".lock", os.O_CREAT | os.O_RDWR, 0o666)
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                for leftover in [*self.path.glob(".run-*"), *self.path.glob(".petcontact-*.tmp")]:
                    remove(leftover)
                fcntl.flock(self._lock, fcntl.LOCK_SH)
            except BlockingIOError:
                remarks = [
                    f"{self.path}: another run is at work here; what both compute is computed twice"
                ]
                fcntl.flock(self._lock, fcntl.LOCK_SH)
            except OSError:
                pass  # a file system without locks
            running.mkdir()
        except OSError as error:
            raise InputError(
                f"{self.path}: cannot be used as the folder of a sweep ({error.strerror})"
            ) from None
        return running, remarks

    def close(self, running: Path) -> None:
        """Close the files of the run."""
        remove(running)
        os.close(self._lock)

    @contextlib.contextmanager
    def renewing(self) -> Iterator[None]:
        """A block in which one run renews the table while others wait, so that the last one has the
        rows of all."""
        lock = os.open(self.path / ".lock-table", os.O_CREAT | os.O_RDWR, 0o666)
        try:
            with contextlib.suppress(OSError):
                fcntl.flock(lock, fcntl.LOCK_EX)
            yield
        finally:
            os.close(lock)

    def log_files(self) -> list[Path]:
        """Log files, in the order of their runs."""
        return sorted(self.logs.glob("*.log"))

    def write_index(self, sweep: Sweep, identity: Identity) -> None:
        """sweep.json, whole or not at all."""
        source, data, problems = sweep.content
        content = {
            "format": FORMAT,
            "version": FORMAT_VERSION,
            "title": sweep.file.title,
            "cases": len(sweep),
            "source": source,
            "sweep": data,
            "problems": problems,
            "identity": identity.facts,
        }
        write_text(self.index, json.dumps(content, indent=1, default=str))

    def read_index(self) -> tuple[Sweep, Identity]:
        """The sweep that was computed here last, and what its cases are.

        Raises
        ------
        ResultError
            If there is none.
        """
        try:
            index: Keyed = json.loads(self.index.read_text(encoding="utf-8"))
            if (index["format"], index["version"]) != (FORMAT, FORMAT_VERSION):
                raise InputError("of another version of petcontact")
            sweep = Sweep(index["source"], index["sweep"], index["problems"])
            return sweep, Identity(sweep, index["identity"])
        except (OSError, ValueError, KeyError, TypeError, AttributeError, InputError) as error:
            why = f"{self.index.name}: {error.strerror}" if isinstance(error, OSError) else error
            raise ResultError(
                f"{self.path}: not the folder or results.h5 of a sweep ({why})"
            ) from None


def remove(path: Path) -> None:
    """A file or a whole folder, if it is there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
