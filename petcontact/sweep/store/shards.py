"""Fields of cases in shards: what a rank finishes within a second is one HDF5 file.

Fields on Γ_C lie below one another, so that a thousand cases take no more data sets than one: the nodes of case k are
`nodes[k]:nodes[k+1]` of each data set in /contact, its iterations `iterations[k]:iterations[k+1]` of each in /history, and
its id is `id[k]`. Whole results are groups under the id of their case, as in a result file. A shard's name ends with the
checksum of its content, so that a shard that was altered or damaged is known for it.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ...contact.state import COLUMNS
from ...errors import ResultError
from ...results.format.container import opened
from ...results.hdf5 import write_group
from ...results.records import ContactFields
from ...results.solution import Solution
from ...runtime.atomic_write import temporary_name


class Shard:
    """Fields that are not on the disk yet, in memory.

    Parameters
    ----------
    folder : Path
    keep : {"contact", "all"}
        Fields on Γ_C and histories, or whole results.
    """

    def __init__(self, folder: Path, keep: str) -> None:
        self._folder, self._keep = folder, keep
        self._cases: dict[tuple[bool, int], list[tuple[str, Solution]]] = {}

    def add(self, id_: str, solution: Solution) -> None:
        """Take a case in."""
        kind = solution.bilateral, next(iter(solution.meshes.values())).dim
        self._cases.setdefault(kind, []).append((id_, solution))

    def flush(self) -> dict[str, str]:
        """Put all that was added on the disk, one body and several in a shard each; the shard's name by the id of the case.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        names: dict[str, str] = {}
        for cases in self._cases.values():
            name = self._write(cases)
            names |= {id_: name for id_, _ in cases}
        self._cases = {}
        return names

    def _write(self, cases: list[tuple[str, Solution]]) -> str:
        # built in memory: HDF5 crashes the process when the disk fills up under a file of its own
        with h5py.File("shard", "w", driver="core", backing_store=False, track_order=True) as file:
            if self._keep == "all":
                for id_, solution in cases:
                    group = file.create_group(id_, track_order=True)
                    write_group(group, solution)
            else:
                _write_contacts(file, cases)
            file.flush()
            image = file.id.get_file_image()
        name = f"{self._keep}-{hashlib.blake2b(image, digest_size=16).hexdigest()}.h5"
        with temporary_name(self._folder / name) as temporary:
            temporary.write_bytes(image)
        return name


def _write_contacts(file: Any, cases: list[tuple[str, Solution]]) -> None:
    file["id"] = np.array([id_.encode() for id_, _ in cases])
    for group, bounds, arrays in (("contact", "nodes", contact_arrays), ("history", "iterations", _history_arrays)):
        found = [arrays(solution) for _, solution in cases]
        sizes = [max((len(values) for values in some.values()), default=0) for some in found]
        file[bounds] = np.concatenate([[0], np.cumsum(sizes)])
        for name in found[0]:
            values = np.concatenate([some[name] for some in found])
            file[f"{group}/{name}"] = np.char.encode(values) if values.dtype.kind == "U" else values


def contact_arrays(solution: Solution) -> dict[str, Any]:
    """Nodal fields on Γ_C; of several bodies those of all interfaces after the last step, with the name of the interface."""
    columns = solution.columns()
    if solution.bilateral:
        return {name: columns[name] for name in ContactFields.__dataclass_fields__}
    return {**columns, "interface": columns["pair"]}


def _history_arrays(solution: Solution) -> dict[str, Any]:
    """One value an iteration; of load steps one an increment."""
    if not solution.bilateral:
        return {key: np.array([getattr(step, key) for step in solution.tried], float)
                for key in ("step", "load_factor", "iterations")}  # fmt: skip
    return {key: np.array(getattr(solution.history, key), float) for key in COLUMNS}


def read_contact(path: Path, id_: str) -> dict[str, Any]:
    """The fields on Γ_C of a case, and its history as `history_...`.

    Raises
    ------
    ResultError
        If the shard is missing, damaged, or holds no such case.
    """
    if not intact(path):
        raise ResultError(f"{path}: missing or damaged")
    with opened(path) as file:
        ids = file["id"][()].tolist()
        if id_.encode() not in ids:
            raise ResultError(f"{path}: holds no case {id_}")
        case = ids.index(id_.encode())
        found = {}
        for group, bounds in (("contact", file["nodes"]), ("history", file["iterations"])):
            rows = slice(*bounds[case : case + 2].tolist())
            prefix = "" if group == "contact" else "history_"
            for name, values in file[group].items() if group in file else ():
                some = values[rows]
                found[prefix + name] = np.char.decode(some) if some.dtype.kind == "S" else some
    return found


def intact(path: Path) -> bool:
    """Whether a shard holds, bit for bit, what was written."""
    try:
        return path.is_file() and hashlib.blake2b(path.read_bytes(), digest_size=16).hexdigest() == path.stem.split("-")[-1]
    except OSError:
        return False


def kept_in(name: str) -> str:
    """What a shard keeps, by its name: scalars (no shard), contact or all; a case file of format 1 keeps all."""
    return "scalars" if not name else "all" if "/" in name else name.split("-")[0]


def shard_path(folder: Path, name: str) -> Path:
    """Where the shard of a row is, below the folder of a sweep."""
    return folder / name if "/" in name else folder / "fields" / name
