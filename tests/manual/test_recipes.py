"""The chapter of recipes: each command is run in this process, and ends with the figures that the
chapter has."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest
from manual.test_gallery import NUMBERS, check_numbers
from problems import unexplained

from petcontact import load, read_result, solve
from petcontact.commands.main import main
from petcontact.manual import chapter
from petcontact.refinement.panels.forecast import hertz_ellipse

ROOT = Path(__file__).parents[2]
CONFIGS = sorted(path.name for path in (ROOT / "configs" / "recipes").glob("*.toml"))

SLOW = (
    *("load_path.toml", "rounded_pin.toml", "o_ring.toml", "limit_torque.toml"),
    *("roller_on_plate.toml", "ball_in_groove.toml"),
    *("limit_load.toml", "mesh_in_space.toml", "symmetry.toml", "two_solutions.toml"),
)
"""Take longer than the others."""


def command(config: str) -> list[str]:
    """The first command of the chapter that solves it."""
    lines = [
        line.partition("   #")[0]
        for line in chapter("recipes").splitlines()
        if f"recipes/{config}" in line
    ]
    return shlex.split(lines[0])[1:]


@pytest.fixture(
    params=[pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in CONFIGS]
)
def recipe(request, tmp_path, monkeypatch):
    """Name of a config, exit status of its command, and its solution."""
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    monkeypatch.chdir(tmp_path)
    words = command(request.param)
    status = main([*words, *(() if "--no-figures" in words else ("--no-figures",))])
    return Path(request.param).stem, status, read_result(words[words.index("-o") + 1])


def grip(solution):
    moved = solution.last.obstacles["grip"]
    return [*moved.displacement, moved.rotation], [0.0397, 0.0763, 0.00273]


def o_ring(solution):
    largest = [solution.pairs[name].pressure.max() for name in ("floor", "lid", "wall")]
    return largest, [1.58, 1.58, 1.10]


def roller_on_plate(solution):
    """Halfway along; Hertz has 857 under the mean load, which is 3 % more than the load there."""
    pair = solution.pairs["line"]
    middle = np.abs(pair.x[:, 1]) < 5.0
    load = float((pair.weight * pair.pressure)[np.abs(pair.x[:, 1]) < 1.0].sum()) / 2.0
    return [float(pair.pressure[middle].max()), load], [832.0, 97.0]


def ball_in_groove(solution):
    """Beside Hertz' ellipse, of which the chapter has the half-widths."""
    a, b, _ = hertz_ellipse((0.1, 0.1 - 2.0 / 20.56), 500.0, 210_000.0 / 0.91)
    assert (a, b, 750.0 / np.pi / a / b) == pytest.approx((0.127, 1.272, 1480.0), rel=2e-3)
    return float(solution.pairs["groove"].pressure.max()), 1477.0


def hole(solution):
    """The stress at the hole as the verdict has it, and by Heywood for a hole of a tenth of the
    width."""
    angle = np.linspace(0.5 * np.pi, 0.4 * np.pi, 20)
    largest = solution.von_mises_at(np.column_stack([np.cos(angle), np.sin(angle)])).max()
    assert largest == pytest.approx((2.0 + 0.9**3) / 0.9, rel=5e-3) and not solution.pairs
    return largest, 3.035


def limit_load(solution):
    """µN; the solve ends between it and 1/256 of the step beyond."""
    assert "cannot be held: the load pushes it along +x" in solution.reason
    assert "0.8008" in solution.reason
    return -solution.pairs["bottom"].force[0], 0.8


def limit_torque(solution):
    moments = [step.pairs["fit"].moment for step in solution.steps[-3:]]
    assert moments[1:] == pytest.approx([moments[-1]] * 2, rel=1e-3)
    assert not solution.warnings
    return -moments[-1], 2.0 * np.pi * 0.2 * 1.974


def two_solutions(solution):
    """What jams, with a warning; from the frictionless start the one that has parted."""
    assert any("with Coulomb's law there are two here" in text for text in solution.warnings)
    config = ROOT / "configs/recipes/two_solutions.toml"
    parted = solve(load(config, {"method.start": "frictionless"}))
    assert parted.converged and not parted.pairs["bottom"].force.any()
    assert all("no contact anywhere" in text for text in parted.warnings)
    return solution.pairs["bottom"].force, [-0.00120, 0.00153]


def mesh_in_space(solution):
    return solution.pairs["bottom"].force[[0, 2]], [-1.884, 10.856]


def rounded_pin(solution):
    pressed, turned = (step.pairs["tip"] for step in solution.steps[-2:])
    return [pressed.force[2], turned.moment[2]], [646.0, -67.9]


def load_path(solution):
    """Energies on the path, and of the last force at once."""
    once = [{"name": "at once", "increments": "auto"}]
    changes = {"obstacle.0.force": [3.5, -10.0], "step": once}
    at_once = solve(load(ROOT / "configs/recipes/load_path.toml", changes))
    spent = [
        sum(step.pairs["top"].dissipated for step in each.steps) for each in (solution, at_once)
    ]
    assert spent[1] == pytest.approx(0.00174, rel=0.02)
    return spent[0], 0.00695


def test_a_recipe_ends_with_the_figures_of_the_chapter(recipe):
    name, status, solution = recipe
    assert status == (3 if name == "limit_load" else 0)
    if name in NUMBERS:
        check_numbers(name, solution)
    assert unexplained(ROOT / "configs/recipes" / f"{name}.toml", solution) == []
    if name in globals():
        found, printed = globals()[name](solution)
        assert np.asarray(found) == pytest.approx(np.asarray(printed), rel=1e-2)
    assert name in NUMBERS or name in globals()
