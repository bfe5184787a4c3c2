"""The cases of a sweep as columns, derived from its logs; and results.h5 with the finished ones, a
data set a column.

pandas.DataFrame({name: column[()] for name, column in
h5py.File("out/results.h5")["cases"].items()})
"""

from __future__ import annotations

import functools
import importlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ...errors import InputError, OutputError, ResultError
from ...record import record
from ...results.format.container import write_atomically
from ...results.solution import Solution, read_result
from ...runtime.hints import among
from ...untyped import DataFrame, Keyed
from ..design.identity import Identity
from ..design.sweep import Sweep
from .columns import Column, Columns, columns_of, size_of, stacked, taken, texts
from .fields import unpacked
from .folder import FORMAT, FORMAT_VERSION, SweepFolder
from .log import records

OWN = ("digest",)
"""Columns that are the program's, not the user's."""
OF_RECORDS = ("id", "keep", "bytes", "sum")
"""Entries of a record that are no columns: the id is that which the case has in the sweep."""


@record
class CaseTable:
    """The cases of a sweep in its order.

    Attributes
    ----------
    title : str
    coordinates : list of str
        Names of the columns that distinguish the cases.
    columns : dict of str to array
        id, coordinates, status (converged | not converged | failed | missing), reason, iterations
        and the quantities; texts as UTF-8 bytes, NaN where there is nothing.
    folder : Path
        Where the logs with kept fields are.
    keys : mapping of str to str
        Coordinates by the dotted keys that they vary.
    """

    title: str
    coordinates: list[str]
    columns: Columns
    folder: Path
    keys: Mapping[str, str] = field(default_factory=dict)

    def __len__(self) -> int:
        return size_of(self.columns)

    @property
    def names(self) -> list[str]:
        """Names of the columns that users see."""
        return [name for name in self.columns if name not in OWN]

    @functools.cached_property
    def status(self) -> list[str]:
        """Status of every case."""
        return texts(self.columns["status"])

    def values(self, name: str) -> list[Any]:
        """A column as Python's values: text, number, or None where there is nothing.

        Raises
        ------
        InputError
            If there is no such column.
        """
        if name not in self.names:
            raise InputError(
                f"{name}: neither a coordinate nor a quantity of this sweep"
                f"{among(name, self.names)}"
            )
        return plain(self.columns[name])

    def numbers(self, name: str) -> Column:
        """A column of numbers as floats.

        Raises
        ------
        InputError
            If there is no such column, or it holds texts.
        """
        self.values(name)
        if self.columns[name].dtype.kind == "S":
            raise InputError(f"{name}: holds texts, not numbers")
        return self.columns[name].astype(float)

    def kept(self, case: int) -> Solution | Keyed | None:
        """What is kept of a case by its place in the table: the whole result, fields on the
        contact, or None.

        Raises
        ------
        ResultError
            If the fields are damaged.
        """
        digest = texts(self.columns["digest"][case : case + 1])[0]
        logs = SweepFolder(self.folder).log_files()
        newest = [
            record for path in logs for record in records(path) if record.row["digest"] == digest
        ][-1:]
        if not newest or not newest[0].row["bytes"]:
            return None
        (record,) = newest
        content = record.fields()
        if content is None:
            raise ResultError(
                f"{record.path}: the fields of {record.row['id']} are damaged; the sweep computes "
                "them again"
            )
        return unpacked(content, record.row["keep"])


def plain(values: Column) -> list[Any]:
    """A column as Python's values; whole numbers are int where all are (NaN is None)."""
    if values.dtype.kind == "S":
        return texts(values)
    return [None if value != value else value for value in values.tolist()]


def derived(sweep: Sweep, identity: Identity, logs: Iterable[Path]) -> Columns:
    """A row a case of a sweep: the newest record of its digest, or the status "missing"."""
    digests = [identity.digest(place).encode() for place in range(len(sweep))]
    wanted = set(digests)
    columns = columns_of(
        {name: value for name, value in row.items() if name not in OF_RECORDS}
        for path in logs
        for row, *_ in records(path)
        if row["digest"].encode() in wanted
    )
    newest = (
        {digest: row for row, digest in enumerate(columns["digest"].tolist())} if columns else {}
    )
    if len(newest) < len(wanted):
        columns = stacked(
            [columns, columns_of([{"digest": "", "status": "missing", "reason": ""}])]
        )
    rows = taken(columns, np.array([newest.get(digest, -1) for digest in digests], np.int64))
    heads = columns_of(
        {"id": id_, **sweep.coordinates(place)} for place, id_ in enumerate(sweep.ids)
    )
    return {**heads, **{name: values for name, values in rows.items() if name not in heads}}


