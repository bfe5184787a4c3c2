"""Tables, CSV and the page of a sweep; the published counts."""

from __future__ import annotations

import base64
import csv
import io
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from conftest import example
from mpi4py import MPI

from petcontact import Contact, Material, MeshOptions, Rectangle
from petcontact.commands.main import main
from petcontact.errors import InputError, ResultError
from petcontact.results.hdf5 import write_failure
from petcontact.sweep.cases import load_sweep
from petcontact.sweep.published import example_number, published_count, published_counts
from petcontact.sweep.report import csv_text, html, markdown, representatives
from petcontact.sweep.run import run_sweep
from petcontact.sweep.table import Row, make_cell, make_tables, read_rows, text

CONFIGS = Path(__file__).parents[2] / "configs"
SWEEP = """
title = "A <b>small</b> & quick sweep | two bodies"
problems = ["example1.toml", "example2.toml"]
[cross]
rule = ["self-adaptive", "modified"]
rho = [1.0, 1e3]
element_size = [0.4, 0.2]
"""


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A folder with a sweep of 16 cases of the paper, one of them failed and one missing."""
    folder = tmp_path_factory.mktemp("swept")
    for name in ("example1.toml", "example2.toml"):
        (folder / name).write_text((CONFIGS / name).read_text())
    (folder / "sweep.toml").write_text(SWEEP)
    sweep = load_sweep(folder / "sweep.toml")
    run_sweep(sweep, folder / "out", MPI.COMM_SELF, say=lambda line: None)
    cases = {case.id: case.case for case in sweep.cases}
    failed = "example1-modified-rho1e3-h0.4"
    write_failure(folder / "out" / "cases" / f"{failed}.h5", cases[failed], "made to fail")
    (folder / "out/cases/example2-modified-rho1e3-h0.4.h5").unlink()
    return folder / "out"


def row(published=None, iterations=10, status="converged", **coordinates):
    return Row("id", coordinates, status, {"iterations": iterations}, published)


# -- the paper's counts ---------------------------------------------------------------------------------------------


def test_published_means_are_those_of_the_tables():
    counts = published_counts()
    assert len(counts) == 128

    def mean(number, rule):
        some = [count for (example, name, *_), count in counts.items() if (example, name) == (number, rule)]
        return round(sum(some) / len(some), 1), len(some)

    assert mean(1, "self-adaptive") == (69.5, 32)
    assert mean(1, "modified") == (51.8, 32)
    assert mean(2, "self-adaptive") == (59.2, 32)
    assert mean(2, "modified") == (45.8, 32)


@pytest.mark.parametrize(
    ("number", "rule", "rho", "h", "count"), [(1, "modified", 1.0, 0.05, 62), (2, "self-adaptive", 1e7, 0.2, 65)]
)
def test_a_case_is_known_by_what_it_is(number, rule, rho, h, count):
    case = example(number, mesh=MeshOptions(element_size=h, order=0), rule=rule, rho=rho, omega=0.9)
    assert published_count(case) == count
    other_mesh = case.model_copy(update={"mesh": MeshOptions(element_size=h, order=1)})
    assert published_count(other_mesh) is None
    assert published_count(example(number, mesh=MeshOptions(element_size=0.3), rule=rule, rho=rho)) is None
    assert published_count(example(number, mesh=MeshOptions(element_size=h), rule="fixed", rho=rho)) is None


@pytest.mark.parametrize(
    "change",
    [
        {"material": Material(young_modulus=10_000.0, poisson_ratio=0.3, plane="stress")},
        {"material": Material(young_modulus=10_001.0, poisson_ratio=0.3)},
        {"geometry": Rectangle(lower_left=(0.0, 0.0), upper_right=(8.0, 4.1))},
        {"geometry": Rectangle(lower_left=(-1.0, 0.0), upper_right=(8.0, 4.0))},
    ],
)
def test_another_problem_is_not_the_papers(change):
    case = example(1)
    assert example_number(case) == 1
    assert example_number(case.model_copy(update=change)) is None


def test_other_boundary_conditions_are_not_the_papers():
    case = example(2)
    without_load = tuple(b for b in case.boundary if b.part != "right")
    assert example_number(case.model_copy(update={"boundary": without_load})) is None
    slippery = (Contact(part="bottom", friction_bound=449.0), *case.boundary[1:])
    assert example_number(case.model_copy(update={"boundary": slippery})) is None
    # an edge that carries no traction may be left out
    case = example(1)
    free = tuple(b for b in case.boundary if b.part != "right")
    assert example_number(case.model_copy(update={"boundary": free})) == 1


# -- tables ---------------------------------------------------------------------------------------------------------


def test_rule_and_h_go_across_and_rho_down(swept):
    title, rows = read_rows(swept)
    assert title.startswith("A <b>small</b>")
    tables = make_tables(rows)
    assert [table.title for table in tables] == ["example1", "example2"]
    assert tables[0].rows == [(1.0,), (1e3,)]
    assert tables[0].columns == [("self-adaptive", 0.4), ("self-adaptive", 0.2), ("modified", 0.4), ("modified", 0.2)]
    assert tables[0].text((1.0,), ("self-adaptive", 0.2)).endswith(" / 81")
    assert tables[0].text((1e3,), ("modified", 0.4)) == "failed / 43"
    assert tables[1].text((1e3,), ("modified", 0.4)) == "missing"


def test_any_coordinates_down_and_across_average_the_rest(swept):
    _, rows = read_rows(swept)
    (table,) = make_tables(rows, ["problem"], ["rule"])
    some = [r for r in rows if r.coordinates["problem"] == "example1" and r.coordinates["rule"] == "self-adaptive"]
    assert table.cells[("example1",), ("self-adaptive",)].ours == sum(r.iterations for r in some) / 4
    assert table.cells[("example1",), ("self-adaptive",)].published == (59 + 81 + 58 + 62) / 4
    assert table.cells[("example1",), ("modified",)].note == "1 missed"
    (plain,) = make_tables(rows, ["rho", "problem"], [])
    assert plain.columns == [()]
    assert len(plain.rows) == 4
    with pytest.raises(InputError, match=r"colour.*problem, rule"):
        make_tables(rows, ["colour"])


def test_cells():
    assert make_cell([row(), row(iterations=11)]).text() == "10.5"
    assert make_cell([row(20), row(30)]).text() == "10 / 25"
    assert make_cell([row(20), row(30, status="failed")]).text() == "10 / 20 (1 missed)"
    assert make_cell([row(20), row(None)]).text() == "10"
    assert make_cell([row(20, status="not converged")]).text() == "not converged / 20"
    assert make_cell([row(20, status="failed"), row(30, status="failed")]).text() == "2 missed / 25"
    assert make_cell([]).text() == ""


@pytest.mark.parametrize(("value", "shown"), [(1000.0, "1e3"), (0.05, "0.05"), (True, "True"), (None, "–"), ("a b", "a b")])
def test_coordinates_for_people(value, shown):
    assert text(value) == shown


def test_lists_are_coordinates_too():
    rows = [row(value=[0.0, 1.0], rho=1.0), row(value=[0.0, 2.0], rho=1.0)]
    assert len(make_tables(rows, ["value"], ["rho"])[0].rows) == 2


def test_folder_and_results_file_say_the_same_until_the_folder_changes(swept):
    _, rows = read_rows(swept / "results.h5")
    assert {r.status for r in rows} == {"converged"}
    mine = {r.id: r.iterations for r in read_rows(swept)[1] if r.status == "converged"}
    assert len(mine) == 14
    assert mine == {r.id: r.iterations for r in rows if r.id in mine}


@pytest.mark.parametrize("name", ["nothing", "empty", "results.h5", "case.h5"])
def test_what_is_no_sweep_is_refused(tmp_path, name, swept):
    (tmp_path / "empty").mkdir()
    (tmp_path / "results.h5").write_text("x")
    (tmp_path / "case.h5").write_bytes((swept / "cases/example1-modified-rho1-h0.4.h5").read_bytes())
    with pytest.raises(ResultError) as caught:
        read_rows(tmp_path / name)
    assert "\n" not in str(caught.value)


# -- output ---------------------------------------------------------------------------------------------------------


def test_markdown_tables_are_rectangular(swept):
    title, rows = read_rows(swept)
    page = markdown(title, rows, make_tables(rows))
    assert "16 cases: 14 converged, 1 failed, 1 missing" in page
    assert "- example1-modified-rho1e3-h0.4: failed: made to fail" in page
    tables = re.findall(r"(?:^\|.*\n)+", page, re.MULTILINE)
    assert len(tables) == 2
    for table in tables:
        lines = table.splitlines()
        assert {len(line) for line in lines} == {len(lines[0])}
        assert {line.count("|") for line in lines} == {6}
        assert len(lines) == 2 + 2 + 1
    assert markdown("t", [row(a="x|y")], make_tables([row(a="x|y")], ["a"], [])).count("x\\|y") == 1


def test_csv_has_one_line_a_case(swept):
    _, rows = read_rows(swept)
    lines = list(csv.DictReader(io.StringIO(csv_text(rows))))
    assert len(lines) == 16
    first = lines[0]
    assert (first["id"], first["rule"], first["rho"], first["published"]) == (
        "example1-self-adaptive-rho1-h0.4", "self-adaptive", "1.0", "59",
    )  # fmt: skip
    assert int(first["iterations"]) == rows[0].iterations
    failed = next(line for line in lines if line["status"] == "failed")
    assert failed["reason"] == "made to fail"


class Page(HTMLParser):
    """Tags, links to elsewhere, and text of a page."""

    VOID = ("meta", "img", "br", "link")

    def __init__(self, source: str) -> None:
        super().__init__()
        self.open, self.links, self.images, self.words, self.counts = [], [], [], [], {}
        self.feed(source)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.counts[tag] = self.counts.get(tag, 0) + 1
        if tag not in self.VOID:
            self.open.append(tag)
        for name, value in attrs:
            if tag == "img" and name == "src":
                self.images.append(value)
            elif name in ("src", "href", "srcset", "action"):
                self.links.append(value)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


def test_the_page_stands_alone(swept):
    title, rows = read_rows(swept)
    source = html(swept, title, rows, make_tables(rows))
    page = Page(source)
    assert page.links == []
    assert "url(" not in source
    assert "@import" not in source
    assert len(page.images) == 8
    for image in page.images:
        assert base64.b64decode(image.removeprefix("data:image/png;base64,"))[:8] == b"\x89PNG\r\n\x1a\n"
    assert page.counts.get("b", 0) == 0
    assert "A <b>small</b> & quick sweep | two bodies" in page.words
    assert page.counts["table"] == 2
    shown = " ".join("".join(page.words).split())
    assert "Figure 2 of the paper" in shown
    assert "Figure 6 of the paper" in shown
    assert "made to fail" in shown
    for entry in rows:
        if entry.status == "converged" and entry.coordinates["problem"] == "example1":
            assert f"{entry.iterations} / {entry.published}" in shown


def test_pictures_are_of_the_last_rule_smallest_h_smallest_rho(swept):
    chosen = representatives(read_rows(swept)[1])
    assert [row.id for row in chosen] == ["example1-modified-rho1-h0.2", "example2-modified-rho1-h0.2"]


def test_the_command(swept, tmp_path, capsys):
    target = [str(tmp_path / "t.csv"), str(tmp_path / "t.html")]
    layout = ["--rows", "rho", "--columns", "problem,rule"]
    assert main(["report", str(swept), "--csv", target[0], "--html", target[1], *layout]) == 0
    shown = capsys.readouterr().out
    assert "example1, self-adaptive" in shown
    assert Path(target[0]).read_text().count("\n") == 17
    assert Path(target[1]).read_text().startswith("<!DOCTYPE html>")
    assert main(["report", str(swept), "--csv", str(tmp_path / "no" / "t.csv")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
