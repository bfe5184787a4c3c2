"""The folder of a sweep: its index, table, journals and shards, the lock, and leftovers of a run that was killed."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...errors import InputError, ResultError
from ...runtime.atomic_write import write_text
from ..design.sweep import Sweep
from .table_file import FORMAT, FORMAT_VERSION

LOCK_PATIENCE = 10.0
"""Seconds that a sweep waits for the ranks of a killed one to be gone."""


class SweepFolder:
    """Paths of a sweep below one folder.

    Attributes
    ----------
    index : Path
        sweep.json: everything that the cases follow from.
    table : Path
        results.h5: a column a quantity, a row a finished case.
    journals : Path
        Rows that are not in the table yet, a file a rank and run.
    fields : Path
        Shards with the fields that are kept.
    running : Path
        The counters of a run whose MPI has none; gone when no run is under way.
    """

    def __init__(self, path: str | Path, part: tuple[int, int] | None = None) -> None:
        self.path = Path(path)
        self.index = self.path / "sweep.json"
        self.table = self.path / "results.h5"
        self.journals = self.path / "journal"
        self.fields = self.path / "fields"
        name = "" if part is None else f"-{part[0]}-of-{part[1]}"
        self.running = self.path / f".running{name}"
        # a run of its own holds one lock; a part holds its own and, with all other parts, a second one
        whole, self._parts, self._part = self.path / ".lock", self.path / ".lock-parts", part
        self._mine = [whole] if part is None else [self.path / f".lock{name}", self._parts]
        self._others = self._parts if part is None else whole
        self._locks: dict[Path, int] = {}

    def open(self) -> None:
        """Make the folder, take it for this run alone (or this part of it), remove what a killed run left; for one rank.

        Raises
        ------
        InputError
            If it cannot be made, or another sweep runs in it.
        """
        try:
            for folder in (self.path, self.journals, self.fields):
                folder.mkdir(parents=True, exist_ok=True)
            if self.table.is_dir() or self.index.is_dir():
                raise InputError(f"{self.path}: results.h5 and sweep.json are no folders")
            for path in self._mine:
                self._take(path, fcntl.LOCK_EX if path != self._parts else fcntl.LOCK_SH)
            self._take(self._others, fcntl.LOCK_EX)
            os.close(self._locks.pop(self._others))
            for leftover in [*self.path.glob(".*.tmp"), *self.fields.glob(".*.tmp")] if self._part is None else []:
                leftover.unlink()
            remove(self.running)
            self.running.mkdir()
            self.enter()
        except InputError:
            self.close()
            raise
        except OSError as error:
            raise InputError(f"{self.path}: cannot be used as the folder of a sweep ({error.strerror})") from None

    def enter(self) -> None:
        """Hold the folder as long as this process lives; for the other ranks, after `open`."""
        for path in self._mine:
            self._take(path, fcntl.LOCK_SH)

    def close(self) -> None:
        """Let another sweep in."""
        for descriptor in self._locks.values():
            os.close(descriptor)
        self._locks = {}

    def journal_files(self) -> list[Path]:
        """In the order of their runs."""
        return sorted(self.journals.glob("*.jsonl"))

    def write_index(self, sweep: Sweep) -> None:
        """sweep.json, whole or not at all."""
        source, data, problems = sweep.content
        content = {"format": FORMAT, "version": FORMAT_VERSION, "title": sweep.title, "cases": len(sweep), "source": source,
                   "sweep": data, "problems": problems}  # fmt: skip
        write_text(self.index, json.dumps(content, indent=1, default=str))

    def _take(self, path: Path, kind: int) -> None:
        """A lock that ends with the process, however that ends; file systems without locks go without."""
        if path not in self._locks:
            self._locks[path] = os.open(path, os.O_CREAT | os.O_RDWR, 0o666)
        deadline = time.monotonic() + LOCK_PATIENCE
        while True:
            try:
                fcntl.flock(self._locks[path], kind | fcntl.LOCK_NB)
                return
            except BlockingIOError:
                if time.monotonic() > deadline:
                    raise InputError(f"{self.path}: another sweep runs in this folder") from None
                time.sleep(0.1)
            except OSError:
                return


def remove(path: Path) -> None:
    """A file or a whole folder, if it is there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def read_index(path: Path) -> dict[str, Any]:
    """The index of a sweep's folder, of any format.

    Raises
    ------
    ResultError
        If there is none.
    """
    try:
        index = json.loads((path / "sweep.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise ResultError(f"{path}: not the folder or results.h5 of a sweep") from None
    if not isinstance(index, dict) or index.get("format") != FORMAT or index.get("version") not in (1, FORMAT_VERSION):
        raise ResultError(f"{path}: not the index of a sweep")
    return index


def known_ids(index: dict[str, Any]) -> Sequence[str]:
    """Ids of the cases that an index tells of."""
    if index["version"] == 1:
        return [entry["id"] for entry in index["cases"]]
    return Sweep(index["source"], index["sweep"], index["problems"]).ids
