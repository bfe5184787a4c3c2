"""A body in space over several ranks gives what one rank gives."""

from __future__ import annotations

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import launch

pytestmark = pytest.mark.mpi
CONFIG = Path(__file__).parents[2] / "configs" / "space_b.toml"


@pytest.mark.parametrize("formulation", ["condensed", "full"])
def test_ranks_agree(formulation: str, tmp_path: Path) -> None:
    """Three ranks share neither the 160 nodes nor the 32 contact nodes evenly."""
    found = []
    for ranks in (1, 3):
        output = tmp_path / f"{ranks}.h5"
        keys = ("mesh.element_size=2.0", "mesh.order=1", "method.rule=modified", "method.rho=1000.0",
                f"method.formulation={formulation}")  # fmt: skip
        words = [word for key in keys for word in ("--set", key)]
        done = launch.run(ranks, "-m", "petcontact", "solve", str(CONFIG), "-o", str(output), "--no-figures", *words)
        assert done.returncode == 0, done.stderr
        with h5py.File(output) as file:
            found.append((file["boundary/u"][()], file["contact/sigma_t"][()], int(file.attrs["iterations"])))
    (u, sigma, count), (other_u, other_sigma, other_count) = found
    assert count == other_count
    np.testing.assert_allclose(other_u, u, atol=1e-9 * np.abs(u).max())
    np.testing.assert_allclose(other_sigma, sigma, atol=1e-7 * np.abs(sigma).max())


def test_ranks_share_an_h_matrix(tmp_path: Path) -> None:
    """Blocks are cut where the rows of a rank end, so that digits differ below the tolerance only."""
    found = []
    for ranks in (1, 2):
        output = tmp_path / f"{ranks}.h5"
        done = launch.run(
            ranks, "-m", "petcontact", "solve", str(CONFIG), "-o", str(output), "--no-figures",
            "--set", "mesh.element_size=1.4", "-bem_mat_type", "hmatrix", "-bem_hmatrix_tol", "1e-5",
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert "hmatrix 1e-05" in done.stdout
        with h5py.File(output) as file:
            found.append((file["boundary/u"][()], file["contact/sigma_t"][()]))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-4 * np.abs(one).max())


BLOCKS = """
[bem]
mat_type = "hmatrix"
hmatrix_tol = 1e-5
[[body]]
name = "lower"
material = { young_modulus = 1.0, poisson_ratio = 0.3 }
geometry = { shape = "box", lower = [-1, -1, -1], upper = [1, 1, 0] }
mesh = { element_size = 0.5, order = 1 }
[[body.boundary]]
part = "bottom"
condition = "displacement"
value = [0.0, 0.0, 0.0]
[[body]]
name = "upper"
material = { young_modulus = 3.0, poisson_ratio = 0.3 }
geometry = { shape = "box", lower = [-1, -1, 0], upper = [0.8, 0.9, 1] }
mesh = { element_size = 0.41, order = 1 }
[[body.boundary]]
part = "top"
condition = "traction"
value = [0.002, 0.0, -0.01]
[[contact]]
name = "pair"
secondary = "upper.bottom"
primary = "lower.top"
friction_coefficient = 0.4
"""


def test_ranks_share_the_matrices_of_two_bodies(tmp_path: Path) -> None:
    """One of them is held by contact only, on panels that do not match."""
    found = []
    (tmp_path / "blocks.toml").write_text(BLOCKS)
    for ranks in (1, 3):
        output = tmp_path / f"{ranks}.h5"
        done = launch.run(
            ranks, "-m", "petcontact", "solve", str(tmp_path / "blocks.toml"), "-o", str(output), "--no-figures"
        )
        assert done.returncode == 0, done.stderr
        with h5py.File(output) as file:
            pair = file["steps/1/contact/pair"]
            found.append((pair["pressure"][()], pair["sigma_t"][()], file["steps/1/body/upper/u"][()]))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(other, one, atol=1e-4 * np.abs(one).max())
