"""Every config of the project runs through the command line and ends converged, with a small error
and no warning, or says why it stands there."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import h5py
import pytest
from manual.test_gallery import NUMBERS, check_numbers, check_tension
from marks import some
from problems import unexplained

from petcontact import read_result
from petcontact.commands.main import main

FOLDER = Path(__file__).parents[2] / "configs"
CONFIGS = sorted([*FOLDER.glob("*.toml"), *FOLDER.glob("kinds/*.toml")])
SINGLE = [path for path in CONFIGS if "problems" not in tomllib.loads(path.read_text())]


SLOW = """space_a space_adaptive space_bearing space_bracket space_flange space_hip space_sphere
    space_stack stack axial_press_fit fretting_specimen lap_joint axial_o_ring space_b axial_ball
    axial_torque rotating_blade shrink_fit gallery_bracket fretting heated_disc disc_between_plates
    blade gallery_disc gallery_dovetail gallery_plate gallery_toe axial_bolt example1_adaptive pin
    wedge axial_brake press_fit axial_taper axial_thread railhead"""
DRAWN = ("example1", "pin")
"""Figures take longer than most solves; those of other kinds are drawn by test_every_kind and
test_space_steps."""


@pytest.mark.parametrize(
    "path",
    some([path for path in SINGLE if path.stem not in SLOW.split()], SINGLE),
    ids=lambda path: path.stem,
)
def test_config_runs(path, tmp_path, capfd, monkeypatch):
    monkeypatch.chdir(tmp_path)
    figures = path.stem in DRAWN
    words = ["solve", str(path), "-o", str(tmp_path / "result.h5")]
    words += [] if figures else ["--no-figures"]
    status, printed = main(words), capfd.readouterr()
    assert status == 0, printed.err + printed.out
    assert "converged:" in printed.out
    # a solve that takes seconds, as on a loaded machine, says its size and how far it is
    told = re.compile(r"petcontact: (mesh|matrix:|iteration|step|load|\d+ nodes,) ")
    assert [line for line in printed.err.splitlines() if not told.match(line)] == []
    assert max(len(line) for line in printed.out.splitlines()) <= 80 + len(str(tmp_path))
    assert (len(list(tmp_path.glob("result-*.png"))) >= 2) == figures
    solution = read_result(tmp_path / "result.h5")
    if path.stem in NUMBERS:
        check_numbers(path.stem, solution)
    check_tension(path.stem, solution)
    assert unexplained(path, solution) == []
    with h5py.File(tmp_path / "result.h5") as file:
        assert file.attrs["status"] == "converged"
        last = file[f"steps/{len(file['steps'])}"]
        assert last.attrs["load_factor"] == 1.0 or "sliding" in last.attrs
        # an iterated solve balances forces better than it meets the elastic equations, not exactly
        assert last.attrs["residual_balance"] < max(1e-10, last.attrs["residual_elastic"])
        assert all(len(pair["pressure"]) == len(pair["x"]) for pair in last["contact"].values())
        if len(last["body"]) > 1:  # the shorthand is that of one body
            return
        assert file["contact/u_t"].shape == (len(file["contact/x"]), file["contact/x"].shape[1] - 1)
        assert file["boundary/u"].shape == file["boundary/x"].shape
        assert len(file["history/rho"]) == file.attrs["iterations"]
