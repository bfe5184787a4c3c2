"""The fields that a sweep keeps of a case, as bytes of its log: an npz archive of those on the
contact, or a result file."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path

import numpy as np

from ...contact.state import COLUMNS
from ...results.format.container import image_of
from ...results.hdf5 import write_group
from ...results.records import ContactFields
from ...results.solution import Solution, read_result
from ...untyped import Keyed

DEPTH = {"scalars": 0, "contact": 1, "all": 2}
"""What may be kept, the least first."""


def packed(solution: Solution, keep: str) -> bytes:
    """The fields to keep: of "scalars" none, of "contact" those of `contact_arrays`, of "all" the
    whole result."""
    if keep == "scalars":
        return b""
    if keep == "contact":
        archive = io.BytesIO()
        np.savez(archive, **contact_arrays(solution))
        return archive.getvalue()
    # numbers take longer than to iterate: those that follow from the fields are left to who asks
    compared = solution.coarser is not None or bool(solution.paths)
    return image_of(lambda file: write_group(file, solution, numbers=compared))


def unpacked(content: bytes, keep: str) -> Solution | Keyed:
    """What `packed` has packed: a solution, or arrays by name."""
    if keep == "contact":
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            return dict(archive)
    with tempfile.NamedTemporaryFile(suffix=".h5") as file:
        Path(file.name).write_bytes(content)
        return read_result(file.name)


def contact_arrays(solution: Solution) -> Keyed:
    """Nodal fields on the contact and, as `history_...`, one value an iteration.

    Of several bodies: the fields of all interfaces after the last step, with the name of the
    interface, and one value an increment.
    """
    columns = solution.columns()
    if solution.kind == "bilateral":
        history = {
            f"history_{key}": np.array(getattr(solution.last.history, key), float)
            for key in COLUMNS
        }
        return {**{name: columns[name] for name in ContactFields.__dataclass_fields__}, **history}
    tried = {
        f"history_{key}": np.array([getattr(step, key) for step in solution.tried], float)
        for key in ("step", "load_factor", "iterations")
    }
    return {**columns, "interface": columns["pair"], **tried}