def write_table(
    path: Path, title: str, coordinates: list[str], columns: Columns, facts: Mapping[str, object]
) -> None:
    """results.h5, whole or not at all: the finished cases, and ranks and seconds of the run that
    wrote it.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    columns = taken(columns, columns["status"] != b"missing")
    columns = {name: values for name, values in columns.items() if name not in OWN}

    def fill(file: h5py.File) -> None:
        file.attrs.update(
            {
                "format": FORMAT,
                "format_version": FORMAT_VERSION,
                "title": title,
                "coordinates": json.dumps(coordinates),
                "facts": json.dumps(facts),
            }
        )
        table = file.create_group("cases", track_order=True)
        for name, values in columns.items():
            text = h5py.string_dtype("utf-8", values.dtype.itemsize)
            packed = {"compression": 1, "shuffle": True, "fletcher32": True} if len(values) else {}
            table.create_dataset(
                name, data=values.astype(text) if values.dtype.kind == "S" else values, **packed
            )

    try:
        write_atomically(path, fill)
    except OutputError as error:
        raise OutputError(
            f"{error}; the finished cases are whole, start the sweep again where there is room"
        ) from error


def read_case_table(path: str | Path) -> CaseTable:
    """The cases of a sweep's folder, of a run under way, too, or of the folder of a results.h5.

    Raises
    ------
    ResultError
        If it is neither.
    """
    path = Path(path)
    folder = SweepFolder(path.parent if path.name == "results.h5" else path)
    sweep, identity = folder.read_index()
    return CaseTable(
        sweep.file.title,
        sweep.coordinate_names,
        derived(sweep, identity, folder.log_files()),
        folder.path,
        sweep.names,
    )


def load_sweep(path: str | Path) -> DataFrame | Columns:
    """The table of a sweep, a row a case: coordinates, status and quantities.

    Parameters
    ----------
    path : str or Path
        The folder of a sweep, finished or not, or its results.h5.

    Returns
    -------
    pandas.DataFrame, or dict of str to array
        The latter where pandas is not installed.

    Raises
    ------
    ResultError
        If it is no sweep.
    """
    table = read_case_table(path)
    columns = {
        name: np.array(texts(values), object) if values.dtype.kind == "S" else values
        for name, values in table.columns.items()
        if name in table.names
    }
    try:
        pandas = importlib.import_module("pandas")
    except ImportError:
        return columns
    return pandas.DataFrame(columns)


def load_case(path: str | Path, id_: str) -> Solution | Keyed:
    """What a sweep keeps of one case besides its scalars.

    Parameters
    ----------
    path : str or Path
        The folder of a sweep, finished or not, or the results.h5 in it.
    id_ : str
        Of the case.

    Returns
    -------
    Solution, or dict of str to array
        The fields on Γ_C where only these are kept.

    Raises
    ------
    ResultError
        If it is no sweep, has no such case, or no fields are kept (`keep` in the sweep file).
    """
    table = read_case_table(path)
    ids = texts(table.columns["id"])
    if id_ not in ids:
        raise ResultError(f"{path}: no case {id_}")
    outcome = table.kept(ids.index(id_))
    if outcome is None:
        raise ResultError(
            f'{path}: no fields of {id_} are there; keep = "contact" or "all" in the sweep file '
            f"keeps them"
        )
    return outcome


def read_case(path: str | Path, id_: str = "/") -> Solution:
    """A result file, or with an id that case of a sweep.

    Raises
    ------
    ResultError
        If there is no such file, sweep or case, or not all of its fields are kept.
    """
    if id_ == "/":
        path = Path(path)
        folder = SweepFolder(path.parent if path.name == "results.h5" else path)
        if folder.index.is_file():
            raise ResultError(
                f"{path}: a sweep has many results; --case ID names one of them, such as "
                f"{folder.read_index()[0].ids[0]}"
            )
        return read_result(path)
    outcome = load_case(path, id_)
    if isinstance(outcome, dict):
        raise ResultError(
            f'{path}: {id_} has its fields on the contact part only; keep = "all" in the sweep '
            f"file keeps all"
        )
    return outcome
