"""Bodies over several ranks: each rank eliminates some of them, all get the whole solution."""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from marks import slow

sys.path.insert(0, str(Path(__file__).parent))
import launch

pytestmark = pytest.mark.mpi
CONFIGS = Path(__file__).parents[2] / "configs"
COARSE = tuple(
    word for k in range(2) for word in ("--set", f"body.{k}.mesh={{element_size = 1.0, order = 1}}")
)
GRADED = tuple(
    word
    for k in range(3)
    for word in ("--set", f"body.{k}.mesh={{levels = 6, grading = 0.35, order = 2}}")
)
WEAR = ("--set", "cycle.count=50", "--set", "body.0.mesh.element_sizes.contact=0.1")
HODLR = (
    *GRADED,
    *(
        word
        for key in ('mat_type="hodlr"', "hodlr_tol=1e-13", "hodlr_leaf=32")
        for word in ("--set", f"bem.{key}")
    ),
)
RUNS = {
    "plane": ("stack", "--adapt", "--accuracy", "0.05"),
    "compressed": ("stack", *HODLR),
    "space": ("space_stack", *COARSE),
    "wear over cycles": ("fretting_specimen", *WEAR),
}


@pytest.mark.parametrize("names", [("plane", "space"), slow(("compressed", "wear over cycles"))])
def test_ranks_agree_on_bodies_and_steps(tmp_path, names):
    """Dense bodies are dealt out to the ranks, compressed ones are those of all together.

    The compressed ones' mesh is fixed: the smallest elements of the adaptive one magnify 1e-13 to
    3e-10.
    """
    runs = {name: RUNS[name] for name in names}
    for ranks in (1, 2):
        commands = [
            (
                "solve",
                str(CONFIGS / f"{name}.toml"),
                "--no-figures",
                "-o",
                str(tmp_path / f"{ranks} {run}.h5"),
                *more,
            )
            for run, (name, *more) in runs.items()
        ]
        assert [status for status, _ in launch.series(ranks, *commands, timeout=300.0)] == [
            0
        ] * len(runs)
    for name in runs:
        assert_same(name, tmp_path / f"1 {name}.h5", tmp_path / f"2 {name}.h5")


def assert_same(name, first, second):
    with h5py.File(first) as one, h5py.File(second) as two:
        places = [
            f"steps/{k}/contact/{pair}" for k in one["steps"] for pair in one[f"steps/{k}/contact"]
        ]
        for key in ("pressure", "sigma_t", "gap", "slip", "state"):
            ours, theirs = ([file[f"{place}/{key}"][()] for place in places] for file in (one, two))
            # where all is closed the gap is the round-off of what moved, which the slip tells
            beside = [one[f"{place}/slip"][()] for place in places if key == "gap"]
            largest = max(np.abs(a).max() for a in (*ours, *beside))
            assert all(
                np.allclose(a, b, rtol=0.0, atol=1e-10 * largest)
                for a, b in zip(ours, theirs, strict=True)
            )
