"""Logs, the only truth of a sweep: one file a rank and run, to which records are appended, never
altered and never deleted.

A record is a line, checksum and JSON object with the row of a case, and after it the bytes of its
kept fields, so that the two cannot disagree. Whatever a kill, a full disk or a bad sector leaves
torn does not match its checksum and is not there; the reader goes on with the next line that does.
"""

from __future__ import annotations

import json
import math
import os
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from ...errors import OutputError
from ...runtime.signals import deferred
from ...untyped import Keyed

LONGEST_WAIT = 1.0
"""Seconds of finished work that a kill may cost."""
Row = Keyed


class Log:
    """What one rank finishes in one run, on the disk but for the last second of work.

    Parameters
    ----------
    path : Path
        Of a file that no other writer has; it appears with the first record.
    written : callable
        Called with the numbers of rows, and of failed ones among them, that have just come to the
        disk.
    """

    def __init__(
        self, path: Path, written: Callable[[int, int], None] = lambda rows, failed: None
    ) -> None:
        self.path, self.written = path, written
        self._waiting: list[bytes] = []
        self._failed = 0
        self._oldest = self._last = time.monotonic()

    def add(self, row: Row, fields: bytes = b"") -> None:
        """Append the row of a case that has ended; it began when the one before ended."""
        now = time.monotonic()
        with deferred():
            if not self._waiting:
                self._oldest = self._last
            self._waiting.append(_record(row, fields))
            self._failed += row["status"] == "failed"
        self._last = now
        if now - self._oldest > LONGEST_WAIT:
            self.flush()

    def flush(self) -> None:
        """Put everything on the disk.

        Raises
        ------
        OutputError
            If it cannot be written; what is finished on the disk stays whole.
        """
        if not self._waiting:
            return
        with deferred():
            try:
                self._append(memoryview(b"".join(self._waiting)))
            except OSError as error:
                raise OutputError(
                    f"{self.path}: cannot be written ({error.strerror}); the finished cases are "
                    "whole, start the sweep again where there is room"
                ) from error
            counts = len(self._waiting), self._failed
            self._waiting, self._failed = [], 0
        self.written(*counts)

    def _append(self, rest: memoryview) -> None:
        # opened each time: network file systems show to others what was closed
        descriptor = os.open(self.path, os.O_CREAT | os.O_WRONLY | os.O_APPEND, 0o666)
        try:
            while rest:
                rest = rest[os.write(descriptor, rest) :]
            os.fdatasync(descriptor)
        finally:
            os.close(descriptor)


def _record(row: Row, fields: bytes) -> bytes:
    # a number that is not there is null; one without a bound is Infinity, as Python reads it
    plain = {
        key: None if isinstance(value, float) and math.isnan(value) else value
        for key, value in row.items()
    }
    line = (
        json.dumps(
            {**plain, "bytes": len(fields), "sum": zlib.crc32(fields)}, ensure_ascii=False
        ).encode()
        + b"\n"
    )
    # the last end of line keeps this record and the next one apart, should the first be altered
    return b"%08x %b%b\n" % (zlib.crc32(line), line, fields)


class Record(NamedTuple):
    """A record of a log: the row, and where its fields are."""

    row: Row
    path: Path
    at: int

    def fields(self) -> bytes | None:
        """The bytes of the kept fields; None where they are not what was written."""
        with open(self.path, "rb") as file:
            file.seek(self.at)
            content = file.read(self.row["bytes"])
        return content if zlib.crc32(content) == self.row["sum"] else None


def records(path: Path, *, check: bool = False) -> Iterator[Record]:
    """The whole records of a log in their order; with `check` those alone whose fields are what was
    written.

    A log that is not there has none: a network file system may show an old folder for a while.
    """
    if not path.exists():
        return
    with open(path, "rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        while line := file.readline():
            head, _, text = line.partition(b" ")
            if head != b"%08x" % zlib.crc32(text):
                continue
            record = Record(json.loads(text), path, file.tell())
            length = record.row["bytes"]
            if record.at + length > size or (
                check and length and zlib.crc32(file.read(length)) != record.row["sum"]
            ):
                file.seek(record.at)
                continue
            file.seek(record.at + length)
            yield record
