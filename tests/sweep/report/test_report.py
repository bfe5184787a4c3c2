"""Tables, plots, CSV, Parquet and the page of a sweep."""

from __future__ import annotations

import base64
import csv
import io
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from sweep_files import quietly, sweep_file

from petcontact.commands.main import main
from petcontact.errors import InputError, ResultError, SolverError
from petcontact.pipeline.run import run
from petcontact.results.hdf5 import write_solution
from petcontact.sweep import problems
from petcontact.sweep.design.sweep import read_sweep
from petcontact.sweep.report.formats import csv_text, markdown
from petcontact.sweep.report.page import DRAWN, html, representatives
from petcontact.sweep.report.pivot import (
    ITERATIONS,
    OF_CONTACT,
    Facts,
    asked_about,
    make_tables,
)
from petcontact.sweep.report.sweep_plots import Plot, parse_plot, write_plots
from petcontact.sweep.store.case_table import CaseTable, read_case_table
from petcontact.sweep.store.columns import columns_of

pytestmark = pytest.mark.usefixtures("unsampled")

SWEEP = """
title = "A <b>small</b> & quick sweep | two bodies"
problems = ["example1.toml", "example2.toml"]
keep = "all"
[cross]
rule = ["self-adaptive", "modified"]
rho = [1.0, 1e3]
element_size = [0.4, 0.2]
"""
FAILED, MISSING = "example1-modified-rho1e3-h0.4", "example2-modified-rho1e3-h0.4"


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A folder with a sweep of 16 cases of the paper, one of them failed and one missing."""
    folder = tmp_path_factory.mktemp("swept")
    sweep = read_sweep(sweep_file(folder, SWEEP))

    def failing(prepared):
        if prepared.discrete.problem == sweep[sweep.ids.index(FAILED)]:
            raise SolverError("iterate", "made to fail", "nothing")
        return run(prepared)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(problems, "run", failing)
        quietly(sweep, folder / "out", only=[id_ for id_ in sweep.ids if id_ != MISSING])
    return folder / "out"


@pytest.fixture(scope="module")
def table(swept):
    return read_case_table(swept)


def made(*rows, **coordinates) -> CaseTable:
    """A table of (published, iterations, status)."""
    named = [
        {
            "id": f"c{k}",
            **coordinates,
            "status": status,
            "published": published,
            "iterations": iterations,
            "reason": "",
        }
        for k, (published, iterations, status) in enumerate(rows)
    ]
    return CaseTable("t", list(coordinates), columns_of(named), Path())


def cell(*rows) -> str:
    return Facts(made(*rows), "iterations").cell(range(len(rows))).text()


# -- tables
# --------------------------------------------------------------------------------------------------


def test_rule_and_h_go_across_and_rho_down(table):
    assert table.title.startswith("A <b>small</b>")
    tables = make_tables(table)
    assert [one.title for one in tables] == ["example1", "example2"]
    assert tables[0].rows == [(1.0,), (1e3,)]
    assert tables[0].columns == [
        ("self-adaptive", 0.4),
        ("self-adaptive", 0.2),
        ("modified", 0.4),
        ("modified", 0.2),
    ]
    assert tables[0].text((1.0,), ("self-adaptive", 0.2)).endswith(" / 81")
    assert tables[0].text((1e3,), ("modified", 0.4)) == "failed / 43"
    assert tables[1].text((1e3,), ("modified", 0.4)) == "missing"


def test_any_coordinates_down_and_across_average_the_rest(table):
    (means,) = make_tables(table, ["problem"], ["rule"])
    some = [
        n
        for n, p, r in zip(*map(table.values, ("iterations", "problem", "rule")), strict=True)
        if (p, r) == ("example1", "self-adaptive")
    ]
    assert means.cells[("example1",), ("self-adaptive",)].ours == sum(some) / 4
    assert means.cells[("example1",), ("self-adaptive",)].published == (59 + 81 + 58 + 62) / 4
    assert means.cells[("example1",), ("modified",)].note == "1 missed"
    (plain,) = make_tables(table, ["rho", "problem"], [])
    assert plain.columns == [()]
    assert len(plain.rows) == 4
    with pytest.raises(InputError, match=r"colour.*problem, rule"):
        make_tables(table, ["colour"])


def test_cells():
    good, bad = "converged", "not converged"
    assert cell((None, 10, good), (None, 11, good)) == "10.5"
    assert cell((20, 10, good), (30, 10, good)) == "10 / 25"
    assert cell((20, 10, good), (30, 10, "failed")) == "10 / 20 (1 missed)"
    assert cell((20, 10, good), (None, 10, good)) == "10"
    assert cell((20, 10, bad)) == "not converged / 20"
    assert cell((20, 10, "failed"), (30, 10, "failed")) == "2 missed / 25"


@pytest.mark.parametrize("name", ["nothing", "empty", "results.h5", "case.h5"])
def test_what_is_no_sweep_is_refused(tmp_path, name, swept):
    (tmp_path / "empty").mkdir()
    (tmp_path / "results.h5").write_text("x")
    write_solution(tmp_path / "case.h5", read_case_table(swept).kept(0))
    with pytest.raises(ResultError) as caught:
        read_case_table(tmp_path / name)
    assert "\n" not in str(caught.value)


# -- output
# --------------------------------------------------------------------------------------------------


def test_markdown_tables_are_rectangular(table):
    page = markdown(table, make_tables(table))
    assert "16 cases: 14 converged, 1 failed, 1 missing" in page
    assert f"- {FAILED}: failed: iterate: made to fail" in page
    tables = re.findall(r"(?:^\|.*\n)+", page, re.MULTILINE)
    assert len(tables) == 2
    for found in tables:
        lines = found.splitlines()
        assert {len(line) for line in lines} == {len(lines[0])}
        assert {line.count("|") for line in lines} == {6}
        assert len(lines) == 2 + 2 + 1
    odd = made((None, 1, "converged"), a="x|y")
    assert markdown(odd, make_tables(odd, ["a"], [])).count("x\\|y") == 1


def test_csv_has_one_line_a_case(table):
    lines = list(csv.DictReader(io.StringIO(csv_text(table))))
    assert len(lines) == 16
    first = lines[0]
    assert (first["id"], first["rule"], first["rho"], first["published"]) == (
        "example1-self-adaptive-rho1-h0.4",
        "self-adaptive",
        "1.0",
        "59",
    )
    assert first["iterations"] == str(table.values("iterations")[0]).removesuffix(".0")
    failed = next(line for line in lines if line["status"] == "failed")
    assert failed["reason"].startswith("iterate: made to fail")
    assert "'=1+1" in csv_text(made((None, 1, "converged"), a="=1+1"))


def test_parquet_holds_the_columns_of_the_csv_with_their_types(
    swept, tmp_path, monkeypatch, capsys
):
    polars = pytest.importorskip("polars")
    assert main(["report", str(swept), "--parquet", str(tmp_path / "t.parquet")]) == 0
    frame = polars.read_parquet(tmp_path / "t.parquet")
    lines = list(csv.DictReader(io.StringIO(csv_text(read_case_table(swept)))))
    assert frame.columns == list(lines[0]) and frame.height == 16
    assert frame["max_u_t"].dtype == polars.Float64 and frame["iterations"].dtype == polars.Int64
    assert frame["id"].to_list() == [line["id"] for line in lines]
    monkeypatch.setitem(sys.modules, "polars", None)
    assert main(["report", str(swept), "--parquet", str(tmp_path / "t.parquet")]) == 2
    assert "setup --tables" in capsys.readouterr().err


@pytest.mark.slow
def test_the_page_stands_alone(table):
    source = html(table, make_tables(table), plots=[Plot("max_u_t", "rho", "rule")])
    assert "url(" not in source and "@import" not in source
    links = re.findall(r'(?:src|srcset|href|action)="([^"]*)"', source)
    assert len(links) == 2 * len(DRAWN) + 1
    for image in links:
        picture = base64.b64decode(image.removeprefix("data:image/png;base64,"))
        assert picture[:8] == b"\x89PNG\r\n\x1a\n"
    for tag in set(re.findall(r"<(\w+)", source)) - {"meta", "img", "br", "link"}:
        assert len(re.findall(rf"<{tag}\b", source)) == source.count(f"</{tag}>"), tag
    assert source.count("<table") == 2
    assert "A &lt;b&gt;small&lt;/b&gt; &amp; quick sweep | two bodies" in source
    shown = " ".join(re.sub(r"<[^>]*>", "", source).split())
    for words in ("Figure 2 of the paper", "Figure 6 of the paper", "made to fail"):
        assert words in shown
    assert "max_u_t over rho, a line for each rule" in shown


def test_pictures_are_of_the_last_case_of_each_problem(table):
    ids = table.values("id")
    assert [ids[k] for k in representatives(table)] == [
        "example1-modified-rho1e3-h0.2",
        "example2-modified-rho1e3-h0.2",
    ]


def test_a_plot_shows_means_of_what_converged(table, tmp_path):
    from matplotlib.figure import Figure

    from petcontact.sweep.report.sweep_plots import draw

    figure = Figure()
    draw(figure, table, Plot("iterations", "rho", "problem"))
    (axes,) = figure.axes
    for line, problem in zip(axes.lines, ("example1", "example2"), strict=True):
        x, y = line.get_data()
        assert x.tolist() == [1.0, 1e3]
        mine = [
            n
            for n, p, r, s in zip(
                *map(table.values, ("iterations", "problem", "rho", "status")), strict=True
            )
            if (p, r, s) == (problem, 1e3, "converged")
        ]
        assert y[1] == pytest.approx(np.mean(mine))
    assert axes.get_xscale() == "log"
    (path,) = write_plots(table, [parse_plot("slip_share:rho")], tmp_path)
    assert path.name == "slip_share-over-rho.png" and path.read_bytes()[:4] == b"\x89PNG"
    for bad in ("rho", "a:b:c:d", "rho:"):
        with pytest.raises(InputError, match="QUANTITY:COORDINATE"):
            parse_plot(bad)
    with pytest.raises(InputError, match="holds texts"):
        write_plots(table, [Plot("rule", "rho")], tmp_path)


def test_a_study_of_loads_and_materials_is_asked_about_its_contact():
    """One line a case; iterations are shown where methods are compared."""
    rows = [
        {"id": f"c{k}", "problem": "p", "mu": mu, "status": "converged", "iterations": 5}
        | {"published": None, "reason": "", **dict.fromkeys(OF_CONTACT, 10.0 * mu)}
        | {"estimated_error": None, "warnings": k}
        for k, mu in enumerate((0.1, 0.3))
    ]
    study = CaseTable("t", ["problem", "mu"], columns_of(rows), Path())
    assert asked_about(study) == (*OF_CONTACT, "warnings")  # on fixed meshes no error is known
    alone = [row | dict.fromkeys(OF_CONTACT, 0.0) | {"max_displacement": 1.0} for row in rows]
    bodies = CaseTable("t", ["problem", "mu"], columns_of(alone), Path())
    assert asked_about(bodies) == ("max_displacement", "warnings")
    (one,) = make_tables(study, quantities=asked_about(study))
    assert one.title == "p" and one.row_names == ("mu",) and not one.means
    assert one.text((0.3,), ("contact_area",)) == "3"
    rows[1] |= {"max_pressure": np.inf, "estimated_error": np.nan}
    peaks = CaseTable("t", ["problem", "mu"], columns_of(rows), Path())
    named = ("max_pressure", "estimated_error")
    (of_peaks,) = make_tables(peaks, quantities=named)
    assert [of_peaks.text((0.3,), (name,)) for name in named] == ["without a bound", "not known"]
    assert "| max_pressure |" in (shown := markdown(study, [one], OF_CONTACT))
    assert "Others: estimated_error, warnings; --cells" in shown and "mean of" in shown
    (mean,) = make_tables(study, ["problem"], quantities=OF_CONTACT)
    assert "the mean over mu of" in markdown(study, [mean], OF_CONTACT)
    own = [row | {"slip_work": 1.0, "force_x": 2.0, "von_mises_1": 3.0} for row in rows]
    asked = asked_about(CaseTable("t", ["problem", "mu"], columns_of(own), Path()))
    assert {"slip_work", "von_mises_1"} < {*asked} and "force_x" not in asked
    renamed = [{("rho" if key == "mu" else key): v for key, v in row.items()} for row in rows]
    methods = CaseTable("t", ["problem", "rho"], columns_of(renamed), Path())
    assert asked_about(methods) == (ITERATIONS,)


def test_the_command(swept, tmp_path, capsys):
    layout = ["--rows", "method.rho", "--columns", "problem,rule", "--cells", "slip_share"]
    assert main(["report", str(swept), "--csv", str(tmp_path / "t.csv"), *layout]) == 0
    shown = capsys.readouterr().out
    assert "example1, self-adaptive" in shown and "Cells: slip_share" in shown
    assert (tmp_path / "t.csv").read_text().count("\n") == 17
    for words in (["--csv", str(tmp_path / "no" / "t.csv")], ["--cells", "colour"]):
        assert main(["report", str(swept), *words]) == 2
        assert capsys.readouterr().err.count("\n") == 1
    assert main(["report", str(swept), "--plot", "slip_shar:method.rho"]) == 2
    assert "did you mean 'slip_share'?" in capsys.readouterr().err
