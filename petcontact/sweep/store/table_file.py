"""results.h5: the table of a sweep, a data set a column, which one line of h5py, pandas or polars reads.

    pandas.DataFrame({name: column[()] for name, column in h5py.File("out/results.h5")["cases"].items()})
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ...errors import OutputError, ResultError
from ...results.format.container import opened, write_atomically
from .columns import Columns, checksum, size_of

FORMAT, FORMAT_VERSION = "petcontact sweep", 2
TABLE, FACTS = "cases", "facts"


@dataclass(frozen=True)
class TableFile:
    """What is in a results.h5.

    Attributes
    ----------
    title : str
    coordinates : list of str
        The columns that distinguish the cases.
    columns : dict of str to array
        All columns, one value a case, in the order of the sweep.
    facts : dict
        Ranks, seconds and processor times of the run that wrote it.
    """

    title: str
    coordinates: list[str]
    columns: Columns
    facts: dict[str, Any] = field(default_factory=dict)

    def write(self, path: Path) -> None:
        """Whole or not at all.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        def fill(file: h5py.File) -> None:
            file.attrs.update({
                "format": FORMAT, "format_version": FORMAT_VERSION, "title": self.title,
                "coordinates": json.dumps(self.coordinates), "checksum": checksum(self.columns),
            })  # fmt: skip
            file[FACTS] = json.dumps(self.facts)
            table = file.create_group(TABLE, track_order=True)
            for name, values in self.columns.items():
                width = values.dtype.itemsize
                kind = h5py.string_dtype("utf-8", width) if values.dtype.kind == "S" else values.dtype
                packed = {"compression": 1, "shuffle": True, "fletcher32": True} if size_of(self.columns) else {}
                table.create_dataset(name, data=values.astype(kind), **packed)

        try:
            write_atomically(path, fill)
        except OutputError as error:
            raise OutputError(
                f"{error}; the finished cases are whole, start the sweep again where there is room"
            ) from error


def read_table(path: Path) -> TableFile:
    """The table of a results.h5, every value checked.

    Raises
    ------
    ResultError
        If it is missing, damaged, altered, or of another format.
    """
    with opened(path) as file:
        if file.attrs.get("format") != FORMAT or file.attrs.get("format_version") != FORMAT_VERSION:
            raise ResultError(f"{path}: not the table of a sweep")
        try:
            columns = {}
            for name, stored in file[TABLE].items():
                if stored.external or stored.ndim != 1:
                    raise ValueError(f"column {name} is none")
                columns[name] = stored[()]
            columns = {name: v.astype(f"S{v.dtype.itemsize}") if v.dtype.kind == "S" else v for name, v in columns.items()}
            facts = json.loads(file[FACTS][()])
            title, names = str(file.attrs["title"]), json.loads(file.attrs["coordinates"])
            whole = not columns or {"id", "digest", "status", "fields", *names} <= set(columns)
            intact = whole and file.attrs["checksum"] == checksum(columns)
        except Exception as error:  # whatever damaged bytes make of h5py and numpy
            raise ResultError(f"{path}: damaged ({type(error).__name__}: {' '.join(str(error).split())})") from error
    if not intact or len({np.shape(values) for values in columns.values()}) > 1:
        raise ResultError(f"{path}: damaged (its checksum does not match)")
    return TableFile(title, names, columns, facts)
