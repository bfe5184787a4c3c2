"""The chapter of pictures: every problem stands in it, and no picture is older than what draws it."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import json
import re
import shlex
from pathlib import Path

import numpy as np

from petcontact import load
from petcontact.commands.options import overrides
from petcontact.reference import persson

ROOT = Path(__file__).parents[2]
LOADER = importlib.machinery.SourceFileLoader("gallery", str(ROOT / "scripts/gallery"))
GALLERY = importlib.util.module_from_spec(importlib.util.spec_from_loader("gallery", LOADER))
LOADER.exec_module(GALLERY)


def test_no_picture_is_older_than_its_problem_or_the_code_that_draws_it():
    """`scripts/gallery NAME ...` draws again."""
    record = json.loads(GALLERY.DRAWN.read_text())
    changed = {
        name
        for name, path in GALLERY.configs().items()
        if record.get(name) != GALLERY.digest_of(path)
    }
    assert changed == set(), f"scripts/gallery {' '.join(sorted(changed))}"


def test_every_problem_stands_in_the_chapter_with_a_picture_and_a_few_sentences():
    text = GALLERY.CHAPTER.read_text()
    assert {*re.findall(r"`configs/(?:recipes/)?(\w+)\.toml`", text)} == {*GALLERY.configs()}
    for entry in re.split(r"^### ", text, flags=re.MULTILINE)[1:]:
        (picture,) = re.findall(r"pictures/gallery/(\w+\.png)", entry)
        assert (GALLERY.PICTURES / picture).stat().st_size < 200_000
        prose = re.split(r"\n## ", entry)[0].partition(".png)")[2]
        assert 2 <= len(re.findall(r"[.:*](?:\s|$)", prose)) <= 12, entry


def test_every_problem_names_one_thing_to_change():
    for path in GALLERY.configs().values():
        (change,) = re.findall(r"^# One thing to change: --set (.+)$", path.read_text(), re.M)
        assert load(path, overrides(shlex.split(change))).toml() != load(path).toml()


def largest(name):
    """The first number of a name in a verdict, and its error."""

    def found(solution):
        number = next(number for number in solution.numbers if number.name == name)
        return number.value, float(number.error)

    return found


NUMBERS = {
    "axial_ball": largest("largest p"),
    "fretting": largest("largest p"),
    "hertz": largest("largest p"),
    "hole": largest("von Mises stress on the surface"),
    "limit_load": lambda s: (np.array([s.failed.load_factor]), 0.0),
    "pin": largest("largest p"),
    "press_fit": largest("largest p"),
    "space_hip": lambda s: (np.linalg.norm(s.last.pairs["joint"].force), 50.0),
    "space_sphere": largest("largest p"),
    "symmetry": largest("force"),
}
"""What the chapter prints of problems that tests solve as they are, and its error."""


def check_numbers(name, solution):
    """The numbers of the chapter are those of a solution, to their last digit or the error that is
    reported; references are of closed forms. Called where all configs and recipes are solved."""
    text = re.search(r"\*\*(.*?)\*\*", GALLERY.entry(name), re.DOTALL)[1].replace("\n", " ")
    computed, *references = (
        [n.replace(" ", "") for n in re.findall(r"-?\d[\d ]*(?:\.\d+)?", part)]
        for part in re.split(r"[;:.] ?(?=[A-Zµt])", text)
    )
    values, error = NUMBERS[name](solution)
    values = [*np.atleast_1d(values).tolist()]
    assert len(computed) >= len(values)
    for value, printed in zip(values, computed, strict=False):
        last = 0.5 * 10.0 ** -len(printed.partition(".")[2])
        assert abs(float(printed) - value) <= max(1.02 * last, error if error < 1e9 else 0.0), (
            printed,
            value,
        )
    if name in REFERENCES:
        assert float(f"{REFERENCES[name](solution):.3g}") == float(references[0][0])


def check_tension(name, solution):
    """The chapter says where contact pulls on more than a twentieth of it, but for bonded pairs; that
    of the README's picture pulls nowhere."""
    free = {side.name for side in solution.problem.interfaces if side.law.normal != "bonded"}
    pairs = [pair for each, pair in solution.pairs.items() if each in free]
    area = sum(float(pair.weight.sum()) for pair in pairs)
    share = sum(pair.tension_share * float(pair.weight.sum()) for pair in pairs) / (area or 1.0)
    most = 0.0 if f"gallery/{name}.png" in (ROOT / "README.md").read_text() else 0.05
    said = [
        0.01 * float(text)
        for text in re.findall(r"pulls\son about ([\d.]+) %", GALLERY.entry(name))
    ]
    # round-off, which is another one on each processor, decides which nodes next to an edge pull
    assert share <= most or min(abs(each - share) for each in said) < 0.02


REFERENCES = {
    # the force is that of the solution: the cylinder is displaced
    "hertz": lambda s: np.sqrt(abs(s.last.pairs["top"].force[1]) * 1000.0 / 0.91 / (np.pi * 2.0)),
    "hole": lambda s: 3.03,  # Heywood: 2 + (1 - 0.1)**3, with the stress of the net section
    "pin": lambda s: persson.pressure(np.zeros(1), np.radians(60.0))[0],
    "limit_load": lambda s: 0.8,
}
