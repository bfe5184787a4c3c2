"""What newcomers write first is answered with the spelling of this package, and the file that holds
the mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from petcontact import InputError, load
from petcontact.commands.main import main
from petcontact.model.case import whole_key

pytestmark = pytest.mark.usefixtures("unsampled")

CONFIG = Path(__file__).parents[2] / "configs" / "example1.toml"


@pytest.mark.parametrize(
    ("setting", "hint"),
    [
        ("boundary.0.friction_bound='x^2'", "a power is written with **"),
        ("boundary.0.friction_bound='10x'", "as in 10*x"),
        ("boundary.0.friction_bound='2(x+1)'", "as in 10*x"),
        ("boundary.0.g=3.0", "did you mean 'friction_bound'?"),
        ("boundary.1.condition='clamped'", "did you mean 'displacement'?"),
        ("boundary.2.value=['free', 0.0]", "a free component of a traction is 0.0"),
        ("material.E=3.0", "did you mean 'young_modulus'?"),
        ("element_size=20.0", "it is held at 2 nodes only; use smaller elements"),
    ],
)
def test_hints(setting, hint, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["solve", str(CONFIG), "--no-figures", "--set", setting]) == 2
    said = capsys.readouterr().err
    assert hint in said and str(CONFIG) in said and said.count("\n") == 1


def test_a_bare_key_is_one_of_the_solver_tables():
    assert whole_key("element_size") == "mesh.element_size" and whole_key("rho") == "method.rho"
    assert whole_key("title") == "title" and whole_key("no_such") == "no_such"
    assert load(CONFIG, {"element_size": 0.5}).mesh.element_size == 0.5
    with pytest.raises(InputError, match="no_such: unknown key"):
        load(CONFIG, {"no_such": 1})
