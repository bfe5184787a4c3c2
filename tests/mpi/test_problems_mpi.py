"""Problems of every kind over several ranks have the results that one rank has: dense bodies are
dealt out, compressed ones are those of all ranks together."""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from marks import slow
from problems import block, contact_pair

sys.path.insert(0, str(Path(__file__).parent))
import launch

pytestmark = pytest.mark.mpi
CONFIGS = Path(__file__).parents[2] / "configs"
HELD_BY_CONTACT = (
    block("lower", [-1, -1, -1], [1, 1, 0], mesh="element_size = 0.5, order = 1", bottom=[0.0] * 3)
    + block(
        "upper",
        [-1, -1, 0],
        [0.8, 0.9, 1],
        3.0,
        mesh="element_size = 0.41, order = 1",
        top=("traction", [0.002, 0.0, -0.01]),
    )
    + contact_pair("pair", "upper.bottom", "lower.top", 0.4)
)
COARSE = "mesh.element_size=2.0 mesh.order=1 method.rule=modified method.rho=1000.0"
HODLR = "bem.mat_type=hodlr bem.hodlr_tol=1e-13 bem.hodlr_leaf=32"
RUNS = {
    "plane bodies, adaptive": ("stack", 1e-10, "--adapt", "--accuracy", "0.05"),
    "one body, compressed": ("example2", 1e-6, "mesh.element_size=0.18 bem.mat_type=hodlr"),
    # along disks Newton's method ends at its tolerance, else at round-off
    "space, bodies": (
        "space_stack",
        1e-10,
        " ".join(f"body.{k}.mesh={{element_size=1.0,order=1}}" for k in range(2))
        + " method.tolerance=1e-10",
    ),
    # blocks are cut where the rows of a rank end, so that digits differ below the tolerance
    "space, H-matrix": (
        "space_b",
        1e-4,
        "mesh.element_size=1.4 bem.mat_type=hmatrix bem.hmatrix_tol=1e-5",
    ),
    # three ranks share neither the 160 nodes nor the 32 contact nodes evenly
    "space, condensed": ("space_b", 1e-7, COARSE),
    "space, full": ("space_b", 1e-7, f"{COARSE} method.formulation=full"),
    "space, held by contact": ("blocks", 1e-4, "bem.mat_type=hmatrix bem.hmatrix_tol=1e-5"),
    # of a fixed mesh: the smallest elements of the adaptive one magnify 1e-13 to 3e-10
    "plane bodies, compressed": (
        "stack",
        1e-10,
        " ".join(f"body.{k}.mesh={{levels=6,grading=0.35,order=2}}" for k in range(3))
        + " "
        + HODLR,
    ),
    "wear over cycles": (
        "fretting_specimen",
        1e-10,
        "cycle.count=50 body.0.mesh.element_sizes.contact=0.1",
    ),
}
"""Config, how far exact solutions may be apart, keys that are set or words of the command."""
MAGNIFIED = 30.0
"""Errors of fields over the residuals of the law, of all increments so far, that the files tell.
Two solves with residuals of 1.9e-9 and .9e-9 differed by 3.9e-8 in a later step."""
NAMES = list(RUNS)


@pytest.mark.parametrize(
    ("ranks", "names"), [(2, NAMES[:4]), (3, NAMES[4:7]), slow(2, NAMES[7:])], ids=str
)
def test_ranks_agree(ranks, names, tmp_path):
    (tmp_path / "blocks.toml").write_text(HELD_BY_CONTACT)
    for count in (1, ranks):
        commands = []
        for name in names:
            config, _, *words = RUNS[name]
            if len(words) == 1:
                words = [word for key in words[0].split() for word in ("--set", key)]
            path = tmp_path / "blocks.toml" if config == "blocks" else CONFIGS / f"{config}.toml"
            output = str(tmp_path / f"{count} {name}.h5")
            commands.append(("solve", str(path), "--no-figures", "-o", output, *words))
        done = launch.series(count, *commands, timeout=300.0)
        assert [status for status, _ in done] == [0] * len(names)
    for name in names:
        with (
            h5py.File(tmp_path / f"1 {name}.h5") as one,
            h5py.File(tmp_path / f"{ranks} {name}.h5") as many,
        ):
            assert_same(one, many, RUNS[name][1])


def assert_same(one, many, apart):
    """Fields of all pairs and bodies in all increments, relative to the largest of their kind."""
    places = [
        f"steps/{k}/contact/{pair}" for k in one["steps"] for pair in one[f"steps/{k}/contact"]
    ]
    bodies = [f"steps/{k}/body/{name}" for k in one["steps"] for name in one[f"steps/{k}/body"]]
    apart += MAGNIFIED * sum(
        file[f"steps/{k}"].attrs[f"residual_{name}"]
        for file in (one, many)
        for k in one["steps"]
        for name in ("normal", "tangential", "balance")
    )
    for key in ("pressure", "sigma_t", "gap", "slip", "u"):
        where = bodies if key == "u" else places
        ours, theirs = ([file[f"{at}/{key}"][()] for at in where] for file in (one, many))
        # where all is closed the gap is the round-off of what moved, which the slip tells
        beside = [one[f"{at}/slip"][()] for at in where if key == "gap"]
        largest = max(np.abs(a).max() for a in (*ours, *beside))
        for a, b in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(b, a, rtol=0.0, atol=apart * largest, err_msg=key)
