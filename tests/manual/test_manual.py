"""The manual and the README keep what they say: commands run, links lead somewhere, the reference
is current."""

from __future__ import annotations

import itertools
import re
import runpy
import shutil
import textwrap
import tomllib
from pathlib import Path

import forked
import pytest
from marks import slow
from matplotlib.colors import rgb_to_hsv, to_rgb

import petcontact
from petcontact.commands.schema import schema_text
from petcontact.manual import BOOKS, chapter, pages, topics
from petcontact.runtime.figure_style import STATES

ROOT = Path(__file__).parents[2]
MANUAL = ROOT / "petcontact" / "manual"
PAGES = [ROOT / "README.md", *sorted(MANUAL.rglob("*.md"))]
LINK = re.compile(r"\]\(([^)#\s]+)\)")
RANKS = re.compile(r"mpiexec -n \d+ ")
MODULE = re.compile(r"(?:`(\w+)`\s+of\s+)?`((?:\w+/)+\w+\.py)(?:::(\w+))?`")


SOURCES = tomllib.loads((ROOT / "tests/data/manual_numbers.toml").read_text())
SLOW = ("fields", "contact", "operators", "export", "loads", "wear", "fatigue", "sweeps", "options")
"""Chapters whose commands take longest: scripts/test --slow, or scripts/verify_manual."""
VERIFY = runpy.run_path(str(ROOT / "scripts/verify_manual"))
blocks, commands = VERIFY["blocks"], VERIFY["commands"]
REFERENCE = runpy.run_path(str(ROOT / "scripts/config_reference"))
READ = runpy.run_path(str(ROOT / "scripts/readability"))
DOCS = runpy.run_path(str(ROOT / "scripts/docs"))


def is_run(page: Path) -> bool:
    return bool(commands(page.read_text(), slow=False) or blocks(page.read_text(), "python"))


def marks(page: Path) -> list:
    ranks = any(RANKS.match(line) for line, _ in commands(page.read_text(), slow=False))
    return [pytest.mark.mpi] * ranks + [pytest.mark.slow] * (page.stem in SLOW)


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=marks(page)) for page in PAGES if is_run(page)],
    ids=lambda page: page.stem,
)
def test_commands_and_programs_print_the_numbers_of_the_text(page, tmp_path):
    """But for `sh slow`, which scripts/verify_manual --slow runs."""
    done = VERIFY["Page"](page, forked.program())
    shutil.copytree(
        ROOT / "configs", tmp_path / "configs", ignore=shutil.ignore_patterns("pictures")
    )
    VERIFY["do"](done, tmp_path, slow=False)
    assert done.failed == [] and done.commands > 0
    assert VERIFY["missing"](done, False, SOURCES.get(page.stem, {}))[1] == []


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page.parent != MANUAL / "cases"], ids=lambda page: page.stem
)
def test_numbers_of_sections_without_commands_have_a_source(page):
    """Those that a command of the page may print are left to the test above."""
    if not is_run(page):
        assert VERIFY["missing"](VERIFY["Page"](page), False, SOURCES.get(page.stem, {}))[1] == []
    named = re.findall(r"(?:petcontact|scripts|tests)/[\w/.]+\w", str(SOURCES.get(page.stem, "")))
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_a_number_that_nothing_prints_is_found(tmp_path):
    """To its digits, as a share, and as an input; years and numbers of equations are none."""
    text = "## A\n\n```sh\ntrue\n```\n{} and 25.4 %, of 2019, by (4.12), `h = 0.31`: 0.31.\n"
    (tmp_path / "page.md").write_text(text.format("1.234e-3, 0.987"))
    page = VERIFY["Page"](tmp_path / "page.md")
    page.printed.append("0.0012341 0.25400")
    assert VERIFY["missing"](page, False, {}) == (4, ["page, A: 0.987"])
    assert VERIFY["missing"](page, False, {"0.987": "by hand"})[1] == []
    assert VERIFY["missing"](page, False, {"*": "by hand"}) == (0, [])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_what_is_linked_and_named_is_there(page):
    """Modules have the name that is said to be of them: `name` of `folder/module.py`."""
    for target in LINK.findall(page.read_text()):
        assert "://" in target or (page.parent / target).exists(), target
    for name, path, test in MODULE.findall(page.read_text()):
        folders = (ROOT, ROOT / "petcontact", ROOT / "tests")
        found = [folder / path for folder in folders if (folder / path).exists()]
        assert found, path
        assert name in (text := found[0].read_text()) and test in text, f"{name}{test} of {path}"


