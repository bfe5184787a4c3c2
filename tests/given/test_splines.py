"""Gaps through points: against closed forms, near noisy points, and mistakes in one line."""

from __future__ import annotations

import doctest
import functools
from pathlib import Path

import numpy as np
import pytest

from petcontact import InputError, solve
from petcontact.geometry.noise import Noise
from petcontact.given import splines
from petcontact.given.sites import Sites
from petcontact.given.tables.points import Points
from petcontact.given.values import as_given
from petcontact.model.case import parse_problem

X = np.linspace(-1.0, 1.0, 50)
PARABOLA = np.column_stack([X, X**2 / 4.0 - 0.01])


def test_examples():
    assert doctest.testmod(splines).failed == 0


def config(gap):
    sides = {"bottom": {"condition": "displacement", "value": [0.0, 0.0]}}
    sides |= {side: {"condition": "traction", "value": [0.0, 0.0]} for side in ("left", "right")}
    sides["top"] = {"condition": "contact", "normal": "unilateral", "gap": gap}
    return {
        "material": {"young_modulus": 1000.0, "poisson_ratio": 0.3},
        "geometry": {"shape": "rectangle", "lower_left": [-1, -1], "upper_right": [1, 0]},
        "mesh": {"element_size": 0.1, "element_sizes": {"top": 0.02}, "order": 2},
        "boundary": [{"part": part, **condition} for part, condition in sides.items()],
    }


@functools.cache
def of_the_parabola():
    return pressure("x**2/4 - 0.01")[1]


def pressure(gap, folder=Path()):
    solution = solve(parse_problem(config(gap), "c.toml", {}, folder))
    return solution, np.asarray(solution.pairs["top"].pressure)


@pytest.mark.parametrize("smooth", [0.0, 1e-5])
def test_a_parabola_through_50_points_is_the_parabola(tmp_path, smooth):
    np.savetxt(tmp_path / "scan.csv", PARABOLA, delimiter="; ", header="x; gap")
    expected = of_the_parabola()
    found = pressure({"points": "scan.csv", "columns": [0, 1], "smooth": smooth}, tmp_path)[1]
    assert expected.max() > 1.0
    assert np.abs(found - expected).max() < 1e-4 * expected.max()


@pytest.mark.parametrize("mark", [";", "\t"])
def test_a_file_of_decimal_commas_has_the_numbers(tmp_path, mark):
    lines = ["x,z".replace(",", mark), f"mm{mark}µm", *(f"{x}{mark}{z}" for x, z in PARABOLA)]
    lines[3] = lines[3].replace(mark, " ")  # as in public files of rails
    (tmp_path / "scan.csv").write_text("\n".join(lines).replace(".", ","))
    assert np.array_equal(Points(tmp_path / "scan.csv").table, PARABOLA)


def test_noise_is_told_and_smoothed():
    noisy = PARABOLA + [0.0, 1.0] * np.random.default_rng(1).normal(0.0, 6e-5, (50, 2))
    noise = as_given(Points(noisy), "gap").noise_at(np.zeros(2), 0.1)
    assert noise.largest == pytest.approx(1.7e-4, rel=0.5) and noise.share > 0.1
    assert as_given(Points(PARABOLA), "gap").noise_at(np.zeros(2), 0.1) == Noise()
    solution, raw = pressure({"points": noisy.tolist()})
    assert any("which their spline follows" in warning for warning in solution.warnings)
    solution, smooth = pressure({"points": noisy.tolist(), "smooth": 1.8e-4})
    assert not any("which their spline follows" in warning for warning in solution.warnings)
    expected = of_the_parabola()
    off = [np.abs(p - expected).max() / expected.max() for p in (raw, smooth)]
    assert off[1] < 0.5 * off[0] and off[1] < 0.05


@pytest.mark.parametrize("smooth", [1e-5, 1e-3])
def test_a_spline_is_at_most_smooth_away_and_its_curvature_is_continuous(smooth):
    y = np.sin(5.0 * X) + np.random.default_rng(2).normal(0.0, smooth / 5.0, 50)
    gap = as_given(Points(np.column_stack([X, y]), smooth=smooth), "gap")
    assert np.abs(gap.at(Sites(np.column_stack([X, X]))) - y).max() <= smooth * (1.0 + 1e-9)
    step = 1e-4
    x = np.arange(-0.99, 0.99, step)
    bend = np.diff(gap.at(Sites(np.column_stack([x, x]))), 2) / step**2
    assert np.abs(np.diff(bend)).max() < 1e-2 * np.abs(bend).max()


@pytest.mark.parametrize("scattered", [False, True])
@pytest.mark.parametrize("smooth", [0.0, 1e-3])
def test_a_surface_through_points_in_space(scattered, smooth):
    random = np.random.default_rng(3)
    grid = np.stack(np.meshgrid(X[::5], X[::5]), axis=-1).reshape(-1, 2)
    places = random.uniform(-1.0, 1.0, (200, 2)) if scattered else grid
    bowl = lambda p: p[:, 0] ** 2 + 0.3 * p[:, 0] * p[:, 1]  # noqa: E731
    gap = as_given(Points(np.column_stack([places, bowl(places)]), smooth=smooth), "gap")
    at = random.uniform(-0.7, 0.7, (100, 3))
    assert np.abs(gap.at(Sites(at)) - bowl(at)).max() <= max(2.0 * smooth, 1e-9)
    with pytest.raises(InputError, match=r"gap.columns: must be 2 columns"):
        gap.at(Sites(at[:, :2]))


@pytest.mark.parametrize(
    ("text", "key", "said"),
    [
        ("0\n1\n2\n3\n", {}, "points: must have at least 2 columns"),
        ("0,0\n1,nan\n2,0\n3,0\n", {}, "finite numbers, row 2"),
        (
            "0,0\n2,1\n1,0\n3,0\n",
            {},
            "x must increase from row to row; row 2 has 2, the next one 1",
        ),
        ("0,0\n1,1\n2,0\n", {}, "needs at least 4 rows, got 3"),
        ("0,0\n1;0,5\n2,0\n3,0\n", {}, "line 2 of"),
        ("0,0 0,5\n1,5 2,0\n", {"columns": [0, 1]}, "row of numbers: '0,0 0,5'"),
        ("0 mm;1 mm\n1 mm;2 mm\n", {}, "line 1 of"),
        ("scan\nof one\n", {}, "line 2 of"),
        ("0,0\n1,a\n2,0\n3,0\n", {}, "is no row of numbers: '1,a', got"),
        ("0,0\n1\n2,0\n3,0\n", {}, "has 1 columns, those before have 2"),
        ("0,0\n1,1\n2,0\n3,0\n", {"columns": [0, 2]}, "columns: must be 2 columns"),
        ("0,0\n1,1\n2,0\n3,0\n", {"smooth": -1.0}, "smooth: must be greater than or equal to 0"),
        ("0,0\n1,1\n2,0\n3,0\n", {"smoth": 1.0}, "smoth: unknown key, did you mean 'smooth'"),
        (None, {}, "scan.csv: cannot be read"),
    ],
)
def test_a_mistake_is_one_line(tmp_path, text, key, said):
    if text is not None:
        (tmp_path / "scan.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        parse_problem(config({"points": "scan.csv", **key}), "c.toml", {}, tmp_path)
    line = str(caught.value)
    assert line.startswith("c.toml: boundary[3].gap") and said in line and "\n" not in line


def test_points_that_do_not_reach_are_refused():
    with pytest.raises(InputError, match=r"reach from x = -1 to 0.18.*, asked for at x = "):
        pressure({"points": PARABOLA[:30].tolist()})
