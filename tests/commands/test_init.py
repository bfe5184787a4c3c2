"""Starters solve as they are written, editors get a schema that fits, and chapters of the manual
are shown."""

from __future__ import annotations

import json
import tomllib

import jsonschema
import pytest

from petcontact.commands.help import OTHER_WORDS
from petcontact.commands.init import KINDS
from petcontact.commands.main import main
from petcontact.manual import BOOKS, chapter

pytestmark = pytest.mark.usefixtures("unsampled")


@pytest.mark.parametrize("kind", KINDS)
def test_a_starter_solves_as_it_is(kind, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["init", "own", "--kind", kind]) == 0
    schema = json.loads(
        (tmp_path / f"petcontact.{'sweep-' if kind == 'sweep' else ''}schema.json").read_text()
    )
    jsonschema.Draft7Validator.check_schema(schema)
    jsonschema.validate(tomllib.loads((tmp_path / "own.toml").read_text()), schema)
    command = (
        ["sweep", "own.toml", "-o", "out"]
        if kind == "sweep"
        else ["solve", "own.toml", "--no-figures"]
    )
    assert main(command) == 0
    printed = capsys.readouterr().out
    assert "converged" in printed and "warning" not in printed


def test_the_schema_refuses_what_the_program_refuses(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["init", "own"]) == 0
    schema = json.loads((tmp_path / "petcontact.schema.json").read_text())
    config = tomllib.loads((tmp_path / "own.toml").read_text())
    wrong = [
        ("material", "young_modulus", -1.0),
        ("material", "youngs_modulus", 1.0),
        ("geometry", "shape", "disc"),
    ]
    for table, key, value in wrong:
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(config | {table: config[table] | {key: value}}, schema)


def test_init_replaces_nothing_unasked(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.toml").write_text("mine")
    assert main(["init", "own"]) == 2
    assert "--force" in capsys.readouterr().err and (tmp_path / "own.toml").read_text() == "mine"


def test_help_lists_and_shows_chapters(capsys):
    assert main(["help"]) == 0
    listed = capsys.readouterr().out
    lines = listed.splitlines()
    assert max(map(len, lines)) <= 80
    assert all(len(line.split(maxsplit=1)[1]) > 20 for line in lines if line.startswith("  "))
    for book, chapters in BOOKS.items():
        listed = listed.partition(f"\n{book}\n")[2]
        assert all(f"  {topic} " in listed for topic in chapters)
    assert main(["help", "config"]) == 0
    assert "young_modulus" in capsys.readouterr().out
    assert main(["help", "confg"]) == 2
    assert "did you mean 'config'" in capsys.readouterr().err


@pytest.mark.parametrize("words", ["torque", "limit load"])
def test_help_searches_all_chapters(words, capsys):
    """Chapter, number of the line and its text, with the words in sight, in 80 columns."""
    assert main(["help", "--search", words]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    found, name = 0, ""
    for line in lines:
        number, _, text = line.strip().partition("  ")
        if line and not line.startswith(" "):
            name = line.split()[0]
        elif number.isdigit():
            found += 1
            assert words.lower() in text.lower()
            assert text.removeprefix("...")[:20] in chapter(name).splitlines()[int(number) - 1]
    assert found and (words != "torque" or "recipes" in "\n".join(lines))


@pytest.mark.parametrize("key", ["friction_coefficient", "mesh.element_size"])
def test_help_of_a_key_says_what_it_is(key, capsys):
    assert main(["help", key]) == 0
    first, *rest = capsys.readouterr().out.splitlines()
    assert key in first and "number" in first and len(" ".join(rest[:3]).split()) > 10


@pytest.mark.parametrize("word", ["3d", "how accurate"])
def test_help_of_a_word_that_people_use_leads_to_a_chapter(word, capsys):
    assert all(chapter(name) for name in OTHER_WORDS.values())
    assert main(["help", *word.split()]) == 0
    assert f"petcontact help {OTHER_WORDS[word]}`" in capsys.readouterr().out


def test_code_of_a_chapter_is_not_wrapped_on_a_terminal(monkeypatch):
    """And a pager gets it, so that one sees its beginning."""
    paged = []
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setattr("pydoc.pager", paged.append)
    monkeypatch.setenv("COLUMNS", "60")
    assert main(["help", "contact"]) == 0
    (text,) = paged
    code = [line for line in chapter("contact").splitlines() if "-bem_hodlr_tol 1e" in line]
    assert any(line.startswith("petcontact solve") and line in text for line in code)
