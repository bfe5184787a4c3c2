"""The chapter of pictures: every problem stands in it, and no picture is older than what draws it."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import json
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
LOADER = importlib.machinery.SourceFileLoader("gallery", str(ROOT / "scripts/gallery"))
GALLERY = importlib.util.module_from_spec(importlib.util.spec_from_loader("gallery", LOADER))
LOADER.exec_module(GALLERY)


def test_no_picture_is_older_than_its_problem_or_the_code_that_draws_it():
    """`scripts/gallery NAME` draws those of changed configs again, `scripts/gallery` all."""
    record = json.loads(GALLERY.DRAWN.read_text())
    changed = {
        name
        for name, path in GALLERY.configs().items()
        if record["problems"].get(name) != GALLERY.digest_of(path)
    }
    assert changed == set(), f"scripts/gallery {' '.join(sorted(changed))}"
    assert record["drawing"] == GALLERY.digest_of_drawing(), "scripts/gallery"


def test_every_problem_stands_in_the_chapter_with_a_picture_and_a_few_sentences():
    text = GALLERY.CHAPTER.read_text()
    assert {*re.findall(r"`configs/(?:recipes/)?(\w+)\.toml`", text)} == {*GALLERY.configs()}
    for entry in re.split(r"^### ", text, flags=re.MULTILINE)[1:]:
        (picture,) = re.findall(r"pictures/gallery/(\w+\.png)", entry)
        assert (GALLERY.PICTURES / picture).stat().st_size < 200_000
        prose = re.split(r"\n## ", entry)[0].partition(".png)")[2]
        assert 2 <= len(re.findall(r"[.:*](?:\s|$)", prose)) <= 12, entry


def test_the_digest_is_that_of_code(monkeypatch, tmp_path):
    """Comments do not count, numbers do."""
    folder = tmp_path / "figures"
    folder.mkdir()
    for name in GALLERY.DRAWING[:-1]:
        (folder / f"{name}.py").write_text('"""Text."""\nA = 1  # comment\n')
    monkeypatch.setattr(GALLERY, "FOLDERS", (folder, GALLERY.FOLDERS[1]))
    first = GALLERY.digest_of_drawing()
    (folder / "plane.py").write_text('"""Other."""\nA = 1\n')
    assert GALLERY.digest_of_drawing() == first
    (folder / "plane.py").write_text('"""Other."""\nA = 2\n')
    assert GALLERY.digest_of_drawing() != first
