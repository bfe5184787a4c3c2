"""Small sweeps for tests: their files, and running them on one rank."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from mpi4py import MPI

from petcontact.sweep.design.sweep import Sweep, read_sweep
from petcontact.sweep.run import run_sweep

CONFIGS = Path(__file__).parents[1] / "configs"
SMALL = """
title = "small"
problems = ["example1.toml"]
keep = "{keep}"
[set]
max_iterations = {limit}
[cross]
rule = ["self-adaptive", "modified"]
rho = [1.0, 1e3]
element_size = [0.8, 0.4]
"""


def sweep_file(
    folder: Path, text: str = "", name: str = "small.toml", *, limit: int = 1000, keep: str = "all"
) -> Path:
    """A sweep file beside the paper's examples; the small sweep of eight cases by default."""
    for example in ("example1.toml", "example2.toml"):
        (folder / example).write_text((CONFIGS / example).read_text())
    path = folder / name
    path.write_text(text or SMALL.format(limit=limit, keep=keep))
    return path


def sweep_of(folder: Path, **tables: Any) -> Sweep:
    """The sweep of such tables; of Example 1 where no problems are named."""
    tables = {"problems": ["example1.toml"], **tables}
    plain = {key: value for key, value in tables.items() if not isinstance(value, dict)}
    lines = [f"{key} = {json.dumps(value)}" for key, value in plain.items()]
    for key, table in tables.items():
        if key not in plain:
            lines.append(f"[{key}]")
            lines += [f"{json.dumps(k)} = {json.dumps(v)}" for k, v in table.items()]
    return read_sweep(sweep_file(folder, "\n".join(lines)))


def quietly(sweep, folder, **options):
    """Run a sweep on one rank."""
    return run_sweep(
        sweep, folder, MPI.COMM_SELF, say=options.pop("say", lambda line: None), **options
    )
