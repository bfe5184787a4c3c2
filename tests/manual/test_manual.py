"""The manual and the README keep what they say: commands run, links lead somewhere, the reference
is current."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import textwrap
import tomllib
from pathlib import Path

import forked
import pytest

import petcontact
from petcontact.commands.schema import schema_text
from petcontact.manual import ORDER, chapter, pages, topics
from petcontact.model.problem import OneBody, Problem
from petcontact.model.reference import EXAMPLE, _places

ROOT = Path(__file__).parents[2]
MANUAL = ROOT / "petcontact" / "manual"
PAGES = [ROOT / "README.md", *sorted(MANUAL.rglob("*.md"))]
FENCE = re.compile(r"^```(\w+)([^\n]*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]+)\)")
RANKS = re.compile(r"mpiexec -n \d+ ")
MODULE = re.compile(r"(?:`(\w+)`\s+of\s+)?`((?:\w+/)+\w+\.py)(?:::(\w+))?`")


def blocks(page: Path, language: str) -> list[tuple[str, str]]:
    """Words after the language, and the text, of each fenced block."""
    return [
        (words.strip(), text)
        for kind, words, text in FENCE.findall(page.read_text())
        if kind == language
    ]


def run(program: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join(
        map(str, [Path(forked.program()).parent, Path(sys.executable).parent, os.environ["PATH"]])
    )
    environment = os.environ | {
        "PATH": path,
        "PYTHONPATH": str(ROOT),
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    }
    return subprocess.run(
        program, cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )


def commands(page: Path) -> list[tuple[str, bool]]:
    """Lines of the blocks of `sh` in order, and whether they must be refused; without `sh slow`,
    which takes minutes."""
    return [
        (line, "fails" in words)
        for words, text in blocks(page, "sh")
        if "slow" not in words
        for line in (line.partition("   #")[0].strip() for line in text.splitlines())
        if line
    ]


def check(line: str, fails: bool, folder: Path) -> None:
    done = run(["bash", "-c", line], folder)
    assert (done.returncode != 0) == fails, f"{line}\n{done.stdout}{done.stderr}"


def on_ranks(page: Path) -> bool:
    return any(RANKS.match(line) for line, _ in commands(page))


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[pytest.mark.mpi] * on_ranks(page))
        for page in PAGES
        if commands(page)
    ],
    ids=lambda page: page.stem,
)
def test_every_fenced_command_runs(page, tmp_path):
    """As it stands: a page that has commands on ranks is run with them, once."""
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    for line, fails in commands(page):
        check(line, fails, tmp_path)


@pytest.mark.parametrize(
    "page", [page for page in PAGES if blocks(page, "python")], ids=lambda page: page.stem
)
def test_every_python_block_runs(page, tmp_path):
    """Those of a page in one program; `python file=NAME` are files for it, `python sketch` are not
    run."""
    found = blocks(page, "python")
    shutil.copytree(
        ROOT / "configs", tmp_path / "configs", ignore=shutil.ignore_patterns("pictures")
    )
    for words, text in found:
        if words.startswith("file="):
            file = tmp_path / words.removeprefix("file=")
            file.parent.mkdir(exist_ok=True)
            file.write_text(text)
    program = "\n".join(
        text for words, text in found if "sketch" not in words and not words.startswith("file=")
    )
    if program:
        done = run([forked.program(), "-c", program], tmp_path)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_links_lead_somewhere(page):
    for target in LINK.findall(page.read_text()):
        assert "://" in target or (page.parent / target).exists(), target


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_modules_that_are_named_exist(page):
    """And they have the name that is said to be of them: `name` of `folder/module.py`."""
    for name, path, test in MODULE.findall(page.read_text()):
        found = [
            folder / path
            for folder in (ROOT, ROOT / "petcontact", ROOT / "tests")
            if (folder / path).exists()
        ]
        assert found, path
        assert name in (text := found[0].read_text()) and test in text, f"{name}{test} of {path}"


def test_the_readme_has_the_verdict_that_is_printed():
    """But for round-off and what depends on the machine."""
    verdict = petcontact.solve(ROOT / "configs" / "example1.toml").verdict()
    wanted = re.sub(r"(elastic residual).*", r"\1", verdict[: verdict.index("  time [s]")])
    readme = re.sub(r"(elastic residual).*", r"\1", (ROOT / "README.md").read_text())
    assert textwrap.indent(wanted, "    ") in readme


def test_the_config_in_the_readme_is_solved(tmp_path):
    """And it lifts off nowhere, as a block that is pressed down; its mesh adapts itself."""
    ((_, text),) = blocks(ROOT / "README.md", "toml")
    (tmp_path / "own.toml").write_text(text)
    solution = petcontact.solve(tmp_path / "own.toml")
    assert solution.converged and solution.accuracy.error <= 1e-2
    assert solution.pairs["bottom"].state.max() < 2 and solution.reactions()["bottom"][1] > 0.0


@pytest.mark.parametrize(
    "file",
    ["configs/example1.toml", "configs/wedge.toml", "petcontact/manual/starters/bodies.toml"],
)
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


def test_the_chapters_are_the_files():
    """A chapter is there as soon as its file is; only the order is written down."""
    assert {path.stem for path in MANUAL.glob("*.md")} == set(topics())
    assert {
        path.relative_to(MANUAL).with_suffix("").as_posix() for path in MANUAL.rglob("*.md")
    } == set(pages())
    assert list(topics())[: len(ORDER)] == list(ORDER)


def test_the_config_reference_is_current():
    """Mended by scripts/manual."""
    assert chapter("config").endswith(schema_text("problem", as_markdown=True))
    for kind in ("problem", "sweep"):
        name = {"problem": "petcontact.schema.json", "sweep": "petcontact.sweep-schema.json"}[kind]
        assert (ROOT / "configs" / name).read_text() == schema_text(kind)


def test_no_bar_cuts_a_meaning_off():
    """|σ_t| in a table would end the cell."""
    rows = [line for line in chapter("config").splitlines() if line.startswith("| `")]
    assert any("\\|σ_t\\|" in row for row in rows)
    assert {len(re.findall(r"(?<!\\)\|", row)) for row in rows} == {6}


def test_every_key_has_a_meaning():
    rows = [line.split(" | ") for line in chapter("config").splitlines() if line.startswith("| `")]
    assert len(rows) > 60
    assert not [row[0] for row in rows if len(row) < 5 or not row[4].strip(" |")]
    kinds = {row[0].strip("| `"): row[3] for row in rows}
    assert kinds["exponent"] == "3D" and kinds["vertices"] == "2D, axial" and kinds["part"] == "all"


def test_every_table_has_an_example_that_is_read():
    """A table of it, at the place that the heading names; shapes from files are not opened."""
    models = {m: place for root in (Problem, OneBody) for place, m in _places(root) if place}
    for model, place in models.items():
        (example,) = EXAMPLE.findall(model.__doc__)
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
    """Line by line to three digits, but for residuals, which are round-off."""
    verdict = petcontact.solve(petcontact.load(ROOT / file, changes)).verdict()
    printed, shown = (
        re.sub(r"\d+\.\d+", lambda found: f"{float(found[0]):.3g}", text)
        for text in (re.sub(r"[0-9.]+e-1\d", "", each) for each in (verdict, chapter("tutorial")))
    )
    title, _, rest = printed.partition("  time [s]")[0].partition("\n")
    lines = (
        rest.splitlines() if title in shown else rest[rest.index("  step 1") :].splitlines()[:10]
    )
    assert len(lines) > 5
    assert not [line for line in lines if line not in shown]
