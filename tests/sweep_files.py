"""Small sweeps for tests: their files, and running them on one rank."""

from __future__ import annotations

from pathlib import Path

from mpi4py import MPI

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


def quietly(sweep, folder, **options):
    """Run a sweep on one rank."""
    return run_sweep(
        sweep, folder, MPI.COMM_SELF, say=options.pop("say", lambda line: None), **options
    )
