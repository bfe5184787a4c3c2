"""All cases of a sweep as columns, finished or not, of a folder or a results.h5 of any format."""

from __future__ import annotations

import functools
import importlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError, ResultError
from ...results.format.container import opened
from ...results.solution import Solution, read_result
from ..design.sweep import Sweep
from . import format1
from .columns import Column, Columns, columns_of, size_of, stacked, taken, texts
from .finished import read_all
from .folder import SweepFolder, read_index
from .shards import contact_arrays, kept_in, read_contact, shard_path
from .table_file import FORMAT, read_table

OWN = ("digest", "fields")
"""Columns that are the program's, not the user's."""


@dataclass(frozen=True)
class CaseTable:
    """The cases of a sweep in its order.

    Attributes
    ----------
    title : str
    coordinates : list of str
        Names of the columns that distinguish the cases.
    columns : dict of str to array
        id, coordinates, status (converged | not converged | failed | missing), reason, iterations and the quantities; texts
        as UTF-8 bytes, NaN where there is nothing.
    folder : Path
        Where the shards with fields are.
    """

    title: str
    coordinates: list[str]
    columns: Columns
    folder: Path

    def __len__(self) -> int:
        return size_of(self.columns)

    @property
    def names(self) -> list[str]:
        """Columns for the user."""
        return [name for name in self.columns if name not in OWN]

    @functools.cached_property
    def status(self) -> list[str]:
        """Of every case."""
        return texts(self.columns["status"])

    def values(self, name: str) -> list[Any]:
        """A column as Python's values: text, number, or None where there is nothing.

        Raises
        ------
        InputError
            If there is no such column.
        """
        if name not in self.columns or name in OWN:
            raise InputError(f"{name}: neither a coordinate nor a quantity of this sweep; there are {', '.join(self.names)}")
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

    def solution(self, case: int) -> Solution | None:
        """The whole result of a case by its place in the table; None where it is not kept."""
        name, id_ = self._shard(case)
        if kept_in(name) != "all":
            return None
        path = shard_path(self.folder, name)
        return read_result(path) if "/" in name else read_result(path, id_)

    def contact(self, case: int) -> dict[str, Any] | None:
        """The fields on Γ_C of a case by its place in the table; None where they are not kept."""
        name, id_ = self._shard(case)
        if kept_in(name) == "contact":
            return read_contact(shard_path(self.folder, name), id_)
        solution = self.solution(case)
        return None if solution is None else contact_arrays(solution)

    def _shard(self, case: int) -> tuple[str, str]:
        """Name of the shard with the fields of a case, and the case's id."""
        some = slice(case, case + 1)
        return texts(self.columns["fields"][some])[0] if "fields" in self.columns else "", texts(self.columns["id"][some])[0]


def plain(values: Column) -> list[Any]:
    """A column as Python's values; whole numbers are int where all are (NaN is None)."""
    if values.dtype.kind == "S":
        return texts(values)
    return [None if value != value else value for value in values.tolist()]


def read_case_table(path: str | Path) -> CaseTable:
    """The cases of a sweep's folder, of a run under way, too, or of its results.h5.

    Raises
    ------
    ResultError
        If it is neither.
    """
    path = Path(path)
    if not path.is_dir():
        return _from_file(path)
    index = read_index(path)
    if index["version"] == 1:
        return _from_format1(path, path, index)
    try:
        sweep = Sweep(index["source"], index["sweep"], index["problems"])
    except (KeyError, TypeError, InputError) as error:
        raise ResultError(f"{path}: not the index of a sweep ({error})") from None
    columns, _ = read_all(SweepFolder(path))
    newest = {id_: row for row, id_ in enumerate(texts(columns["id"]))} if columns else {}
    places = [place for place, id_ in enumerate(sweep.ids) if id_ in newest]
    there = taken(columns, [newest[sweep.ids[place]] for place in places]) if places else {}
    missing = sorted(set(range(len(sweep))) - set(places))
    if missing:
        # texts and numbers of the coordinates come out as they do for the rows that are there
        nothing = {"status": "missing", "reason": "", "fields": ""}
        rows = ({"id": sweep.ids[k], **sweep.coordinates(k), **nothing} for k in missing)
        there = stacked([there, columns_of(rows)]) if there else columns_of(rows)
        there = taken(there, np.argsort([*places, *missing], kind="stable"))
    return CaseTable(index["title"], sweep.coordinate_names, there, path)


def _from_file(path: Path) -> CaseTable:
    with opened(path) as file:
        form, old = file.attrs.get("format"), ".index" in file
        index = json.loads(file[".index"][()]) if old else {}
    if form != FORMAT:
        raise ResultError(f"{path}: not the folder or results.h5 of a sweep")
    if old:
        return _from_format1(path, path.parent, index)
    table = read_table(path)
    return CaseTable(table.title, table.coordinates, table.columns, path.parent)


def _from_format1(path: Path, folder: Path, index: Mapping[str, Any]) -> CaseTable:
    names = list(dict.fromkeys(name for entry in index["cases"] for name in entry["coordinates"]))
    columns = columns_of(format1.read_rows(path, dict(index)))
    columns["fields"] = np.array([f"cases/{id_}.h5".encode() for id_ in texts(columns["id"])], "S")
    return CaseTable(index["title"], names, columns, folder)


def load_sweep(path: str | Path) -> Any:
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
    columns = {name: np.array(texts(values), object) if values.dtype.kind == "S" else values
               for name, values in table.columns.items() if name in table.names}  # fmt: skip
    try:
        pandas = importlib.import_module("pandas")
    except ImportError:
        return columns
    return pandas.DataFrame(columns)


def load_case(path: str | Path, id_: str) -> Solution | dict[str, Any]:
    """What a sweep keeps of one case besides its scalars.

    Parameters
    ----------
    path : str or Path
        The folder of a sweep, finished or not.
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
    place = ids.index(id_)
    found = table.solution(place) or table.contact(place)
    if found is None:
        raise ResultError(f'{path}: no fields of {id_} are there; keep = "contact" or "all" in the sweep file keeps them')
    return found


def read_case(path: str | Path, id_: str = "/") -> Solution:
    """A result file, or with an id that case of a sweep.

    Raises
    ------
    ResultError
        If there is no such file, sweep or case, or not all of its fields are kept.
    """
    if id_ == "/":
        return read_result(path)
    found = load_case(path, id_)
    if isinstance(found, dict):
        raise ResultError(f'{path}: {id_} has its fields on the contact part only; keep = "all" in the sweep file keeps all')
    return found
