"""A body that only friction holds: solved as long as the bound can carry the loads, else
reported."""

from __future__ import annotations

import re

import h5py
import pytest

from petcontact.commands.main import main

pytestmark = pytest.mark.usefixtures("unestimated", "unsampled")

BLOCK = """
material = { young_modulus = 1e4, poisson_ratio = 0.3 }
geometry = { shape = "rectangle", lower_left = [0.0, 0.0], upper_right = [8.0, 4.0] }
mesh = { element_size = 0.4 }
boundary = [
    { part = "bottom", condition = "contact", friction_bound = 50.0 },
    { part = "top", condition = "traction", value = [0.0, 0.0] },
    { part = "left", condition = "traction", pressure = 30.0 },
    { part = "right", condition = "traction", value = [0.0, 0.0] },
]
"""


@pytest.fixture
def block(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "block.toml").write_text(BLOCK)

    def run(*given):
        settings = [word for setting in given for word in ("--set", setting)]
        words = ["solve", "block.toml", "-o", "r.h5", "--force", "--no-figures", "--verbose"]
        status, (out, err) = main([*words, *settings]), capsys.readouterr()
        return status, " ".join(out.split()), err

    return run


@pytest.mark.parametrize(
    ("method", "pressure"),
    # where nearly all of it slips the projection method needs more than its 1000 iterations
    [("semismooth-newton", 97.0), ("operator-robin", 97.0), ("projection", 30.0)],
)
def test_friction_that_can_carry_the_load_does(block, method, pressure):
    """Capacity 8·50 = 400, load 4·pressure."""
    status, out, _ = block(f"boundary.2.pressure={pressure}", f"method.name={method}")
    assert status == 0 and "3 motions held by contact only" in out
    force = [float(number) for number in re.search(r"force \((\S+), (\S+)\)", out).groups()]
    assert force == pytest.approx([-4.0 * pressure, 0.0], rel=1e-9, abs=1e-9)
    with h5py.File("r.h5") as file:
        assert file.attrs["status"] == "converged"


def test_friction_that_cannot_is_told_with_the_load_that_it_could(block):
    status, out, _ = block("boundary.2.pressure=110.0")
    reached = float(re.search(r"no equilibrium at load factor (\d\.\d+)", out)[1])
    assert status == 3 and reached == pytest.approx(400.0 / 440.0, abs=0.01)
