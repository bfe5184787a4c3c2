"""Sweep files: crossed, zipped, sampled and listed points; ids; mistakes."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sweep_files import CONFIGS, sweep_file, sweep_of

from petcontact.errors import InputError
from petcontact.sweep.design import sweep_file as module
from petcontact.sweep.design.axes import short_number
from petcontact.sweep.design.sweep import Sweep, read_sweep
from petcontact.sweep.design.sweep_file import read_files


@given(st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(10**15), 10**15))
def test_a_number_in_an_id_reads_back(value):
    assert float(short_number(value)) == value


def test_dotted_keys_and_variants(tmp_path):
    sweep = read_sweep(
        sweep_file(
            tmp_path,
            """
problems = ["example1.toml", "example2.toml"]
[set]
omega = 1.5
[cross]
"material.poisson_ratio" = [0.2, 0.3]
tau = [1.0]
[[variant]]
name = "as is"
[[variant]]
name = "other start"
start = "frictionless"
omega = 0.9
""",
        )
    )
    assert sweep.ids[:4] == [
        "example1-as-is-poissonratio0.2-tau1",
        "example1-as-is-poissonratio0.3-tau1",
        "example1-other-start-poissonratio0.2-tau1",
        "example1-other-start-poissonratio0.3-tau1",
    ]
    found = [(sweep[k].method.omega, sweep[k].method.start) for k in (0, 2, 4, 6)]
    assert found == [(1.5, "zero"), (0.9, "frictionless")] * 2
    assert sweep.coordinates(3) == {
        "problem": "example1",
        "variant": "other start",
        "poisson_ratio": 0.3,
        "tau": 1.0,
    }


def test_loads_of_parts_and_bodies_have_speaking_names(tmp_path):
    crossed = {
        "boundary.2.value.0": [400.0, 500.0],
        "boundary.3.value": [[0.0, 50.25], [0.0, -50.25]],
        "boundary.0.friction_bound": [100.0],
    }
    sweep = sweep_of(tmp_path, cross=crossed)
    left, right = (sweep[0].boundary[k].part for k in (2, 3))
    assert sweep.coordinate_names == [
        "problem",
        f"{left}.value.x",
        f"{right}.value",
        "friction_bound",
    ]
    assert sweep.ids[1] == f"example1-{left}.value.x400-{right}.value2-frictionbound100"
    assert (left, right) == ("left", "right")


def test_a_key_may_be_given_a_name(tmp_path):
    text = (
        'problems = ["example1.toml"]\n[cross]\n"boundary.2.value.0" = [400.0]\nrho = [1.0, '
        "2.0]\n[names]\n{}"
    )
    given = '"boundary.2.value.0" = "push"\nrho = "start"'
    sweep = read_sweep(sweep_file(tmp_path, text.format(given)))
    assert sweep.coordinate_names == ["problem", "push", "start"]
    assert sweep.ids[1] == "example1-push400-rho2"
    mistakes = {
        'omega = "x"': "method.omega does not vary",
        'rho = "two words"': "names",
        'rhoo = "x"': "rhoo",
    }
    for bad, message in mistakes.items():
        with pytest.raises(InputError, match=message):
            read_sweep(sweep_file(tmp_path, text.format(bad)))


@pytest.mark.parametrize("name", ["pipe", "large.csv"])
def test_files_that_never_end_are_refused(tmp_path, monkeypatch, name):
    monkeypatch.setattr(module, "LARGEST_POINTS", 100)
    (tmp_path / "large.csv").write_text("rho\n" + "1.0\n" * 50)
    os.mkfifo(tmp_path / "pipe")
    for text in (
        'problems = ["example1.toml"]\npoints = "{}"',
        'problems = ["{}"]\n[cross]\nrho = [1.0]',
    ):
        if name != "large.csv" or "points" in text:
            with pytest.raises(InputError, match=r"not a regular file|larger than the"):
                read_sweep(sweep_file(tmp_path, text.format(name)))


def test_zipped_lists_are_walked_together_and_crossed_with_the_rest(tmp_path):
    together = {"rho": [1.0, 10.0, 100.0], "omega": [1.8, 1.6, 1.4]}
    sweep = sweep_of(tmp_path, cross={"tau": [1.0, 2.0]}, zip=together)
    assert len(sweep) == 6
    assert {(c.method.rho, c.method.omega) for c in sweep} == {
        (1.0, 1.8),
        (10.0, 1.6),
        (100.0, 1.4),
    }
    assert sweep.ids[4] == "example1-tau2-rho10-omega1.6"


@pytest.mark.parametrize("method", ["latin-hypercube", "sobol"])
def test_samples_fill_their_box_evenly_and_are_the_same_for_the_same_seed(tmp_path, method):
    box = {"rho": [1.0, 1e4], "material.poisson_ratio": [0.1, 0.4]}

    def drawn(seed):
        sample = {"method": method, "points": 64, "seed": seed, "log": ["rho"]}
        return sweep_of(tmp_path, sample=sample, **{"sample.range": box})

    sweep = drawn(3)
    points = np.array([[c.method.rho, c.material.poisson_ratio] for c in sweep])
    unit = np.transpose([np.log10(points[:, 0]) / 4.0, (points[:, 1] - 0.1) / 0.3])
    # one point in each of 64 slices of each coordinate: both designs are Latin for a power of two
    assert all(sorted((64 * column).astype(int)) == list(range(64)) for column in unit.T)
    again, other = drawn(3), drawn(4)
    assert list(again) == list(sweep)
    assert other.coordinates(0) != sweep.coordinates(0)
    assert sweep.ids[9] == "example1-sample10"


def test_points_of_a_csv_file(tmp_path):
    lines = (
        "rho, boundary.0.friction_bound, rule",
        "1.0, 100, modified",
        "2e3,150.5,self-adaptive",
    )
    (tmp_path / "points.csv").write_text("\n".join(lines))
    sweep = sweep_of(tmp_path, points="points.csv")
    assert sweep.ids == ["example1-point1", "example1-point2"]
    second = sweep[1]
    assert (second.method.rho, second.method.rule, second.boundary[0].friction_bound) == (
        2e3,
        "self-adaptive",
        150.5,
    )
    # everything that the cases follow from is in what is read
    (tmp_path / "points.csv").unlink()
    assert Sweep(*sweep.content).ids == sweep.ids


def test_a_million_cases_take_no_memory_until_they_are_asked_for(tmp_path):
    rho, tau = ([k / step for k in range(1, 1001)] for step in (1, 100))
    text = f'problems = ["example1.toml"]\n[cross]\nrho = {rho}\ntau = {tau}\n'
    source, data, problems = read_files(sweep_file(tmp_path, text))
    sweep = Sweep(source, data, problems)
    assert len(sweep) == 1_000_000
    assert sweep.coordinates(999_999) == {"problem": "example1", "rho": 1000.0, "tau": 10.0}


SOBOL = 'problems = ["example1.toml"]\n[sample]\nmethod = "sobol"\npoints = 900000\n{}'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("problems = []", "problems"),
        ('problems = ["example1.toml"]\n[cross]\nrhoo = [1.0]', "rhoo"),
        ('problems = ["example1.toml"]\n[cross]\nrho = [1.0, 1]', "twice"),
        ('problems = ["example1.toml"]\n[cross]\nrho = [-1.0]', "method.rho"),
        (
            'problems = ["example1.toml"]\n[cross]\nrho = [1.0]\n[zip]\n"method.rho" = [2.0]',
            "elsewhere",
        ),
        ('problems = ["example1.toml"]\n[[variant]]\nomega = 1.0', "name"),
        ('problems = ["example1.toml", "./example1.toml"]', "twice"),
        (
            'problems = ["example1.toml", "other/example1.toml"]',
            "differ in more than their folders",
        ),
        ('problems = ["missing.toml"]', "missing.toml"),
        ('problems = ["example1.toml"]\n[zip]\nrho = [1.0, 2.0]\ntau = [1.0]', "one length"),
        ('problems = ["example1.toml"]\nquantities = ["slip work"]', "module:function"),
        ('problems = ["example1.toml"]\npoints = "points.csv"', "line 3 has 1 values"),
        ('problems = ["example1.toml"]\npoints = "nothing.csv"', "nothing.csv"),
        (SOBOL.format("range = {rho = [2.0, 1.0]}"), "low < high"),
        (SOBOL.format('log = ["rho"]\nrange = {rho = [0.0, 1.0]}'), "positive"),
        (SOBOL.format('log = ["tau"]\nrange = {rho = [1.0, 2.0]}'), "no range"),
        (SOBOL.format("range = {tau = [1.0, 2.0]}\n[cross]\nrho = [1.0, 2.0]"), "largest sweep"),
    ],
)
def test_mistakes_are_one_line_that_names_the_key(tmp_path, text, message):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "example1.toml").write_text((CONFIGS / "example1.toml").read_text())
    (tmp_path / "points.csv").write_text("rho,tau\n1.0,2.0\n3.0\n")
    with pytest.raises(InputError) as caught:
        read_sweep(sweep_file(tmp_path, text))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