def test_the_readme_has_the_verdict_that_is_printed():
    """But for round-off and what depends on the machine."""
    verdict = petcontact.solve(ROOT / "configs" / "example1.toml").verdict()
    wanted = re.sub(r"(elasticity).*", r"\1", verdict[: verdict.index("  time [s]")])
    readme = re.sub(r"(elasticity).*", r"\1", (ROOT / "README.md").read_text())
    assert textwrap.indent(wanted, "    ") in readme


def test_what_is_cited_has_the_version_and_the_title():
    citation, readme = ((ROOT / name).read_text() for name in ("CITATION.cff", "README.md"))
    title = re.search(r'^title: "(.*)"$', citation, re.MULTILINE)[1]
    assert f"version: {petcontact.__version__}\n" in citation
    assert f"version = {{{petcontact.__version__}}}" in readme and f"{{{title}}}" in readme


def test_the_config_in_the_readme_is_solved(tmp_path):
    """And it lifts off nowhere, as a block that is pressed down; its mesh adapts itself."""
    ((_, text),) = blocks((ROOT / "README.md").read_text(), "toml")
    (tmp_path / "own.toml").write_text(text)
    solution = petcontact.solve(tmp_path / "own.toml")
    assert solution.converged and solution.accuracy.error <= 1e-2
    assert solution.pairs["bottom"].state.max() < 2 and solution.reactions()["bottom"][1] > 0.0


@pytest.mark.parametrize("file", ["configs/wedge.toml", slow("configs/example1.toml")])
def test_the_glossary_has_every_word_of_a_verdict(file):
    problem = petcontact.load(ROOT / file)
    verdict = petcontact.solve(problem).verdict().removeprefix(problem.title)
    verdict = re.sub(r"  warning: .*\n(   .*\n)*", "", verdict)
    names = {
        name for text in re.findall(r'"([^"]+)"', problem.toml()) for name in re.split(r"\W", text)
    }
    words = set(re.findall(r"[A-Za-z_]{2,}", re.sub(r"[0-9.]+e[-+][0-9]+", "", verdict))) - names
    assert len(words) > 20
    assert not {word for word in words if word.lower() not in chapter("glossary").lower()}


def test_an_equation_of_the_paper_is_where_the_table_says():
    rows = re.findall(r"^\| (.+?) \|.+\| `(.+\.py)` \| `(\w+)` \|$", chapter("paper"), re.M)
    assert len(rows) > 10
    for equations, file, name in rows:
        text = (ROOT / "petcontact" / file).read_text()
        assert re.search(rf"^(class|def) {name}\b", text, re.M), name
        for each in re.findall(r"\(\d\.\d+\)|Algorithm 1|Lemma 2\.1|Theorem 3\.1", equations):
            assert each in text, (file, each)


def test_a_letter_has_one_meaning():
    """g is the gap and b the bound of shear; in the paper, and its chapter, g is the bound."""
    symbols = re.findall(r"^- \*\*(.+?)\*\*", chapter("glossary").partition("## Symbols")[2], re.M)
    letters = [letter for each in symbols for letter in each.split(", ")]
    assert len(letters) == len({*letters})
    of_bound = re.compile(r"(?:bound|at most|[<∫≤]=?)\s+g\b|∫g\b")
    texts = {page.stem: page.read_text() for page in PAGES if page.stem != "paper"}
    assert not [name for name, text in texts.items() if of_bound.search(text)]


