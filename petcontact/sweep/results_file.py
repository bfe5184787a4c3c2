"""results.h5: all cases of a sweep in one file, one group each, copied from the case files as they appear."""

from __future__ import annotations

import contextlib
import io
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import h5py

from ..errors import OutputError, ResultError
from ..results.hdf5 import FORMAT_VERSION, opened
from ..runtime.atomic_write import temporary_name
from .cases import Sweep
from .folder import INDEX_FORMAT, SweepFolder, index_text

INDEX, FACTS = ".index", ".facts"
"""Data sets of results.h5 beside the cases, whose ids never begin with a dot."""


class Collector:
    """Fills a hidden file while the sweep runs; `finish` gives it its name.

    Attributes
    ----------
    statuses : dict of int to (str, str)
        Status and reason of the cases collected so far, by their place in the sweep.
    """

    def __init__(self, folder: SweepFolder, sweep: Sweep) -> None:
        self._folder, self._sweep = folder, sweep
        self._path = folder.path / f".{folder.results.name}.collected.tmp"
        self.statuses: dict[int, tuple[str, str]] = {}
        try:
            self._raw = _Steadfast(self._path, "w+")
        except OSError as error:
            raise self._error(error) from error
        self._file: Any = h5py.File(self._raw, "w")

    def add(self, places: Iterable[int], limit: int | None = None) -> None:
        """Copy the files of some cases (at most `limit`) that are not copied yet."""
        waiting = sorted(set(places) - self.statuses.keys())
        for place in waiting[:limit]:
            case = self._sweep.cases[place]
            with opened(self._folder.case_file(case)) as source:
                # without attributes: HDF5 1.10 crashes on copying those of a group that tracks their order
                source.copy(source["/"], self._file, case.id, without_attrs=True)
                attributes = dict(source.attrs)
            self._file[case.id].attrs.update(attributes)
            self._check()
            self.statuses[place] = (str(attributes["status"]), str(attributes["reason"]))

    def finish(self, facts: dict[str, Any]) -> Path:
        """Close, flush to the disk, rename to results.h5."""
        self._file.attrs.update({"format": INDEX_FORMAT, "format_version": FORMAT_VERSION, "title": self._sweep.title})
        # data sets: an attribute holds 64 kB at most
        self._file[INDEX] = index_text(self._sweep)
        self._file[FACTS] = json.dumps(facts)
        self._file.close()
        self._check()
        self._raw.close()
        with temporary_name(self._folder.results) as temporary:
            os.replace(self._path, temporary)
        return self._folder.results

    def _check(self) -> None:
        if (error := self._raw.error) is not None:
            with contextlib.suppress(OSError, RuntimeError):
                self._file.close()
            self._raw.close()
            self._path.unlink(missing_ok=True)
            raise self._error(error) from error

    def _error(self, error: OSError) -> OutputError:
        return OutputError(
            f"{self._folder.results}: cannot be written ({error.strerror}); the finished cases are whole, "
            "start the sweep again where there is room"
        )


class _Steadfast(io.FileIO):
    """A file that keeps the first error of its writes to itself, for HDF5, which crashes the process on one.

    Attributes
    ----------
    error : OSError or None
        To be looked at by who writes.
    """

    error: OSError | None = None

    def write(self, data: Any) -> int:
        """All of the data, or nothing more after an error."""
        rest = memoryview(data).cast("B")
        size = len(rest)
        while len(rest) and self.error is None:
            try:
                rest = rest[super().write(rest) or 0 :]
            except OSError as error:
                self.error = error
        return size

    def truncate(self, size: int | None = None) -> int:
        """Of the file, unless it had an error."""
        try:
            return super().truncate(size) if self.error is None else size or 0
        except OSError as error:
            self.error = error
            return size or 0


def read_index(path: str | Path) -> dict[str, Any]:
    """The index of a sweep's folder or of its results.h5.

    Raises
    ------
    ResultError
        If there is none.
    """
    path = Path(path)
    try:
        if path.is_dir():
            index = json.loads(SweepFolder(path).index.read_text(encoding="utf-8"))
        else:
            with opened(path) as file:
                index = json.loads(file[INDEX][()])
    except (OSError, ValueError, KeyError) as error:
        if isinstance(error, ResultError):
            raise
        raise ResultError(f"{path}: not the folder or results.h5 of a sweep") from None
    if not isinstance(index, dict) or index.get("format") != INDEX_FORMAT:
        raise ResultError(f"{path}: not the index of a sweep")
    return index
