"""A body in space over several ranks gives what one rank gives."""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from problems import block, contact_pair

sys.path.insert(0, str(Path(__file__).parent))
import launch

pytestmark = pytest.mark.mpi
CONFIG = Path(__file__).parents[2] / "configs" / "space_b.toml"


BLOCKS = (
    '[bem]\nmat_type = "hmatrix"\nhmatrix_tol = 1e-5\n'
    + block(
        "lower",
        [-1, -1, -1],
        [1, 1, 0],
        mesh="element_size = 0.5, order = 1",
        bottom=[0.0, 0.0, 0.0],
    )
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


KEYS = ("mesh.element_size=2.0", "mesh.order=1", "method.rule=modified", "method.rho=1000.0")


def test_ranks_agree(tmp_path: Path) -> None:
    """Three share neither the 160 nodes nor the 32 contact nodes evenly; one of two bodies is held
    by contact only."""
    (tmp_path / "blocks.toml").write_text(BLOCKS)
    for ranks in (1, 3):
        commands = [
            (
                "solve",
                str(CONFIG),
                "-o",
                str(tmp_path / f"{ranks} {formulation}.h5"),
                "--no-figures",
                *(
                    word
                    for key in (*KEYS, f"method.formulation={formulation}")
                    for word in ("--set", key)
                ),
            )
            for formulation in ("condensed", "full")
        ]
        commands += [
            (
                "solve",
                str(tmp_path / "blocks.toml"),
                "-o",
                str(tmp_path / f"{ranks} blocks.h5"),
                "--no-figures",
            )
        ]
        assert [status for status, _ in launch.series(ranks, *commands, timeout=300.0)] == [0, 0, 0]
    for formulation in ("condensed", "full"):
        found = []
        for ranks in (1, 3):
            with h5py.File(tmp_path / f"{ranks} {formulation}.h5") as file:
                found.append(
                    (
                        file["boundary/u"][()],
                        file["contact/sigma_t"][()],
                        int(file.attrs["iterations"]),
                    )
                )
        (u, sigma, count), (other_u, other_sigma, other_count) = found
        assert count == other_count, formulation
        np.testing.assert_allclose(other_u, u, atol=1e-9 * np.abs(u).max())
        np.testing.assert_allclose(other_sigma, sigma, atol=1e-7 * np.abs(sigma).max())
    bodies = []
    for ranks in (1, 3):
        with h5py.File(tmp_path / f"{ranks} blocks.h5") as file:
            pair = file["steps/1/contact/pair"]
            bodies.append(
                (pair["pressure"][()], pair["sigma_t"][()], file["steps/1/body/upper/u"][()])
            )
    for one, other in zip(*bodies, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-4 * np.abs(one).max())


def test_ranks_share_an_h_matrix(tmp_path: Path) -> None:
    """Blocks are cut where the rows of a rank end, so that digits differ below the tolerance
    only."""
    found = []
    for ranks in (1, 2):
        output = tmp_path / f"{ranks}.h5"
        done = launch.run(
            ranks,
            "-m",
            "petcontact",
            "solve",
            str(CONFIG),
            "-o",
            str(output),
            "--no-figures",
            "--verbose",
            "--set",
            "mesh.element_size=1.4",
            "-bem_mat_type",
            "hmatrix",
            "-bem_hmatrix_tol",
            "1e-5",
        )
        assert done.returncode == 0, done.stderr
        assert "hmatrix 1e-05" in done.stdout
        with h5py.File(output) as file:
            found.append((file["boundary/u"][()], file["contact/sigma_t"][()]))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-4 * np.abs(one).max())