def test_states_have_the_colours_in_which_they_are_drawn():
    hues = {"blue": (0.5, 0.7), "orange": (0.03, 0.11), "yellow": (0.11, 0.2), "red": (0.9, 1.0)}
    words = "stick|slip", rf"\b(?:{'|'.join(hues)})\b"
    hue = {name: rgb_to_hsv(to_rgb(colour))[0] for name, colour, _ in STATES.values()}
    found = []
    for sentence in itertools.chain(*(READ["sentences"](page.read_text()) for page in PAGES)):
        states, colours = (re.findall(each, sentence.lower()) for each in words)
        found += zip(states, colours, strict=True) if len(states) == len(colours) else []
    assert len(found) > 4
    assert [each for each in found if not hues[each[1]][0] < hue[each[0]] < hues[each[1]][1]] == []


def test_the_site_names_its_cases_and_the_groups_of_its_api(tmp_path):
    groups = {name: each[name] for each in DOCS["navigation"](tmp_path / "api") for name in each}
    titles = [*itertools.chain(*groups["Verification cases"])]
    assert len(titles) == len([*(MANUAL / "cases").glob("*.md")])
    assert all(re.match(r"[BC]\d\d[a-z]?: \w.{8}", title) for title in titles)
    assert all(title[0].isupper() for title in itertools.chain(*groups["Python API"]))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_site_leaves_no_subscript_or_power_as_text(page):
    drawn = DOCS["with_notation"](page.read_text())
    code = r"^ *```.*?^ *```|^\$\$.*?\$\$|`[^`]*`|\]\([^)]*\)|^#.*?$|^    .*?$"
    text = re.sub(code, "", drawn, flags=re.MULTILINE | re.DOTALL)
    assert re.findall(r"[Α-Ωα-ωµ]_\w\S*|\b[a-zA-Z]_\w\b|\w\^\S+", text) == []
    formula = "√(σ_a² + k²σ_n,max²) like K r^(λ-1), code_aster and `sigma_n`"
    typeset = "√(<i>σ</i><sub>a</sub>² + k²<i>σ</i><sub>n,max</sub>²) like K r<sup>λ-1</sup>, "
    assert DOCS["with_notation"](formula) == f"{typeset}code_aster and `sigma_n`"


def test_every_chapter_stands_in_one_of_the_four_books():
    """Chapters are the files, in the same book in `petcontact help`, on the site and in the README's
    table."""
    assert {path.stem for path in MANUAL.glob("*.md")} == {*topics()}
    names = {path.relative_to(MANUAL).with_suffix("").as_posix() for path in MANUAL.rglob("*.md")}
    assert names == {*pages()}
    assert [*topics()] == [name for chapters in BOOKS.values() for name in chapters]
    lines = (ROOT / "README.md").read_text().splitlines()
    rows = [line[1:-1].split("|") for line in lines if line[0:1] == "|" and "manual/" in line]
    for column, chapters in zip(zip(*rows, strict=True), BOOKS.values(), strict=True):
        assert {*re.findall(r"manual/(\w+)\.md", " ".join(column))} == {*chapters}


def test_the_config_reference_is_current():
    """Mended by scripts/manual."""
    assert chapter("config").endswith(REFERENCE["markdown"](REFERENCE["MODELS"]))
    for kind in ("problem", "sweep"):
        name = {"problem": "petcontact.schema.json", "sweep": "petcontact.sweep-schema.json"}[kind]
        assert (ROOT / "configs" / name).read_text() == schema_text(kind)


