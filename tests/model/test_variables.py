"""Numbers of a config that are expressions of its variables."""

from __future__ import annotations

import pytest

from petcontact import load
from petcontact.errors import InputError

TEXT = """
[variables]
t = 2.0
h = "t/4"
n = 2
E = 1000.0
[material]
young_modulus = "2*E"
poisson_ratio = 0.3
thickness = "t"
[geometry]
shape = "rectangle"
lower_left = [0, "-h"]
upper_right = ["2*t + 1", 0]
[mesh]
element_size = "h"
order = "n"
[[boundary]]
part = "bottom"
condition = "displacement"
value = [0, 0]
[[boundary]]
part = "top"
condition = "traction"
pressure = "E*x**2"
[[boundary]]
part = "left"
condition = "traction"
value = [0, 0]
[[boundary]]
part = "right"
condition = "traction"
value = [0, 0]
"""


def loaded(tmp_path, text=TEXT, **changes):
    path = tmp_path / "case.toml"
    path.write_text(text)
    return load(path, changes)


def test_numbers_are_expressions_of_variables(tmp_path):
    problem = loaded(tmp_path)
    assert problem.material.young_modulus == 2000.0 and problem.material.thickness == 2.0
    assert problem.geometry.lower_left == (0.0, -0.5) and problem.geometry.upper_right == (5.0, 0.0)
    assert problem.mesh.element_size == 0.5 and problem.mesh.order == 2
    assert problem.boundary[1].pressure == "(1000.0)*x**2"
    assert problem.variables == {"t": 2.0, "h": 0.5, "n": 2.0, "E": 1000.0}
    (tmp_path / "again.toml").write_text(problem.toml())
    assert load(tmp_path / "again.toml") == problem


def test_a_variable_is_overridden_with_all_that_follows(tmp_path):
    problem = loaded(tmp_path, **{"variables.t": 4.0})
    assert problem.mesh.element_size == 1.0 and problem.geometry.upper_right == (9.0, 0.0)


def test_a_variable_may_be_the_sign_of_micro(tmp_path):
    """Python reads it as Greek mu in expressions."""
    own = TEXT.replace("t = 2.0", 't = "10*µ"').replace("[variables]", '[variables]\n"µ" = 0.2')
    (tmp_path / "own.toml").write_text(own, encoding="utf-8")
    assert load(tmp_path / "own.toml").variables["t"] == 2.0


@pytest.mark.parametrize("variables", ["", "[variables]\nt = 2.0\n"])
def test_a_number_may_be_an_expression_of_no_variable(tmp_path, variables):
    """Beside a variable that another key uses, and in a file without any."""
    text = TEXT[TEXT.index("[material]") :].replace('"2*E"', "1000.0").replace('"E*x**2"', '"x**2"')
    for old, new in [
        ("t", "pi/2" if not variables else "t"),
        ("-h", "-sqrt(4)"),
        ("n", "max(1, 2)"),
    ]:
        text = text.replace(f'"{old}"', f'"{new}"')
    text = text.replace('"2*t + 1"', "5.0").replace('"h"', '"cos(pi/3)"')
    problem = loaded(tmp_path, variables + text)
    assert problem.material.thickness == pytest.approx(2.0 if variables else 1.5707963)
    assert problem.geometry.lower_left == (0.0, -2.0) and problem.mesh.order == 2
    assert problem.mesh.element_size == pytest.approx(0.5)


@pytest.mark.parametrize("text", ["2*h +", "sqrt(-h)", "pi(2)", "1/(h - h)", "max(h)"])
def test_what_has_no_value_is_refused_by_its_key(tmp_path, text):
    own = TEXT.replace('element_size = "h"', f'element_size = "{text}"')
    with pytest.raises(InputError, match=r"case.toml: mesh.element_size: must be a number, got"):
        loaded(tmp_path, own)


def test_nothing_is_varied_by_what_nothing_depends_on(tmp_path):
    (tmp_path / "own.toml").write_text(loaded(tmp_path).toml())
    with pytest.raises(InputError, match=r"variables\.t: nothing in the file depends on it"):
        load(tmp_path / "own.toml", {"variables.t": 3.0})


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("t = 2.0", "x = 2.0", "variables.x: must be a word .*; expressions know x already"),
        ("t = 2.0", 'thick = 2.0\nt = "thik"', "variables.t: unknown name 'thik' in .*'thick'"),
        ("t = 2.0", "t = 2.0\nlenght = 3.0", "variables.lenght: nothing in the file depends on it"),
        ("t = 2.0", 't = 2.0\ntitle = "A"', r"title belongs above the first \[table\]"),
        ("t = 2.0", 't = 2.0\nhole_d = 1.0\nwidth = "2*hole"', "variables.width: .*'hole_d'"),
        ('element_size = "h"', 'element_size = "h + ht"', r"mesh.element_size: .*mean '(h|t)'"),
        ("t = 2.0", "t = true", "variables.t: must be a number or an expression of those before"),
        ("t = 2.0", "t = inf", "variables.t: must be a number or an expression of those before"),
        ('h = "t/4"', 'h = "q/4"', "variables.h: must be a number or an expression"),
        ('element_size = "h"', 'element_size = "h*q"', "mesh.element_size: must be a number"),
    ],
)
def test_what_is_no_variable_is_refused(tmp_path, old, new, said):
    with pytest.raises(InputError, match=said):
        loaded(tmp_path, TEXT.replace(old, new))


def test_a_number_with_an_exponent_is_no_word(tmp_path):
    text = TEXT.replace('element_size = "h"', 'element_size = "1e-1*h"')
    assert loaded(tmp_path, text).mesh.element_size == pytest.approx(0.05)


def test_a_variable_that_is_not_there_is_not_overridden(tmp_path):
    with pytest.raises(InputError, match=r"variables: no variable 'q'"):
        loaded(tmp_path, **{"variables.q": 4.0})
