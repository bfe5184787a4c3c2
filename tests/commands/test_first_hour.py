"""What a beginner types: results are shown again, shells complete words, extras are named by the
command that installs them, and both spellings of a key are taken."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from petcontact import Circle, Material, solve
from petcontact.commands.main import main
from petcontact.commands.parsers import COMMANDS
from petcontact.compare.side_by_side import named_contenders
from petcontact.errors import EXTRAS, InputError, installed_by

ROOT = Path(__file__).parents[2]
BLOCK = "petcontact/manual/starters/bodies.toml"

pytestmark = pytest.mark.usefixtures("unsampled")


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    path = tmp_path_factory.mktemp("shown") / "two.h5"
    solve(ROOT / BLOCK).save(path)
    return path


def test_show_prints_the_verdict_again(result, capsys):
    assert main(["show", str(result)]) == 0
    assert capsys.readouterr().out.startswith("converged: A block pressed onto another")
    assert main(["show", str(result), "--json"]) == 0
    table = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    force = [n for n in table["numbers"] if (n["name"], n["step"]) == ("force", 2)]
    assert table["status"] == "converged" and force[0]["of"] == "interface"
    assert force[0]["unit"] == "N/mm" and 0.0 < force[0]["error"] < force[0]["value"][1]


def test_a_folder_is_not_named_like_a_file(result, tmp_path, capsys):
    for words in (["export", "--csv", "all.xlsx"], ["plot", "-o", "all.png"]):
        assert main([words[0], str(result), words[1], str(tmp_path / words[2])]) == 2
        assert "a folder is expected" in capsys.readouterr().err
    assert not [*tmp_path.iterdir()]


def test_quiet_prints_one_line(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert main(["solve", str(ROOT / BLOCK), "--quiet", "--no-figures"]) == 0
    out, err = capfd.readouterr()
    assert out == "converged: A block pressed onto another and pushed\n" and not err


def test_a_shell_completes_commands_and_options(capsys):
    assert main(["completion"]) == 0
    script = capsys.readouterr().out
    program = f'petcontact() {{ {sys.executable} -m petcontact "$@"; }}\n'
    asked = "COMP_WORDS=(petcontact solve --fig); COMP_CWORD=2; _petcontact; echo ${COMPREPLY[@]}"
    words = subprocess.run(["bash", "-c", program + script + asked], capture_output=True, text=True)
    assert words.stdout.split() == ["--figures"]
    asked = "COMP_WORDS=(petcontact ''); COMP_CWORD=1; _petcontact; echo ${COMPREPLY[@]}"
    words = subprocess.run(["bash", "-c", script + asked], capture_output=True, text=True)
    assert words.stdout.split() == list(COMMANDS)


def test_extras_are_those_that_the_setup_installs(result, monkeypatch):
    """And without pandas a table is refused in one line that says what to type."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    options = (ROOT / "scripts/setup").read_text()
    for extra, packages in EXTRAS.items():
        wanted = " ".join(project["optional-dependencies"][extra])
        assert all(package in wanted for package in packages.split())
        assert extra == "petsc" or f"--{extra}" in options
    monkeypatch.chdir(ROOT)
    assert installed_by("cad") == "scripts/setup --cad"
    monkeypatch.setitem(sys.modules, "pandas", None)
    from petcontact import read_result

    with pytest.raises(ImportError, match=r"needs pandas, .* scripts/setup --tables") as failed:
        read_result(result).to_dataframe()
    assert isinstance(failed.value, InputError)


def test_center_and_centre_are_one_key():
    assert Circle("rim", centre=(0, 1), radius=2) == Circle("rim", center=(0, 1), radius=2)
    with pytest.raises(InputError, match="centre"):
        Circle("rim", center=(0, 1), centre=(0, 1), radius=2)
    with pytest.raises(InputError, match="unknown key"):
        Material(1.0, 0.3, centre=(0, 1))


PLAIN = """material = { young_modulus = 1.0, poisson_ratio = 0.3 }
geometry = { shape = "rectangle", lower_left = [0, 0], upper_right = [2, 1] }
boundary = [{ part = "bottom", condition = "contact", friction_bound = 1.0 }]
"""


@pytest.mark.parametrize(
    ("words", "config", "said"),
    [
        ("", ("lower_left", "lower"), "a key of shape = 'box'"),
        ("", ("= 1.0 }]", '= 1.0 }]\n[[boundary]]\npart = "top"'), "boundary"),
        ("", ("geometry =", "[boundary]\n[[boundary]]\ngeometry ="), "write [[boundary]]"),
        ("", ("0.3 }", "0.3, units = 1 }"), "a key of the top of the file"),
        ("", ("", ""), 'part = "right", condition = "traction", value = [0.0, 0.0]'),
        ("--set friction_bound=3", ("", ""), "did you mean boundary.0.friction_bound?"),
        ("-o x.vtu", ("", ""), "a result is a file .h5"),
        ("--accuracy 10%", ("", ""), "no positive number"),
    ],
)
def test_a_mistake_is_answered_with_what_to_write(words, config, said, tmp_path, capsys):
    (tmp_path / "own.toml").write_text(PLAIN.replace(*config) if config[0] else PLAIN)
    try:
        status = main(["solve", str(tmp_path / "own.toml"), *words.split()])
    except SystemExit as left:
        status = left.code
    line = capsys.readouterr().err
    assert status == 2 and line.count("\n") == 1 and said in line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["own.toml"]


def test_words_that_people_use_are_found_in_the_manual(capsys):
    assert main(["help", "mu"]) == 0
    assert "friction_coefficient" in capsys.readouterr().out
    assert main(["help", "plasticity"]) == 0
    assert "linear elastic" in capsys.readouterr().out
    assert main(["help", "friktion"]) == 2
    assert "did you mean 'friction'?" in capsys.readouterr().err


def test_compare_takes_the_names_of_methods_and_rules():
    assert named_contenders("modified") == ["rule (4.3)"]
    assert len(named_contenders("projection")) == 4
    with pytest.raises(InputError, match="did you mean 'projection'"):
        named_contenders("projecton")
