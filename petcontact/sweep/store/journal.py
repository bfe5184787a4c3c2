"""Journals: the rows of finished cases as they come, one file a rank and run, a line of JSON a case with its checksum.

A line is there or it is not: whatever a kill or a full disk cuts off does not match its checksum and is not read. A program
that reads JSON lines (`pandas.read_json(path, lines=True)`) reads a journal.
"""

from __future__ import annotations

import json
import math
import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ...errors import OutputError

HEAD = '{"crc32":"%08x",'
HEAD_LENGTH = len(HEAD % 0)
Row = dict[str, Any]


class Journal:
    """One rank's journal of one run; the file appears with its first row."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._descriptor = -1

    def append(self, rows: list[Row]) -> None:
        """Write rows to the disk.

        Raises
        ------
        OutputError
            If they cannot be written; what is finished on the disk stays whole.
        """
        try:
            if self._descriptor < 0:
                self._descriptor = os.open(self.path, os.O_CREAT | os.O_WRONLY | os.O_APPEND, 0o666)
            rest = memoryview("".join(map(_line, rows)).encode())
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
            os.fdatasync(self._descriptor)
        except OSError as error:
            raise OutputError(
                f"{self.path}: cannot be written ({error.strerror}); the finished cases are whole, "
                "start the sweep again where there is room"
            ) from error

    def close(self) -> None:
        """The file stays until its rows are in the table."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def _line(row: Row) -> str:
    # NaN is no JSON: a number that is not there is null
    plain = {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in row.items()}
    text = json.dumps(plain, ensure_ascii=False)[1:]
    return HEAD % zlib.crc32(text.encode()) + text + "\n"


def read_journal(path: Path) -> Iterator[Row]:
    """The whole rows of a journal; a torn or altered line is left out."""
    with open(path, "rb") as file:
        for line in file:
            text = line[HEAD_LENGTH:].rstrip(b"\n")
            if line[:HEAD_LENGTH] == (HEAD % zlib.crc32(text)).encode() and line.endswith(b"\n"):
                yield json.loads(b"{" + text)
