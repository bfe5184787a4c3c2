"""What of a sweep is on the disk and can be used again: rows of this sweep's cases whose digests and fields are right."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...errors import InputError, ResultError
from ...results.solution import read_solution
from ..design.identity import Identity
from ..design.sweep import Sweep
from . import format1
from .columns import Columns, columns_of, size_of, stacked, taken, texts
from .folder import SweepFolder, known_ids, read_index
from .journal import Journal, read_journal
from .shards import intact, kept_in, shard_path
from .table_file import TableFile, read_table

DEPTH = {"scalars": 0, "contact": 1, "all": 2}


@dataclass
class Finished:
    """Rows on the disk.

    Attributes
    ----------
    columns : dict of str to array
        Table and journals below one another, the newest row of a case last.
    row : dict of int to int
        By place in the sweep, its newest row.
    reusable : set of int
        Places of the cases that need not be computed again.
    remarks : list of str
        What was found wrong, a line each.
    """

    columns: Columns = field(default_factory=dict)
    row: dict[int, int] = field(default_factory=dict)
    reusable: set[int] = field(default_factory=set)
    remarks: list[str] = field(default_factory=list)


def read_all(folder: SweepFolder) -> tuple[Columns, list[str]]:
    """All rows of the table and then of the journals; and a line about what cannot be read."""
    blocks, remarks = [], []
    for path in folder.journal_files():
        try:
            blocks.append(columns_of(read_journal(path)))
        except FileNotFoundError:
            pass                              # a run that has just ended took it into the table, which is looked at last
        except (OSError, ValueError) as error:
            remarks.append(f"{path}: cannot be read ({error})")
    if folder.table.exists():
        try:
            blocks.insert(0, read_table(folder.table).columns)
        except ResultError as error:
            remarks.append(f"{error}: its cases are computed again unless a journal has them")
    return stacked([block for block in blocks if size_of(block)]), remarks


def look(sweep: Sweep, identity: Identity, folder: SweepFolder) -> Finished:
    """What is finished; for one rank. Fields are looked at by `bad_shards`."""
    found = Finished()
    found.columns, found.remarks = read_all(folder)
    if not size_of(found.columns):
        return found
    places = {id_: place for place, id_ in enumerate(sweep.ids)}
    needed = DEPTH[sweep.keep]
    columns = zip(*(texts(found.columns[name]) for name in ("id", "digest", "status", "fields")), strict=True)
    others = 0
    for number, (id_, digest, status, shard) in enumerate(columns):
        place = places.get(id_)
        if place is None:
            continue
        found.row[place] = number
        same = digest == identity.digest(place)
        others += not same
        if same and status in format1.FINISHED and DEPTH[kept_in(shard)] >= needed:
            found.reusable.add(place)
        else:
            found.reusable.discard(place)
    if others:
        found.remarks.append(f"{others} cases are there with another config, other files or options: computed again")
    return found


def shards_of(found: Finished) -> dict[str, list[int]]:
    """Places of the reusable cases by the shard with their fields."""
    by_shard: dict[str, list[int]] = {}
    if found.reusable:
        names = texts(found.columns["fields"])
        for place in found.reusable:
            if name := names[found.row[place]]:
                by_shard.setdefault(name, []).append(place)
    return by_shard


def bad_shards(folder: Path, names: Iterable[str]) -> list[str]:
    """Those of some shards that are missing, damaged or altered."""
    return [name for name in names if not _usable(shard_path(folder, name))]


def _usable(path: Path) -> bool:
    if path.parent.name == "fields":
        return intact(path)
    # a case file of format 1 has no checksum
    try:
        return format1.sound(read_solution(path))
    except ResultError:
        return False


def adopt_format1(sweep: Sweep, identity: Identity, folder: SweepFolder, token: str) -> int:
    """Journal the rows of a folder of format 1 whose case files can be used again; how many. For one rank."""
    if not (folder.index.exists() and read_index(folder.path)["version"] == 1):
        return 0
    rows = []
    for place, id_ in enumerate(sweep.ids):
        if not (folder.path / "cases" / f"{id_}.h5").is_file():
            continue
        case = sweep[place]
        row = format1.adopted(folder.path, id_, case.case, case.coordinates)
        if row is not None:
            rows.append({**row, "digest": identity.digest(place)})
    if rows:
        journal = Journal(folder.journals / f"{token}-format1.jsonl")
        journal.append(rows)
        journal.close()
    if folder.table.exists():
        folder.table.rename(folder.path / "results-format1.h5")
    return len(rows)


def refuse_another(sweep: Sweep, folder: SweepFolder, force: bool) -> None:
    """Refuse a folder that holds a case which this sweep has not.

    Raises
    ------
    InputError
        If it does, unless forced.
    """
    if force or not folder.index.exists():
        return
    try:
        ids = known_ids(read_index(folder.path))
    except (ResultError, InputError, KeyError, TypeError):
        raise InputError(f"{folder.index}: not the index of a sweep; --force replaces it") from None
    mine = set(sweep.ids)
    strange = [id_ for id_ in ids if id_ not in mine]
    if strange:
        raise InputError(
            f"{folder.path}: holds another sweep ({len(strange)} of its {len(ids)} cases are not of this one, for example "
            f"{strange[0]}); name another folder with -o, or replace it with --force"
        )


def settle(sweep: Sweep, identity: Identity, folder: SweepFolder, facts: dict[str, Any]) -> TableFile:
    """Bring journals into the table, the newest row a case in the order of the sweep, and remove them; for one rank.

    Rows of another config, of other files or options are left out. A table that stays as it is is not written again.
    """
    journals = folder.journal_files()
    columns, _ = read_all(folder)
    places = {id_: place for place, id_ in enumerate(sweep.ids)}
    row: dict[int, int] = {}
    rows = zip(texts(columns["id"]), texts(columns["digest"]), strict=True) if size_of(columns) else ()
    for number, (id_, digest) in enumerate(rows):
        if id_ in places and digest == identity.digest(places[id_]):
            row[places[id_]] = number
    order = [row[place] for place in sorted(row)]
    table = TableFile(sweep.title, sweep.coordinate_names, taken(columns, order), facts)
    if not journals and folder.table.exists() and order == list(range(size_of(columns))):
        return table                          # nothing is new
    table.write(folder.table)
    for journal in journals:
        journal.unlink()
    return table
