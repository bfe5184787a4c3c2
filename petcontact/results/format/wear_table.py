"""The table of cycles in a result file: /wear."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...arrays import Index
from ...mesh.storage import demand
from ...untyped import Group
from ..records import WearHistory


def write_wear(group: Group, wear: WearHistory) -> None:
    """/wear/cycle (j,), and in /wear/contact/NAME pressure and depth (j, m), volume and
    largest_depth (j,)."""
    place = group.create_group("wear", track_order=True)
    place["cycle"] = wear.cycle
    for name, depth in wear.depth.items():
        folder = place.create_group(f"contact/{name}", track_order=True)
        folder["pressure"], folder["depth"] = wear.pressure[name], depth
        folder["volume"] = depth @ group[f"pairs/{name}/weight"][()]
        folder["largest_depth"] = depth.max(axis=1, initial=0.0)


def read_wear(group: Group, nodes: Mapping[str, Index], source: str) -> WearHistory | None:
    """What was written; None where there are no cycles.

    Raises
    ------
    ResultError
        If arrays do not fit each other.
    """
    if "wear" not in group:
        return None
    cycle, places = group["wear/cycle"][()], group["wear"].get("contact", {})
    history = {
        key: {name: folder[key][()] for name, folder in places.items()}
        for key in ("pressure", "depth")
    }
    for key, arrays in history.items():
        for name, values in arrays.items():
            wanted = len(cycle), len(nodes.get(name, ()))
            demand(
                values.shape == wanted,
                f"{source}: wear/contact/{name}/{key} has shape {values.shape}, not {wanted}",
            )
    demand(bool(np.all(np.diff(cycle) > 0)), f"{source}: wear/cycle does not increase")
    return WearHistory(cycle, history["pressure"], history["depth"])
