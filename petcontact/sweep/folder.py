"""The folder of a sweep: case files, what is finished, the lock, and leftovers of a run that was killed."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import time
from pathlib import Path
from typing import Any

from ..errors import InputError, ResultError
from ..results.hdf5 import FORMAT, FORMAT_VERSION, opened
from ..runtime.atomic_write import write_text
from .cases import Sweep, SweepCase
from .claims import Board

FINISHED = ("converged", "not converged")
INDEX_FORMAT = "petcontact sweep"
LOCK_PATIENCE = 10.0
"""Seconds that a sweep waits for the ranks of a killed one to be gone."""


class SweepFolder:
    """Paths of a sweep below one folder.

    Attributes
    ----------
    cases : Path
        One result file a case, ID.h5.
    results : Path
        results.h5: all cases, one group each.
    index : Path
        sweep.json: title, ids and coordinates of the cases.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.cases = self.path / "cases"
        self.results = self.path / "results.h5"
        self.index = self.path / "sweep.json"
        self.board = Board(self.path / ".running")
        self._lock = -1

    def case_file(self, case: SweepCase) -> Path:
        """The result file of a case."""
        return self.cases / f"{case.id}.h5"

    def open(self) -> None:
        """Make the folder, take it for this run alone, remove what a killed run left; for one rank.

        Raises
        ------
        InputError
            If it cannot be made, or another sweep runs in it.
        """
        try:
            self.cases.mkdir(parents=True, exist_ok=True)
            self._take(fcntl.LOCK_EX)
            for leftover in [*self.path.glob(".*.tmp"), *self.cases.glob(".*.tmp")]:
                leftover.unlink()
            shutil.rmtree(self.board.folder, ignore_errors=True)
            self.board.folder.mkdir()
            self._take(fcntl.LOCK_SH)
        except OSError as error:
            raise InputError(f"{self.path}: cannot be used as the folder of a sweep ({error.strerror})") from None

    def enter(self) -> None:
        """Hold the folder as long as this process lives; for the other ranks, after `open`."""
        self._take(fcntl.LOCK_SH)

    def close(self) -> None:
        """Let another sweep in."""
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1

    def clear_board(self) -> None:
        """Remove the board of a run that has ended."""
        shutil.rmtree(self.board.folder, ignore_errors=True)

    def write_index(self, sweep: Sweep) -> None:
        """sweep.json, whole or not at all."""
        write_text(self.index, index_text(sweep))

    def is_finished(self, case: SweepCase) -> bool:
        """Whether the file of a case can be read, is of this format, of the same config, and did not fail."""
        path = self.case_file(case)
        if not path.exists():
            return False
        try:
            attributes = read_attributes(path)
        except ResultError:
            return False
        return (
            (attributes.get("format"), attributes.get("format_version")) == (FORMAT, FORMAT_VERSION)
            and attributes.get("status") in FINISHED
            and attributes.get("config") == case.case.toml()
        )

    def _take(self, kind: int) -> None:
        """A lock that ends with the process, however that ends; file systems without locks go without."""
        if self._lock < 0:
            self._lock = os.open(self.path / ".lock", os.O_CREAT | os.O_RDWR, 0o666)
        deadline = time.monotonic() + LOCK_PATIENCE
        while True:
            try:
                fcntl.flock(self._lock, kind | fcntl.LOCK_NB)
                return
            except BlockingIOError:
                if time.monotonic() > deadline:
                    raise InputError(f"{self.path}: another sweep runs in this folder") from None
                time.sleep(0.1)
            except OSError:
                return


def index_text(sweep: Sweep) -> str:
    """Title, ids and coordinates as JSON."""
    cases = [{"id": case.id, "coordinates": case.coordinates} for case in sweep.cases]
    return json.dumps({"format": INDEX_FORMAT, "version": 1, "title": sweep.title, "cases": cases}, indent=1)


def read_attributes(path: str | Path) -> dict[str, Any]:
    """The attributes of a result file.

    Raises
    ------
    ResultError
        If it is no whole HDF5 file.
    """
    with opened(path) as file:
        return dict(file.attrs)