def test_every_key_has_a_meaning():
    lines = [line for line in chapter("config").splitlines() if line.startswith("| `")]
    rows = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]
    assert len(rows) > 60 and {len(row) for row in rows} == {5} and all(row[4] for row in rows)
    kinds = {row[0].strip("`"): row[3] for row in rows}
    assert kinds["exponent"] == "3D" and kinds["vertices"] == "2D, axial" and kinds["part"] == "all"


def test_every_table_has_an_example_that_is_read():
    """A table of it, at the place that the heading names; shapes from files are not opened."""
    roots, places = REFERENCE["MODELS"].values(), REFERENCE["places_of"]
    models = {model: place for root in roots for place, model in places(root) if place}
    for model, place in models.items():
        (example,) = REFERENCE["EXAMPLE"].findall(model.__doc__)
        value = tomllib.loads(textwrap.dedent(example))
        for key in place.partition(" ")[0].strip("[]").removeprefix("body.").split("."):
            value = value[key]
            while isinstance(value, list):
                value = value[0]
        assert isinstance(model(**value), model)


@pytest.mark.parametrize(
    ("file", "changes"),
    [
        ("petcontact/manual/starters/block.toml", {}),
        ("configs/hertz.toml", {"mesh": {"accuracy": 1e-2}}),
        ("petcontact/manual/starters/bodies.toml", {}),
    ],
)
def test_the_tutorial_has_what_is_printed(file, changes):
    """Line by line to three digits, but for residuals, which are round-off, and for iterations,
    which sets may take more or fewer of where round-off decides."""
    verdict = petcontact.solve(petcontact.load(ROOT / file, changes)).verdict()
    printed, shown = (
        re.sub(r"\d+\.\d+", lambda found: f"{float(found[0]):.3g}", text)
        for text in (
            re.sub(r"[0-9.]+e-1\d|\d+ iterations", "", each)
            for each in (verdict, chapter("tutorial"))
        )
    )
    title, _, rest = printed.partition("  time [s]")[0].partition("\n")
    lines = rest.splitlines() if title in shown else rest.partition("  largest von")[0].splitlines()
    assert len(lines) > 5
    assert not [line for line in lines if line not in shown]


def test_the_page_on_units_has_one_problem_in_two_sets_of_units(tmp_path):
    """What its second column changes, and no more, makes metres and pascals of it."""
    ((_, text),) = blocks(chapter("units"), "toml")
    (tmp_path / "mm.toml").write_text(text)
    keys = {
        "young_modulus": ("material.young_modulus", 210e9),
        "density": ("material.density", 7850.0),
        "thickness": ("material.thickness", 0.02),
        "upper_right": ("geometry.upper_right", [0.1, 0.05]),
        "acceleration": ("loads.acceleration", [0.0, -9.81]),
        "pressure": ("boundary.1.pressure", 2000.0),
        "units": ("units", {"length": "m", "stress": "Pa"}),
    }
    assert set(re.findall(r"^\| `(\w+)`", chapter("units"), re.MULTILINE)) == {*keys}
    verdicts = [
        petcontact.solve(petcontact.load(tmp_path / "mm.toml", changes)).verdict()
        for changes in ({}, dict(keys.values()))
    ]
    assert all("force on the body (-2, 7.70085) N" in verdict for verdict in verdicts)
    assert "0.005351 +- 6e-06 MPa at 5 mm" in verdicts[0]
    assert "5351 +- 6 Pa at 0.005 m" in verdicts[1]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_chapter_is_read_at_once(page):
    """By the bars of scripts/readability."""
    assert READ["broken"](page.read_text()) == []


def test_the_books_of_users_are_short():
    """20 000 words at most in the three that are not evidence: of sentences, since the config
    reference is a table."""
    names = [name for book in ("Tutorial", "How-to", "Reference") for name in BOOKS[book]]
    texts = [(MANUAL / f"{name}.md").read_text() for name in names]
    words = [len(READ["WORD"].findall(each)) for text in texts for each in READ["sentences"](text)]
    assert sum(words) <= 20_000
